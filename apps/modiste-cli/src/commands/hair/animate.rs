//! `modiste hair animate`.

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;
use modiste::{BodyChoice, Dress, Gender, HairChoice, HairRegion, Length, MotionChoice, WindDirection};

use crate::words::{GenderName, region_length, wind};

/// Let learned hair follow a motion on a bare body; the style may change within the sequence.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  modiste hair animate --motion walk.bvh --length 0..1.35 --wind 0.5,+x --out hair\n  modiste hair animate --mix front=0,back=1 --out hair"
)]
pub(crate) struct HairAnimateArguments {
    /// Hair: the name of a model that ships, or a model file.
    #[arg(long, value_name = "NAME", default_value = "long")]
    hair: String,
    /// Whose body model.
    #[arg(long, value_enum, default_value = "female")]
    gender: GenderName,
    /// Motion file: BVH, packed by gzip or not; otherwise walking.
    #[arg(long, value_name = "FILE")]
    motion: Option<PathBuf>,
    /// Length factor, or from..to over the sequence.
    #[arg(long, value_name = "FACTOR|FROM..TO", default_value = "1", value_parser = span, allow_hyphen_values = true)]
    length: [f64; 2],
    /// Softness factor, or from..to.
    #[arg(long, value_name = "FACTOR|FROM..TO", default_value = "1", value_parser = span, allow_hyphen_values = true)]
    softness: [f64; 2],
    /// Wind: its strength and where it blows to.
    #[arg(long, value_name = "STRENGTH,DIRECTION", value_parser = wind, allow_hyphen_values = true)]
    wind: Option<(f64, WindDirection)>,
    /// Length factors of regions of their own: front, sides or back.
    #[arg(long, value_name = "REGION=FACTOR", value_delimiter = ',', value_parser = region_length)]
    mix: Vec<(HairRegion, f64)>,
    /// Number of frames (30 a second); otherwise all of the file, or 4 seconds.
    #[arg(long, value_name = "NUMBER")]
    frames: Option<usize>,
    /// Folder for the results.
    #[arg(long, value_name = "FOLDER", default_value = "out/hair")]
    out: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

impl HairAnimateArguments {
    pub(crate) fn job(&self) -> Dress {
        let motion = self.motion.clone().map_or(Dress::default().motion, MotionChoice::File);
        let hair = HairChoice {
            model: self.hair.clone(),
            length: self.length,
            softness: self.softness,
            wind: self.wind,
            lengths: self.mix.clone(),
        };
        Dress {
            gender: Gender::from(self.gender),
            body: BodyChoice::Average,
            motion,
            garments: Vec::new(),
            hair: Some(hair),
            length: self.frames.map(Length::Frames),
            out: self.out.clone(),
            ..Dress::default()
        }
    }
}

/// Reads `0.5` or `0..1.35`.
fn span(text: &str) -> Result<[f64; 2]> {
    let number = |word: &str| word.parse::<f64>().with_context(|| format!("`{word}` is not a number"));
    match text.split_once("..") {
        Some((from, to)) => Ok([number(from)?, number(to)?]),
        None => Ok([number(text)?; 2]),
    }
}

#[cfg(test)]
mod tests {
    use super::span;

    #[test]
    fn spans_are_read_or_refused() {
        assert_eq!(span("0..1.35").unwrap().map(f64::to_bits), [0.0f64, 1.35].map(f64::to_bits));
        assert_eq!(span("0.4").unwrap().map(f64::to_bits), [0.4f64; 2].map(f64::to_bits));
        assert!(span("0..x").is_err());
    }
}
