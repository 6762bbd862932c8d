//! `modiste bench dress`.

use std::fmt::Write;

use clap::Args;
use modiste::{BenchDress, BenchedDress};

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
    /// Frames that count.
    #[arg(long, value_name = "NUMBER", default_value_t = 120, value_parser = count)]
    frames: usize,
    /// Print a list of rows as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

impl BenchDressArguments {
    pub(crate) fn job(&self) -> BenchDress {
        BenchDress { gender: self.gender.into(), threads: self.threads.clone(), frames: self.frames }
    }
}

pub(crate) fn text(benched: &BenchedDress) -> String {
    let mut text = format!(
        "{}, ms a frame (median)\n{:<18}{:>9}{:>9}{:>8}{:>11}{:>8}{:>8}{:>8}{:>9}",
        benched.machine.processor,
        "outfit",
        "vertices",
        "threads",
        "body",
        "synthesis",
        "fit",
        "total",
        "95 %",
        "peak MB"
    );
    for row in &benched.rows {
        let _always_ok = write!(
            text,
            "\n{:<18}{:>9}{:>9}{:>8.1}{:>11.1}{:>8.1}{:>8.1}{:>8.1}{:>9.0}",
            row.outfit,
            row.vertices,
            row.threads,
            row.body_ms,
            row.synthesis_ms,
            row.fit_ms,
            row.total_ms_p50,
            row.total_ms_p95,
            row.peak_mb
        );
    }
    text
}
