//! Whether the learned dynamics keep the wrinkles of the simulation (DRAPE fig. 11 d).

use anyhow::{Result, ensure};
use modiste::Sources;
use modiste_body::Gender;
use modiste_cloth::dress::TailorOptions;
use modiste_cloth::training_set::{Wardrobe, held_out_sequences};
use modiste_core::Silent;
use modiste_garment::drape::PoseSequence;
use modiste_garment::report::{SequenceReport, evaluate_sequence, longest_run};

use super::page::{Page, rounded};
use super::plot::{Series, lines};
use super::trials::wardrobe;

/// The share of the simulation's mean curvature that the dynamics must keep.
const SHARE_LIMIT: f64 = 0.85;
/// Frames through which the dynamics must stay stable, and what a coefficient may then be (standard deviations).
const STABLE_FRAMES: usize = 3000;
const STABLE_LIMIT: f64 = 10.0;
/// Held-out clips that are simulated for comparison.
const CLIPS: usize = 1;

pub(super) fn measure() -> Result<Page> {
    let mut page = Page::new("Wrinkles");
    page.paragraph(
        "A captured motion that was not trained on, simulated on the mean body, and synthesised with and without \
         dynamics: mean over the vertices of the mean curvature. \u{201c}Projected\u{201d} puts the simulation's own wrinkles through \
         the learned space: the nearest to it that any dynamics could come. With and without dynamics, each coefficient has \
         the amplitude that it had in motions held out in training (not in the paper).",
    );
    let mut rows = Vec::new();
    for gender in Gender::ALL {
        let (model, garments) = wardrobe(gender)?;
        let body = model.body(&[])?;
        let mocap = Sources::default().mocap().ok_or_else(|| anyhow::anyhow!("captured motions are not there"))?;
        let motions = held_out_sequences(&body, &mocap, &Silent)?;
        ensure!(motions.len() >= CLIPS, "fewer than {CLIPS} held-out clips are there");
        for garment in &garments {
            let name = format!("{} {}", gender.name(), garment.garment().name);
            let what = format!("{name}: the mean body can be dressed and simulated");
            let tailor = match Wardrobe::new(&model, &garment.garment().name, TailorOptions::default()) {
                Ok(tailor) => tailor,
                Err(error) => {
                    page.claim(&what, "yes".to_owned(), error.to_string(), false);
                    continue;
                }
            };
            for motion in &motions[..CLIPS] {
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
                };
                let report = evaluate_sequence(garment, &sequence, &|pose, out| body.pose(pose, out))?;
                rows.push(describe(&mut page, &name, &report)?);
            }
            let largest = longest_run(garment, &motions[0].motion, STABLE_FRAMES);
            let what = format!("{name}: largest wrinkle coefficient in {STABLE_FRAMES} frames");
            page.at_most(&what, largest, STABLE_LIMIT, "standard deviations");
        }
    }
    page.table(
        &["garment", "motion", "physics (1/m)", "with dynamics", "without", "projected", "error with dynamics (mm)"],
        rows,
    );
    Ok(page)
}

fn describe(page: &mut Page, name: &str, report: &SequenceReport) -> Result<[String; 7]> {
    let [physics, dynamic, fixed, projected] =
        [&report.physics, &report.dynamic, &report.fixed, &report.projected].map(|figures| figures.mean_curvature());
    let motion = &report.name;
    let what = format!("{name}, {motion}: mean curvature with dynamics as a share of physics");
    page.at_least(&what, dynamic / physics, SHARE_LIMIT, "");
    let what = format!("{name}, {motion}: mean curvature with dynamics above without");
    page.claim(&what, "above".to_owned(), format!("{} and {}", rounded(dynamic), rounded(fixed)), dynamic > fixed);
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
        rounded(1e3 * report.dynamic.mean_error()),
    ])
}
