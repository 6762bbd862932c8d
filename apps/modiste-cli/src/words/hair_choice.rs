//! The words for how hair is worn.

use clap::Args;
use modiste::{HairChoice, HairRegion, WindDirection};

use super::{region_length, wind};

/// How hair is worn by somebody who is dressed.
#[derive(Debug, Args)]
pub(crate) struct HairArguments {
    /// Hair: the name of a model that ships, or a model file.
    #[arg(long, value_name = "NAME")]
    hair: Option<String>,
    /// Length factor: 0 is the shortest that was learned, 1 the longest.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, requires = "hair", allow_hyphen_values = true)]
    hair_length: f64,
    /// Softness factor: 0 is stiff, 1 soft.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, requires = "hair", allow_hyphen_values = true)]
    hair_softness: f64,
    /// Wind: its strength and where it blows to, seen from the person: +z ahead, +x to their left.
    #[arg(long, value_name = "STRENGTH,DIRECTION", value_parser = wind, requires = "hair", allow_hyphen_values = true)]
    wind: Option<(f64, WindDirection)>,
    /// Length factors of regions of their own: front, sides or back, such as `front=0.1,back=1`.
    #[arg(long, value_name = "REGION=FACTOR", value_delimiter = ',', value_parser = region_length, requires = "hair")]
    hair_mix: Vec<(HairRegion, f64)>,
}

impl HairArguments {
    pub(crate) fn choice(&self) -> Option<HairChoice> {
        Some(HairChoice {
            model: self.hair.clone()?,
            length: [self.hair_length; 2],
            softness: [self.hair_softness; 2],
            wind: self.wind,
            lengths: self.hair_mix.clone(),
        })
    }
}
