//! One dressed character, frame after frame: what a game or a viewer runs.

use std::sync::Arc;
use std::time::Duration;

use modiste_body::{Body, Pose, PoseScratch};
use modiste_core::Vec3;
use modiste_garment::refine::FitOptions;
use modiste_garment::{DrapeModel, FrameReport, GarmentFlags, Outfit};

use crate::{Person, SceneError, Stage};

/// A person in motion. Everything that is constant is made once; [`step`](Self::step) goes from a pose to the vertices of
/// body and garments.
///
/// Models are shared by `Arc`: a further character costs its own state only. Frames must come at the rate of the garments
/// ([`Person::fps`]).
#[derive(Debug, Clone)]
pub struct Dresser {
    body: Body,
    outfit: Outfit,
    vertices: Vec<Vec3>,
    posing: PoseScratch,
    times: [Duration; Stage::COUNT],
}

impl Dresser {
    /// Prepares a person to move.
    ///
    /// # Errors
    /// A garment that does not go with the body.
    pub fn new(person: &Person, options: &FitOptions) -> Result<Self, SceneError> {
        let outfit = Outfit::new(person.body(), person.garments(), options)?;
        let vertices = person.body().rest_vertices().to_vec();
        let times = [Duration::ZERO; Stage::COUNT];
        Ok(Self { body: person.body().clone(), outfit, vertices, posing: PoseScratch::default(), times })
    }

    /// The next frame.
    pub fn step(&mut self, pose: &Pose) -> &FrameReport {
        let Self { body, outfit, vertices, posing, times } = self;
        let report = outfit.step_with(pose, || {
            body.pose_with(pose, posing, vertices);
            &*vertices
        });
        let fit = report.seconds() - report.body_seconds - report.prepare_seconds;
        *times = [report.body_seconds, report.prepare_seconds, fit].map(|time| Duration::from_secs_f64(time.max(0.0)));
        report
    }

    /// Forgets the past: the next frame is the first.
    pub fn restart(&mut self) {
        self.outfit.restart();
    }

    /// Vertices of the body in the last frame (m, world).
    pub fn body_vertices(&self) -> &[Vec3] {
        &self.vertices
    }

    /// Number of garments.
    pub fn garment_count(&self) -> usize {
        self.outfit.count()
    }

    /// The model of a garment, counted from the inside.
    pub fn garment(&self, layer: usize) -> &Arc<DrapeModel> {
        self.outfit.model(layer)
    }

    /// Vertices of a garment in the last frame (m, world), counted from the inside.
    pub fn vertices(&self, layer: usize) -> &[Vec3] {
        self.outfit.vertices(layer)
    }

    /// Vertices of a garment in the last frame as they were predicted, before the fit (m, world).
    pub fn predicted(&self, layer: usize) -> &[Vec3] {
        self.outfit.predicted(layer)
    }

    /// What could not be done for a garment in the last frame, counted from the inside.
    pub fn flags(&self, layer: usize) -> GarmentFlags {
        self.outfit.report().layers[layer].flags()
    }

    /// What the last frame took, by [`Stage`]. On more than one thread garments are made while the body is posed; then
    /// [`Stage::Synthesis`] is what is left to wait for when it is.
    pub fn times(&self) -> [Duration; Stage::COUNT] {
        self.times
    }
}
