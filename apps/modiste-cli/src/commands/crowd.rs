//! `modiste crowd`.

use std::fmt::Write;
use std::path::PathBuf;

use clap::Args;
use modiste::{Crowd, Length, MadeCrowd};

use crate::words::{FormatName, formats};

/// Make many people: random bodies, garments and motions, each in a folder of their own and at their place in one scene.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  modiste crowd --count 200 --motion-dir mocap --format glb,usd --out crowd")]
pub(crate) struct CrowdArguments {
    /// Number of people.
    #[arg(long, default_value_t = 20)]
    count: usize,
    /// Folder of motions (BVH, packed by gzip or not); otherwise those that the program makes itself.
    #[arg(long, value_name = "FOLDER")]
    motion_dir: Option<PathBuf>,
    /// Length of the animation.
    #[arg(long, default_value_t = 2.0)]
    seconds: f64,
    /// Seed of everything that is random.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Forms in which each person is written, with commas between; with `usd` there is one layer that holds them all.
    #[arg(long, value_name = "NAMES", value_enum, value_delimiter = ',', default_value = "glb")]
    format: Vec<FormatName>,
    /// Folder for the results.
    #[arg(long, value_name = "FOLDER", default_value = "out/crowd")]
    out: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

impl CrowdArguments {
    pub(crate) fn job(&self) -> Crowd {
        Crowd {
            count: self.count,
            motions: self.motion_dir.clone(),
            length: Length::Seconds(self.seconds),
            seed: self.seed,
            formats: formats(&self.format),
            out: self.out.clone(),
        }
    }
}

pub(crate) fn text(made: &MadeCrowd) -> String {
    let report = &made.report;
    let [all, first, second] = report.seconds_per_character;
    let mut text = format!(
        "{} people in {:.1} s by {} threads: {all:.2} s each on one ({first:.2} s in the first half, {second:.2} s in the second)",
        report.characters.len(),
        report.seconds,
        report.threads
    );
    if let (Some(models), Some(character), Some(peak)) = (report.models_mb, report.character_mb, report.peak_mb) {
        let _always_ok =
            write!(text, "\nmemory: {models:.0} MB of models, {character:.1} MB for each person, {peak:.0} MB at most");
    }
    for file in made.files.iter().filter(|file| file.extension().is_some()) {
        let _always_ok = write!(text, "\nwrote {}", file.display());
    }
    text
}
