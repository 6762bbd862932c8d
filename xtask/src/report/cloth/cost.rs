//! What a frame costs and how that grows with the mesh.

use std::cell::RefCell;
use std::sync::Arc;
use std::time::Instant;

use anyhow::Result;
use modiste_body::{Gender, ScapeModel, motion::generate};
use modiste_cloth::dress::TailorOptions;
use modiste_cloth::pattern::known;
use modiste_cloth::training_set::{Wardrobe, simulated_frames};
use modiste_cloth::validate::sphere_drop;
use serde::Serialize;

use crate::assets::body_file;
use crate::report::page::{Page, rounded};

/// Sizes that are timed.
const SIZES: [usize; 3] = [5_000, 10_000, 20_000];
/// Length of the walk that is timed (s).
const SECONDS: f64 = 2.0;
/// Every so many frames the terminal hears how far the walk is.
const FRAMES_TOLD: usize = 20;
/// Time (s) that Blender's cloth (bpy 5.0) takes for a frame of 5,000 and of 20,000 vertices on a machine of this class; see
/// the project's design.
const BLENDER: [(usize, f64); 2] = [(5_000, 0.26), (20_000, 1.25)];

/// What a frame took.
#[derive(Debug, Serialize)]
struct Cost {
    scene: &'static str,
    vertices: usize,
    median_seconds: f64,
    slow_seconds: f64,
}

pub(crate) fn measure() -> Result<Page> {
    let mut page = Page::new("Cost");
    page.paragraph(
        "Time of a frame on one core, at three sizes of the mesh: a square of jersey dropped on a sphere of 20,480 triangles, and \
         a T-shirt on a body of 26,756 triangles that walks for two seconds. Blender's cloth took 0.26 s a frame at 5,000 \
         vertices and 1.25 s at 20,000 on a machine of this class, which grows with the power 1.13.",
    );
    let mut costs = Vec::new();
    for size in SIZES {
        println!("  a square of {size} vertices on a sphere");
        let drop = sphere_drop(size)?;
        costs.push(Cost {
            scene: "square on a sphere",
            vertices: drop.vertices,
            median_seconds: drop.median_frame,
            slow_seconds: drop.slow_frame,
        });
    }
    for size in SIZES {
        costs.push(walk(size)?);
    }
    let row = |index: usize| {
        let cost = &costs[index];
        let blender = BLENDER.iter().find(|(size, _)| cost.vertices.abs_diff(*size) < size / 10);
        let blender = blender.map_or_else(|| "–".to_owned(), |(_, seconds)| rounded(*seconds));
        let times = [cost.median_seconds, cost.slow_seconds].map(rounded);
        let grown =
            if index.is_multiple_of(SIZES.len()) { "–".to_owned() } else { rounded(power(&costs[index - 1], cost)) };
        [vec![cost.scene.to_owned(), cost.vertices.to_string()], times.to_vec(), vec![grown, blender]].concat()
    };
    let header = ["scene", "vertices", "frame (s)", "95 % below (s)", "grows with the power", "Blender (s)"];
    page.table(&header, (0..costs.len()).map(row));
    for runs in costs.chunks(SIZES.len()) {
        let (first, last) = (&runs[0], &runs[runs.len() - 1]);
        let what = format!("{}: power by which the time grows with the vertices", first.scene);
        page.at_most(&what, power(first, last), 1.35, "");
        for (cost, (_, blender)) in [first, last].into_iter().zip(BLENDER) {
            let what = format!("{}, {} vertices: time of a frame over Blender's", cost.scene, cost.vertices);
            page.at_most(&what, cost.median_seconds / blender, 1.0, "");
        }
    }
    page.figures("costs", &costs)?;
    Ok(page)
}

/// The power of the number of vertices with which the time grows from one size to another.
fn power(small: &Cost, large: &Cost) -> f64 {
    (large.median_seconds / small.median_seconds).ln() / (large.vertices as f64 / small.vertices as f64).ln()
}

/// A T-shirt of about `size` vertices on a woman who walks.
fn walk(size: usize) -> Result<Cost> {
    println!("  a T-shirt of {size} vertices: dressing");
    let model = ScapeModel::load(body_file(Gender::Female))?;
    let body = model.body(&[])?;
    let motion = generate::walk(&body, SECONDS)?;
    let options = TailorOptions { vertex_count: size, ..TailorOptions::default() };
    let wardrobe = Wardrobe::new(&model, Arc::new(known("tshirt", Gender::Female)?), options)?;
    let stamps = RefCell::new(vec![Instant::now()]);
    let frames = simulated_frames(&motion);
    let tick = || {
        let mut stamps = stamps.borrow_mut();
        stamps.push(Instant::now());
        let frame = stamps.len() - 1;
        if frame.is_multiple_of(FRAMES_TOLD) {
            println!("  a T-shirt of {size} vertices: frame {frame} of {frames}, {:.0?}", stamps[0].elapsed());
        }
    };
    wardrobe.simulate(&body, wardrobe.template(), ("timing", &motion), &tick)?;
    let mut seconds: Vec<f64> = stamps.borrow().windows(2).map(|pair| (pair[1] - pair[0]).as_secs_f64()).collect();
    seconds.sort_by(f64::total_cmp);
    let at = |share: usize| seconds.get(seconds.len().saturating_sub(1) * share / 100).copied().unwrap_or(f64::NAN);
    let vertices = wardrobe.template().state.positions.len();
    Ok(Cost { scene: "T-shirt on a walking body", vertices, median_seconds: at(50), slow_seconds: at(95) })
}
