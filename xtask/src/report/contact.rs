//! Whether skin stays out of other skin.

use std::time::Instant;

use anyhow::Result;
use modiste_body::{Body, Motion, Part, PoseScratch};
use modiste_core::{Silent, TriangleBvh, Vec3, quantile, vertex_normals};
use serde::Serialize;

use super::page::{Page, rounded};
use super::trials::trials;

/// Every so many frames are looked at for crossings.
const STRIDE: usize = 5;
/// Skin is taken to be inside other skin from this far (m) above it on.
const LIFT: f64 = 1e-4;
/// Displacements below this (m) do not count as such.
const LEAST: f64 = 1e-4;
/// Share of the skin's vertices inside other skin that has to be gone.
const WANTED_GONE: f64 = 0.9;

/// What was found in one motion of one body.
#[derive(Debug, Serialize)]
struct Found {
    trial: String,
    /// Vertices of trunk and limbs inside other skin, a frame, without contact and with it.
    inside: [f64; 2],
    /// Pairs of faces that cross, a frame, beyond those of the template pose.
    crossing: [f64; 2],
    /// How far skin that gave way went (mm): 95 % below, and most.
    moved_mm: [f64; 2],
    /// What of it changes from frame to frame, `d_t - (d_{t-1} + 2 d_t + d_{t+1}) / 4` in the frame of the part (mm): 95 % below.
    flicker_mm: f64,
    /// Time of posing without contact and with it (ms, median).
    pose_ms: [f64; 2],
}

pub(super) fn measure() -> Result<Page> {
    let mut page = Page::new("Skin against skin");
    page.paragraph(
        "The posed body as SCAPE alone has it, and where skin gives way to skin. Vertices of trunk, arms and legs inside the \
         surface of the body (winding number just above the skin), and pairs of faces that cross beyond those of the template \
         pose, a frame; how far skin gave way; how much of that changes from one frame to the next; and the time of a pose. \
         Hands, feet and head take no part, and what they cross counts among the pairs.",
    );
    let mut found = Vec::new();
    for trial in trials(&Silent)? {
        println!("  {}", trial.name);
        found.push(look(trial.name.clone(), trial.person.body(), &trial.motion));
    }
    let rows = found.iter().map(|found| {
        let pair = |[without, with]: [f64; 2]| format!("{} / {}", rounded(without), rounded(with));
        [
            found.trial.clone(),
            pair(found.inside),
            pair(found.crossing),
            pair(found.moved_mm),
            rounded(found.flicker_mm),
            pair(found.pose_ms),
        ]
    });
    let header = [
        "trial",
        "vertices inside, without / with",
        "pairs crossing, without / with",
        "moved (mm), 95 % / most",
        "of it from frame to frame (mm), 95 %",
        "pose (ms), without / with",
    ];
    page.table(&header, rows);
    let sum = |which: usize| found.iter().map(|found| found.inside[which]).sum::<f64>();
    let gone = 1.0 - sum(1) / sum(0).max(f64::MIN_POSITIVE);
    page.at_least("vertices of skin in other skin that are gone", 100.0 * gone, 100.0 * WANTED_GONE, "%");
    page.figures("contact", &found)?;
    Ok(page)
}

fn look(trial: String, body: &Body, motion: &Motion) -> Found {
    let model = body.model();
    let (topology, parts) = (model.topology(), model.vertex_parts());
    let mut tree = TriangleBvh::new(topology, body.rest_vertices());
    let folded = tree.self_intersections(body.rest_vertices()).len() as f64;
    let is_soft =
        |part: Part| !matches!(part, Part::Head | Part::LeftHand | Part::RightHand | Part::LeftFoot | Part::RightFoot);
    let mut scratch = PoseScratch::default();
    let (mut inside, mut crossing, mut looked) = ([0.0; 2], [0.0; 2], 0.0f64);
    let (mut moved, mut times) = (Vec::new(), [Vec::new(), Vec::new()]);
    for (frame, pose) in motion.frames.iter().enumerate() {
        let mut posed = [Vec::new(), Vec::new()];
        let started = Instant::now();
        body.pose_without_contact(pose, &mut posed[0]);
        let between = Instant::now();
        body.pose_with(pose, &mut scratch, &mut posed[1]);
        times[0].push(1e3 * (between - started).as_secs_f64());
        times[1].push(1e3 * between.elapsed().as_secs_f64());
        let world = pose.world_quaternions();
        let of_part = |v: usize| world[parts[v].index()].conjugate() * (posed[1][v] - posed[0][v]);
        moved.push((0..parts.len()).map(of_part).collect::<Vec<Vec3>>());
        if frame % STRIDE != 0 {
            continue;
        }
        looked += 1.0;
        for (which, x) in posed.iter().enumerate() {
            tree.refit(x);
            let normals = vertex_normals(topology, x);
            let is_inside = |v: &usize| is_soft(parts[*v]) && tree.contains(x, x[*v] + LIFT * normals[*v]);
            inside[which] += (0..x.len()).filter(is_inside).count() as f64;
            crossing[which] += (tree.self_intersections(x).len() as f64 - folded).max(0.0);
        }
    }
    let lengths: Vec<f64> = moved
        .iter()
        .flatten()
        .map(|d| d.length())
        .filter(|length| *length > LEAST)
        .map(|length| 1e3 * length)
        .collect();
    let mut changes = Vec::new();
    for at in moved.windows(3) {
        let places = (0..parts.len()).filter(|&v| at.iter().any(|frame| frame[v].length() > LEAST));
        changes.extend(places.map(|v| 1e3 * (at[1][v] - (at[0][v] + 2.0 * at[1][v] + at[2][v]) / 4.0).length()));
    }
    Found {
        trial,
        inside: inside.map(|sum| sum / looked.max(1.0)),
        crossing: crossing.map(|sum| sum / looked.max(1.0)),
        moved_mm: [0.95, 1.0].map(|share| quantile(&lengths, share).unwrap_or(0.0)),
        flicker_mm: quantile(&changes, 0.95).unwrap_or(0.0),
        pose_ms: times.map(|times| quantile(&times, 0.5).unwrap_or(0.0)),
    }
}
