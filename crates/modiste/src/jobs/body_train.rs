//! Learning the body models from a population.

use std::collections::BTreeMap;
use std::path::PathBuf;

use modiste_body::scape::Provenance;
use modiste_body::scape::train::{LICENCE, TrainOptions, TrainingBodies, train};
use modiste_body::{Gender, MakeHumanModel, population};
use modiste_io::makehuman;
use serde::Serialize;

use crate::event::Reporter;
use crate::{JobError, Sources};

/// Learns the body model of one gender.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyTrain {
    /// Whose bodies.
    pub gender: Gender,
    /// The population, as [`crate::BodyPopulation`] makes it.
    pub population: PathBuf,
    /// Where the skin weights come from.
    pub sources: Sources,
    /// The model file.
    pub out: PathBuf,
}

/// What learning a body model gives back.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrainedBody {
    /// The model file.
    pub file: PathBuf,
    /// Number of bodies that it was learned from.
    pub bodies: usize,
    /// Size of the file (bytes).
    pub bytes: u64,
}

impl BodyTrain {
    pub(crate) fn run(&self, reporter: &Reporter<'_>) -> Result<TrainedBody, JobError> {
        let files = makehuman::open(self.sources.makehuman()?)?;
        let people = population::read(&self.population, self.gender)?;
        let model = MakeHumanModel::new(&files, self.gender)?;
        let bodies = TrainingBodies::from_population(&people, &model, false);
        let options = TrainOptions::default();
        let trained = train(&bodies, &options, reporter)?;
        let name = self.population.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let hash = modiste_io::hash(&modiste_io::read_bytes(&self.population)?);
        let provenance = Provenance {
            seed: options.seed,
            sources: BTreeMap::from([(name, hash.to_string())]),
            licence: LICENCE.to_owned(),
            command: format!("modiste body train --gender {}", self.gender.name()),
        };
        trained.model.save(&self.out, &provenance)?;
        reporter.wrote(&self.out);
        Ok(TrainedBody {
            file: self.out.clone(),
            bodies: bodies.vertices.len(),
            bytes: modiste_io::file_size(&self.out)?,
        })
    }
}
