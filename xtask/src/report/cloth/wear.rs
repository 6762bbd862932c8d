//! Garments on bodies: whether they stay where they are, outside the body, through fast motion and from a bad start.

use std::sync::Arc;
use std::time::Instant;

use anyhow::Result;
use modiste_body::motion::generate;
use modiste_body::{Body, Gender, Motion, Part, Pose, ScapeModel};
use modiste_cloth::dress::TailorOptions;
use modiste_cloth::pattern::known;
use modiste_cloth::training_set::{
    Sequence, Simulation, Wardrobe, held_out_sequences, simulated_frames, training_sequences,
};
use modiste_core::{Quat, TriangleBvh, Vec3};
use rayon::prelude::*;
use serde::Serialize;

use crate::assets::body_file;
use crate::report::page::{Page, rounded};
use crate::shell::workspace_root;

/// Garments that are worn here.
const WORN: [&str; 2] = ["tshirt", "pants"];
/// Clips of fast motion, at full speed, and those with jumps.
const FAST: [&str; 6] =
    ["jumpingjack_13_29a", "kick_135_04", "kick_11_01", "kick_10_01", "run_35_17", "kneeraise_13_30c"];
const JUMPS: [&str; 3] = ["jump_01_01", "jump_02_04", "jump_49_02"];
/// Frames for which a T-shirt is worn walking, and how many at either end are compared.
const LONG: usize = 1000;
const COMPARED: usize = 60;
/// Vertical drift (mm) of the shoulder line that is allowed, and sinking of the band of pants.
const CREEP_LIMIT: f64 = 10.0;
const SINK_LIMIT: f64 = 15.0;
/// Stretch (%) that is allowed where a bad pose is held.
const HELD_STRETCH_LIMIT: f64 = 12.0;
/// Deeper than this (m) a vertex counts as inside the body; nearer, rounding decides.
const DEPTH: f64 = 1e-4;
/// Frames for which a bad pose is held.
const HELD: usize = 30;

/// A garment through a motion.
#[derive(Debug, Serialize)]
struct Run {
    garment: &'static str,
    motion: String,
    /// Frames of the motion as simulated, with its lead-in, and those before the cloth was torn.
    wanted: usize,
    frames: usize,
    /// Most vertices below the surface of the parts that they lie on, after any frame.
    inside: usize,
    /// The same against the whole body: limbs that pass through the garment among it.
    inside_anything: usize,
    /// Largest 99th percentile of the edge stretch, and that of the last frame.
    stretch: f64,
    last_stretch: f64,
    /// How far (m) the garment's band or shoulder line sank along the part that carries it, from the first frames after the
    /// lead-in to the last.
    sunk: f64,
    /// The same for the frame in which it was lowest.
    sunk_most: f64,
}

impl Run {
    /// Whether the simulation ended before the motion did, because the garment was torn.
    fn is_torn(&self) -> bool {
        self.frames < self.wanted
    }

    fn torn(&self) -> String {
        format!("torn after {} of {} frames", self.frames, self.wanted)
    }
}

pub(crate) fn measure() -> Result<Page> {
    let mut page = Page::new("Wear");
    let model = ScapeModel::load(body_file(Gender::Female))?;
    let body = model.body(&[])?;
    let wardrobes = WORN
        .into_par_iter()
        .map(|name| {
            Ok((name, Wardrobe::new(&model, Arc::new(known(name, Gender::Female)?), TailorOptions::default())?))
        })
        .collect::<Result<Vec<_>>>()?;
    let mocap = workspace_root().join("../shared/data/mocap");
    let silent = modiste_core::Silent;
    let mut clips = training_sequences(&body, Some(&mocap), &silent)?;
    clips.extend(held_out_sequences(&body, &mocap, &silent)?);
    let named = |names: &[&str]| -> Vec<Sequence> {
        names.iter().filter_map(|name| clips.iter().find(|clip| clip.name == **name).cloned()).collect()
    };
    let wear = |sequences: &[Sequence]| wear_all(&wardrobes, &body, sequences);
    let (fast, jumps) = (named(&FAST), named(&JUMPS));
    let starts = bad_starts(&body);
    let walk = Sequence { name: "made_walk".to_owned(), motion: generate::walk(&body, LONG as f64 / generate::FPS)? };
    let fast = wear(&fast)?;
    fast_motion(&mut page, &fast)?;
    let jumps = wear(&jumps)?;
    jumping(&mut page, &jumps)?;
    let long = wear_all(&wardrobes[..1], &body, std::slice::from_ref(&walk))?;
    creeping(&mut page, &long)?;
    bad_poses(&mut page, &wear(&starts)?)?;
    Ok(page)
}

fn wear_all(wardrobes: &[(&'static str, Wardrobe)], body: &Body, sequences: &[Sequence]) -> Result<Vec<Run>> {
    let pairs: Vec<_> = wardrobes.iter().flat_map(|worn| sequences.iter().map(move |clip| (worn, clip))).collect();
    pairs
        .par_iter()
        .with_max_len(1)
        .map(|((garment, wardrobe), clip)| {
            let clock = Instant::now();
            let whole = wardrobe.simulate(body, wardrobe.template(), (&clip.name, &clip.motion), &|| {})?;
            println!("  {garment}, {}: {} frames in {:.0?}", clip.name, whole.frames.len(), clock.elapsed());
            let [sunk, sunk_most] = sunk(wardrobe, &whole);
            Ok(Run {
                garment,
                motion: clip.name.clone(),
                wanted: simulated_frames(&clip.motion),
                frames: whole.frames.len(),
                inside: whole.inside.iter().copied().max().unwrap_or(0),
                inside_anything: inside_anything(body, &whole),
                stretch: whole.stretch.iter().copied().fold(0.0, f64::max),
                last_stretch: whole.stretch.last().copied().unwrap_or(f64::NAN),
                sunk,
                sunk_most,
            })
        })
        .collect()
}

/// Most vertices inside the body as a whole after any frame, by an exact test of its own.
fn inside_anything(body: &Body, run: &Simulation) -> usize {
    let mut tree = TriangleBvh::new(body.model().topology(), body.rest_vertices());
    let mut posed = Vec::new();
    let mut most = 0;
    for (pose, cloth) in run.motion.frames.iter().zip(&run.frames) {
        body.pose(pose, &mut posed);
        tree.refit(&posed);
        let is_inside = |x: &&Vec3| {
            tree.closest_point(&posed, **x, 0.1).is_some_and(|near| near.distance > DEPTH) && tree.contains(&posed, **x)
        };
        most = most.max(cloth.iter().filter(is_inside).count());
    }
    most
}

/// How far (m) the anchored vertices, those of the band or of the shoulder seams, sank along the part that carries it: the mean of the last frames, and the least of
/// all, against the mean of the first after the lead-in.
fn sunk(wardrobe: &Wardrobe, run: &Simulation) -> [f64; 2] {
    let line = wardrobe.anchors();
    let carrier = if wardrobe.tailor().design().garment() == "tshirt" { Part::Chest } else { Part::Pelvis };
    let mut heights = Vec::new();
    for ((pose, cloth), skin) in run.motion.frames.iter().zip(&run.frames).zip(&run.body_anchors).skip(run.lead_in) {
        let up = pose.world_quaternions()[carrier.index()] * Vec3::Y;
        let offset = |([vertex, _], below): (&[u32; 2], &Vec3)| (cloth[*vertex as usize] - *below).dot(up);
        heights.push(line.iter().zip(skin).map(offset).sum::<f64>() / line.len().max(1) as f64);
    }
    let count = COMPARED.min(heights.len() / 3);
    if count == 0 {
        return [f64::NAN; 2];
    }
    let mean = |heights: &[f64]| heights.iter().sum::<f64>() / heights.len() as f64;
    let before = mean(&heights[..count]);
    let lowest = heights.iter().copied().fold(f64::INFINITY, f64::min);
    [before - mean(&heights[heights.len() - count..]), before - lowest]
}

fn fast_motion(page: &mut Page, runs: &[Run]) -> Result<()> {
    page.paragraph(
        "Fast motion at the speed at which it was captured, with the lead-in from the template pose, every frame of the \
         simulation as it is, none left out. A simulation ends where the \
         99th percentile of the edge stretch passes 30 %, from which it would not come back: the garment is torn. `inside` counts vertices below the surface of the parts that they lie on; the last \
         column counts against the whole body, with arms that pass through a shirt and limbs that pass through each other.",
    );
    table(page, runs);
    for run in runs {
        page.at_most(
            &format!("{} in {}: vertices inside the body", run.garment, run.motion),
            run.inside as f64,
            0.0,
            "",
        );
    }
    none_torn(page, "fast motions", runs);
    page.figures("fast", &runs)
}

fn jumping(page: &mut Page, runs: &[Run]) -> Result<()> {
    page.paragraph(
        "Jumps. Pants hang from a band whose vertices are held by springs to the waist, as elastic holds them: that they stay up \
         shows the band, not friction alone. `Sunk` compares the means of the last and the first two seconds (a third of a shorter \
         clip); `at its lowest` is the one frame in which the band was lowest, most often at a landing.",
    );
    table(page, runs);
    for run in runs.iter().filter(|run| run.garment == "pants") {
        let what = format!("pants in {}: sinking of the band", run.motion);
        if run.is_torn() {
            page.claim(&what, format!("at most {SINK_LIMIT} mm"), run.torn(), false);
        } else {
            page.at_most(&what, 1e3 * run.sunk, SINK_LIMIT, "mm");
        }
    }
    none_inside(page, "jumps", runs);
    none_torn(page, "jumps", runs);
    page.figures("jumps", &runs)
}

fn creeping(page: &mut Page, runs: &[Run]) -> Result<()> {
    page.paragraph(format!(
        "A T-shirt on a body that walks for {LONG} frames: the height of its shoulder line, the anchors along both shoulder seams, \
         over the skin that lay under them at first, in the frame of the chest, mean of the last {COMPARED} frames against the first. \
         Nothing but friction holds it."
    ));
    table(page, runs);
    for run in runs {
        let what = format!("{} over {LONG} frames: vertical drift of the shoulder line", run.garment);
        page.at_most(&what, 1e3 * run.sunk.abs(), CREEP_LIMIT, "mm");
    }
    none_inside(page, "the long walk", runs);
    none_torn(page, "the long walk", runs);
    page.figures("creep", &runs)
}

fn bad_poses(page: &mut Page, runs: &[Run]) -> Result<()> {
    page.paragraph(
        "Poses in which the body passes through itself, taken up within the lead-in and held: upper arms in the trunk, hands in \
         the hips, thighs in each other, thighs in the belly. Cloth between two parts cannot be outside of both; it must neither \
         tear nor be left inside the part that it lies on.",
    );
    table(page, runs);
    for run in runs {
        let name = format!("{} in pose {}", run.garment, run.motion);
        page.at_most(&format!("{name}: vertices inside the body"), run.inside as f64, 0.0, "");
        let what = format!("{name}: stretch when held");
        if run.is_torn() {
            page.claim(&what, format!("at most {HELD_STRETCH_LIMIT} %"), run.torn(), false);
        } else {
            page.at_most(&what, 100.0 * run.last_stretch, HELD_STRETCH_LIMIT, "%");
        }
    }
    page.figures("starts", &runs)
}

fn none_inside(page: &mut Page, what: &str, runs: &[Run]) {
    let most = runs.iter().map(|run| run.inside).max().unwrap_or(0);
    page.at_most(&format!("{what}: vertices inside the body after any frame"), most as f64, 0.0, "");
}

fn none_torn(page: &mut Page, what: &str, runs: &[Run]) {
    let whole = runs.iter().filter(|run| !run.is_torn()).count();
    page.claim(
        &format!("{what} that no garment is torn in"),
        format!("{} of {}", runs.len(), runs.len()),
        format!("{whole} of {}", runs.len()),
        whole == runs.len(),
    );
}

fn table(page: &mut Page, runs: &[Run]) {
    let moved = |metres: f64| if metres.is_nan() { "–".to_owned() } else { rounded(1e3 * metres) };
    let row = |run: &Run| {
        let torn =
            if run.is_torn() { format!("{} of {}, **torn**", run.frames, run.wanted) } else { run.frames.to_string() };
        [
            run.garment.to_owned(),
            run.motion.clone(),
            torn,
            run.inside.to_string(),
            rounded(100.0 * run.stretch),
            moved(run.sunk),
            moved(run.sunk_most),
            run.inside_anything.to_string(),
        ]
    };
    let header = [
        "garment",
        "motion",
        "frames",
        "inside",
        "largest stretch (%)",
        "sunk (mm)",
        "at its lowest (mm)",
        "inside anything",
    ];
    page.table(&header, runs.iter().map(row));
}

/// Poses in which parts of the body pass through each other, each held for a second.
fn bad_starts(body: &Body) -> Vec<Sequence> {
    let stand = generate::stand(body);
    let turned = |pose: &mut Pose, part: Part, turn: Vec3| {
        let own = pose.rotation(part);
        pose.set_rotation(part, Quat::from_scaled_axis(turn) * own);
        // The same on the other side, seen in a mirror.
        let other = part.mirrored();
        if other != part {
            let own = pose.rotation(other);
            pose.set_rotation(other, Quat::from_scaled_axis(Vec3::new(turn.x, -turn.y, -turn.z)) * own);
        }
    };
    let made = |name: &str, turns: &[(Part, Vec3)]| {
        let mut pose = stand.clone();
        turns.iter().for_each(|&(part, turn)| turned(&mut pose, part, turn));
        Sequence { name: name.to_owned(), motion: Motion { fps: generate::FPS, frames: vec![pose; HELD] } }
    };
    vec![
        made("arms_in_trunk", &[(Part::LeftUpperArm, Vec3::new(0.0, 0.0, -0.35))]),
        made(
            "hands_in_hips",
            &[(Part::LeftUpperArm, Vec3::new(0.0, 0.0, 0.35)), (Part::LeftForearm, Vec3::new(0.0, 0.0, -0.9))],
        ),
        made("thighs_crossed", &[(Part::LeftThigh, Vec3::new(0.0, 0.0, -0.2))]),
        made(
            "deep_squat",
            &[(Part::LeftThigh, Vec3::new(-2.2, 0.0, 0.15)), (Part::LeftShin, Vec3::new(2.3, 0.0, 0.0))],
        ),
    ]
}
