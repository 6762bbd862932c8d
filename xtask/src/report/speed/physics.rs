//! Our own physics at the paper's resolution, on the same machine.

use std::cell::RefCell;
use std::sync::Arc;
use std::time::Instant;

use anyhow::Result;
use modiste_body::{Gender, ScapeModel, motion::generate};
use modiste_cloth::dress::TailorOptions;
use modiste_cloth::pattern::known;
use modiste_cloth::training_set::Wardrobe;
use serde::Serialize;

use super::{time, wardrobe};
use crate::assets::{GARMENTS, body_file};
use crate::report::page::{Page, rounded};

/// Length of the walk that is simulated (s).
const SECONDS: f64 = 2.0;

/// What a frame of one garment took.
#[derive(Debug, Serialize)]
struct Cost {
    garment: String,
    vertices: usize,
    physics_ms: f64,
    learned_ms: f64,
}

pub(crate) fn measure() -> Result<Page> {
    let mut page = Page::new("Beside our own physics");
    page.paragraph(
        "Each garment of table 1 cut to about the paper's number of vertices and simulated on a walking body by `modiste-cloth`, \
         on one core, beside the learned garment with as many vertices, body included, on one core too. Several garments take \
         physics as long as all of them together.",
    );
    let mut costs = Vec::new();
    for (garment, size) in GARMENTS {
        println!("  {garment}: dressing {size} vertices");
        let (vertices, physics_ms) = simulate(garment, size)?;
        let (model, garments) = wardrobe(&[garment])?;
        let worn = garments.iter().map(|garment| Ok(garment.resampled(vertices)?)).collect::<Result<Vec<_>>>()?;
        let learned_ms = time(&model, worn, 1)?.median;
        costs.push(Cost { garment: garment.to_owned(), vertices, physics_ms, learned_ms });
    }
    let row = |cost: &Cost| {
        let times = [cost.physics_ms, cost.learned_ms, cost.physics_ms / cost.learned_ms];
        [cost.garment.clone(), cost.vertices.to_string()].into_iter().chain(times.map(rounded)).collect::<Vec<_>>()
    };
    page.table(&["garment", "vertices", "physics (ms)", "learned (ms)", "times faster"], costs.iter().map(row));
    let least = costs.iter().map(|cost| cost.physics_ms / cost.learned_ms).fold(f64::INFINITY, f64::min);
    page.at_least("times faster than our own physics, any garment", least, 1.0, "");
    page.figures("costs", &costs)?;
    Ok(page)
}

/// Vertices of a garment and the median time of a frame of its simulation (ms).
fn simulate(garment: &str, size: usize) -> Result<(usize, f64)> {
    let model = ScapeModel::load(body_file(Gender::Female))?;
    let body = model.body(&[])?;
    let motion = generate::walk(&body, SECONDS)?;
    let options = TailorOptions { vertex_count: size, ..TailorOptions::default() };
    let wardrobe = Wardrobe::new(&model, Arc::new(known(garment, Gender::Female)?), options)?;
    let stamps = RefCell::new(vec![Instant::now()]);
    let tick = || stamps.borrow_mut().push(Instant::now());
    wardrobe.simulate(&body, wardrobe.template(), ("timing", &motion), &tick)?;
    let mut times: Vec<f64> = stamps.borrow().windows(2).map(|pair| 1e3 * (pair[1] - pair[0]).as_secs_f64()).collect();
    times.sort_by(f64::total_cmp);
    let median = times.get(times.len() / 2).copied().unwrap_or(f64::NAN);
    Ok((wardrobe.template().state.positions.len(), median))
}
