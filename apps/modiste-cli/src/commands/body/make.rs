//! `modiste body make`.

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::Args;
use modiste::{BodyChoice, BodyMake, MadeBody};

use crate::words::BodyArguments;

/// Make the body that comes nearest to some measurements.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  modiste body make --height 1.65 --weight 60 --chest 0.92 --waist 0.75 --hip 0.98 --out body.obj"
)]
pub(crate) struct BodyMakeArguments {
    #[command(flatten)]
    body: BodyArguments,
    /// OBJ file for the body.
    #[arg(long, value_name = "FILE", default_value = "body.obj")]
    out: PathBuf,
    /// Print shape and measurements as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

impl BodyMakeArguments {
    pub(crate) fn job(&self) -> Result<BodyMake> {
        let body = self.body.choice();
        if body == BodyChoice::Average {
            bail!("nothing says which body to make: give a measurement such as --height 1.65, or --shape");
        }
        Ok(BodyMake { gender: self.body.gender.into(), body, out: self.out.clone() })
    }
}

pub(crate) fn text(made: &MadeBody) -> String {
    let shape: Vec<String> = made.shape.iter().map(|value| format!("{value:.3}")).collect();
    format!("{}\n\nshape {}\nwrote {}", made.measurements, shape.join(","), made.file.display())
}
