//! The words for whose body it is.

use clap::ValueEnum;
use modiste::Gender;

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum GenderName {
    Female,
    Male,
}

impl From<GenderName> for Gender {
    fn from(name: GenderName) -> Self {
        match name {
            GenderName::Female => Self::Female,
            GenderName::Male => Self::Male,
        }
    }
}
