//! How well the shape of a garment follows from that of a body (DRAPE fig. 13).

use anyhow::Result;
use modiste_garment::TrainingSet;
use modiste_garment::drape::{Placement, ShapeOptions, leave_one_out};

use super::page::{Page, rounded};
use super::plot::{Series, lines};
use crate::assets::{training_folder, training_sets};

/// Numbers of body coefficients that are tried.
const BODY_COUNTS: [usize; 10] = [1, 2, 4, 6, 8, 10, 12, 15, 18, 20];
/// Error (mm) that is allowed at 20 coefficients.
const ERROR_LIMIT: f64 = 10.0;
/// Bodies that a garment must have been draped over.
const BODIES: f64 = 60.0;

pub(super) fn measure() -> Result<Page> {
    let mut page = Page::new("Clothing shape");
    page.paragraph(
        "Each of the bodies is left out in turn: the garment is learned from the others, predicted for the body that was \
         left out and put in place by its anchors, whose offset from the body is learned too; mean distance from the simulated garment.",
    );
    let mut curves = Vec::new();
    let mut rows = Vec::new();
    let (sets, missing) = training_sets();
    if !missing.is_empty() {
        page.paragraph(format!("Without a training set on this machine: {}.", missing.join(", ")));
    }
    for (gender, garment) in sets {
        let set = TrainingSet::load_sequences(training_folder(gender, garment), |_| false)?;
        let found = leave_one_out(&set, &ShapeOptions::default(), &BODY_COUNTS, Placement::Anchors)?;
        let name = format!("{} {garment}", gender.name());
        let points = found.body_counts.iter().zip(&found.mean_error).map(|(&k, &error)| (k as f64, 1e3 * error));
        curves.push(Series::new(&name, points.collect()));
        let last = found.mean_error.len() - 1;
        page.at_most(&format!("{name}: error at 20 coefficients"), 1e3 * found.mean_error[last], ERROR_LIMIT, "mm");
        page.at_least(&format!("{name}: bodies"), set.shapes.len() as f64, BODIES, "");
        rows.push([
            name.clone(),
            rounded(1e3 * found.mean_error[last]),
            rounded(1e3 * found.worst_error[last]),
            rounded(1e3 * found.projection_error),
            rounded(1e3 * found.mean_garment_error),
        ]);
        page.figures(&name, &found)?;
    }
    page.table(&["garment", "mean (mm)", "worst body (mm)", "if φ were known (mm)", "mean garment (mm)"], rows);
    let svg = lines(["body coefficients", "mean distance (mm)"], &curves, Some(ERROR_LIMIT))?;
    page.plot("garment-shape", "Error of the garment against the number of body coefficients", svg);
    Ok(page)
}
