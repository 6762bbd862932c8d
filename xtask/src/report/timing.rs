//! What a frame takes.

use anyhow::{Context, Result};
use modiste_core::Silent;
use modiste_garment::refine::FitOptions;
use modiste_scene::{Machine, Stage, Summary};

use super::page::{Page, rounded};
use super::trials::trials;

/// Frames at the start that are left out.
const WARM_UP: usize = 10;

pub(super) fn measure() -> Result<Page> {
    let mut page = Page::new("Time per frame");
    let mut all = trials(&Silent)?;
    anyhow::ensure!(!all.is_empty(), "there is no trial");
    let trial = all.swap_remove(0);
    let animation = trial.person.animate(&trial.motion, &FitOptions::default(), &Silent)?;
    let sizes: Vec<String> = animation
        .tracks
        .iter()
        .map(|track| {
            format!(
                "{} {} vertices, {} triangles",
                track.name,
                track.topology.vertex_count(),
                track.topology.face_count()
            )
        })
        .collect();
    let machine = Machine::this();
    page.paragraph(format!(
        "One character, {} frames after a warm-up of {WARM_UP}, on {} ({} threads). {}.",
        animation.frame_count() - WARM_UP,
        machine.processor,
        machine.threads,
        sizes.join("; ")
    ));
    let mut rows = Vec::new();
    for stage in Stage::ALL {
        let summary = animation.timing.stage(stage, WARM_UP).context("the motion is too short to be timed")?;
        rows.push(row(stage.name(), &summary));
        page.figures(stage.name(), &summary)?;
    }
    let total = animation.timing.total(WARM_UP).context("the motion is too short to be timed")?;
    rows.push(row("total", &total));
    page.figures("total", &total)?;
    page.table(&["stage", "median (ms)", "95% (ms)"], rows);
    Ok(page)
}

fn row(name: &str, summary: &Summary) -> [String; 3] {
    [name.to_owned(), rounded(summary.median), rounded(summary.p95)]
}
