//! Whether the simulation that garments are learned from can be trusted.

use std::time::Instant;

use anyhow::Result;
use modiste_body::{Gender, ScapeModel, motion::generate};
use modiste_cloth::dress::TailorOptions;
use modiste_cloth::training_set::Wardrobe;
use serde::{Deserialize, Serialize};

use super::page::{Page, rounded};
use crate::assets::{GARMENTS, body_file, training_folder};

/// 99th percentile of the edge stretch that training poses may have.
const STRETCH_LIMIT: f64 = 0.08;
/// Time (ms) that a frame may take on one core, per vertex: 60 ms at 5,000, 120 ms at 10,000.
const MILLISECONDS_PER_VERTEX: f64 = 60.0 / 5000.0;
/// Length of the motion that is timed (s).
const TIMED_SECONDS: f64 = 2.0;

/// The part of a training set's manifest that is looked at here.
#[derive(Debug, Deserialize)]
struct Manifest {
    sequences: Vec<Entry>,
    dropped: Vec<Dropped>,
}

#[derive(Debug, Deserialize)]
struct Entry {
    name: String,
    kind: String,
    frames: usize,
    stretch: f64,
    inside: usize,
}

#[derive(Debug, Deserialize)]
struct Dropped {
    name: String,
    why: String,
}

/// What one frame took.
#[derive(Debug, Serialize)]
struct Cost {
    garment: String,
    vertices: usize,
    median_ms: f64,
}

pub(super) fn measure() -> Result<Page> {
    let mut page = Page::new("Cloth physics");
    page.paragraph(
        "The training sets as simulated: the largest 99th percentile of the edge stretch and the largest number of \
         vertices inside the body in any frame of a motion. Derivatives of the energies against finite differences, and \
         strips against closed forms, are tests of `modiste-cloth`.",
    );
    training_sets(&mut page)?;
    costs(&mut page)?;
    Ok(page)
}

fn training_sets(page: &mut Page) -> Result<()> {
    let mut rows = Vec::new();
    for gender in Gender::ALL {
        for garment in GARMENTS {
            let manifest: Manifest = modiste_io::json::read(training_folder(gender, garment).join("manifest.json"))?;
            let name = format!("{} {garment}", gender.name());
            let poses = || manifest.sequences.iter().filter(|entry| entry.kind == "pose");
            let frames: usize = poses().map(|entry| entry.frames).sum();
            let stretch = poses().map(|entry| entry.stretch).fold(0.0, f64::max);
            let inside = poses().map(|entry| entry.inside).max().unwrap_or(0);
            page.at_most(
                &format!("{name}: 99th percentile of edge stretch"),
                100.0 * stretch,
                100.0 * STRETCH_LIMIT,
                "%",
            );
            page.at_most(&format!("{name}: vertices inside the body"), inside as f64, 0.0, "");
            page.at_least(&format!("{name}: frames of motion"), frames as f64, 700.0, "");
            for entry in poses() {
                rows.push([
                    name.clone(),
                    entry.name.clone(),
                    entry.frames.to_string(),
                    rounded(100.0 * entry.stretch),
                    entry.inside.to_string(),
                ]);
            }
            for dropped in &manifest.dropped {
                page.paragraph(format!("{name}: {} was left out: {}", dropped.name, dropped.why));
            }
        }
    }
    page.table(&["garment", "motion", "frames", "stretch (%)", "inside"], rows);
    Ok(())
}

fn costs(page: &mut Page) -> Result<()> {
    let model = ScapeModel::load(body_file(Gender::Female))?;
    let body = model.body(&[])?;
    let motion = generate::walk(&body, TIMED_SECONDS)?;
    let mut costs = Vec::new();
    for garment in GARMENTS {
        let wardrobe = Wardrobe::new(&model, garment, TailorOptions::default())?;
        let stamps = std::cell::RefCell::new(vec![Instant::now()]);
        let tick = || stamps.borrow_mut().push(Instant::now());
        wardrobe.simulate(&body, wardrobe.template(), ("timing", &motion), &tick)?;
        let mut frames: Vec<f64> =
            stamps.borrow().windows(2).map(|pair| 1e3 * (pair[1] - pair[0]).as_secs_f64()).collect();
        frames.sort_by(f64::total_cmp);
        let vertices = wardrobe.template().state.positions.len();
        let median_ms = frames[frames.len() / 2];
        let limit = MILLISECONDS_PER_VERTEX * vertices as f64;
        page.at_most(
            &format!("{garment}: time per frame on one core, {vertices} vertices"),
            median_ms,
            limit.round(),
            "ms",
        );
        costs.push(Cost { garment: garment.to_owned(), vertices, median_ms });
    }
    page.figures("costs", &costs)
}
