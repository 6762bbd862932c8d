//! `modiste bench hair`.

use std::fmt::Write;

use clap::Args;
use modiste::{BenchHair, BenchedHair};

use crate::words::count;

/// Time learned hair beside our physics.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  modiste bench hair --json")]
pub(crate) struct BenchHairArguments {
    /// Hair: the name of a model that ships, or a model file.
    #[arg(long, value_name = "NAME", default_value = "long")]
    hair: String,
    /// Numbers of guides, with commas between.
    #[arg(long, value_name = "NUMBERS", value_delimiter = ',', default_value = "198,962,3980", value_parser = count)]
    guides: Vec<usize>,
    /// Numbers of threads, with commas between.
    #[arg(long, value_name = "NUMBERS", value_delimiter = ',', default_value = "1,2", value_parser = count)]
    threads: Vec<usize>,
    /// Frames that count.
    #[arg(long, value_name = "NUMBER", default_value_t = 120, value_parser = count)]
    frames: usize,
    /// Garments that are worn in rows of their own, from the inside out; `none` for the bare body alone.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', default_value = "pants,longsleeve")]
    garments: Vec<String>,
    /// Print a list of rows as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

impl BenchHairArguments {
    pub(crate) fn job(&self) -> BenchHair {
        BenchHair {
            model: self.hair.clone(),
            guides: self.guides.clone(),
            threads: self.threads.clone(),
            frames: self.frames,
            garments: if self.garments == ["none"] { Vec::new() } else { self.garments.clone() },
        }
    }
}

pub(crate) fn text(benched: &BenchedHair) -> String {
    let mut text = format!(
        "{}, ms a frame (median)\n{:>7}{:>9}{:>11}{:>11}{:>9}{:>8}{:>8}{:>9}{:>10}{:>10}  worn",
        benched.machine.processor,
        "guides",
        "threads",
        "synthesis",
        "collision",
        "points",
        "total",
        "95 %",
        "physics",
        "inside",
        "behind"
    );
    for row in &benched.rows {
        let _always_ok = write!(
            text,
            "\n{:>7}{:>9}{:>11.2}{:>11.2}{:>9.2}{:>8.2}{:>8.2}{:>9.1}{:>9.3}%{:>9.3}%  {}",
            row.guides,
            row.threads,
            row.synthesis_ms,
            row.collision_ms,
            row.reconstruction_ms,
            row.total_ms_p50,
            row.total_ms_p95,
            row.physics_ms,
            100.0 * row.inside,
            100.0 * row.behind,
            if row.garments.is_empty() { "nothing" } else { &row.garments }
        );
    }
    text
}
