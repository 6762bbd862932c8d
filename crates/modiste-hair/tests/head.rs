//! Hair on the heads of the trained body models, from roots to worn hair.

use std::path::Path;
use std::sync::Arc;

use modiste_body::motion::generate;
use modiste_body::{Body, Motion, Part, Pose, ScapeModel};
use modiste_core::{Quat, Silent, Vec3};
use modiste_hair::collision::penetration_exact;
use modiste_hair::model::{HairModel, LearnOptions, Provenance, learn};
use modiste_hair::rod::{Material, Simulation, SimulationOptions, Wind};
use modiste_hair::training::{Cell, Factors, Recipe, Sequence, TrainingFolder};
use modiste_hair::{
    Bust, FullHair, Groom, POINTS, Region, Style, WornHair, carry, evaluate, skull_middle, spread_roots,
};

fn body() -> Body {
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets");
    ScapeModel::load(assets.join("body-female.safetensors")).expect("the model ships").body(&[]).expect("the mean body")
}

/// Somebody who stands and shakes their head at this rate (Hz).
fn shaking(body: &Body, frames: usize, rate: f64) -> Motion {
    let stand = generate::stand(body);
    let pose = |frame: usize| -> Pose {
        let mut pose = stand.clone();
        let angle = 0.5 * (std::f64::consts::TAU * rate * frame as f64 / 30.0).sin();
        pose.set_rotation(Part::Head, Quat::from_rotation_y(angle) * pose.rotation(Part::Head));
        pose
    };
    Motion { fps: 30.0, frames: (0..frames).map(pose).collect() }
}

#[test]
fn roots_are_even_and_the_first_of_many_are_those_of_few() {
    let body = body();
    let roots = spread_roots(&body, 300, 5).unwrap();
    let at = |roots: &[modiste_hair::Root]| -> Vec<Vec3> {
        roots.iter().map(|root| root.position(body.model().topology(), body.rest_vertices())).collect()
    };
    let points = at(&roots);
    let nearest = |i: usize| {
        (0..points.len()).filter(|&j| j != i).map(|j| points[i].distance(points[j])).fold(f64::INFINITY, f64::min)
    };
    let distances: Vec<f64> = (0..points.len()).map(nearest).collect();
    let (least, most) = distances.iter().fold((f64::INFINITY, 0.0f64), |(a, b), &d| (a.min(d), b.max(d)));
    assert!(least > 0.4 * most && most < 0.03, "{least} to {most}");
    assert!(points.iter().all(|p| p.y > 1.4), "a root is below the head");
    assert_eq!(spread_roots(&body, 300, 5).unwrap(), roots);
    let message = spread_roots(&body, 0, 5).unwrap_err().to_string();
    assert!(message.contains("guides on the scalp: wanted 1 to 20000, found 0"), "{message}");
}

#[test]
fn grooms_lie_on_the_head_and_lengths_correspond() {
    let body = body();
    let surface = Bust::new(body.model()).unwrap().surface(body.rest_vertices());
    for style in Style::ALL {
        let [short, long] = [0.0, 1.0].map(|length| Groom::grow(&body, style, length, 60, 1).unwrap());
        assert_eq!(short.roots, long.roots);
        let found = penetration_exact(&long.guides.points, &surface);
        assert!(found.rate() < 0.01 && found.deepest < 2e-3, "{style:?}: {found:?}");
        let metres = modiste_hair::arc_length(long.guides.guide(3));
        assert!((metres / style.lengths()[1] - 1.0).abs() < 0.2, "{style:?}: {metres} m");
    }
    assert!(Groom::grow(&body, Style::Bob, 7.0, 10, 1).is_err());
}

#[test]
fn curves_are_carried_to_the_head_or_refused() {
    let body = body();
    // Our own guides in centimetres, elsewhere, come back to where they were.
    let groom = Groom::grow(&body, Style::Bob, 1.0, 200, 2).unwrap();
    let curves: Vec<Vec<Vec3>> = groom
        .guides
        .iter()
        .map(|guide| guide.iter().map(|p| 100.0 * *p + Vec3::new(7.0, -30.0, 12.0)).collect())
        .collect();
    let back = carry(&body, &curves, 1.0, None).unwrap();
    let worst = back.guides.points.iter().zip(&groom.guides.points).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
    assert!(worst < 0.03, "{worst} m off");
    assert_eq!(back.guides.count(), 200);
    let mut one_far = curves.clone();
    for p in &mut one_far[5] {
        *p += Vec3::new(0.0, 0.0, 90.0);
    }
    let message = carry(&body, &one_far, 1.0, None).unwrap_err().to_string();
    assert!(message.contains("guide 5"), "{message}");
    let mut nothing = curves;
    nothing[3] = vec![Vec3::X; 4];
    assert!(carry(&body, &nothing, 1.0, None).unwrap_err().to_string().contains("guide 3: wanted a length"));
}

#[test]
fn simulated_hair_stays_out_of_the_body() {
    let body = body();
    let groom = Groom::grow(&body, Style::Long, 1.0, 40, 1).unwrap();
    let motion = shaking(&body, 24, 1.2);
    let mut vertices = Vec::new();
    body.pose(&motion.frames[0], &mut vertices);
    let material = Material::of_softness(1.0).unwrap();
    let mut hair = Simulation::new(&body, &vertices, &groom, material, SimulationOptions::default()).unwrap();
    let bust = Bust::new(body.model()).unwrap();
    let start = hair.positions();
    for pose in &motion.frames {
        body.pose(pose, &mut vertices);
        hair.step(&vertices, &Wind::still());
        let found = penetration_exact(&hair.positions(), &bust.surface(&vertices));
        // The thesis's own training data: 1.9 % of points, 3.8 mm.
        assert!(found.rate() < 0.005 && found.deepest < 2e-3, "{found:?}");
    }
    let moved = hair.positions().iter().zip(&start).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
    assert!(moved > 0.03 && moved < 0.8, "{moved}");
    assert!(Material::of_softness(f64::NAN).is_err());
}

#[test]
fn hair_is_learned_saved_and_worn_by_other_bodies() {
    let body = body();
    let folder = tempfile::tempdir().unwrap();
    let cells = vec![Cell::STYLES[0]];
    let recipe = Recipe { style: Style::Bob, guides: 24, seed: 3, cells: cells.clone(), source: None };
    let set = TrainingFolder::open(folder.path().join("set"), recipe.clone()).unwrap();
    let sequences: Vec<Sequence> = [0.5, 0.9, 1.4, 0.7]
        .into_iter()
        .enumerate()
        .map(|(index, rate)| Sequence {
            name: format!("made_{index}"),
            motion: shaking(&body, 45, rate),
            held_out: index == 3,
        })
        .collect();
    let groom = Groom::grow(&body, Style::Bob, 1.0, 24, 3).unwrap();
    set.simulate(&body, std::slice::from_ref(&groom), &sequences, &Silent).unwrap();
    let other = Recipe { guides: 25, ..recipe };
    assert!(TrainingFolder::open(folder.path().join("set"), other).is_err());
    let names: Vec<String> = sequences.iter().map(|sequence| sequence.name.clone()).collect();
    for plain in [true, false] {
        let options = LearnOptions { hair_dimensions: 8, bust_dimensions: 3, plain };
        let learned = learn(&set, &names, &body, &groom.roots, &options, &Silent).unwrap();
        assert!(learned.energy > 0.8 && learned.model.stability(1).unwrap().iter().all(|style| style.2 < 1.0));
        let error = &evaluate(&learned.model, &set, &names, &Silent).unwrap()[0];
        assert!(error.test_cm < error.still_cm, "{error:?}");

        let file = folder.path().join("hair.safetensors");
        learned.model.save(&file, &Provenance::default()).unwrap();
        let model = Arc::new(HairModel::load(&file).unwrap());
        assert_eq!((model.guide_count(), model.layout()), (24, learned.model.layout()));
        let tall = body.model().body(&[1.5, -1.0]).unwrap();
        let motion = shaking(&tall, 20, 1.0);
        let (mut vertices, bust) = (Vec::new(), Bust::new(tall.model()).unwrap());
        let mut worn = WornHair::new(&model, &tall, Factors::default()).unwrap();
        for pose in &motion.frames {
            tall.pose(pose, &mut vertices);
            worn.step(pose, &vertices, &[]).unwrap();
            let found = penetration_exact(worn.points(), &bust.surface(&vertices));
            assert!(found.inside == 0, "{found:?}");
            for (root, guide) in model.roots().iter().zip(worn.points().chunks_exact(POINTS)) {
                assert!(guide[0].distance(root.position(tall.model().topology(), &vertices)) < 1e-5);
            }
        }
        let full = FullHair::new(&tall, model.roots(), worn.points(), 50, 1).unwrap();
        assert_eq!(full.points(tall.model().topology(), &vertices, worn.points()).len(), 50 * POINTS);
        assert_eq!(model.densified(&body, 60).unwrap().guide_count(), 60);
        // A cut in the motion: hair comes along as it lies on the head, however far that is, and stays as long as it is.
        let mut twin = WornHair::new(&model, &tall, Factors::default()).unwrap();
        for pose in &motion.frames {
            tall.pose(pose, &mut vertices);
            twin.step(pose, &vertices, &[]).unwrap();
        }
        for _ in 0..40 {
            let mut after = |hair: &mut WornHair, put: Vec3| -> Vec<Vec3> {
                let mut pose = motion.frames[19].clone();
                pose.root_translation += put;
                tall.pose(&pose, &mut vertices);
                hair.step(&pose, &vertices, &[]).unwrap();
                hair.points().iter().map(|p| *p - put).collect()
            };
            let (here, there) =
                (after(&mut worn, Vec3::new(7.0, 0.0, -3.0)), after(&mut twin, Vec3::new(-0.4, 0.0, 20.0)));
            for (guide, other) in here.chunks_exact(POINTS).zip(there.chunks_exact(POINTS)) {
                let apart = guide.iter().zip(other).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
                assert!(apart < 1e-4, "{apart} m, plain {plain}");
                assert!(guide.iter().all(|p| p.distance(guide[0]) < 0.3), "hair of 0.24 m has grown, plain {plain}");
            }
        }
        let styled = Factors::new(0.5, 0.5);
        assert!(WornHair::new(&model, &tall, styled).unwrap_err().to_string().contains("the only one"));
    }
}

#[test]
fn regions_of_the_scalp_have_lengths_of_their_own() {
    let body = body();
    let folder = tempfile::tempdir().unwrap();
    let cells = Cell::STYLES.to_vec();
    let recipe = Recipe { style: Style::Long, guides: 24, seed: 3, cells: cells.clone(), source: None };
    let set = TrainingFolder::open(folder.path().join("set"), recipe).unwrap();
    let sequences = [("made_0", 0.6), ("made_1", 1.1)];
    let sequences = sequences.map(|(name, rate)| Sequence {
        name: name.to_owned(),
        motion: shaking(&body, 60, rate),
        held_out: false,
    });
    let grooms: Vec<Groom> =
        cells.iter().map(|cell| Groom::grow(&body, Style::Long, cell.length, 24, 3).unwrap()).collect();
    set.simulate(&body, &grooms, &sequences, &Silent).unwrap();
    let names: Vec<String> = sequences.iter().map(|sequence| sequence.name.clone()).collect();
    let options = LearnOptions { hair_dimensions: 8, bust_dimensions: 3, plain: false };
    let model = learn(&set, &names, &body, &grooms[0].roots, &options, &Silent).unwrap().model.shared();
    let mut hair = [
        WornHair::new(&model, &body, Factors::new(1.0, 0.5)).unwrap(),
        WornHair::new(&model, &body, Factors::new(0.0, 0.5)).unwrap(),
        WornHair::mixed(&model, &body, Factors::new(1.0, 0.5), &[(Region::Front, 0.0)]).unwrap(),
    ];
    let mut vertices = Vec::new();
    for pose in &shaking(&body, 12, 0.8).frames {
        body.pose(pose, &mut vertices);
        for hair in &mut hair {
            hair.step(pose, &vertices, &[]).unwrap();
        }
    }
    let [long, short, mixed] = hair.each_ref().map(WornHair::points);
    let middle = skull_middle(&body);
    let mut seen = 0;
    for (guide, root) in model.roots().iter().enumerate() {
        let front = Region::of(root.position(body.model().topology(), body.rest_vertices()) - middle) == Region::Front;
        let points = guide * POINTS..(guide + 1) * POINTS;
        let reach = |points: &[Vec3]| modiste_hair::arc_length(points);
        let (wanted, other) = if front { (short, long) } else { (long, short) };
        let [own, wanted, other] = [mixed, wanted, other].map(|hair| reach(&hair[points.clone()]));
        assert!((own - wanted).abs() < 0.5 * (own - other).abs(), "guide {guide}: {own} {wanted} {other}");
        seen += usize::from(front);
    }
    assert!((3..21).contains(&seen), "{seen}");
    assert!(WornHair::mixed(&model, &body, Factors::default(), &[(Region::Back, 9.0)]).is_err());
}
