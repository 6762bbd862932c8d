//! How long a frame takes.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use modiste_body::{Gender, Motion, ScapeModel};
use modiste_core::Progress;
use modiste_garment::DrapeModel;
use modiste_garment::refine::FitOptions;
use modiste_scene::{Dresser, Machine, Memory, Person, Stage, reset_peak_memory, time_frames};
use serde::{Deserialize, Serialize};

use crate::event::Reporter;
use crate::{Action, Assets, BodyChoice, JobError, MotionChoice};

/// How fine garments are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Resolution {
    /// As they are in `assets`.
    BuiltIn,
    /// As in DRAPE table 1.
    Paper,
}

/// Times characters, one at a time, from the pose in to the vertices out.
#[derive(Debug, Clone, PartialEq)]
pub struct BenchDress {
    /// Whose body model and garments.
    pub gender: Gender,
    /// Only this outfit, such as `shorts+tshirt`; all of them when absent. What memory one takes is told best by a program
    /// that has measured no other before.
    pub outfit: Option<String>,
    /// How fine the garments are, each measured. Garments of the paper's resolution are those that `cargo xtask assets --paper`
    /// has made, where they are there; otherwise the built-in ones are subdivided.
    pub resolutions: Vec<Resolution>,
    /// Numbers of threads, each measured.
    pub threads: Vec<usize>,
    /// Frames that count; a third as many go before them to warm up.
    pub frames: usize,
}

impl Default for BenchDress {
    fn default() -> Self {
        let resolutions = vec![Resolution::BuiltIn, Resolution::Paper];
        Self { gender: Gender::Female, outfit: None, resolutions, threads: vec![1, 2], frames: 120 }
    }
}

/// What a frame takes in one outfit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BenchRow {
    /// The garments, from the inside out.
    pub outfit: String,
    /// How fine they are.
    pub resolution: Resolution,
    /// Whether a garment was not learned as fine as this, but subdivided: as much to do, but no finer wrinkles.
    pub subdivided: bool,
    /// Vertices of all garments.
    pub vertices: usize,
    /// Threads used.
    pub threads: usize,
    /// Median time to pose the body (ms).
    pub body_ms: f64,
    /// Median time to make the garments (ms), beyond that for the body where they are made meanwhile.
    pub synthesis_ms: f64,
    /// Median time to fit them (ms).
    pub fit_ms: f64,
    /// Median time of a whole frame (ms).
    pub total_ms_p50: f64,
    /// 95% of the frames took less (ms).
    pub total_ms_p95: f64,
    /// Time from the model files to the first frame (ms).
    pub start_ms: f64,
    /// Largest memory of the whole program meanwhile (MB).
    pub peak_mb: f64,
    /// What the paper took to make the garments, to fit them and in all (s; DRAPE table 1), with as many vertices as
    /// [`Resolution::Paper`] has.
    pub paper_s: [f64; 3],
}

/// What benchmarking gives back.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BenchedDress {
    /// The machine.
    pub machine: Machine,
    /// One row for each outfit, resolution and number of threads.
    pub rows: Vec<BenchRow>,
}

impl BenchDress {
    /// The outfits that can be measured: those of DRAPE table 1.
    pub fn outfits() -> Vec<String> {
        OUTFITS.iter().map(|(outfit, _)| outfit.join("+")).collect()
    }
}

/// The outfits of DRAPE table 1 and what they took: synthesis, fit, in all (s).
const OUTFITS: [(&[&str], [f64; 3]); 7] = [
    (&["tshirt"], [0.1, 0.8, 0.9]),
    (&["shorts"], [0.06, 0.4, 0.46]),
    (&["skirt"], [0.06, 0.4, 0.46]),
    (&["longsleeve"], [0.1, 0.7, 0.8]),
    (&["pants"], [0.09, 0.6, 0.69]),
    (&["shorts", "tshirt"], [0.16, 1.2, 1.4]),
    (&["pants", "longsleeve"], [0.19, 1.3, 1.6]),
];

/// Vertices of the garments there.
const PAPER_VERTICES: [(&str, usize); 5] =
    [("tshirt", 18_903), ("shorts", 10_028), ("skirt", 8_933), ("longsleeve", 17_136), ("pants", 15_980)];

/// Where garments of that resolution are, from the folder of the assets.
const PAPER_ASSETS: &str = "../training/paper-assets";
/// Where training sets are, from there, and below it the garments that were subdivided, by the hash of what they are made from.
const TRAINING: &str = "../training";
const SUBDIVIDED: &str = "subdivided";

/// The model files of a garment.
struct Files {
    built_in: PathBuf,
    paper: PathBuf,
    /// Whether the latter was subdivided.
    subdivided: bool,
}

impl BenchDress {
    pub(crate) fn run(&self, reporter: &Reporter<'_>) -> Result<BenchedDress, JobError> {
        const STAGE: &str = "bench";
        let assets = Assets::find()?;
        let known = assets.garments(self.gender)?;
        let is_known = |outfit: &[&str]| outfit.iter().all(|name| known.iter().any(|garment| garment == name));
        let is_wanted = |outfit: &[&str]| self.outfit.as_ref().is_none_or(|wanted| *wanted == outfit.join("+"));
        let outfits: Vec<_> = OUTFITS.into_iter().filter(|(outfit, _)| is_known(outfit) && is_wanted(outfit)).collect();
        if let (Some(wanted), true) = (&self.outfit, outfits.is_empty()) {
            return Err(JobError::UnknownOutfit { name: wanted.clone(), known: Self::outfits() });
        }
        reporter.start(STAGE, outfits.len() * self.resolutions.len() * self.threads.len());
        let folder = modiste_io::TemporaryFolder::new()?;
        let mut rows = Vec::new();
        for &resolution in &self.resolutions {
            for &(outfit, paper_s) in &outfits {
                let files = outfit
                    .iter()
                    .map(|name| self.files(&assets, name, resolution, folder.path()))
                    .collect::<Result<Vec<_>, JobError>>()?;
                for &threads in &self.threads {
                    rows.push(BenchRow { paper_s, ..self.row(&assets, &files, resolution, threads, reporter)? });
                    reporter.advance(STAGE, rows.len());
                }
            }
        }
        reporter.finish(STAGE);
        Ok(BenchedDress { machine: Machine::this(), rows })
    }

    /// The files of a garment; one that is to be as fine as in the paper and is not there is made in `folder`, or in that of
    /// the training sets if there is one, so that the next program that measures has only to read it.
    fn files(&self, assets: &Assets, name: &str, resolution: Resolution, folder: &Path) -> Result<Files, JobError> {
        let built_in = assets.garment(self.gender, name)?;
        let file = format!("{}-{name}.safetensors", self.gender.name());
        let learned = assets.folder().join(PAPER_ASSETS).join(&file);
        if resolution == Resolution::BuiltIn || modiste_io::exists(&learned) {
            return Ok(Files { built_in, paper: learned, subdivided: false });
        }
        let kept = assets.folder().join(TRAINING);
        let paper = if modiste_io::exists(&kept) {
            let hash = modiste_io::hash(&modiste_io::read_bytes(&built_in)?);
            kept.join(SUBDIVIDED).join(hash).join(file)
        } else {
            folder.join(file)
        };
        let wanted = PAPER_VERTICES.iter().find(|(garment, _)| *garment == name);
        if let Some((_, vertices)) = wanted.filter(|_| !modiste_io::exists(&paper)) {
            DrapeModel::load(&built_in)?.resampled(*vertices)?.save(&paper)?;
        }
        Ok(Files { built_in, paper, subdivided: true })
    }

    fn row(
        &self,
        assets: &Assets,
        files: &[Files],
        resolution: Resolution,
        threads: usize,
        reporter: &Reporter<'_>,
    ) -> Result<BenchRow, JobError> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.map_err(|error| JobError::Threads { wanted: threads, reason: error.to_string() })?;
        reset_peak_memory();
        let started = Instant::now();
        let first_frame = || -> Result<(Person, Dresser), JobError> {
            let model = ScapeModel::load(assets.body(self.gender))?;
            let load = |files: &Files| {
                let file = if resolution == Resolution::BuiltIn { &files.built_in } else { &files.paper };
                Ok(Arc::new(DrapeModel::load(file)?))
            };
            let garments = files.iter().map(load).collect::<Result<Vec<_>, JobError>>()?;
            let person = Person::new(BodyChoice::Average.make(&model, reporter)?, garments)?;
            let mut dresser = Dresser::new(&person, &FitOptions::default())?;
            dresser.step(&person.body().template_pose());
            Ok((person, dresser))
        };
        let (person, mut dresser) = pool.install(first_frame)?;
        let start_ms = 1e3 * started.elapsed().as_secs_f64();
        let motion: Motion = MotionChoice::Action(Action::Walk).motion(person.body(), None, person.fps(), reporter)?;
        dresser.restart();
        let warm_up = self.frames.div_ceil(3);
        let timing = pool.install(|| time_frames(&mut dresser, &motion, warm_up + self.frames));
        let median = |stage| timing.stage(stage, warm_up).map_or(0.0, |summary| summary.median);
        let total = timing.total(warm_up);
        let layers = 0..dresser.garment_count();
        Ok(BenchRow {
            outfit: layers
                .clone()
                .map(|layer| dresser.garment(layer).garment().name.clone())
                .collect::<Vec<_>>()
                .join("+"),
            resolution,
            subdivided: files.iter().any(|files| files.subdivided),
            vertices: layers.map(|layer| dresser.vertices(layer).len()).sum(),
            threads,
            body_ms: median(Stage::Body),
            synthesis_ms: median(Stage::Synthesis),
            fit_ms: median(Stage::Fit),
            total_ms_p50: total.map_or(0.0, |summary| summary.median),
            total_ms_p95: total.map_or(0.0, |summary| summary.p95),
            start_ms,
            peak_mb: Memory::now().map_or(0.0, |memory| memory.peak_mb),
            paper_s: [0.0; 3],
        })
    }
}
