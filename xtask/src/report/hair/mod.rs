//! What learned hair is worth: the tables and figures of Guan's chapter 6, with ours beside them.
//!
//! The model is `assets/hair-long.safetensors`; its training set, which the held-out sequences are part of, is looked for in
//! `training/hair/long-<guides>`.

mod collision;
mod errors;

use std::sync::Arc;

use anyhow::{Result, bail};
use modiste::{BenchHair, Event, Gender, HairStyle, Job, Outcome, run};
use modiste_body::{Body, ScapeModel};
use modiste_core::{Silent, Vec3};
use modiste_hair::collision::{Penetration, penetration_exact};
use modiste_hair::model::HairModel;
use modiste_hair::training::{Factors, Recipe, Sequence, TrainingFolder, sequences};
use modiste_hair::{Bust, POINTS, WornHair};

use super::page::{Page, rounded};
use crate::assets::{body_file, hair_file, hair_folder};
use crate::shell::workspace_root;
pub(super) use collision::collision;
pub(super) use errors::errors;

/// Frames of the long run.
const LONG_RUN: usize = 10_000;

struct Scene {
    body: Body,
    model: Arc<HairModel>,
    sequences: Vec<Sequence>,
}

impl Scene {
    /// Frames that are learned from, or those that are held out.
    fn frames(&self, held_out: bool) -> usize {
        let wanted = self.sequences.iter().filter(|sequence| sequence.held_out == held_out);
        wanted.map(|sequence| sequence.motion.frames.len()).sum()
    }
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
            100.0 * row.behind,
            row.deepest_behind_mm,
        ];
        [row.guides.to_string(), row.threads.to_string(), row.garments.clone()]
            .into_iter()
            .chain(numbers.map(rounded))
            .collect::<Vec<_>>()
    });
    let header = [
        "guides",
        "threads",
        "worn",
        "synthesis (ms)",
        "collision (ms)",
        "points (ms)",
        "total (ms)",
        "95 % (ms)",
        "physics (ms)",
        "times faster",
        "inside (%)",
        "deepest (mm)",
        "behind clothing (%)",
        "deepest behind (mm)",
    ];
    page.table(&header, rows);
    for row in found.rows.iter().filter(|row| row.threads == 2) {
        let worn = if row.garments.is_empty() { String::new() } else { format!(" over {}", row.garments) };
        let what = |what: &str| format!("{what}, {} guides{worn}", row.guides);
        if !row.garments.is_empty() {
            page.at_most(&what("points behind clothing"), 100.0 * row.behind, 0.05, "%");
            page.at_most(&what("deepest point behind clothing"), row.deepest_behind_mm, 1.0, "mm");
            continue;
        }
        if row.guides == 3980 {
            page.at_most("frame of 3,980 guides on two cores", row.total_ms_p50, 8.0, "ms");
        }
        page.at_least(&what("times faster than our physics"), row.physics_ms / row.total_ms_p50, 25.0, "");
        page.at_most(&what("points inside by exact test"), 100.0 * row.inside, 0.05, "%");
        page.at_most(&what("deepest point inside"), row.deepest_mm, 1.0, "mm");
    }
    page.figures("rows", &found.rows)?;
    long_run(&mut page)?;
    page.paragraph(
        "Pictures, drawn by `modiste hair animate` and made smaller: \
         [length from 0 to 1.35](slider-length.png) (`--length 0..1.35`), \
         [softness from 0 to 1](slider-softness.png) (`--softness 0..1`), \
         [wind to the left](slider-wind.png) (`--wind 1,+x`), [wind from the front](wind-front.png) (`--wind 1,-z`), and \
         [lengths mixed by region](mixed-lengths.png) (`--mix front=0,back=1,sides=0.5`), as in figure 6.6. The styles, walking: \
         [short](style-short.png), [bob](style-bob.png), [long](style-long.png), and [swept back](style-swept.png), which is \
         stiff (`--softness 0`): soft, its sides fall into the face.",
    );
    Ok(page)
}

fn long_run(page: &mut Page) -> Result<()> {
    let scene = scene()?;
    let mut worn = WornHair::new(&scene.model, &scene.body, Factors::default())?;
    let poses = scene.sequences.iter().filter(|sequence| sequence.held_out).flat_map(|s| &s.motion.frames);
    let once = poses.clone().count();
    let bust = Bust::new(scene.body.model())?;
    let mut surface = bust.surface(scene.body.rest_vertices());
    let mut inside = Penetration::default();
    let mut vertices = Vec::new();
    let (mut furthest, mut stillest) = (0.0f64, f64::INFINITY);
    let mut window: Vec<Vec3> = Vec::new();
    for (index, pose) in poses.cycle().take(LONG_RUN).enumerate() {
        scene.body.pose(pose, &mut vertices);
        worn.step(pose, &vertices, &[])?;
        if index < once {
            surface.set(&bust.gather(&vertices));
            inside = inside.join(penetration_exact(worn.points(), &surface));
        }
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
    page.at_most("points inside by exact test, all held-out motions", 100.0 * inside.rate(), 0.05, "%");
    page.at_most("deepest point inside, all held-out motions", 1e3 * inside.deepest, 1.0, "mm");
    page.at_most(&format!("furthest point from the crown in {LONG_RUN} frames"), furthest, 1.0, "m");
    page.at_least("least mean motion of tips from one ten seconds to the next", 1e3 * stillest, 0.1, "mm");
    Ok(())
}
