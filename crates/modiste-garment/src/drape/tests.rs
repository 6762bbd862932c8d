//! The learned garment as a whole.

use std::sync::Arc;

use modiste_body::{Motion, Part, Pose};
use modiste_core::{Mat3, Quat, Silent, Vec3, centroid, deformation_gradients};

use super::blend::blend_parts;
use super::synthetic::{PELVIS, anchor_body, motion, sequence, shaped, training_set};
use super::{
    CoarseOptions, DrapeModel, DynamicsOptions, InputOptions, Placement, PoseSequence, ShapeOptions, Synthesis,
    TrainOptions, TrainingSet, WrinkleOptions, Wrinkles, leave_one_out,
};

fn options() -> TrainOptions {
    TrainOptions {
        shape: ShapeOptions { count: 5, body_count: 3, ridge: 1e-6, area_weighted: false },
        // The tube turns with its parts as the paper's garments do.
        wrinkle: WrinkleOptions {
            max_count: 12,
            min_count: 4,
            variance: 0.999,
            blend_width: 0.0,
            ..WrinkleOptions::default()
        },
        dynamics: DynamicsOptions {
            inputs: InputOptions::PAPER,
            folds: 5,
            max_amplitude: 1.0,
            ..DynamicsOptions::default()
        },
        coarse: CoarseOptions { count: 0, ..CoarseOptions::default() },
        one_sided: true,
    }
}

/// With the coarse deformation, which the paper does not have.
fn coarse_options() -> TrainOptions {
    TrainOptions { coarse: CoarseOptions { count: 8, centres: 60, ..CoarseOptions::default() }, ..options() }
}

fn trained(set: &TrainingSet) -> Arc<DrapeModel> {
    Arc::new(DrapeModel::train(set, &options(), &Silent).unwrap().0)
}

fn run(model: &Arc<DrapeModel>, shape: &[f64], motion: &Motion, kind: Wrinkles) -> Vec<Vec<Vec3>> {
    let mut synthesis = Synthesis::new(model.clone(), shape, 4).unwrap().with_wrinkles(kind);
    motion.frames.iter().map(|pose| synthesis.step(pose, &anchor_body(pose)).to_vec()).collect()
}

fn mean_distance(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.distance(*b)).sum::<f64>() / a.len() as f64
}

#[test]
fn an_unseen_motion_is_followed_and_better_with_dynamics_than_without() {
    let set = training_set();
    let model = trained(&set);
    let truth = sequence(&set.garment, "unseen", motion(99, 120));
    let error = |kind| {
        let frames = run(&model, &[], &truth.motion, kind);
        frames.iter().zip(&truth.frames).skip(10).map(|(a, b)| mean_distance(a, b)).sum::<f64>() / 110.0
    };
    let (dynamic, fixed) = (error(Wrinkles::Dynamic), error(Wrinkles::Static));
    assert!(dynamic < 0.0035, "{dynamic} {fixed}");
    assert!(dynamic < 0.6 * fixed && fixed < 0.006, "{dynamic} {fixed}");
}

#[test]
fn an_unseen_body_gets_its_own_garment() {
    let set = training_set();
    let model = trained(&set);
    let still = Motion { fps: 30.0, frames: vec![Pose::template(Vec3::new(0.0, 0.9, 0.0))] };
    let error = |given: &[f64], truth: &[f64]| {
        let made = &run(&model, given, &still, Wrinkles::Static)[0];
        let mean = &run(&model, &[], &still, Wrinkles::Static)[0];
        let (truth, template) = (shaped(&set.garment, truth), shaped(&set.garment, &[]));
        // Changes are compared: the wrinkles of the template pose are common to both.
        let change = |a: &[Vec3], b: &[Vec3]| -> Vec<Vec3> {
            let shift = centroid(a) - centroid(b);
            a.iter().zip(b).map(|(a, b)| *a - *b - shift).collect()
        };
        mean_distance(&change(made, mean), &change(&truth, &template))
    };
    let shape = [1.5, -1.0, 1.2];
    assert!(error(&shape, &shape) < 0.001, "{}", error(&shape, &shape));
    assert!(error(&[], &shape) > 0.005, "the body matters");
}

#[test]
fn heading_and_place_of_the_body_carry_over_to_the_garment() {
    let set = training_set();
    let mut options = options();
    options.dynamics.inputs = InputOptions::default();
    let model = Arc::new(DrapeModel::train(&set, &options, &Silent).unwrap().0);
    let plain = motion(21, 25);
    let (turn, shift) = (Quat::from_rotation_y(2.0), Vec3::new(3.0, 0.0, -1.0));
    let mut turned = plain.clone();
    for pose in &mut turned.frames {
        pose.root_translation = turn * pose.root_translation + shift;
        pose.rotations[0] = (turn * Quat::from_scaled_axis(pose.rotations[0])).to_scaled_axis();
    }
    let wanted = run(&model, &[1.0, 0.5], &plain, Wrinkles::Dynamic);
    let found = run(&model, &[1.0, 0.5], &turned, Wrinkles::Dynamic);
    for (wanted, found) in wanted.iter().zip(&found) {
        let wanted: Vec<Vec3> = wanted.iter().map(|vertex| turn * *vertex + shift).collect();
        assert!(mean_distance(&wanted, found) < 1e-9);
    }
}

#[test]
fn the_factors_multiply_back_to_the_gradients() {
    let set = training_set();
    let example = &set.sequences[1];
    let (pose, vertices) = (&example.motion.frames[40], &example.frames[40]);
    let gradients = deformation_gradients(&set.garment.topology, &set.garment.template, vertices);
    for width in [0.0, 0.05] {
        let mut options = options();
        options.wrinkle.blend_width = width;
        let model = DrapeModel::train(&set, &options, &Silent).unwrap().0;
        let row = model.wrinkle.row_of(&set.garment, pose, vertices);
        let mut product = vec![Mat3::ZERO; gradients.len()];
        let mut shape = vec![Mat3::IDENTITY; gradients.len()];
        model.wrinkle.frames.clone().into_tangents(&mut shape);
        model.wrinkle.compose(pose, &shape, &row, &mut product);
        for (wanted, found) in gradients.iter().zip(&product) {
            assert!(wanted.abs_diff_eq(*found, 1e-5), "{wanted} {found}");
        }
    }
}

#[test]
fn fine_wrinkles_make_up_for_those_that_none_holds() {
    let set = training_set();
    let train = |count: usize| {
        let options = WrinkleOptions { max_count: count, min_count: count, ..options().wrinkle };
        super::WrinkleModel::train(
            &set.garment,
            blend_parts(&set.garment, options.blend_width).unwrap().faces,
            &set.sequences,
            &options,
        )
        .unwrap()
        .0
    };
    let (few, many) = (train(3), train(12));
    assert!(few.held_out_loss() > many.held_out_loss() && many.held_out_loss() >= 0.0, "more hold more");
    let mut few = few;
    few.std_devs = vec![2.0, 1.0, 0.5];
    few.total_variance = 6.0;
    few.held_out_loss = 0.1;
    let gain = (1.0f64 + 0.6 / 1.25).sqrt();
    assert!(few.fine_gains().iter().zip([1.0, gain, gain]).all(|(found, wanted)| (found - wanted).abs() < 1e-12));
    few.held_out_loss = 0.9;
    assert!(few.fine_gains().iter().all(|&found| found <= 2.0f64.sqrt() + 1e-12), "no variance more than doubles");
}

#[test]
fn a_kernel_that_is_not_finite_is_refused() {
    let centres = modiste_core::Matrix::from_rows(&[vec![0.0, f64::NAN], vec![1.0, 0.5]]);
    assert!(super::PoseKernel::new(centres, 1.0).is_err());
}

#[test]
fn leaving_one_out_agrees_with_training_again_on_the_others() {
    let set = training_set();
    let shape = ShapeOptions { count: 3, body_count: 5, ridge: 0.2, area_weighted: false };
    let curve = leave_one_out(&set, &shape, &[0, 1, 3, 5], Placement::Anchors).unwrap();
    let mut error = 0.0;
    for left_out in 0..set.shapes.len() {
        let mut rest = set.shapes.clone();
        let sample = rest.remove(left_out);
        let model = super::ShapeModel::train(&set.garment, &rest, &shape).unwrap();
        let gradients = model.gradients(&model.predict(&sample.shape, sample.ease));
        let solver = modiste_core::GradientReconstruction::new(&set.garment.topology, &set.garment.template).unwrap();
        let mut made = vec![Vec3::ZERO; sample.vertices.len()];
        solver.reconstruct(&gradients, &mut made);
        let shift = model.predict_offset(&sample.shape, sample.ease)
            - crate::refine::anchors::offset(&set.garment.anchors, &made, &sample.body_anchors);
        made.iter_mut().for_each(|vertex| *vertex += shift);
        error += mean_distance(&made, &sample.vertices) / set.shapes.len() as f64;
    }
    assert!((curve.mean_error[3] - error).abs() < 1e-5, "{} {error}", curve.mean_error[3]);
    let form = leave_one_out(&set, &shape, &[0, 1, 3, 5], Placement::Centroid).unwrap();
    assert!(form.mean_error[2] < 0.3 * form.mean_error[0], "{form:?}");
    assert!(form.projection_error <= form.mean_error[2] && form.mean_error[0] <= form.mean_garment_error * 1.001);
}

#[test]
fn a_model_file_gives_the_same_garment_again() {
    let set = training_set();
    for options in [options(), coarse_options()] {
        gives_the_same_again(DrapeModel::train(&set, &options, &Silent).unwrap().0);
    }
}

fn gives_the_same_again(mut model: DrapeModel) {
    model.provenance.licence = "CC0".into();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tube.safetensors");
    model.save(&path).unwrap();
    let again = DrapeModel::load(&path).unwrap();
    assert_eq!(again.provenance, model.provenance);
    assert_eq!(again.to_bytes("again").unwrap(), model.to_bytes("model").unwrap());
    let moving = motion(31, 12);
    let wanted = run(&Arc::new(model), &[0.4, -1.0], &moving, Wrinkles::Dynamic);
    assert_eq!(run(&Arc::new(again), &[0.4, -1.0], &moving, Wrinkles::Dynamic), wanted);
}

#[test]
fn damaged_model_files_are_refused_with_the_reason() {
    let model = DrapeModel::train(&training_set(), &options(), &Silent).unwrap().0;
    let bytes = model.to_bytes("tube").unwrap();
    let refusal = |bytes: Vec<u8>| DrapeModel::parse(bytes, "tube.safetensors").unwrap_err().to_string();
    assert!(refusal(bytes[..bytes.len() / 2].to_vec()).contains("tube.safetensors"));
    assert!(refusal(Vec::new()).contains("tube.safetensors"));
    let replaced = |from: &str, to: &str| {
        let text = from.as_bytes();
        let at = bytes.windows(text.len()).position(|window| window == text).expect("the header names it");
        let mut damaged = bytes.clone();
        damaged[at..at + text.len()].copy_from_slice(to.as_bytes());
        refusal(damaged)
    };
    assert!(replaced(r#"schema\":1"#, r#"schema\":9"#).contains("version 9"));
    let older = replaced(r#"garment_version\":\"3"#, r#"garment_version\":\"1"#);
    assert!(
        older.contains("wanted version 3") && older.contains("found version 1; the garment has to be learned again")
    );
    assert!(replaced(r#"kind\":\"garment"#, r#"kind\":\"gaiters"#).contains("gaiters"));
    assert!(replaced(r#"gender\":\"female"#, r#"gender\":\"femail"#).contains("femail"));
    assert!(replaced(r#"input_gravity\":\"false"#, r#"input_gravity\":\"falsy"#).contains("falsy"));
}

#[test]
fn what_does_not_fit_the_model_is_refused() {
    let set = training_set();
    let model = trained(&set);
    let refusal = |shape: &[f64], count| Synthesis::new(model.clone(), shape, count).unwrap_err().to_string();
    assert!(refusal(&[f64::NAN], 4).contains("β[0]"));
    assert!(refusal(&[], 3).contains("more than 3 vertices"));
    let mut short = set.clone();
    short.sequences[2].frames.pop();
    assert!(DrapeModel::train(&short, &options(), &Silent).unwrap_err().to_string().contains("motion_2"));
    let mut bad = set.clone();
    bad.shapes[3].vertices[5].y = f64::NAN;
    assert!(DrapeModel::train(&bad, &options(), &Silent).unwrap_err().to_string().contains("shape 3"));
    let mut empty = set;
    empty.shapes.clear();
    assert!(DrapeModel::train(&empty, &options(), &Silent).unwrap_err().to_string().contains("at least 2 bodies"));
}

#[test]
fn a_garment_that_slides_as_it_moves_is_followed() {
    // The tube rises with the bend of the chest.
    let slid = |mut sequence: PoseSequence| {
        for (pose, vertices) in sequence.motion.frames.iter().zip(&mut sequence.frames) {
            let way =
                pose.world_rotations()[Part::Chest.index()] * (0.2 * pose.rotations[Part::Chest.index()].x * Vec3::Y);
            vertices.iter_mut().for_each(|vertex| *vertex += way);
        }
        sequence
    };
    let mut set = training_set();
    set.sequences = set.sequences.into_iter().map(slid).collect();
    let model = Arc::new(DrapeModel::train(&set, &coarse_options(), &Silent).unwrap().0);
    let unseen = slid(sequence(&set.garment, "unseen", motion(99, 80)));
    let error = |synthesis: Synthesis| {
        let mut synthesis = synthesis;
        let frames = unseen.motion.frames.iter().zip(&unseen.frames);
        let distances = frames.map(|(pose, truth)| mean_distance(synthesis.step(pose, &anchor_body(pose)), truth));
        distances.sum::<f64>() / unseen.frames.len() as f64
    };
    let synthesis = || Synthesis::new(model.clone(), &[], 4).unwrap();
    let (sliding, resting) = (error(synthesis()), error(synthesis().plain()));
    assert!(sliding < 0.5 * resting, "{sliding} {resting}");
}

#[test]
fn a_training_set_is_read_back_from_its_folder() {
    let set = training_set();
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let entry =
        |name: &str, finished| serde_json::json!({"name": name, "kind": "pose", "frames": 80, "finished": finished});
    let manifest = serde_json::json!({
        "schema": 1, "garment": "tube", "gender": "female", "seed": 7, "hashes": {"pattern.json": "abc"},
        "sequences": [entry("motion_0", true), entry("motion_1", false)], "dropped": [],
    });
    modiste_io::json::write(path("manifest.json"), &manifest).unwrap();
    let garment = &set.garment;
    let (faces, shapes) = (garment.topology.face_count(), set.shapes.len());
    let parts: Vec<u8> = garment.face_parts.iter().map(|part| part.index() as u8).collect();
    let mut writer = modiste_io::npz::Writer::new();
    writer.add_triangles("faces", garment.topology.faces()).add_u8("face_parts", &[faces], parts);
    writer.add_points("template", &garment.template).add_u32("waist_band", &[0], vec![]);
    writer.add_u32("anchors", &[garment.anchors.len(), 2], garment.anchors.as_flattened().to_vec());
    writer.add_f32("uv", &[faces, 3, 2], garment.uv.as_flattened().as_flattened().to_vec());
    writer.save(path("garment.npz")).unwrap();
    let flat = |lists: &[Vec<Vec3>]| -> Vec<f32> {
        lists.iter().flatten().flat_map(|vertex| vertex.as_vec3().to_array()).collect()
    };
    let meshes: Vec<Vec<Vec3>> = set.shapes.iter().map(|sample| sample.vertices.clone()).collect();
    let beta: Vec<f32> = set.shapes.iter().flat_map(|sample| sample.shape.iter().map(|&b| b as f32)).collect();
    let mut writer = modiste_io::npz::Writer::new();
    writer.add_f32("vertices", &[shapes, garment.template.len(), 3], flat(&meshes)).add_f32("beta", &[shapes, 5], beta);
    let anchors: Vec<Vec<Vec3>> = set.shapes.iter().map(|sample| sample.body_anchors.clone()).collect();
    writer.add_f32("body_anchors", &[shapes, garment.anchors.len(), 3], flat(&anchors));
    writer.save(path("shapes.npz")).unwrap();
    let example = &set.sequences[0];
    let rotations: Vec<Vec<Vec3>> = example.motion.frames.iter().map(|pose| pose.rotations.to_vec()).collect();
    let roots: Vec<Vec3> = example.motion.frames.iter().map(|pose| pose.root_translation).collect();
    let mut writer = modiste_io::npz::Writer::new();
    writer.add_f32("vertices", &[80, garment.template.len(), 3], flat(&example.frames));
    writer.add_f32("rotations", &[80, 19, 3], flat(&rotations)).add_points("root_translation", &roots);
    writer.add_f64("fps", &[], vec![30.0]);
    writer.add_f32("body_anchors", &[80, garment.anchors.len(), 3], flat(&example.body_anchors));
    writer.save(path("pose-motion_0.npz")).unwrap();

    modiste_io::write_bytes(path("pattern.json"), b"{\"panels\": 1}").unwrap();

    let read = TrainingSet::load(folder.path()).unwrap();
    assert_eq!(read.garment.pattern, "{\"panels\": 1}");
    assert!(mean_distance(&read.sequences[0].body_anchors[7], &example.body_anchors[7]) < 1e-6);
    assert_eq!((read.shapes.len(), read.sequences.len(), read.seed), (12, 1, 7));
    assert_eq!(read.garment.face_parts, garment.face_parts);
    assert!(mean_distance(&read.shapes[3].body_anchors, &set.shapes[3].body_anchors) < 1e-6);
    assert_eq!(read.garment.topology, garment.topology);
    assert_eq!(read.sources, set.sources);
    assert!(mean_distance(&read.sequences[0].frames[33], &example.frames[33]) < 1e-6);
    assert!((read.sequences[0].motion.frames[5].rotations[2] - example.motion.frames[5].rotations[2]).length() < 1e-6);

    let mut short = modiste_io::npz::Writer::new();
    short.add_points("template", &garment.template);
    short.save(path("garment.npz")).unwrap();
    let refusal = TrainingSet::load(folder.path()).unwrap_err().to_string();
    assert!(refusal.contains("garment.npz") && refusal.contains("faces"), "{refusal}");
}

#[test]
fn the_ease_is_learned_beside_the_shape_of_the_body() {
    let mut set = training_set();
    let widened = |x: &[Vec3], ease: f64| -> Vec<Vec3> {
        x.iter().map(|x| Vec3::new(x.x * (1.0 + 0.1 * ease), x.y, x.z * (1.0 + 0.1 * ease))).collect()
    };
    for (index, sample) in set.shapes.iter_mut().enumerate() {
        sample.ease = [-0.9, 0.3, 0.8, -0.4][index % 4];
        sample.vertices = widened(&sample.vertices, sample.ease);
    }
    let model = DrapeModel::train(&set, &options(), &Silent).unwrap().0;
    assert!(model.shape.has_ease());
    let bytes = model.to_bytes("tube").unwrap();
    let width = |ease: f64| {
        let model = Arc::new(DrapeModel::parse(bytes.clone(), "tube").unwrap().with_ease(ease).unwrap());
        assert!((model.ease() - ease).abs() < 1e-12);
        let still = Motion { fps: 30.0, frames: vec![Pose::template(PELVIS * Vec3::Y)] };
        let made = &run(&model, &[], &still, Wrinkles::Static)[0];
        made.iter().map(|x| x.x).fold(f64::NEG_INFINITY, f64::max)
            - made.iter().map(|x| x.x).fold(f64::INFINITY, f64::min)
    };
    let [slim, regular, loose] = [-1.0, 0.0, 1.0].map(width);
    assert!(
        (regular / slim - 1.0 / 0.9).abs() < 0.02 && (loose / regular - 1.1).abs() < 0.02,
        "{slim} {regular} {loose}"
    );
    for ease in [1.5, f64::NAN] {
        let refusal = model.clone().with_ease(ease).unwrap_err().to_string();
        assert!(refusal.starts_with("ease of tube: wanted a number from -1"), "{refusal}");
    }
    let plain = DrapeModel::train(&training_set(), &options(), &Silent).unwrap().0;
    let refusal = plain.clone().with_ease(0.5).unwrap_err().to_string();
    assert!(refusal.contains("learned in one cut alone") && plain.with_ease(0.0).is_ok(), "{refusal}");
}
