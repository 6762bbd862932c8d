//! Discs of cloth that hang over a plate, several of a kind: each may fold in another way.

use anyhow::Result;
use modiste_cloth::Fabric;
use modiste_cloth::validate::{DrapeOptions, DrapeRun, drape};
use rayon::prelude::*;
use serde::Serialize;

use crate::report::page::rounded;

/// Discs that are draped for each mean; they differ in where their folds begin.
pub(super) const DISCS: u64 = 4;

/// Several discs of one kind.
#[derive(Debug, Serialize)]
pub(super) struct Discs {
    pub(super) fabric: String,
    pub(super) options: DrapeOptions,
    /// Rim below the plate (mm) and drape coefficient (%), each in the mean and with the standard error of the mean.
    pub(super) rim: [f64; 2],
    pub(super) coefficient: [f64; 2],
    pub(super) runs: Vec<DrapeRun>,
}

impl Discs {
    /// The numbers of folds that were found.
    pub(super) fn folds(&self) -> String {
        let folds = || self.runs.iter().map(|run| run.folds);
        let (least, most) = (folds().min().unwrap_or(0), folds().max().unwrap_or(0));
        if least == most { least.to_string() } else { format!("{least} to {most}") }
    }

    /// How many came to rest.
    pub(super) fn at_rest(&self) -> String {
        format!("{} of {}", self.runs.iter().filter(|run| run.at_rest).count(), self.runs.len())
    }
}

/// Drapes [`DISCS`] discs.
pub(super) fn hang(fabric: &Fabric, options: DrapeOptions) -> Result<Discs> {
    let runs = (0..DISCS)
        .into_par_iter()
        .map(|seed| Ok(drape(fabric, DrapeOptions { seed, ..options })?))
        .collect::<Result<Vec<DrapeRun>>>()?;
    let (rings, substeps) = (options.rings, options.substeps);
    println!("  {} on {rings} rings, {substeps} steps a frame", fabric.name);
    Ok(Discs {
        fabric: fabric.name.clone(),
        options,
        rim: mean_and_error(&runs, |run| 1e3 * run.drop),
        coefficient: mean_and_error(&runs, |run| 100.0 * run.coefficient),
        runs,
    })
}

fn mean_and_error(runs: &[DrapeRun], value: impl Fn(&DrapeRun) -> f64) -> [f64; 2] {
    let count = runs.len() as f64;
    let mean = runs.iter().map(&value).sum::<f64>() / count;
    let variance = runs.iter().map(|run| (value(run) - mean).powi(2)).sum::<f64>() / (count - 1.0);
    [mean, (variance / count).sqrt()]
}

/// A mean with its standard error.
pub(super) fn with_error([mean, error]: [f64; 2]) -> String {
    format!("{} ± {}", rounded(mean), rounded(error))
}
