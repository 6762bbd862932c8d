//! From a groom to learned hair: simulate, learn, measure.

use std::collections::BTreeMap;
use std::path::PathBuf;

use modiste_body::{Body, Gender, ScapeModel};
use modiste_core::Progress;
use modiste_hair::model::{LearnOptions, Provenance, learn};
use modiste_hair::training::{Cell, Recipe, TrainingFolder, sequences};
use modiste_hair::{CellError, Groom, Style, carry, evaluate};
use modiste_io::curves;
use serde::Serialize;

use crate::event::Reporter;
use crate::{Assets, JobError};

/// Simulates and learns hair of one family of styles. Resumes where it was stopped.
#[derive(Debug, Clone, PartialEq)]
pub struct HairLearn {
    /// Whose mean body it is learned on; any body may wear it.
    pub gender: Gender,
    /// The style that is grown.
    pub style: Style,
    /// Guides from a file instead.
    pub guides_from: Option<PathBuf>,
    /// Number of guides, N_g; of a file, the first so many.
    pub guides: usize,
    /// Most hair coefficients, d_h.
    pub dimensions: usize,
    /// Whether long soft hair is simulated in wind too.
    pub wind: bool,
    /// Whether only long soft hair is simulated, as in the dense set of the thesis.
    pub single: bool,
    /// Whether the model is that of the thesis alone; otherwise hair is learned in the space of the head, with fuller inputs.
    pub plain: bool,
    /// Seed of roots, made motions and gusts.
    pub seed: u64,
    /// Folder with captured motions (`mocap`); it may be absent.
    pub data: PathBuf,
    /// Folder for the training set.
    pub training: PathBuf,
    /// The model file.
    pub out: PathBuf,
}

/// What learning hair gives back.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LearnedHair {
    /// Name of the hair.
    pub name: String,
    /// Number of guides.
    pub guides: usize,
    /// Sequences learned from, and their frames in each cell.
    pub sequences: usize,
    /// Frames in each cell.
    pub frames: usize,
    /// Hair coefficients, d_h.
    pub dimensions: usize,
    /// Part of the variance that they hold.
    pub energy: f64,
    /// Largest eigenvalue of the dynamics over a grid of length and softness.
    pub lambda_max: f64,
    /// Noise that the regression allows for in each cell: independent, shared, and of the inputs.
    pub ridges: Vec<[f64; 3]>,
    /// Errors of each cell.
    pub errors: Vec<CellError>,
    /// Size of the file.
    pub bytes: u64,
    /// The file.
    pub file: PathBuf,
}

/// Intervals of the grid that λ is looked at on.
const GRID: usize = 10;

impl HairLearn {
    pub(crate) fn run(&self, reporter: &Reporter<'_>) -> Result<LearnedHair, JobError> {
        modiste_io::check_writable(&self.out)?;
        let assets = Assets::find()?;
        let body = ScapeModel::load(assets.body(self.gender))?.body(&[])?;
        let cells = self.cells();
        let grooms = cells.iter().map(|cell| self.groom(&body, cell.length)).collect::<Result<Vec<_>, _>>()?;
        let mocap = self.data.join("mocap");
        let mocap = modiste_io::exists(&mocap).then_some(mocap);
        if mocap.is_none() {
            reporter.warn("there is no captured motion: hair is learned from made motions alone");
        }
        let sequences = sequences(&body, mocap.as_deref(), self.seed, reporter)?;
        let recipe = Recipe {
            style: self.style,
            guides: grooms[0].guides.count(),
            seed: self.seed,
            cells,
            source: self.source(),
        };
        let folder = TrainingFolder::open(&self.training, recipe)?;
        folder.simulate(&body, &grooms, &sequences, reporter)?;
        let names: Vec<String> = sequences.iter().map(|sequence| sequence.name.clone()).collect();
        let options = if self.plain { LearnOptions::plain() } else { LearnOptions::default() };
        let options = LearnOptions { hair_dimensions: self.dimensions, ..options };
        let learned = learn(&folder, &names, &body, &grooms[0].roots, &options, reporter)?;
        let model = &learned.model;
        model.save(&self.out, &self.provenance(&assets, &names)?)?;
        reporter.wrote(&self.out);
        let errors = evaluate(model, &folder, &names, reporter)?;
        let lambda_max = model.stability(GRID)?.into_iter().map(|(_, _, lambda)| lambda).fold(0.0, f64::max);
        Ok(LearnedHair {
            name: model.name().to_owned(),
            guides: model.guide_count(),
            sequences: learned.sequences,
            frames: learned.frames,
            dimensions: model.layout().hair,
            energy: learned.energy,
            lambda_max,
            ridges: model.ridges().iter().map(|ridge| [ridge.independent, ridge.shared, ridge.inputs]).collect(),
            errors,
            bytes: modiste_io::file_size(&self.out)?,
            file: self.out.clone(),
        })
    }

    fn cells(&self) -> Vec<Cell> {
        let styles: &[Cell] = if self.single { &Cell::STYLES[..1] } else { &Cell::STYLES };
        let winds: &[Cell] = if self.wind { &Cell::WINDS } else { &[] };
        styles.iter().chain(winds).copied().collect()
    }

    fn groom(&self, body: &Body, length: f64) -> Result<Groom, JobError> {
        match &self.guides_from {
            Some(file) => Ok(carry(body, &curves::read(file)?, length, Some(self.guides))?),
            None => Ok(Groom::grow(body, self.style, length, self.guides, self.seed)?),
        }
    }

    fn source(&self) -> Option<String> {
        let stem = self.guides_from.as_ref()?.file_stem()?;
        Some(stem.to_string_lossy().into_owned())
    }

    fn provenance(&self, assets: &Assets, sequences: &[String]) -> Result<Provenance, JobError> {
        let what = match &self.guides_from {
            Some(file) => format!("--guides-from {}", file.file_name().unwrap_or_default().to_string_lossy()),
            None => format!("--style {}", self.style.name()),
        };
        let wind = if self.wind { "" } else { " --no-wind" };
        let single = if self.single { " --single" } else { "" };
        let plain = if self.plain { " --plain" } else { "" };
        let command = format!(
            "modiste hair learn {what} --guides {} --dimensions {}{wind}{single}{plain} --seed {} --out hair.safetensors",
            self.guides, self.dimensions, self.seed
        );
        let mut sources = BTreeMap::new();
        let mut add = |path: PathBuf| -> Result<(), JobError> {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            sources.insert(name, modiste_io::hash(&modiste_io::read_bytes(&path)?));
            Ok(())
        };
        add(assets.body(self.gender))?;
        if let Some(file) = &self.guides_from {
            add(file.clone())?;
        }
        for name in sequences.iter().filter(|name| !name.starts_with("made_")) {
            add(self.data.join("mocap").join(format!("{name}.bvh.gz")))?;
        }
        let licence = "Apache-2.0 OR MIT; learned from our own simulation, moved by CMU motion capture (mocap.cs.cmu.edu, \
                       free for all uses) and made motions";
        Ok(Provenance { command, sources, licence: licence.to_owned() })
    }
}
