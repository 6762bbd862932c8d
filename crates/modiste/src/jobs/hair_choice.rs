//! Which hair a person wears, and how.

use std::path::{Path, PathBuf};

use modiste_hair::Region;
use modiste_hair::model::HairModel;
use modiste_hair::training::{Factors, WindDirection};
use modiste_scene::WornStyle;

use crate::{Assets, JobError};

/// Which hair a person wears, and how; factors go evenly from the first frame's to the last frame's.
#[derive(Debug, Clone, PartialEq)]
pub struct HairChoice {
    /// Name of a model in the assets, or a file.
    pub model: String,
    /// Length factor at the first and the last frame: 0 is the shortest that was learned, 1 the longest.
    pub length: [f64; 2],
    /// Softness factor at the first and the last frame: 0 is stiff, 1 soft.
    pub softness: [f64; 2],
    /// Strength of the wind and where it blows to, seen from the person.
    pub wind: Option<(f64, WindDirection)>,
    /// Length factors of regions of the scalp that have their own.
    pub lengths: Vec<(Region, f64)>,
}

impl HairChoice {
    /// The hair of this name, long and soft as far as it goes.
    pub fn new(model: impl Into<String>) -> Self {
        Self { model: model.into(), length: [1.0; 2], softness: [1.0; 2], wind: None, lengths: Vec::new() }
    }

    pub(crate) fn file(&self, assets: &Assets) -> Result<PathBuf, JobError> {
        self.factors(0).check()?;
        self.factors(1).check()?;
        for &(_, length) in &self.lengths {
            Factors { length, ..self.factors(0) }.check()?;
        }
        assets.hair(&self.model)
    }

    pub(crate) fn load(&self, file: &Path) -> Result<WornStyle, JobError> {
        let model = HairModel::load(file)?.shared();
        let factors = [self.factors(0), self.factors(1)];
        for factors in factors {
            // Refuses what the model has not learned before anything moves.
            factors.weights(model.cells())?;
            for &(_, length) in &self.lengths {
                Factors { length, ..factors }.weights(model.cells())?;
            }
        }
        Ok(WornStyle { model, factors, lengths: self.lengths.clone() })
    }

    fn factors(&self, end: usize) -> Factors {
        let wind = self.wind.map_or([0.0, 0.0], |(strength, direction)| [strength, direction.angle()]);
        Factors { length: self.length[end], softness: self.softness[end], wind }
    }
}
