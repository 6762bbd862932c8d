//! Making populations of bodies that measure as real people do.

use std::path::PathBuf;

use modiste_body::Gender;
use modiste_body::population::{PopulationOptions, PopulationReport, make};
use serde::Serialize;

use crate::event::Reporter;
use crate::limits::check_range;
use crate::{JobError, Sources};

/// Most bodies that are solved at once; ANSUR II has 4,082 men.
const MOST_BODIES: usize = 20_000;

/// Makes populations. What an interrupted run finished is kept.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyPopulation {
    /// Whose bodies.
    pub genders: Vec<Gender>,
    /// How many of each.
    pub count: usize,
    /// Seed of the choice of subjects and of what is held out.
    pub seed: u64,
    /// What they are made from.
    pub sources: Sources,
    /// The folder for `population-<gender>.npz`.
    pub out: PathBuf,
}

/// What making populations gives back.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MadePopulation {
    /// One file for each gender.
    pub files: Vec<PathBuf>,
    /// How the bodies compare with the survey.
    pub report: PopulationReport,
}

impl BodyPopulation {
    pub(crate) fn run(&self, reporter: &Reporter<'_>) -> Result<MadePopulation, JobError> {
        check_range("number of bodies", self.count as f64, (2.0, MOST_BODIES as f64), "bodies")?;
        let sources = self.sources.population()?;
        let options = PopulationOptions { count: self.count, seed: self.seed, ..PopulationOptions::default() };
        let report = make(&sources, &self.genders, &options, &self.out, reporter)?;
        let file = |gender: &Gender| self.out.join(format!("population-{}.npz", gender.name()));
        let files: Vec<PathBuf> = self.genders.iter().map(file).collect();
        files.iter().for_each(|file| reporter.wrote(file));
        Ok(MadePopulation { files, report })
    }
}
