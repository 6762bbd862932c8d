//! Whether the learned dynamics keep the wrinkles of the simulation (DRAPE fig. 11 d).

use std::sync::Arc;

use anyhow::{Result, ensure};
use modiste::Sources;
use modiste_body::Gender;
use modiste_cloth::dress::TailorOptions;
use modiste_cloth::pattern::known;
use modiste_cloth::training_set::{Wardrobe, held_out_sequences};
use modiste_core::Silent;
use modiste_garment::drape::PoseSequence;
use modiste_garment::report::{SequenceFigures, SequenceReport, evaluate_sequence, longest_run};

use super::page::{Page, rounded};
use super::plot::{Series, lines};
use super::trials::wardrobe;

/// The share of the simulation's mean curvature that the dynamics must keep.
const SHARE_LIMIT: f64 = 0.85;
/// Frames through which the dynamics must stay stable, and what a coefficient may then be (standard deviations).
const STABLE_FRAMES: usize = 3000;
const STABLE_LIMIT: f64 = 10.0;
/// Held-out clips that are simulated for comparison: the paper's own test sequence runs, jumps and stops.
const CLIPS: [&str; 3] = ["walk_12_02", "run_35_22", "stretcharms_02_06"];

pub(super) fn measure() -> Result<Page> {
    let mut page = Page::new("Wrinkles");
    page.paragraph(
        "Captured motions that were not trained on, simulated on the mean body, and synthesised with and without dynamics: \
         mean over the vertices of the mean curvature. The claim is on all frames together. \u{201c}Projected\u{201d} puts the \
         simulation's own wrinkles through the learned space: the nearest to it that any dynamics could come. Each coefficient \
         is shown with a factor, with dynamics and without the same but where the latter would overshoot; together they bring \
         motions held out in training near the curvature of their simulation (not in the paper).",
    );
    let mut rows = Vec::new();
    for gender in Gender::ALL {
        let (model, garments) = wardrobe(gender)?;
        let body = model.body(&[])?;
        let mocap = Sources::default().mocap().ok_or_else(|| anyhow::anyhow!("captured motions are not there"))?;
        let motions = held_out_sequences(&body, &mocap, &Silent)?;
        for clip in CLIPS {
            ensure!(motions.iter().any(|motion| motion.name == clip), "the held-out clip {clip} is not there");
        }
        for garment in &garments {
            let name = format!("{} {}", gender.name(), garment.garment().name);
            let what = format!("{name}: the mean body can be dressed and simulated");
            let pattern = Arc::new(known(&garment.garment().name, gender)?);
            let tailor = match Wardrobe::new(&model, pattern, TailorOptions::default()) {
                Ok(tailor) => tailor,
                Err(error) => {
                    page.claim(&what, "yes".to_owned(), error.to_string(), false);
                    continue;
                }
            };
            let mut reports = Vec::new();
            for motion in motions.iter().filter(|motion| CLIPS.contains(&motion.name.as_str())) {
                let run = (motion.name.as_str(), &motion.motion);
                let simulation = match tailor.simulate(&body, tailor.template(), run, &|| {}) {
                    Ok(simulation) => simulation,
                    Err(error) => {
                        page.claim(&what, "yes".to_owned(), format!("{}: {error}", motion.name), false);
                        continue;
                    }
                };
                let sequence = PoseSequence {
                    name: motion.name.clone(),
                    motion: simulation.motion.clone(),
                    frames: simulation.frames.clone(),
                    body_anchors: simulation.body_anchors.clone(),
                };
                let report = evaluate_sequence(garment, &sequence, &[], &|pose, out| body.pose(pose, out))?;
                rows.push(describe(&mut page, &name, &report)?);
                reports.push(report);
            }
            compare(&mut page, &name, &reports);
            let largest = longest_run(garment, &motions[0].motion, STABLE_FRAMES);
            let what = format!("{name}: largest wrinkle coefficient in {STABLE_FRAMES} frames");
            page.at_most(&what, largest, STABLE_LIMIT, "standard deviations");
        }
    }
    page.table(
        &[
            "garment",
            "motion",
            "physics (1/m)",
            "with dynamics",
            "without",
            "projected",
            "share with dynamics",
            "error with dynamics (mm)",
        ],
        rows,
    );
    Ok(page)
}

/// The claims on all frames of a garment.
fn compare(page: &mut Page, name: &str, reports: &[SequenceReport]) {
    let mean = |of: &dyn Fn(&SequenceReport) -> &SequenceFigures| {
        let all: Vec<f64> = reports.iter().flat_map(|report| of(report).curvature.iter().copied()).collect();
        all.iter().sum::<f64>() / all.len().max(1) as f64
    };
    let (physics, dynamic, fixed) = (mean(&|r| &r.physics), mean(&|r| &r.dynamic), mean(&|r| &r.fixed));
    let what = format!("{name}: mean curvature with dynamics as a share of physics");
    page.at_least(&what, dynamic / physics, SHARE_LIMIT, "");
    let what = format!("{name}: mean curvature with dynamics above without");
    page.claim(&what, "above".to_owned(), format!("{} and {}", rounded(dynamic), rounded(fixed)), dynamic > fixed);
}

fn describe(page: &mut Page, name: &str, report: &SequenceReport) -> Result<[String; 8]> {
    let [physics, dynamic, fixed, projected] =
        [&report.physics, &report.dynamic, &report.fixed, &report.projected].map(|figures| figures.mean_curvature());
    let motion = &report.name;
    let curve = |label: &str, values: &[f64]| {
        Series::new(label, values.iter().enumerate().map(|(frame, &value)| (frame as f64, value)).collect())
    };
    let series = [
        curve("physics", &report.physics.curvature),
        curve("with dynamics", &report.dynamic.curvature),
        curve("without", &report.fixed.curvature),
    ];
    let file = format!("wrinkles-{}-{motion}", name.replace(' ', "-"));
    page.plot(
        &file,
        &format!("Wrinkles of {name} in {motion}"),
        lines(["frame", "mean curvature (1/m)"], &series, None)?,
    );
    page.figures(&format!("{name} {motion}"), report)?;
    Ok([
        name.to_owned(),
        motion.clone(),
        rounded(physics),
        rounded(dynamic),
        rounded(fixed),
        rounded(projected),
        rounded(dynamic / physics),
        rounded(1e3 * report.dynamic.mean_error()),
    ])
}
