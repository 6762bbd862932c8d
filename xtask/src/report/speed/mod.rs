//! What a frame costs: beside the paper, beside our own physics, and how it grows.

pub(crate) mod crowd;
pub(crate) mod frames;
pub(crate) mod growth;
pub(crate) mod physics;

use std::sync::Arc;

use anyhow::{Context, Result};
use modiste::Assets;
use modiste_body::{Body, Gender, Motion, ScapeModel, motion::generate, motion::resample};
use modiste_garment::DrapeModel;
use modiste_garment::refine::FitOptions;
use modiste_scene::{Dresser, Person, Summary, time_frames};

/// Length of the walk that is timed (s).
const SECONDS: f64 = 4.0;
/// Frames that count, and those before them.
const FRAMES: usize = 90;
const WARM_UP: usize = 30;

/// The female body model and its garments of these names.
fn wardrobe(names: &[&str]) -> Result<(Arc<ScapeModel>, Vec<DrapeModel>)> {
    let assets = Assets::find()?;
    let model = ScapeModel::load(assets.body(Gender::Female))?;
    let garments = names.iter().map(|name| Ok(DrapeModel::load(assets.garment(Gender::Female, name)?)?));
    Ok((model, garments.collect::<Result<_>>()?))
}

fn walk(body: &Body, fps: f64) -> Result<Motion> {
    Ok(resample(&generate::walk(body, SECONDS)?, fps))
}

/// Times a walk of the mean body in some garments.
fn time(model: &Arc<ScapeModel>, garments: Vec<DrapeModel>, threads: usize) -> Result<Summary> {
    let person = Person::new(model.body(&[])?, garments.into_iter().map(Arc::new).collect())?;
    let motion = walk(person.body(), person.fps())?;
    let mut dresser = Dresser::new(&person, &FitOptions::default())?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    let timing = pool.install(|| time_frames(&mut dresser, &motion, WARM_UP + FRAMES));
    timing.total(WARM_UP).context("no frame was timed")
}
