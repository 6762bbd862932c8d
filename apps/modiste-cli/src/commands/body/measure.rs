//! `modiste body measure`.

use std::path::PathBuf;

use clap::Args;
use modiste::{BodyMeasure, MeasuredBody};

/// Measure a body in the template pose; names after ISO 8559-1, metres and kilograms.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  modiste body measure body.obj --json")]
pub(crate) struct BodyMeasureArguments {
    /// OBJ file of a body in the template pose, such as `body make` writes.
    file: PathBuf,
    /// Print the measurements as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

impl BodyMeasureArguments {
    pub(crate) fn job(&self) -> BodyMeasure {
        BodyMeasure { file: self.file.clone() }
    }
}

pub(crate) fn text(measured: &MeasuredBody) -> String {
    measured.measurements.to_string()
}
