//! Whether the simulation that garments are learned from can be trusted.

use std::sync::Arc;
use std::time::Instant;

use anyhow::Result;
use modiste_body::{Gender, ScapeModel, motion::generate};
use modiste_cloth::dress::TailorOptions;
use modiste_cloth::pattern::known;
use modiste_cloth::training_set::Wardrobe;
use modiste_cloth::validate::figures;
use serde::{Deserialize, Serialize};

use super::page::{Page, rounded};
use crate::assets::{GARMENTS, body_file, training_folder, training_sets};

/// 99th percentile of the edge stretch that training poses may have.
const STRETCH_LIMIT: f64 = 0.08;
/// Time (ms) that a frame may take on one core, per vertex: 60 ms at 5,000, 120 ms at 10,000.
const MILLISECONDS_PER_VERTEX: f64 = 60.0 / 5000.0;
/// How far the simulation of a strip may be from theory.
const FORM_LIMIT: f64 = 0.05;
/// Sizes of the squares that are dropped on a sphere.
const DROPPED_SIZES: [usize; 2] = [5000, 10_000];
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
         vertices inside the body in any frame of a motion. Strips, planes and free sheets against what theory says; \
         derivatives of the energies against finite differences are tests of `modiste-cloth`.",
    );
    closed_forms(&mut page)?;
    as_simulated(&mut page)?;
    costs(&mut page)?;
    Ok(page)
}

/// Small simulations whose outcome is known.
fn closed_forms(page: &mut Page) -> Result<()> {
    let found = figures(&DROPPED_SIZES)?;
    let forms = [
        ("strip under its own weight, elongation", &found.hanging_strip),
        ("loaded strip, elongation", &found.loaded_strip),
        ("clamped strip, energy", &found.clamped_strip),
        ("stiff cantilever, sag", &found.stiff_cantilever),
        ("soft cantilever, sag", &found.soft_cantilever),
    ];
    let rows = forms.map(|(name, form)| {
        let numbers = [form.measured, form.expected, 100.0 * form.relative_error.abs()].map(rounded);
        [vec![name.to_owned()], numbers.to_vec()].concat()
    });
    page.table(&["closed form", "simulated (SI)", "theory (SI)", "difference (%)"], rows);
    for (name, form) in forms {
        page.at_most(&format!("{name}: difference"), 100.0 * form.relative_error.abs(), 100.0 * FORM_LIMIT, "%");
    }
    let slides = found.inclines.iter().map(|run| [run.steepness, 1e3 * run.slid, 1e3 * run.expected].map(rounded));
    page.table(&["slope over friction", "slid (mm)", "Coulomb (mm)"], slides);
    let drops = found.drops.iter().map(|drop| {
        let numbers = [1e3 * drop.median_frame, 1e3 * drop.slow_frame, 100.0 * drop.stretch].map(rounded);
        [vec![drop.vertices.to_string()], numbers.to_vec(), vec![drop.inside.to_string()]].concat()
    });
    page.table(&["vertices on a sphere", "frame (ms)", "95% (ms)", "stretch (%)", "inside"], drops);
    for drop in &found.drops {
        let limit = MILLISECONDS_PER_VERTEX * drop.vertices as f64;
        let what = format!("square of {} vertices on a sphere: time per frame on one core", drop.vertices);
        page.at_most(&what, 1e3 * drop.median_frame, limit.round(), "ms");
    }
    page.figures("closed_forms", &found)
}

fn as_simulated(page: &mut Page) -> Result<()> {
    let mut rows = Vec::new();
    let (sets, missing) = training_sets();
    if !missing.is_empty() {
        page.paragraph(format!("Without a training set on this machine: {}.", missing.join(", ")));
    }
    for (gender, garment) in sets {
        let manifest: Manifest = modiste_io::json::read(training_folder(gender, garment).join("manifest.json"))?;
        let name = format!("{} {garment}", gender.name());
        let poses = || manifest.sequences.iter().filter(|entry| entry.kind == "pose");
        let frames: usize = poses().map(|entry| entry.frames).sum();
        let stretch = poses().map(|entry| entry.stretch).fold(0.0, f64::max);
        let inside = poses().map(|entry| entry.inside).max().unwrap_or(0);
        page.at_most(&format!("{name}: 99th percentile of edge stretch"), 100.0 * stretch, 100.0 * STRETCH_LIMIT, "%");
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
    page.table(&["garment", "motion", "frames", "stretch (%)", "inside"], rows);
    Ok(())
}

fn costs(page: &mut Page) -> Result<()> {
    let model = ScapeModel::load(body_file(Gender::Female))?;
    let body = model.body(&[])?;
    let motion = generate::walk(&body, TIMED_SECONDS)?;
    let mut costs = Vec::new();
    for (garment, _) in GARMENTS {
        let what = format!("{garment}: the mean body can be dressed");
        let wardrobe = match Wardrobe::new(&model, Arc::new(known(garment, Gender::Female)?), TailorOptions::default())
        {
            Ok(wardrobe) => wardrobe,
            Err(error) => {
                page.claim(&what, "yes".to_owned(), error.to_string(), false);
                continue;
            }
        };
        page.claim(&what, "yes".to_owned(), "yes".to_owned(), true);
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
