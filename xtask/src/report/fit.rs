//! Whether garments stay outside the body.

use anyhow::Result;
use modiste_core::Silent;
use modiste_garment::refine::Penetration;
use modiste_garment::report::wear;

use super::page::{Page, rounded};
use super::trials::trials;

/// Depth (mm) that no vertex may have after the fit.
const DEPTH_LIMIT: f64 = 0.5;
const TRIALS: f64 = 12.0;
/// Penetration is measured in every frame of this many.
const STRIDE: usize = 2;

pub(super) fn measure() -> Result<Page> {
    let mut page = Page::new("Fit");
    page.paragraph(
        "Vertices of the garments inside the body's surface (winding number above one half) per frame, and the depth of \
         the deepest in mm: as synthesised, after the paper's three iterations alone, and after our fit. Motions and \
         bodies were not trained on.",
    );
    let mut rows = Vec::new();
    let (mut deepest, mut paper_deepest, mut count) = (0.0f64, 0.0f64, 0);
    let mut reports = Vec::new();
    for trial in trials(&Silent)? {
        let report = wear(&trial.name, trial.person.body(), trial.person.garments(), &trial.motion, STRIDE)?;
        for layer in &report.layers {
            let cell = |found: &Penetration| {
                let per_frame = found.count as f64 / report.measured_frames.max(1) as f64;
                format!("{} / {}", rounded(per_frame), rounded(1e3 * found.worst_depth))
            };
            deepest = deepest.max(1e3 * layer.fitted.worst_depth);
            paper_deepest = paper_deepest.max(1e3 * layer.paper.worst_depth);
            rows.push([
                trial.name.clone(),
                layer.garment.clone(),
                cell(&layer.predicted),
                cell(&layer.paper),
                cell(&layer.fitted),
                report.self_crossing_frames.to_string(),
            ]);
        }
        reports.push(report);
        count += 1;
    }
    page.table(
        &[
            "trial",
            "garment",
            "synthesised",
            "paper's iterations",
            "our fit",
            "frames in which the body crosses itself",
        ],
        rows,
    );
    page.at_most("deepest vertex after the fit", deepest, DEPTH_LIMIT, "mm");
    page.at_least("pairs of motion and body", f64::from(count), TRIALS, "");
    page.paragraph(format!(
        "After the paper's iterations alone the deepest vertex lies {} mm deep.",
        rounded(paper_deepest)
    ));
    page.figures("trials", &reports)?;
    Ok(page)
}
