//! `modiste hair learn`.

use std::fmt::Write;
use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;
use modiste::{HairLearn, HairStyle, LearnedHair};

use crate::words::GenderName;

/// Simulate guides through many motions and learn from that. Resumes where it was stopped.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  modiste hair learn --style long --guides 962 --out hair.safetensors\n  modiste hair learn --guides-from sintel_hair.tfx --guides 228 --out sintel.safetensors"
)]
pub(crate) struct HairLearnArguments {
    /// The style that is grown: `short`, `bob`, `long` or `swept`.
    #[arg(long, value_name = "STYLE", default_value = "long", value_parser = style)]
    style: HairStyle,
    /// Guides from a file instead: TressFX (.tfx), .hair, or lines of an .obj.
    #[arg(long, value_name = "FILE", conflicts_with = "style")]
    guides_from: Option<PathBuf>,
    /// Number of guides.
    #[arg(long, value_name = "NUMBER", default_value_t = 198)]
    guides: usize,
    /// Most hair coefficients.
    #[arg(long, value_name = "NUMBER", default_value_t = 64)]
    dimensions: usize,
    /// Do not simulate wind.
    #[arg(long)]
    no_wind: bool,
    /// Only long soft hair, as in the dense set of the thesis.
    #[arg(long)]
    single: bool,
    /// Only what the thesis has: hair in a space that turns with the heading alone, driven by the bust coefficients alone.
    #[arg(long)]
    plain: bool,
    /// Whose mean body it is learned on.
    #[arg(long, value_enum, default_value = "female")]
    gender: GenderName,
    /// Seed of roots, made motions and gusts.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Folder with captured motions (`mocap`); it may be absent.
    #[arg(long, value_name = "FOLDER", default_value = "../shared/data")]
    data: PathBuf,
    /// Folder for the training set; otherwise `training/hair/<style>-<guides>`.
    #[arg(long, value_name = "FOLDER")]
    training: Option<PathBuf>,
    /// The model file.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

impl HairLearnArguments {
    pub(crate) fn job(&self) -> HairLearn {
        let stem = self.guides_from.as_ref().and_then(|file| file.file_stem());
        let name = stem.map_or_else(|| self.style.name().into(), |stem| stem.to_string_lossy());
        let folder = || PathBuf::from(format!("training/hair/{name}-{}", self.guides));
        HairLearn {
            gender: self.gender.into(),
            style: self.style,
            guides_from: self.guides_from.clone(),
            guides: self.guides,
            dimensions: self.dimensions,
            wind: !self.no_wind,
            single: self.single,
            plain: self.plain,
            seed: self.seed,
            data: self.data.clone(),
            training: self.training.clone().unwrap_or_else(folder),
            out: self.out.clone(),
        }
    }
}

fn style(text: &str) -> Result<HairStyle> {
    let known = HairStyle::ALL.map(HairStyle::name).join(", ");
    HairStyle::from_name(text).with_context(|| format!("there is no style `{text}`; known: {known}"))
}

pub(crate) fn text(learned: &LearnedHair) -> String {
    let mut text = format!(
        "{}: {} guides from {} sequences of {} frames, {} coefficients ({:.1} % of the variance), largest eigenvalue {:.4}",
        learned.name,
        learned.guides,
        learned.sequences,
        learned.frames,
        learned.dimensions,
        100.0 * learned.energy,
        learned.lambda_max
    );
    for error in &learned.errors {
        let _always_ok =
            write!(text, "\n{:<12} error {:.2} cm, held out {:.2} cm", error.cell, error.training_cm, error.test_cm);
    }
    let _always_ok = write!(text, "\nwrote {} ({:.1} MB)", learned.file.display(), learned.bytes as f64 / 1e6);
    text
}

#[cfg(test)]
mod tests {
    use super::style;

    #[test]
    fn unknown_styles_are_refused() {
        assert!(style("mullet").unwrap_err().to_string().contains("known: short, bob, long, swept"));
    }
}
