//! How well the body model describes bodies and poses that it was not trained on.

use anyhow::Result;
use modiste::Sources;
use modiste_body::scape::evaluate::{VertexError, held_out_poses, pose_errors, shape_errors};
use modiste_body::scape::train::{TrainOptions, Trained, TrainingBodies, train};
use modiste_body::{Gender, MakeHumanModel};
use modiste_core::Silent;

use super::page::{Page, rounded};
use super::plot::{Series, lines};
use super::population;

/// Held-out bodies that the error is taken over.
const HELD_OUT_BODIES: usize = 200;
/// Most coefficients that are tried.
const MOST_COEFFICIENTS: usize = 60;
/// Coefficients of the shipped models, and the error (mm) that they may have.
const COEFFICIENTS: usize = 20;
const ERROR_LIMIT: f64 = 4.0;
/// Poses that Q was not learned from.
const POSES: usize = 20;

pub(super) fn measure() -> Result<Page> {
    let mut page = Page::new("Body model (SCAPE)");
    page.paragraph(
        "The shape of held-out bodies in the template pose, rebuilt from the first coefficients β; and the mean body in \
         poses that Q was not learned from, against the skinned body that Q was learned from.",
    );
    let files = modiste_io::makehuman::open(Sources::default().makehuman()?)?;
    let mut curves = Vec::new();
    for gender in Gender::ALL {
        let people = population::read(gender)?;
        let model = MakeHumanModel::new(&files, gender)?;
        let bodies = TrainingBodies::from_population(&people, &model, false);
        let held_out = TrainingBodies::from_population(&people, &model, true).first(HELD_OUT_BODIES);
        let shape_count = MOST_COEFFICIENTS.min(bodies.vertices.len() - 1);
        let wide = train(&bodies, &TrainOptions { shape_count, ..TrainOptions::default() }, &Silent)?;
        let errors = shape_errors(&wide.model, &wide.shape_space, &held_out.vertices)?;
        let points = errors.iter().zip(1..).map(|(error, count)| (f64::from(count), error.mean)).collect();
        curves.push(Series::new(gender.name(), points));
        shape_table(&mut page, gender, held_out.vertices.len(), &errors);
        let what = format!("{}: mean vertex error at {COEFFICIENTS} coefficients", gender.name());
        page.at_most(&what, errors[COEFFICIENTS.min(errors.len()) - 1].mean, ERROR_LIMIT, "mm");
        let what = format!("{}: held-out bodies", gender.name());
        page.at_least(&what, held_out.vertices.len() as f64, HELD_OUT_BODIES as f64, "");
        page.figures(&format!("{}_mean_error_mm", gender.name()), &errors.iter().map(|e| e.mean).collect::<Vec<_>>())?;
        pose_table(&mut page, &bodies, &wide)?;
    }
    let svg = lines(["coefficients", "mean vertex error (mm)"], &curves, Some(ERROR_LIMIT))?;
    page.plot("scape-coefficients", "Error of held-out bodies against the number of coefficients", svg);
    Ok(page)
}

fn shape_table(page: &mut Page, gender: Gender, bodies: usize, errors: &[VertexError]) {
    page.paragraph(format!("### {}: {bodies} held-out bodies", gender.name()));
    let rows = [1, 2, 5, 10, 15, 20, 30, 40, 60].into_iter().filter(|&count| count <= errors.len()).map(|count| {
        let error = errors[count - 1];
        [count.to_string(), rounded(error.mean), rounded(error.p95), rounded(error.largest)]
    });
    page.table(&["coefficients", "mean (mm)", "95% (mm)", "largest (mm)"], rows);
}

/// Our model beside plain SCAPE and what each of its parts gives.
fn pose_table(page: &mut Page, bodies: &TrainingBodies, wide: &Trained) -> Result<()> {
    let poses = held_out_poses(wide.skin.joints(), POSES);
    let row = |name: &str, trained: &Trained| -> Result<[String; 3]> {
        let errors = pose_errors(&trained.model, &trained.skin, &poses)?;
        let mean = errors.iter().map(|error| error.mean).sum::<f64>() / errors.len().max(1) as f64;
        let largest = errors.iter().map(|error| error.largest).fold(0.0, f64::max);
        Ok([name.to_owned(), rounded(mean), rounded(largest)])
    };
    let mut rows = vec![row("blended R, Q", wide)?];
    let few = TrainOptions { shape_count: 2, ..TrainOptions::default() };
    for (name, blend_rotations, learn_pose_deformation) in
        [("rigid R, Q (plain SCAPE)", false, true), ("blended R alone", true, false), ("rigid R alone", false, false)]
    {
        let options = TrainOptions { blend_rotations, learn_pose_deformation, ..few.clone() };
        rows.push(row(name, &train(&bodies.first(3), &options, &Silent)?)?);
    }
    page.table(&["pose model", "mean (mm)", "largest (mm)"], rows);
    Ok(())
}
