//! The words for the forms of an animation.

use clap::ValueEnum;
use modiste::Format;

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum FormatName {
    Glb,
    Usd,
    Pc2,
    Obj,
    Ply,
    Npz,
}

impl From<FormatName> for Format {
    fn from(name: FormatName) -> Self {
        match name {
            FormatName::Glb => Self::Glb,
            FormatName::Usd => Self::Usd,
            FormatName::Pc2 => Self::Pc2,
            FormatName::Obj => Self::Obj,
            FormatName::Ply => Self::Ply,
            FormatName::Npz => Self::Npz,
        }
    }
}

/// Each form once, in the order of [`Format::ALL`].
pub(crate) fn formats(names: &[FormatName]) -> Vec<Format> {
    let mut formats: Vec<Format> = names.iter().map(|&name| name.into()).collect();
    formats.sort();
    formats.dedup();
    formats
}
