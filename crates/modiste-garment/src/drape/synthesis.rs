//! The garment on one body, frame after frame (DRAPE eq. 7).

use std::sync::Arc;

use modiste_body::{Part, Pose};
use modiste_core::{Mat3, Vec3};

use super::basis::BasisScratch;
use super::dynamics::DynamicsState;
use super::model::DrapeModel;
use crate::GarmentError;
use crate::refine::anchors::translation;

/// Which wrinkles are put on the garment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Wrinkles {
    /// From pose and past frames.
    #[default]
    Dynamic,
    /// From the pose alone: the model of order zero.
    Static,
}

/// Makes the garment for one body shape. Holds what is constant for the body, the state of the dynamics, and all memory
/// that a frame needs.
#[derive(Debug, Clone)]
pub struct Synthesis {
    model: Arc<DrapeModel>,
    kind: Wrinkles,
    /// D of each face, to vectors in its tangent frame.
    shape_deformations: Vec<Mat3>,
    /// How far (m) the anchors lie from those of the body in the template pose, seen from the part that they follow.
    offset: Vec3,
    anchor_part: Part,
    state: DynamicsState,
    wrinkles: Vec<f32>,
    scratch: BasisScratch,
    gradients: Vec<Mat3>,
    vertices: Vec<Vec3>,
}

impl Synthesis {
    /// Fits the garment to a body of shape `shape` (β in standard deviations) and `body_vertex_count` vertices.
    ///
    /// # Errors
    /// A shape that is not finite, or a body with fewer vertices than the anchors name.
    pub fn new(model: Arc<DrapeModel>, shape: &[f64], body_vertex_count: usize) -> Result<Self, GarmentError> {
        if let Some(at) = shape.iter().position(|value| !value.is_finite()) {
            return Err(GarmentError::data(format!("β[{at}]"), "a finite number", shape[at]));
        }
        let largest = model.garment.largest_body_vertex() as usize;
        if largest >= body_vertex_count {
            let wanted = format!("more than {largest} vertices, for the anchors of {}", model.garment.name);
            return Err(GarmentError::data("body", wanted, body_vertex_count));
        }
        let mut shape_deformations = model.shape.gradients(&model.shape.predict(shape, model.ease));
        model.wrinkle.frames.clone().into_tangents(&mut shape_deformations);
        Ok(Self {
            kind: Wrinkles::default(),
            offset: model.shape.predict_offset(shape, model.ease),
            anchor_part: model.garment.anchor_part(),
            state: model.dynamics.start(),
            wrinkles: vec![0.0; model.wrinkle.mean.len()],
            scratch: BasisScratch::default(),
            gradients: vec![Mat3::IDENTITY; shape_deformations.len()],
            vertices: vec![Vec3::ZERO; model.garment.template.len()],
            shape_deformations,
            model,
        })
    }

    /// Chooses the wrinkles.
    #[must_use]
    pub fn with_wrinkles(mut self, kind: Wrinkles) -> Self {
        self.kind = kind;
        self
    }

    /// The model.
    pub fn model(&self) -> &Arc<DrapeModel> {
        &self.model
    }

    /// Forgets the past: the next frame is the first.
    pub fn restart(&mut self) {
        self.state = self.model.dynamics.start();
    }

    /// The garment's vertices (m, world) in the next frame; `body` are the vertices of the posed body. Frames follow each
    /// other at the rate of the model. Nothing is allocated.
    pub fn step(&mut self, pose: &Pose, body: &[Vec3]) -> &[Vec3] {
        let model = &self.model;
        let coefficients = match self.kind {
            Wrinkles::Dynamic => model.dynamics.step(&mut self.state, pose),
            Wrinkles::Static => model.dynamics.step_static(&mut self.state, pose),
        };
        model.wrinkle.expand(coefficients, &mut self.scratch, &mut self.wrinkles);
        let drift = model.drift.of(coefficients);
        self.finish(pose, body, drift)
    }

    /// The garment with given wrinkles.
    fn build(&mut self, pose: &Pose, body: &[Vec3], coefficients: &[f64]) -> &[Vec3] {
        self.model.wrinkle.expand(coefficients, &mut self.scratch, &mut self.wrinkles);
        let drift = self.model.drift.of(coefficients);
        self.finish(pose, body, drift)
    }

    /// The vertices, from the expanded wrinkles and the way that the anchors go with them.
    fn finish(&mut self, pose: &Pose, body: &[Vec3], drift: Vec3) -> &[Vec3] {
        let model = &self.model;
        model.wrinkle.compose(pose, &self.shape_deformations, &self.wrinkles, &mut self.gradients);
        model.reconstruction.reconstruct(&self.gradients, &mut self.vertices);
        let offset = pose.world_rotations()[self.anchor_part.index()] * (self.offset + drift);
        let shift = translation(&model.garment.anchors, &self.vertices, body) + offset;
        for vertex in &mut self.vertices {
            *vertex += shift;
        }
        &self.vertices
    }

    /// The vertices of the last frame (m, world).
    pub fn vertices(&self) -> &[Vec3] {
        &self.vertices
    }
}

/// Puts the wrinkles of given meshes on the mean body's garment: the best that the learned space can show.
#[derive(Debug, Clone)]
pub struct Projection {
    synthesis: Synthesis,
    basis: Vec<f32>,
}

impl Projection {
    /// For the mean body, on which wrinkles are learned.
    pub fn new(model: Arc<DrapeModel>) -> Self {
        let mut shape_deformations = vec![Mat3::IDENTITY; model.garment.topology.face_count()];
        model.wrinkle.frames.clone().into_tangents(&mut shape_deformations);
        let basis = model.wrinkle.basis.to_f32();
        let synthesis = Synthesis {
            kind: Wrinkles::default(),
            offset: model.shape.predict_offset(&[], 0.0),
            anchor_part: model.garment.anchor_part(),
            state: model.dynamics.start(),
            wrinkles: vec![0.0; model.wrinkle.mean.len()],
            scratch: BasisScratch::default(),
            gradients: shape_deformations.clone(),
            vertices: vec![Vec3::ZERO; model.garment.template.len()],
            shape_deformations,
            model,
        };
        Self { synthesis, basis }
    }

    /// The garment with the wrinkles that `truth` (m) has in this pose, as far as they lie in the learned space.
    pub fn project(&mut self, pose: &Pose, body: &[Vec3], truth: &[Vec3]) -> &[Vec3] {
        let wrinkle = &self.synthesis.model.wrinkle;
        let flat = wrinkle.row_of(&self.synthesis.model.garment, pose, truth);
        let rows = self.basis.chunks_exact(flat.len().max(1));
        let along = |row: &[f32]| {
            let numbers = row.iter().zip(&flat).zip(&wrinkle.mean);
            numbers.map(|((b, q), mean)| f64::from(*b) * (f64::from(*q) - f64::from(*mean))).sum::<f64>()
        };
        let coefficients: Vec<f64> = rows.map(along).collect();
        self.synthesis.build(pose, body, &coefficients)
    }
}
