//! How long a frame of hair takes, beside our physics.

use std::time::Instant;

use modiste_body::{Body, Gender, Motion, ScapeModel};
use modiste_core::{Progress, Vec3};
use modiste_hair::collision::{Penetration, penetration_exact};
use modiste_hair::model::HairModel;
use modiste_hair::rod::{Material, Simulation, SimulationOptions, Wind};
use modiste_hair::training::Factors;
use modiste_hair::{Bust, Groom, HairTimes, Style, WornHair};
use modiste_scene::Machine;
use serde::Serialize;

use crate::event::Reporter;
use crate::{Action, Assets, JobError, Length, MotionChoice};

/// Times learned hair, long and soft, on a walking person, and the simulation of as many guides in the same run.
#[derive(Debug, Clone, PartialEq)]
pub struct BenchHair {
    /// Name of a model in the assets, or a file.
    pub model: String,
    /// Numbers of guides; where the model has others, guides between its own are used.
    pub guides: Vec<usize>,
    /// Numbers of threads, each measured.
    pub threads: Vec<usize>,
    /// Frames that count; a quarter as many go before them to warm up.
    pub frames: usize,
}

impl Default for BenchHair {
    /// Table 6.2.
    fn default() -> Self {
        Self { model: "long".to_owned(), guides: vec![198, 962, 3980], threads: vec![1, 2], frames: 120 }
    }
}

/// What a frame takes at one number of guides.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BenchHairRow {
    /// Guides.
    pub guides: usize,
    /// Points of all guides.
    pub points: usize,
    /// Whether the model was learned with so many guides; otherwise they lie between its own.
    pub learned: bool,
    /// Threads used.
    pub threads: usize,
    /// Median time to find the coefficients (ms).
    pub synthesis_ms: f64,
    /// Median time of collision, the exact pass included (ms).
    pub collision_ms: f64,
    /// Median time to make the points (ms).
    pub reconstruction_ms: f64,
    /// Median time of a whole frame (ms).
    pub total_ms_p50: f64,
    /// 95% of the frames took less (ms).
    pub total_ms_p95: f64,
    /// Median time of a frame of our physics with as many guides (ms).
    pub physics_ms: f64,
    /// Points inside the body afterwards, by exact test, as a part of all.
    pub inside: f64,
    /// Depth of the deepest (mm).
    pub deepest_mm: f64,
}

/// What benchmarking gives back.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BenchedHair {
    /// The machine.
    pub machine: Machine,
    /// One row for each number of guides and threads.
    pub rows: Vec<BenchHairRow>,
}

/// Frames of physics that count, and those before them.
const PHYSICS: [usize; 2] = [12, 4];

impl BenchHair {
    pub(crate) fn run(&self, reporter: &Reporter<'_>) -> Result<BenchedHair, JobError> {
        const STAGE: &str = "bench";
        let assets = Assets::find()?;
        let file = assets.hair(&self.model)?;
        let model = HairModel::load(&file)?;
        let body = ScapeModel::load(assets.body(Gender::Female))?.body(&[])?;
        let warm_up = self.frames.div_ceil(4);
        let length = Some(Length::Frames(self.frames + warm_up));
        let motion = MotionChoice::Action(Action::Walk).motion(&body, length, model.fps(), reporter)?;
        reporter.start(STAGE, self.guides.len() * self.threads.len());
        let mut rows = Vec::new();
        for &guides in &self.guides {
            let learned = guides == model.guide_count();
            for &threads in &self.threads {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
                let pool = pool.map_err(|error| JobError::Threads { wanted: threads, reason: error.to_string() })?;
                let hair = if learned { HairModel::load(&file)? } else { model.densified(&body, guides)? };
                let row = pool.install(|| row(hair, learned, threads, &body, &motion, warm_up))?;
                rows.push(row);
                reporter.advance(STAGE, rows.len());
            }
        }
        reporter.finish(STAGE);
        Ok(BenchedHair { machine: Machine::this(), rows })
    }
}

fn row(
    hair: HairModel,
    learned: bool,
    threads: usize,
    body: &Body,
    motion: &Motion,
    warm_up: usize,
) -> Result<BenchHairRow, JobError> {
    let hair = hair.shared();
    let mut worn = WornHair::new(&hair, body, Factors::default())?;
    let bust = Bust::new(body.model())?;
    let mut surface = bust.surface(body.rest_vertices());
    let mut vertices: Vec<Vec3> = Vec::new();
    let mut times: Vec<HairTimes> = Vec::new();
    let mut inside = Penetration::default();
    for pose in &motion.frames {
        body.pose(pose, &mut vertices);
        times.push(worn.step(pose, &vertices, &[])?);
        surface.set(&bust.gather(&vertices));
        inside = inside.join(penetration_exact(worn.points(), &surface));
    }
    let counted = &times[warm_up.min(times.len() - 1)..];
    let sorted = |of: fn(&HairTimes) -> f64| {
        let mut values: Vec<f64> = counted.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        values
    };
    let middle = |of: fn(&HairTimes) -> f64| {
        let values = sorted(of);
        values[values.len() / 2]
    };
    let total = sorted(|t| 1e3 * t.total().as_secs_f64());
    Ok(BenchHairRow {
        guides: hair.guide_count(),
        points: hair.point_count(),
        learned,
        threads,
        synthesis_ms: middle(|t| 1e3 * t.synthesis.as_secs_f64()),
        collision_ms: middle(|t| 1e3 * t.collision.as_secs_f64()),
        reconstruction_ms: middle(|t| 1e3 * t.reconstruction.as_secs_f64()),
        total_ms_p50: total[total.len() / 2],
        total_ms_p95: total[total.len() * 95 / 100],
        physics_ms: physics(body, hair.guide_count(), motion)?,
        inside: inside.rate(),
        deepest_mm: 1e3 * inside.deepest,
    })
}

/// Median time of a frame of the simulation (ms).
fn physics(body: &Body, guides: usize, motion: &Motion) -> Result<f64, JobError> {
    let groom = Groom::grow(body, Style::Long, 1.0, guides, 1)?;
    let mut vertices = Vec::new();
    body.pose(&motion.frames[0], &mut vertices);
    let material = Material::of_softness(1.0)?;
    let mut simulation = Simulation::new(body, &vertices, &groom, material, SimulationOptions::default())?;
    let mut times = Vec::new();
    for pose in motion.frames.iter().take(PHYSICS[0] + PHYSICS[1]) {
        body.pose(pose, &mut vertices);
        let start = Instant::now();
        simulation.step(&vertices, &Wind::still());
        times.push(1e3 * start.elapsed().as_secs_f64());
    }
    let mut counted = times.split_off(PHYSICS[1].min(times.len() - 1));
    counted.sort_by(f64::total_cmp);
    Ok(counted[counted.len() / 2])
}
