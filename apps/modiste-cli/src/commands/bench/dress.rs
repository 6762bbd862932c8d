//! `modiste bench dress`.

use std::fmt::Write;

use clap::{Args, ValueEnum};
use modiste::{BenchDress, BenchedDress, Resolution};

use crate::words::{GenderName, count};

/// Time the outfits of DRAPE's table 1 from the pose in to the vertices out, one character at a time.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  modiste bench dress --json")]
pub(crate) struct BenchDressArguments {
    /// Whose body model and garments.
    #[arg(long, value_enum, default_value = "female")]
    gender: GenderName,
    /// Numbers of threads, with commas between.
    #[arg(long, value_name = "NUMBERS", value_delimiter = ',', default_value = "1,2", value_parser = count)]
    threads: Vec<usize>,
    /// Only this outfit, such as `shorts+tshirt`.
    #[arg(long, value_name = "NAME")]
    outfit: Option<String>,
    /// How fine the garments are.
    #[arg(long, value_enum, value_name = "NAMES", value_delimiter = ',', default_value = "built-in,paper")]
    resolution: Vec<ResolutionName>,
    /// Frames that count.
    #[arg(long, value_name = "NUMBER", default_value_t = 120, value_parser = count)]
    frames: usize,
    /// Print a list of rows as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// How fine garments are.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum ResolutionName {
    /// As they are built in.
    BuiltIn,
    /// As in DRAPE's table 1: those of `cargo xtask assets --paper`, otherwise the built-in ones subdivided.
    Paper,
}

impl From<ResolutionName> for Resolution {
    fn from(name: ResolutionName) -> Self {
        match name {
            ResolutionName::BuiltIn => Self::BuiltIn,
            ResolutionName::Paper => Self::Paper,
        }
    }
}

impl BenchDressArguments {
    pub(crate) fn job(&self) -> BenchDress {
        let resolutions = self.resolution.iter().map(|&name| name.into()).collect();
        BenchDress {
            gender: self.gender.into(),
            outfit: self.outfit.clone(),
            resolutions,
            threads: self.threads.clone(),
            frames: self.frames,
        }
    }
}

pub(crate) fn text(benched: &BenchedDress) -> String {
    let mut text = format!(
        "{}, ms a frame (median); * was subdivided, not learned as fine\n{:<18}{:>10}{:>9}{:>8}{:>11}{:>8}{:>8}{:>8}{:>10}{:>9}{:>12}",
        benched.machine.processor,
        "outfit",
        "vertices",
        "threads",
        "body",
        "synthesis",
        "fit",
        "total",
        "95 %",
        "start",
        "peak MB",
        "paper"
    );
    for row in &benched.rows {
        let vertices = format!("{}{}", row.vertices, if row.subdivided { "*" } else { "" });
        let paper = match row.resolution {
            Resolution::Paper => format!("{:.0}", 1e3 * row.paper_s[2]),
            Resolution::BuiltIn => String::new(),
        };
        let _always_ok = write!(
            text,
            "\n{:<18}{vertices:>10}{:>9}{:>8.1}{:>11.1}{:>8.1}{:>8.1}{:>8.1}{:>10.0}{:>9.0}{paper:>12}",
            row.outfit,
            row.threads,
            row.body_ms,
            row.synthesis_ms,
            row.fit_ms,
            row.total_ms_p50,
            row.total_ms_p95,
            row.start_ms,
            row.peak_mb
        );
    }
    text
}
