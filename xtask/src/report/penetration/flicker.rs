//! Whether garments flicker: how much their acceleration changes from frame to frame, beside physics.

use std::sync::Arc;

use anyhow::Result;
use modiste_body::{Body, Gender, Motion, Part, Pose, ScapeModel};
use modiste_cloth::dress::TailorOptions;
use modiste_cloth::pattern::known;
use modiste_cloth::training_set::Wardrobe;
use modiste_core::{Mat3, Vec3};
use modiste_garment::refine::FitOptions;
use modiste_garment::{DrapeModel, Garment};
use modiste_scene::{Dresser, Person};
use serde::Serialize;

use super::motions;
use crate::assets::{body_file, garment_file};
use crate::report::page::{Page, rounded};

/// Captured motions, of those that no garment was learned from, and the garments that are looked at.
const MOTIONS: usize = 3;
const WORN: [&str; 2] = ["tshirt", "skirt"];

/// Root of the mean square of the high-frequency acceleration (m/s²).
#[derive(Debug, Serialize)]
struct Flicker {
    motion: String,
    garment: String,
    frames: usize,
    learned: f64,
    physics: f64,
}

pub(crate) fn measure() -> Result<Page> {
    let mut page = Page::new("Flicker");
    page.paragraph(
        "The mean woman in one garment, learned and simulated through the same poses. Every vertex is seen from the part of the \
         body that its cloth follows; of its acceleration there the part is taken that changes from frame to frame, \
         `a_t - (a_{t-1} + 2 a_t + a_{t+1}) / 4`, and of that the root of the mean square over vertices and frames (m/s²). A \
         learned garment has the mesh of its own physics, cut anew where the training set is not at hand.",
    );
    let model = ScapeModel::load(body_file(Gender::Female))?;
    let body = model.body(&[])?;
    let mut found = Vec::new();
    for garment in WORN {
        println!("  {garment}: dressing");
        let learned = Arc::new(DrapeModel::load(garment_file(Gender::Female, garment))?);
        let pattern = known(garment, Gender::Female)?;
        let wardrobe = Wardrobe::new(&model, Arc::new(pattern), TailorOptions::default())?;
        for clip in motions::clips(MOTIONS)? {
            println!("  {garment}: {}", clip.name);
            let motion = clip.motion(&body)?;
            let simulation = wardrobe.simulate(&body, wardrobe.template(), ("flicker", &motion), &|| {})?;
            let poses = &simulation.motion.frames[simulation.lead_in..];
            let parts = parts_of(learned.garment());
            let ours = through(&body, &learned, &simulation.motion)?;
            let simulated = &simulation.frames[simulation.lead_in..];
            // A mesh cut anew need not be numbered alike; its vertices follow the parts of the nearest of the learned mesh.
            let nearest = |vertex: &Vec3| {
                let template = &learned.garment().template;
                let near = (0..template.len())
                    .min_by(|&a, &b| template[a].distance(*vertex).total_cmp(&template[b].distance(*vertex)));
                near.map_or(Part::Pelvis, |index| parts[index])
            };
            let simulated_parts: Vec<Part> = wardrobe.template().state.positions.iter().map(nearest).collect();
            found.push(Flicker {
                motion: clip.name.clone(),
                garment: garment.to_owned(),
                frames: poses.len(),
                learned: flicker(&body, poses, &ours[simulation.lead_in..], &parts, motion.fps),
                physics: flicker(&body, poses, simulated, &simulated_parts, motion.fps),
            });
        }
    }
    let row = |run: &Flicker| {
        let names = [run.garment.clone(), run.motion.clone(), run.frames.to_string()];
        names.into_iter().chain([run.learned, run.physics, run.learned / run.physics].map(rounded)).collect::<Vec<_>>()
    };
    page.table(&["garment", "motion", "frames", "learned (m/s²)", "physics (m/s²)", "ratio"], found.iter().map(row));
    let mean = |of: fn(&Flicker) -> f64| found.iter().map(of).sum::<f64>() / found.len().max(1) as f64;
    page.at_most("flicker over that of physics", mean(|run| run.learned) / mean(|run| run.physics), 1.0, "");
    page.figures("runs", &found)?;
    Ok(page)
}

/// The frames of the learned garment.
fn through(body: &Body, garment: &Arc<DrapeModel>, motion: &Motion) -> Result<Vec<Vec<Vec3>>> {
    let person = Person::new(body.clone(), vec![garment.clone()])?;
    let mut dresser = Dresser::new(&person, &FitOptions::default())?;
    let step = |pose: &Pose| {
        dresser.step(pose);
        dresser.vertices(0).to_vec()
    };
    Ok(motion.frames.iter().map(step).collect())
}

/// The part that the first face at each vertex follows.
fn parts_of(garment: &Garment) -> Vec<Part> {
    let part = |vertex: usize| {
        garment.topology.vertex_faces(vertex).first().map_or(Part::Pelvis, |&face| garment.face_parts[face as usize])
    };
    (0..garment.template.len()).map(part).collect()
}

fn flicker(body: &Body, poses: &[Pose], frames: &[Vec<Vec3>], parts: &[Part], fps: f64) -> f64 {
    let local: Vec<Vec<Vec3>> = poses
        .iter()
        .zip(frames)
        .map(|(pose, frame)| {
            let (joints, turns) = (body.joints(pose), pose.world_quaternions().map(Mat3::from_quat));
            let seen = |(x, part): (&Vec3, &Part)| turns[part.index()].transpose() * (*x - joints[part.index()]);
            frame.iter().zip(parts).map(seen).collect()
        })
        .collect();
    let (mut sum, mut count) = (0.0, 0usize);
    for five in local.windows(5) {
        for vertex in 0..parts.len() {
            let x = |frame: usize| five[frame][vertex];
            // Four times what changes of the acceleration is, but for its sign, the fourth difference of the places.
            let changing = 0.25 * fps * fps * (x(0) - 4.0 * x(1) + 6.0 * x(2) - 4.0 * x(3) + x(4));
            sum += changing.length_squared();
            count += 1;
        }
    }
    (sum / count.max(1) as f64).sqrt()
}
