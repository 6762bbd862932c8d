//! A population of bodies in one topology and pose, solved to measure as real people do.
//!
//! The bodies are artist-made morphs (MakeHuman) with soft directions learned from scans (Momentum Human Rig),
//! calibrated to the measurements of real people (ANSUR II); they are not scans.

mod file;
mod make;
mod quality;
mod solve;
mod space;
mod statistics;
mod subject;
mod untangle;

use modiste_core::{Progress, SolveError, seeded_rng};

use crate::makehuman::BODY_VERTEX_COUNT;
use crate::{Gender, MeasureTemplate, Measurements, Part};

pub use file::{PopulationError, read, write};
pub use make::{PopulationReport, PopulationSources, make, soft_directions};
pub use quality::{MeshQuality, mesh_quality};
pub use solve::{SolvedBody, solve_subject};
pub use space::{BodySpace, SoftDirections, Unknown};
pub use statistics::{PopulationStatistics, QuantityStatistics, TwinResidual, statistics};
pub use subject::{ANSUR_QUANTITIES, AnsurQuantity, AnsurStatistics, Subject, SubjectError, ansur_subjects, choose};
pub use untangle::untangle;

/// How a population is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PopulationOptions {
    /// How many subjects, where a file or the committed figures are chosen from.
    pub count: usize,
    /// Seed of the random persons and of the held-out choice.
    pub seed: u64,
    /// Share of subjects that no model may be trained on.
    pub held_out_share: f64,
}

impl Default for PopulationOptions {
    fn default() -> Self {
        Self { count: 1000, seed: 2012, held_out_share: 0.2 }
    }
}

/// One solved person.
#[derive(Debug, Clone, PartialEq)]
pub struct Person {
    /// Number of the subject.
    pub subject: u32,
    /// Whether no model may be trained on this person.
    pub held_out: bool,
    /// What the body was solved for, in the order of [`ANSUR_QUANTITIES`] (m, kg).
    pub targets: [f64; ANSUR_QUANTITIES.len()],
    /// What the body measures.
    pub achieved: Measurements,
    /// Values of the unknowns: [`BodySpace::unknowns`].
    pub parameters: Vec<f64>,
    /// Body vertices (m) in the template pose, feet on `y = 0`, pelvis joint at `x = z = 0`.
    pub vertices: Vec<[f32; 3]>,
    /// Proximal joint of each part (m).
    pub joints: [[f32; 3]; Part::COUNT],
    /// Root mean square distance of corresponding points of the body and its twin without soft directions (m).
    pub twin_distance: f64,
    /// What that twin measures.
    pub twin_achieved: Measurements,
    /// Values of the twin's unknowns.
    pub twin_parameters: Vec<f64>,
}

/// All persons of one gender.
#[derive(Debug, Clone, PartialEq)]
pub struct Population {
    /// Whose bodies.
    pub gender: Gender,
    /// Seed of the run.
    pub seed: u64,
    /// Names of the unknowns.
    pub parameter_names: Vec<String>,
    /// The persons, in the order of the subjects.
    pub persons: Vec<Person>,
}

/// Solves a body for each subject, and its twin without soft directions, on all cores.
///
/// # Errors
/// When a least-squares problem cannot be solved.
pub fn solve(
    space: &BodySpace<'_>,
    template: &MeasureTemplate,
    subjects: &[Subject],
    options: &PopulationOptions,
    progress: &dyn Progress,
) -> Result<Population, SolveError> {
    let held = subject::held_out(subjects.len(), options.held_out_share, options.seed);
    let stage = format!("population {}", space.gender().name());
    progress.start(&stage, subjects.len());
    let done = std::sync::atomic::AtomicUsize::new(0);
    let persons = make::solve_batch(space, template, (subjects, &held), options.seed, &|| {
        progress.advance(&stage, 1 + done.fetch_add(1, std::sync::atomic::Ordering::Relaxed));
    })?;
    progress.finish(&stage);
    let parameter_names = space.unknowns().iter().map(|unknown| unknown.name.clone()).collect();
    Ok(Population { gender: space.gender(), seed: options.seed, parameter_names, persons })
}

fn solve_person(
    [space, twin_space]: [&BodySpace<'_>; 2],
    template: &MeasureTemplate,
    subject: &Subject,
    held_out: bool,
    seed: u64,
) -> Result<Person, SolveError> {
    // One stream per subject: a person does not depend on who else is solved.
    let mut rng = seeded_rng(seed ^ (u64::from(subject.id) << 20));
    let start = space.draw_person(subject.age, &mut rng);
    let body = solve_subject(space, template, subject, &start)?;
    let count = twin_space.unknowns().len();
    // Without soft directions a body is its own twin.
    let twin = if count == start.len() {
        body.clone()
    } else {
        solve_subject(twin_space, template, subject, &start[..count])?
    };
    let squared: f64 = body.points.iter().zip(&twin.points).map(|(a, b)| a.distance_squared(*b)).sum();
    let single: Vec<[f32; 3]> = body.points.iter().map(|p| p.as_vec3().to_array()).collect();
    let mut joints = [[0.0; 3]; Part::COUNT];
    joints.copy_from_slice(&single[BODY_VERTEX_COUNT..]);
    Ok(Person {
        subject: subject.id,
        held_out,
        targets: subject.measurements,
        achieved: body.measurements,
        parameters: body.values,
        vertices: single[..BODY_VERTEX_COUNT].to_vec(),
        joints,
        twin_distance: (squared / body.points.len() as f64).sqrt(),
        twin_achieved: twin.measurements,
        twin_parameters: twin.values,
    })
}
