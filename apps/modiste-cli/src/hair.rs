//! The words about hair.

use std::path::PathBuf;

use anyhow::{Context, Result, bail, ensure};
use clap::{Args, Subcommand};
use modiste::{
    BenchHair, BodyChoice, Dress, Gender, HairChoice, HairLearn, HairStyle, Job, Length, MotionChoice, WindDirection,
};

use crate::arguments::GenderName;

#[derive(Debug, Subcommand)]
pub(crate) enum HairCommand {
    /// Simulate guides through many motions and learn from that. Resumes where it was stopped.
    #[command(
        after_help = "Example:\n  modiste hair learn --style long --guides 962 --out hair.safetensors\n  modiste hair learn --guides-from sintel_hair.tfx --guides 228 --out sintel.safetensors"
    )]
    Learn(HairLearnArguments),
    /// Let learned hair follow a motion on a bare body; the style may change within the sequence.
    #[command(
        after_help = "Example:\n  modiste hair animate --motion walk.bvh --length 0..1.35 --wind 0.5,+x --out hair"
    )]
    Animate(HairAnimateArguments),
}

#[derive(Debug, Args)]
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
    #[arg(long, value_name = "STRENGTH,DIRECTION", value_parser = wind, requires = "hair")]
    wind: Option<(f64, WindDirection)>,
}

#[derive(Debug, Args)]
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
    #[arg(long, value_name = "STRENGTH,DIRECTION", value_parser = wind)]
    wind: Option<(f64, WindDirection)>,
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

#[derive(Debug, Args)]
pub(crate) struct BenchHairArguments {
    /// Hair: the name of a model that ships, or a model file.
    #[arg(long, value_name = "NAME", default_value = "long")]
    hair: String,
    /// Numbers of guides, with commas between.
    #[arg(long, value_name = "NUMBERS", value_delimiter = ',', default_value = "198,962,3980")]
    guides: Vec<usize>,
    /// Numbers of threads, with commas between.
    #[arg(long, value_name = "NUMBERS", value_delimiter = ',', default_value = "1,2")]
    threads: Vec<usize>,
    /// Frames that count.
    #[arg(long, value_name = "NUMBER", default_value_t = 120)]
    frames: usize,
    /// Print a list of rows as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

impl HairCommand {
    pub(crate) fn job(&self) -> Job {
        match self {
            Self::Learn(arguments) => Job::HairLearn(arguments.job()),
            Self::Animate(arguments) => Job::Dress(arguments.job()),
        }
    }

    pub(crate) fn json(&self) -> bool {
        match self {
            Self::Learn(arguments) => arguments.json,
            Self::Animate(arguments) => arguments.json,
        }
    }
}

impl HairLearnArguments {
    fn job(&self) -> HairLearn {
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
            seed: self.seed,
            data: self.data.clone(),
            training: self.training.clone().unwrap_or_else(folder),
            out: self.out.clone(),
        }
    }
}

impl HairArguments {
    pub(crate) fn choice(&self) -> Option<HairChoice> {
        Some(HairChoice {
            model: self.hair.clone()?,
            length: [self.hair_length; 2],
            softness: [self.hair_softness; 2],
            wind: self.wind,
        })
    }
}

impl HairAnimateArguments {
    fn job(&self) -> Dress {
        let motion = self.motion.clone().map_or(Dress::default().motion, MotionChoice::File);
        let hair =
            HairChoice { model: self.hair.clone(), length: self.length, softness: self.softness, wind: self.wind };
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

impl BenchHairArguments {
    pub(crate) fn job(&self) -> BenchHair {
        BenchHair {
            model: self.hair.clone(),
            guides: self.guides.clone(),
            threads: self.threads.clone(),
            frames: self.frames,
        }
    }
}

fn style(text: &str) -> Result<HairStyle> {
    let known = HairStyle::ALL.map(HairStyle::name).join(", ");
    HairStyle::from_name(text).with_context(|| format!("there is no style `{text}`; known: {known}"))
}

/// Reads `0.5` or `0..1.35`.
fn span(text: &str) -> Result<[f64; 2]> {
    let number = |word: &str| word.parse::<f64>().with_context(|| format!("`{word}` is not a number"));
    match text.split_once("..") {
        Some((from, to)) => Ok([number(from)?, number(to)?]),
        None => Ok([number(text)?; 2]),
    }
}

/// Reads `0.5,+x`.
fn wind(text: &str) -> Result<(f64, WindDirection)> {
    let (strength, direction) = text.split_once(',').context("wanted STRENGTH,DIRECTION, such as 0.5,+x")?;
    let strength: f64 = strength.parse().with_context(|| format!("`{strength}` is not a number"))?;
    ensure!(strength.is_finite() && strength >= 0.0, "the strength of the wind is 0 or more, not {strength}");
    let known = WindDirection::ALL.map(WindDirection::name).join(", ");
    match WindDirection::from_name(direction) {
        Some(direction) => Ok((strength, direction)),
        None => bail!("there is no direction `{direction}`; known: {known}"),
    }
}

#[cfg(test)]
mod tests {
    use super::{span, style, wind};
    use modiste::WindDirection;

    #[test]
    fn spans_winds_and_styles_are_read_or_refused() {
        assert_eq!(span("0..1.35").unwrap().map(f64::to_bits), [0.0f64, 1.35].map(f64::to_bits));
        assert_eq!(span("0.4").unwrap().map(f64::to_bits), [0.4f64; 2].map(f64::to_bits));
        assert!(span("0..x").is_err());
        assert_eq!(wind("0.5,+x").unwrap(), (0.5, WindDirection::Left));
        for bad in ["0.5", "x,+x", "-1,+x", "0.5,north"] {
            assert!(wind(bad).is_err(), "{bad}");
        }
        assert!(style("mullet").unwrap_err().to_string().contains("known: short, bob, long, swept"));
    }
}
