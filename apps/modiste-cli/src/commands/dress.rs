//! `modiste dress`.

use std::fmt::Write;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use modiste::{Action, Dress, Dressed, FlaggedFrames, Length, MotionChoice, Region};

use crate::words::{BodyArguments, FormatName, HairArguments, formats};

/// Dress a moving body: animated GLB, pictures, arrays and a report.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  modiste dress --gender male --height 1.82 --weight 88 --motion kick_10_01.bvh.gz --out kick"
)]
pub(crate) struct DressArguments {
    #[command(flatten)]
    body: BodyArguments,
    /// Motion file: BVH, packed by gzip or not.
    #[arg(long, value_name = "FILE", conflicts_with = "action")]
    motion: Option<PathBuf>,
    /// A motion that the program makes itself.
    #[arg(long, value_enum, default_value = "walk")]
    action: ActionName,
    /// Garments, with commas between: names of those that ship, or model files; `none` for the bare body. Each may have its
    /// own ease after a colon: `tshirt:0.5,pants:-1`.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', default_value = "tshirt,shorts")]
    garments: Vec<String>,
    #[command(flatten)]
    hair: HairArguments,
    /// How the garments are cut: from slim, -1, over regular, 0, to loose, 1.
    #[arg(long, value_name = "NUMBER", default_value_t = 0.0, allow_negative_numbers = true)]
    ease: f64,
    /// Number of frames (30 a second); otherwise all of the file, or 4 seconds.
    #[arg(long, value_name = "NUMBER", conflicts_with = "seconds")]
    frames: Option<usize>,
    /// Length of the animation.
    #[arg(long)]
    seconds: Option<f64>,
    /// Forms of the animation, with commas between: `pc2` is an OBJ and a point cache for Blender, `obj` and `ply` are a file for
    /// each frame, `npz` plain arrays.
    #[arg(long, value_name = "NAMES", value_enum, value_delimiter = ',', default_value = "glb,npz")]
    format: Vec<FormatName>,
    /// Map ease and strain: picture, two coloured GLB files, and numbers for each region in the report.
    #[arg(long)]
    fit_map: bool,
    /// Also part triangles that cross skin or a garment below between their corners; up to twice the time.
    #[arg(long)]
    careful: bool,
    /// Folder for the results.
    #[arg(long, value_name = "FOLDER", default_value = "out/dress")]
    out: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum ActionName {
    Walk,
    Turn,
    RaiseArms,
    Squat,
    Kick,
    Jump,
}

impl DressArguments {
    pub(crate) fn job(&self) -> Dress {
        let motion = match &self.motion {
            Some(file) => MotionChoice::File(file.clone()),
            None => MotionChoice::Action(self.action.into()),
        };
        let length = self.frames.map(Length::Frames).or(self.seconds.map(Length::Seconds));
        Dress {
            gender: self.body.gender.into(),
            body: self.body.choice(),
            motion,
            garments: self.garments.iter().filter(|name| *name != "none").cloned().collect(),
            hair: self.hair.choice(),
            ease: self.ease,
            length,
            formats: formats(&self.format),
            fit_map: self.fit_map,
            careful: self.careful,
            out: self.out.clone(),
        }
    }
}

impl From<ActionName> for Action {
    fn from(name: ActionName) -> Self {
        match name {
            ActionName::Walk => Self::Walk,
            ActionName::Turn => Self::Turn,
            ActionName::RaiseArms => Self::RaiseArms,
            ActionName::Squat => Self::Squat,
            ActionName::Kick => Self::Kick,
            ActionName::Jump => Self::Jump,
        }
    }
}

pub(crate) fn text(dressed: &Dressed) -> String {
    let report = &dressed.report;
    let mut text = format!("{} frames at {} per second", report.frames, report.fps);
    if let Some(times) = &report.milliseconds_per_frame {
        // Writing to a string cannot fail.
        let _always_ok = write!(
            text,
            ", {:.1} ms each (body {:.1}, synthesis {:.1}, fit {:.1}; 95% below {:.1})",
            times.total.median, times.body.median, times.synthesis.median, times.fit.median, times.total.p95
        );
    }
    for fit in &report.penetration {
        let _always_ok = write!(
            text,
            "\n{}: vertices inside the body per frame {:.1} before the fit, {:.1} after; deepest {:.2} mm, {:.2} mm",
            fit.garment,
            fit.before.vertices_per_frame,
            fit.after.vertices_per_frame,
            fit.before.deepest_mm,
            fit.after.deepest_mm
        );
    }
    for flagged in &report.flagged {
        let frames = |runs: &[[usize; 2]]| runs.iter().map(|[first, last]| last - first + 1).sum::<usize>();
        let FlaggedFrames { garment, caught, inside, crossing, folded } = flagged;
        let why = [
            (caught, "cloth caught where the body is in itself"),
            (inside, "vertices left in the body or below a garment"),
            (crossing, "triangles crossing what is below"),
            (folded, "triangles crossing each other"),
        ];
        for (runs, what) in why.into_iter().filter(|(runs, _)| !runs.is_empty()) {
            let _always_ok = write!(text, "\n{garment}: flagged for {what} in {} frames", frames(runs));
        }
    }
    for fit in &report.fit_map {
        let name = |word: String| word.to_lowercase();
        let _always_ok = write!(
            text,
            "\n{} (size {}), {}: {}; {:.0} mm from the body (5% nearer than {:.0}), stretched {:.1}% (5% more than {:.1}%)",
            fit.garment,
            fit.size,
            if fit.region == Region::UpperArm { "upper arm".to_owned() } else { name(format!("{:?}", fit.region)) },
            name(format!("{:?}", fit.verdict)),
            fit.ease_mm,
            fit.ease_5_percent_mm,
            fit.strain_percent,
            fit.strain_95_percent
        );
    }
    for file in &dressed.files {
        let _always_ok = write!(text, "\nwrote {}", file.display());
    }
    text
}
