//! What learned hair is worth: the tables and figures of Guan's chapter 6, with ours beside them.
//!
//! The model is `assets/hair-long.safetensors`; its training set, which the held-out sequences are part of, is looked for in
//! `training/hair/long-<guides>`.

use std::sync::Arc;

use anyhow::{Result, bail};
use modiste::{BenchHair, Event, Gender, HairStyle, Job, Outcome, run};
use modiste_body::{Body, ScapeModel};
use modiste_core::{Silent, Vec3};
use modiste_hair::collision::{
    CoefficientDeviation, CollisionOptions, DescentOptions, Penetration, Subspace, descend, penetration_by_vertices,
    solve,
};
use modiste_hair::model::{Dynamics, HairModel, LearnOptions, learn};
use modiste_hair::training::{Cell, Factors, Recipe, Sequence, TrainingFolder, sequences};
use modiste_hair::{Bust, POINTS, Root, Surface, WornHair, evaluate};

use super::page::{Page, rounded};
use super::plot::{Series, lines};
use crate::assets::{body_file, hair_file, hair_folder};
use crate::shell::workspace_root;

/// Table 6.1, main set: mean error on the held-out sequences (cm), and λ_max.
const THESIS_ERRORS: [(&str, f64); 7] = [
    ("l1.0-s1.0", 2.93),
    ("l1.0-s0.0", 1.57),
    ("l0.0-s1.0", 1.22),
    ("l0.0-s0.0", 0.78),
    ("l1.0-s1.0+z", 4.27),
    ("l1.0-s1.0+x", 4.47),
    ("l1.0-s1.0-x", 4.21),
];
/// The sequence that collision is measured on: held out, with complex motion of the head.
const COLLISION_SEQUENCE: &str = "made_shake_and_nod";
/// π₂ of figure 6.7, and τ of figure 6.8.
const PRIORS: [f64; 6] = [0.03, 0.08, 0.13, 0.2, 0.35, 0.6];
const EVERY: [usize; 5] = [1, 2, 5, 10, 15];
/// Frames of that sequence, every so many, that collision is measured on.
const STRIDE: usize = 6;
/// Frames of the long run.
const LONG_RUN: usize = 10_000;
/// Intervals of the grid of figure 6.4.
const GRID: usize = 10;

struct Scene {
    body: Body,
    model: Arc<HairModel>,
    sequences: Vec<Sequence>,
}

fn scene() -> Result<Scene> {
    let file = hair_file(HairStyle::Long);
    if !modiste_io::exists(&file) {
        bail!("there is no {}: `modiste hair learn --style long --out {}` makes it", file.display(), file.display());
    }
    let body = ScapeModel::load(body_file(Gender::Female))?.body(&[])?;
    let model = HairModel::load(file)?.shared();
    let mocap = workspace_root().join("../shared/data/mocap");
    let mocap = modiste_io::exists(&mocap).then_some(mocap);
    let sequences = sequences(&body, mocap.as_deref(), model.seed(), &Silent)?;
    Ok(Scene { body, model, sequences })
}

fn training_set(scene: &Scene) -> Result<TrainingFolder> {
    let root = hair_folder(HairStyle::Long, scene.model.guide_count());
    if !modiste_io::exists(root.join("manifest.json")) {
        bail!("there is no training set in {}", root.display());
    }
    let recipe: Recipe = modiste_io::json::read(root.join("manifest.json"))?;
    Ok(TrainingFolder::open(root, recipe)?)
}

/// Table 6.1 and figure 6.4.
pub(super) fn errors() -> Result<Page> {
    let mut page = Page::new("Error and stability (table 6.1, figure 6.4)");
    let scene = scene()?;
    let folder = training_set(&scene)?;
    let names: Vec<String> = scene.sequences.iter().map(|sequence| sequence.name.clone()).collect();
    let found = evaluate(&scene.model, &folder, &names, &Silent)?;
    let dimensions = scene.model.layout().hair;
    let options = LearnOptions { hair_dimensions: dimensions, plain: true, ..LearnOptions::default() };
    let plain = learn(&folder, &names, &scene.body, scene.model.roots(), &options, &Silent)?.model;
    let plainly = evaluate(&plain, &folder, &names, &Silent)?;
    page.paragraph(format!(
        "Mean distance of guide points from our simulation (cm), the model running freely from the bust alone, without \
         collision handling; {} guides, {dimensions} coefficients. Plain is the model of the thesis alone, learned from the same \
         simulation with as many coefficients: hair in a space that turns with the heading, driven by the bust coefficients. \
         Ours takes hair in the space of the head, and means of the past, products and squares as further inputs. Hair that \
         keeps its mean shape is the error of no model at all.",
        scene.model.guide_count(),
    ));
    let rows = found.iter().zip(&plainly).map(|(error, plain)| {
        let thesis = THESIS_ERRORS.iter().find(|(cell, _)| *cell == error.cell).map_or(f64::NAN, |(_, cm)| *cm);
        let numbers = [
            error.training_cm,
            error.test_cm,
            plain.training_cm,
            plain.test_cm,
            error.projection_cm,
            error.still_cm,
            thesis,
        ];
        std::iter::once(error.cell.clone()).chain(numbers.map(rounded)).collect::<Vec<_>>()
    });
    let header = [
        "hair",
        "learned from",
        "held out",
        "plain, learned from",
        "plain, held out",
        "components alone",
        "mean shape",
        "thesis, held out",
    ];
    page.table(&header, rows);
    for error in &found {
        if let Some((_, limit)) = THESIS_ERRORS.iter().find(|(cell, _)| *cell == error.cell) {
            page.at_most(&format!("error of {} held out", error.cell), error.test_cm, *limit, "cm");
        }
    }
    page.figures("errors", &found)?;
    page.figures("errors_plain", &plainly)?;
    let grid = scene.model.stability(GRID)?;
    let largest = grid.iter().map(|(_, _, lambda)| *lambda).fold(0.0, f64::max);
    page.claim("λ_max over length and softness", "below 1".to_owned(), format!("{largest:.4}"), largest < 1.0);
    page.figures("lambda", &grid)?;
    let plainly = plain.stability(GRID)?.iter().map(|(_, _, lambda)| *lambda).fold(0.0, f64::max);
    page.paragraph(format!("The plain model's λ_max over the same grid is {plainly:.4}."));
    let series: Vec<Series> = [0.0, 0.5, 1.0]
        .into_iter()
        .map(|softness| {
            let row = grid.iter().filter(|(_, s, _)| (s - softness).abs() < 1e-9).map(|&(length, _, l)| (length, l));
            Series::new(format!("softness {softness}"), row.collect())
        })
        .filter(|series| !series.points.is_empty())
        .collect();
    page.plot("hair-lambda", "λ_max against length", lines(["length factor", "λ_max"], &series, Some(1.0))?);
    Ok(page)
}

/// One frame for the measurements of collision.
struct Moment {
    surface: Surface,
    roots: Vec<Vec3>,
    y0: Vec<f64>,
    /// The simulation, in the space of the hair: three numbers a point (m).
    simulated: Vec<f32>,
}

/// Figures 6.7 and 6.8.
pub(super) fn collision() -> Result<Page> {
    let mut page = Page::new("Collision (figures 6.7 and 6.8)");
    let scene = scene()?;
    let moments = moments(&scene)?;
    page.paragraph(format!(
        "Long soft hair in {} frames of {COLLISION_SEQUENCE}, which is made and held out. Points inside by the thesis's test \
         (nearest vertex, eq. 28); the exact pass that follows is not part of this. The thesis's own simulation has 1.9 % of \
         points inside and 3.8 mm; its deviations go from 1.3 to 5.5 %. Components are those of the simulated hair, cut to as \
         many as the model has: what a model without error would show.",
        moments.len()
    ));
    let model = &scene.model;
    let all: Vec<usize> = (0..model.point_count()).filter(|point| point % POINTS != 0).collect();
    let roots: Vec<usize> = (0..model.guide_count()).map(|guide| guide * POINTS).collect();
    let subspace = Subspace::new(model.mean(), model.basis(), all, roots)?;
    let before = measure(model, &moments, |moment| Ok(moment.y0.clone()))?;
    let mut simulated = Inside::default();
    for moment in &moments {
        simulated.add(&moment.simulated, &moment.surface);
    }
    let components = measure(model, &moments, |moment| Ok(model.hair_coefficients(&moment.simulated)))?;
    let [rate, deepest] = simulated.of_frames(moments.len()).map(rounded);
    let mut rows = vec![
        vec!["our simulation".to_owned(), String::new(), rate, deepest, String::new()],
        vec!["its components".to_owned(), String::new(), rounded(components[0]), rounded(components[1]), String::new()],
        row("before", None, &before),
    ];
    let mut series: [Vec<Series>; 3] = [Vec::new(), Vec::new(), Vec::new()];
    for method in ["A", "B"] {
        let mut points: [Vec<(f64, f64)>; 3] = Default::default();
        for prior in PRIORS {
            let options = CollisionOptions { prior, ..CollisionOptions::default() };
            let after = measure(model, &moments, |moment| {
                let pairs = subspace.correspondences(&moment.y0, &moment.surface);
                if method == "A" {
                    return Ok(descend(
                        &subspace,
                        &moment.y0,
                        &pairs,
                        &moment.roots,
                        &options,
                        &DescentOptions::default(),
                    ));
                }
                let report = solve(&subspace, &moment.y0, &pairs, &moment.roots, &options)?;
                Ok(report.rounds.last().unwrap_or(&moment.y0).clone())
            })?;
            for (points, value) in points.iter_mut().zip(after) {
                points.push((prior, value));
            }
            rows.push(row(method, Some(prior), &after));
        }
        for (series, points) in series.iter_mut().zip(points) {
            series.push(Series::new(format!("method {method}"), points));
        }
    }
    page.table(&["method", "π₂", "inside (%)", "mean of the deepest (mm)", "deviation (%)"], rows);
    for ((name, axis), (mut series, before)) in
        [("rate", "inside (%)"), ("deepest", "deepest (mm)"), ("deviation", "deviation (%)")]
            .into_iter()
            .zip(series.into_iter().zip(before))
    {
        series.push(Series::new("before", PRIORS.iter().map(|&prior| (prior, before)).collect()));
        page.plot(&format!("hair-{name}"), axis, lines(["π₂", axis], &series, None)?);
    }
    sub_sampling(&mut page, &scene, &moments)?;
    Ok(page)
}

fn row(method: &str, prior: Option<f64>, values: &[f64; 3]) -> Vec<String> {
    let prior = prior.map_or_else(String::new, |prior| prior.to_string());
    [method.to_owned(), prior].into_iter().chain(values.map(rounded)).collect()
}

fn moments(scene: &Scene) -> Result<Vec<Moment>> {
    let Some(sequence) = scene.sequences.iter().find(|sequence| sequence.name == COLLISION_SEQUENCE) else {
        bail!("there is no sequence {COLLISION_SEQUENCE}");
    };
    let track = scene.model.track(&scene.body)?;
    let bust = Bust::new(scene.body.model())?;
    let mut dynamics = Dynamics::new(&scene.model, Factors::default())?;
    let folder = training_set(scene)?;
    let long_soft = folder.recipe().cells.iter().position(|cell| *cell == Cell::STYLES[0]).unwrap_or(0);
    let simulated = folder.hair(COLLISION_SEQUENCE, long_soft, sequence.motion.frames.len())?;
    let numbers = simulated.len() / sequence.motion.frames.len();
    let mut vertices = Vec::new();
    let mut moments = Vec::new();
    for (index, pose) in sequence.motion.frames.iter().enumerate() {
        scene.body.pose(pose, &mut vertices);
        let (frame, canonical) = track.canonical(&vertices, pose);
        let hair_from_canonical = scene.model.space().pose(&canonical).inverse();
        let state = scene.model.bust_state(frame, canonical);
        let y0 = dynamics.step(&state).to_vec();
        if index % STRIDE == 0 {
            let into_hair = state.world_from_hair().inverse();
            let x = bust.gather(&vertices).into_iter().map(|p| into_hair.transform_point3(p)).collect();
            let topology = scene.body.model().topology();
            let at = |root: &Root| into_hair.transform_point3(root.position(topology, &vertices));
            let roots = scene.model.roots().iter().map(at);
            let simulated = &simulated[index * numbers..(index + 1) * numbers];
            moments.push(Moment {
                surface: Surface::new(bust.topology(), x),
                roots: roots.collect(),
                y0,
                simulated: scene.model.space().carry(&hair_from_canonical, simulated),
            });
        }
    }
    Ok(moments)
}

/// Rate inside (%), mean of the deepest of each frame (mm), and deviation (%), of all points.
fn measure(model: &HairModel, moments: &[Moment], solve: impl Fn(&Moment) -> Result<Vec<f64>>) -> Result<[f64; 3]> {
    let mut numbers = vec![0.0; 3 * model.point_count()];
    let (mut inside, mut deviation) = (Inside::default(), 0.0);
    for moment in moments {
        let y = solve(moment)?;
        model.expansion().expand(&y, &mut numbers);
        inside.add(&numbers, &moment.surface);
        deviation += CoefficientDeviation::new(&y, &moment.y0, model.std_devs()).0;
    }
    let [rate, deepest] = inside.of_frames(moments.len());
    Ok([rate, deepest, 100.0 * deviation / moments.len().max(1) as f64])
}

/// Points inside by the thesis's test, over frames.
#[derive(Default)]
struct Inside {
    sum: Penetration,
    deepest: f64,
}

impl Inside {
    fn add(&mut self, numbers: &[f32], surface: &Surface) {
        let at = |p: &[f32]| Vec3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2]));
        let points: Vec<Vec3> = numbers.chunks_exact(3).map(at).collect();
        let found = penetration_by_vertices(&points, surface);
        self.deepest += found.deepest;
        self.sum = self.sum.join(found);
    }

    /// Rate (%) and mean of the deepest of each frame (mm).
    fn of_frames(&self, count: usize) -> [f64; 2] {
        [100.0 * self.sum.rate(), 1e3 * self.deepest / count.max(1) as f64]
    }
}

/// Figure 6.8: the rate against τ, and the time.
fn sub_sampling(page: &mut Page, scene: &Scene, moments: &[Moment]) -> Result<()> {
    let model = &scene.model;
    let mut rows = Vec::new();
    let mut rates = Vec::new();
    for every in EVERY {
        let guides = || (0..model.guide_count()).step_by(every);
        let looked_at = guides().flat_map(|guide| (1..POINTS).map(move |point| guide * POINTS + point)).collect();
        let roots: Vec<usize> = guides().map(|guide| guide * POINTS).collect();
        let subspace = Subspace::new(model.mean(), model.basis(), looked_at, roots)?;
        let options = CollisionOptions { every, ..CollisionOptions::default() };
        let start = std::time::Instant::now();
        let solved = moments
            .iter()
            .map(|moment| {
                let places: Vec<Vec3> = moment.roots.iter().step_by(every).copied().collect();
                let pairs = subspace.correspondences(&moment.y0, &moment.surface);
                let report = solve(&subspace, &moment.y0, &pairs, &places, &options)?;
                Ok(report.rounds.last().unwrap_or(&moment.y0).clone())
            })
            .collect::<Result<Vec<Vec<f64>>>>()?;
        let milliseconds = 1e3 * start.elapsed().as_secs_f64() / moments.len().max(1) as f64;
        let answers = std::cell::RefCell::new(solved.into_iter());
        let after = measure(model, moments, |moment| Ok(answers.borrow_mut().next().unwrap_or(moment.y0.clone())))?;
        rates.push((every as f64, after[0]));
        rows.push([every.to_string(), rounded(after[0]), rounded(milliseconds)]);
    }
    page.table(&["τ", "inside (%)", "time (ms)"], rows);
    page.plot("hair-sub-sampling", "inside against τ", lines(["τ", "inside (%)"], &[Series::new("B", rates)], None)?);
    Ok(())
}

/// Table 6.2, and a long run.
pub(super) fn times() -> Result<Page> {
    let mut page = Page::new("Time per frame (table 6.2) and a long run");
    let Outcome::BenchedHair(found) = run(&Job::BenchHair(BenchHair::default()), &|_event: Event| {})? else {
        bail!("the bench gave another result");
    };
    page.paragraph(
        "Long soft hair on a walking person, exact pass included. Where the model has other numbers of guides than the row, \
         they lie between its own. The thesis has 14.3, 20.0 and 22.2 ms on a GPU, and 130, 182 and 556 ms of simulation.",
    );
    let rows = found.rows.iter().map(|row| {
        let numbers = [
            row.synthesis_ms,
            row.collision_ms,
            row.reconstruction_ms,
            row.total_ms_p50,
            row.total_ms_p95,
            row.physics_ms,
            row.physics_ms / row.total_ms_p50,
            100.0 * row.inside,
            row.deepest_mm,
        ];
        [row.guides.to_string(), row.threads.to_string()].into_iter().chain(numbers.map(rounded)).collect::<Vec<_>>()
    });
    let header = [
        "guides",
        "threads",
        "synthesis (ms)",
        "collision (ms)",
        "points (ms)",
        "total (ms)",
        "95 % (ms)",
        "physics (ms)",
        "times faster",
        "inside (%)",
        "deepest (mm)",
    ];
    page.table(&header, rows);
    for row in found.rows.iter().filter(|row| row.threads == 2) {
        if row.guides == 3980 {
            page.at_most("frame of 3,980 guides on two cores", row.total_ms_p50, 8.0, "ms");
        }
        let what = |what: &str| format!("{what}, {} guides", row.guides);
        page.at_least(&what("times faster than our physics"), row.physics_ms / row.total_ms_p50, 25.0, "");
        page.at_most(&what("points inside by exact test"), 100.0 * row.inside, 0.05, "%");
        page.at_most(&what("deepest point inside"), row.deepest_mm, 1.0, "mm");
    }
    page.figures("rows", &found.rows)?;
    long_run(&mut page)?;
    Ok(page)
}

fn long_run(page: &mut Page) -> Result<()> {
    let scene = scene()?;
    let mut worn = WornHair::new(&scene.model, &scene.body, Factors::default())?;
    let poses = scene.sequences.iter().filter(|sequence| sequence.held_out).flat_map(|s| &s.motion.frames);
    let mut vertices = Vec::new();
    let (mut furthest, mut stillest) = (0.0f64, f64::INFINITY);
    let mut window: Vec<Vec3> = Vec::new();
    for (index, pose) in poses.cycle().take(LONG_RUN).enumerate() {
        scene.body.pose(pose, &mut vertices);
        worn.step(pose, &vertices, &[])?;
        let head = worn.points()[0];
        furthest = worn.points().iter().map(|p| p.distance(head)).fold(furthest, f64::max);
        if index % 300 == 299 {
            let tips: Vec<Vec3> = worn.points().iter().skip(POINTS - 1).step_by(POINTS).map(|p| *p - head).collect();
            if !window.is_empty() {
                let moved = tips.iter().zip(&window).map(|(a, b)| a.distance(*b)).sum::<f64>() / tips.len() as f64;
                stillest = stillest.min(moved);
            }
            window = tips;
        }
    }
    page.at_most(&format!("furthest point from the crown in {LONG_RUN} frames"), furthest, 1.0, "m");
    page.at_least("least mean motion of tips from one ten seconds to the next", 1e3 * stillest, 0.1, "mm");
    Ok(())
}
