//! What every learned garment is worth on bodies and motions that it was not learned from.

use anyhow::{Result, bail};
use modiste::{EvaluatedGarment, Event, GarmentEvaluate, Gender, Job, Outcome, Sources, run};
use modiste_cloth::pattern;
use serde::{Deserialize, Serialize};

use super::page::{Page, rounded};
use crate::assets::{body_file, garment_file, training_folder};
use crate::shell::workspace_root;

/// Where what was found of each garment is kept, until its model is another.
const FOLDER: &str = "training/evaluations";
/// Bodies beside the mean one that garments are tried on.
const OTHER_BODIES: usize = 4;
/// Error (mm) of the garment's shape on bodies left out, at 20 coefficients.
const SHAPE_LIMIT: f64 = 8.0;
/// Where the mean curvature should be as a share of that of physics.
const CURVATURE: [f64; 2] = [0.85, 1.1];

/// Mean distance (mm) from physics that is allowed on the mean body and on others. For tops and trousers they are what
/// TailorNet (Patel et al. 2020, table 1) reports and less; skirts swing.
fn error_limits(garment: &str) -> [f64; 2] {
    match garment {
        "shorts" | "pants" => [5.0, 8.0],
        "skirt" => [12.0, 18.0],
        _ => [8.0, 11.0],
    }
}

pub(super) fn measure() -> Result<Page> {
    let mut page = Page::new("Learned garments");
    page.paragraph(
        "Each garment as it is synthesised, before the fit, against physics of its pattern in the six captured motions that \
         no garment learns from (walk_12_02, kick_10_01, run_35_22, jump_01_01, squat_14_14c, stretcharms_02_06), on the mean \
         body and on four others drawn at random. Of each simulation the longest run is compared in which nothing is inside \
         the body and the 99th percentile of the edge stretch is at most 8 %. The shape error leaves out one of the training \
         bodies at a time.",
    );
    let mut rows = Vec::new();
    for gender in Gender::ALL {
        for garment in pattern::GARMENTS.into_iter().filter(|garment| modiste_io::exists(garment_file(gender, garment)))
        {
            let found = evaluated(gender, garment)?;
            claim(&mut page, garment, &found);
            rows.push(describe(&found));
            page.figures(&found.garment, &found)?;
        }
    }
    page.table(
        &[
            "garment",
            "shape, left out (mm)",
            "mean body, dynamic (mm)",
            "static (mm)",
            "paper's model (mm)",
            "other bodies, dynamic (mm)",
            "static (mm)",
            "paper's model (mm)",
            "curvature ratio",
            "on other bodies",
            "φ",
            "ψ",
            "variance in ψ",
            "model (MB)",
            "frames",
        ],
        rows,
    );
    Ok(page)
}

/// What was found of a garment, and of which models.
#[derive(Serialize, Deserialize)]
struct Kept {
    stamp: String,
    found: EvaluatedGarment,
}

/// Evaluates a garment, or takes what was found of the same models before.
fn evaluated(gender: Gender, garment: &str) -> Result<EvaluatedGarment> {
    let (model, training) = (garment_file(gender, garment), training_folder(gender, garment));
    let mut bytes = modiste_io::read_bytes(&model)?;
    bytes.extend(modiste_io::read_bytes(body_file(gender))?);
    let stamp = modiste_io::hash(&bytes);
    let file = workspace_root().join(FOLDER).join(format!("{}-{garment}.json", gender.name()));
    if let Some(kept) = modiste_io::json::read::<Kept>(&file).ok().filter(|kept| kept.stamp == stamp) {
        return Ok(kept.found);
    }
    let job = GarmentEvaluate {
        model,
        training: modiste_io::exists(&training).then_some(training),
        bodies: OTHER_BODIES,
        sources: Sources { makehuman: None, data: workspace_root().join("../shared/data") },
    };
    let Outcome::EvaluatedGarment(found) = run(&Job::GarmentEvaluate(job), &tell)? else {
        bail!("evaluating {garment} gave something else");
    };
    modiste_io::create_folder(workspace_root().join(FOLDER))?;
    modiste_io::json::write(&file, &Kept { stamp, found: found.clone() })?;
    Ok(found)
}

/// Says what is being measured; a garment takes minutes.
fn tell(event: Event) {
    match event {
        Event::Started { stage, total } => println!("{stage}: {total} steps"),
        Event::Warning { message } => println!("warning: {message}"),
        Event::Advanced { .. } | Event::Finished { .. } | Event::Wrote { .. } => {}
    }
}

fn shape_error(found: &EvaluatedGarment) -> Option<f64> {
    Some(1e3 * found.evaluation.shape.as_ref()?.mean_error.last()?)
}

fn claim(page: &mut Page, garment: &str, found: &EvaluatedGarment) {
    let name = &found.garment;
    let [mean_limit, other_limit] = error_limits(garment);
    if let Some(error) = shape_error(found) {
        page.at_most(&format!("{name}: shape on bodies left out"), error, SHAPE_LIMIT, "mm");
    }
    page.at_most(
        &format!("{name}: mean distance from physics, mean body"),
        1e3 * found.mean_body.error,
        mean_limit,
        "mm",
    );
    let what = format!("{name}: mean distance from physics, other bodies");
    page.at_most(&what, 1e3 * found.other_bodies.error, other_limit, "mm");
    let ratio = found.mean_body.curvature_ratio;
    page.claim(
        &format!("{name}: curvature as a share of physics"),
        format!("{} to {}", CURVATURE[0], CURVATURE[1]),
        rounded(ratio),
        (CURVATURE[0]..=CURVATURE[1]).contains(&ratio),
    );
    page.at_most(&format!("{name}: spectral radius of the dynamics"), found.evaluation.spectral_radius, 1.0, "");
}

fn describe(found: &EvaluatedGarment) -> [String; 15] {
    let millimetres = |metres: f64| rounded(1e3 * metres);
    let (mean, other, all) = (found.mean_body, found.other_bodies, &found.evaluation);
    [
        found.garment.clone(),
        shape_error(found).map_or_else(|| "–".to_owned(), rounded),
        millimetres(mean.error),
        millimetres(mean.static_error),
        millimetres(mean.plain_error),
        millimetres(other.error),
        millimetres(other.static_error),
        millimetres(other.plain_error),
        rounded(mean.curvature_ratio),
        rounded(other.curvature_ratio),
        all.garment_shape_count.to_string(),
        all.wrinkle_count.to_string(),
        rounded(all.wrinkle_variance),
        rounded(found.bytes as f64 / 1e6),
        (mean.frames + other.frames).to_string(),
    ]
}
