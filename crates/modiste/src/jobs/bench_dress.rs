//! How long a frame takes.

use std::sync::Arc;

use modiste_body::{Gender, Motion, ScapeModel};
use modiste_core::Progress;
use modiste_garment::DrapeModel;
use modiste_garment::refine::FitOptions;
use modiste_scene::{Dresser, Machine, Memory, Person, Stage, Timing, reset_peak_memory};
use serde::Serialize;

use crate::event::Reporter;
use crate::{Action, Assets, BodyChoice, JobError, MotionChoice};

/// Times characters, one at a time, from the pose in to the vertices out.
#[derive(Debug, Clone, PartialEq)]
pub struct BenchDress {
    /// Whose body model and garments.
    pub gender: Gender,
    /// Numbers of threads, each measured.
    pub threads: Vec<usize>,
    /// Frames that count; a third as many go before them to warm up.
    pub frames: usize,
}

impl Default for BenchDress {
    fn default() -> Self {
        Self { gender: Gender::Female, threads: vec![1, 2], frames: 120 }
    }
}

/// What a frame takes in one outfit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BenchRow {
    /// The garments, from the inside out.
    pub outfit: String,
    /// Vertices of all garments.
    pub vertices: usize,
    /// Threads used.
    pub threads: usize,
    /// Median time to pose the body (ms).
    pub body_ms: f64,
    /// Median time to make the garments (ms).
    pub synthesis_ms: f64,
    /// Median time to fit them (ms).
    pub fit_ms: f64,
    /// Median time of a whole frame (ms).
    pub total_ms_p50: f64,
    /// 95% of the frames took less (ms).
    pub total_ms_p95: f64,
    /// Largest memory of the whole program while it ran (MB).
    pub peak_mb: f64,
}

/// What benchmarking gives back.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BenchedDress {
    /// The machine.
    pub machine: Machine,
    /// One row for each outfit and number of threads.
    pub rows: Vec<BenchRow>,
}

/// The outfits of DRAPE table 1, as far as their garments are there.
const OUTFITS: [&[&str]; 7] = [
    &["tshirt"],
    &["shorts"],
    &["skirt"],
    &["longsleeve"],
    &["pants"],
    &["shorts", "tshirt"],
    &["pants", "longsleeve"],
];

impl BenchDress {
    pub(crate) fn run(&self, reporter: &Reporter<'_>) -> Result<BenchedDress, JobError> {
        const STAGE: &str = "bench";
        let assets = Assets::find()?;
        let model = ScapeModel::load(assets.body(self.gender))?;
        let known = assets.garments(self.gender)?;
        let outfits: Vec<&[&str]> = OUTFITS
            .into_iter()
            .filter(|outfit| outfit.iter().all(|name| known.iter().any(|garment| garment == name)))
            .collect();
        reporter.start(STAGE, outfits.len() * self.threads.len());
        let mut rows = Vec::new();
        for outfit in outfits {
            reset_peak_memory();
            let garments = outfit
                .iter()
                .map(|name| Ok(Arc::new(DrapeModel::load(assets.garment(self.gender, name)?)?)))
                .collect::<Result<Vec<_>, JobError>>()?;
            let body = BodyChoice::Average.make(&model, reporter)?;
            let person = Person::new(body, garments)?;
            let motion = MotionChoice::Action(Action::Walk).motion(person.body(), None, person.fps(), reporter)?;
            for &threads in &self.threads {
                rows.push(self.row(&person, &motion, threads)?);
                reporter.advance(STAGE, rows.len());
            }
        }
        reporter.finish(STAGE);
        Ok(BenchedDress { machine: Machine::this(), rows })
    }

    fn row(&self, person: &Person, motion: &Motion, threads: usize) -> Result<BenchRow, JobError> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.map_err(|error| JobError::Threads { wanted: threads, reason: error.to_string() })?;
        let mut dresser = Dresser::new(person, &FitOptions::default())?;
        let warm_up = self.frames.div_ceil(3);
        let mut timing = Timing::default();
        pool.install(|| {
            // There and back again, so that any number of frames is one motion.
            let there = motion.frames.iter();
            let poses = there.clone().chain(there.rev()).cycle();
            for pose in poses.take(warm_up + self.frames) {
                dresser.step(pose);
                timing.push(dresser.times());
            }
        });
        let median = |stage| timing.stage(stage, warm_up).map_or(0.0, |summary| summary.median);
        let total = timing.total(warm_up);
        Ok(BenchRow {
            outfit: (0..dresser.garment_count())
                .map(|layer| dresser.garment(layer).garment().name.clone())
                .collect::<Vec<_>>()
                .join("+"),
            vertices: (0..dresser.garment_count()).map(|layer| dresser.vertices(layer).len()).sum(),
            threads,
            body_ms: median(Stage::Body),
            synthesis_ms: median(Stage::Synthesis),
            fit_ms: median(Stage::Fit),
            total_ms_p50: total.map_or(0.0, |summary| summary.median),
            total_ms_p95: total.map_or(0.0, |summary| summary.p95),
            peak_mb: Memory::now().map_or(0.0, |memory| memory.peak_mb),
        })
    }
}
