//! The garment on one body, frame after frame (DRAPE eq. 7).

use std::sync::Arc;

use modiste_body::{Part, Pose};
use modiste_core::{GradientReconstruction, Mat3, Vec3};

use super::basis::BasisScratch;
use super::coarse::{CoarseModel, MotionState};
use super::dynamics::DynamicsState;
use super::model::DrapeModel;
use super::shape::ShapeModel;
use super::training_set::Garment;
use super::wrinkle::WrinkleModel;
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

/// What of the garment is constant for one body.
#[derive(Debug, Clone)]
pub(crate) struct Fitting {
    /// D of each face, to vectors in its tangent frame.
    shape_deformations: Vec<Mat3>,
    /// How far (m) the anchors lie from those of the body in the template pose, seen from the part that they follow.
    offset: Vec3,
    anchor_part: Part,
}

impl Fitting {
    /// For a body of this shape, and this ease.
    pub(crate) fn new(
        garment: &Garment,
        shape: &ShapeModel,
        wrinkle: &WrinkleModel,
        (body, ease): (&[f64], f64),
    ) -> Self {
        let mut shape_deformations = shape.gradients(&shape.predict(body, ease));
        wrinkle.frames.clone().into_tangents(&mut shape_deformations);
        Self { shape_deformations, offset: shape.predict_offset(body, ease), anchor_part: garment.anchor_part() }
    }

    /// Moves a garment to its place, from the way to the anchors of the body.
    fn place(&self, pose: &Pose, to_anchors: Vec3, vertices: &mut [Vec3]) {
        let shift = to_anchors + pose.world_rotations()[self.anchor_part.index()] * self.offset;
        vertices.iter_mut().for_each(|vertex| *vertex += shift);
    }

    /// Writes the vertices (m, world) of the garment with mean wrinkles, which the coarse deformation starts from.
    /// `to_anchors` is the way from the anchors of a garment to those of the body, `gradients` is written over.
    pub(crate) fn write_reference(
        &self,
        (wrinkle, reconstruction): (&WrinkleModel, &GradientReconstruction),
        (pose, to_anchors): (&Pose, &dyn Fn(&[Vec3]) -> Vec3),
        gradients: &mut [Mat3],
        out: &mut [Vec3],
    ) {
        self.compose(wrinkle, (pose, &wrinkle.mean), gradients);
        reconstruction.reconstruct(gradients, out);
        self.place(pose, to_anchors(out), out);
    }

    /// Writes the composed gradients of all faces with these wrinkles, a flat row.
    pub(crate) fn compose(&self, wrinkle: &WrinkleModel, (pose, wrinkles): (&Pose, &[f32]), gradients: &mut [Mat3]) {
        wrinkle.compose(pose, &self.shape_deformations, wrinkles, gradients);
    }
}

/// Makes the garment for one body shape. Holds what is constant for the body, the state of the dynamics, and all memory
/// that a frame needs.
#[derive(Debug, Clone)]
pub struct Synthesis {
    model: Arc<DrapeModel>,
    kind: Wrinkles,
    is_plain: bool,
    fitting: Fitting,
    state: DynamicsState,
    wrinkles: Vec<f32>,
    scratch: BasisScratch,
    gradients: Vec<Mat3>,
    vertices: Vec<Vec3>,
    course: Option<Course>,
}

/// The state of the coarse deformation, and its memory.
#[derive(Debug, Clone)]
struct Course {
    state: MotionState,
    inputs: Vec<f64>,
    coefficients: Vec<f64>,
    scratch: Vec<f32>,
    places: Vec<Vec3>,
}

impl Course {
    fn new(coarse: &CoarseModel, vertex_count: usize) -> Self {
        Self {
            state: coarse.learned.inputs.start(),
            inputs: vec![0.0; coarse.learned.inputs.count()],
            coefficients: vec![0.0; coarse.count()],
            scratch: Vec::new(),
            places: vec![Vec3::ZERO; vertex_count],
        }
    }

    /// Foretells κ of the next frame.
    fn step(&mut self, coarse: &CoarseModel, kind: Wrinkles, pose: &Pose) {
        coarse.learned.inputs.step(&mut self.state, pose, &mut self.inputs);
        match kind {
            Wrinkles::Dynamic => coarse.learned.dynamic.predict(&self.inputs, &mut self.coefficients),
            Wrinkles::Static => {
                coarse
                    .learned
                    .fixed
                    .predict(&self.inputs[..coarse.learned.inputs.pose_count()], &mut self.coefficients);
            }
        }
    }
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
        let fitting = Fitting::new(&model.garment, &model.shape, &model.wrinkle, (shape, model.ease));
        let vertex_count = model.garment.template.len();
        Ok(Self {
            kind: Wrinkles::default(),
            is_plain: false,
            state: model.dynamics.start(),
            wrinkles: vec![0.0; model.wrinkle.mean.len()],
            scratch: BasisScratch::default(),
            gradients: vec![Mat3::IDENTITY; fitting.shape_deformations.len()],
            vertices: vec![Vec3::ZERO; vertex_count],
            course: model.coarse.as_ref().map(|coarse| Course::new(coarse, vertex_count)),
            fitting,
            model,
        })
    }

    /// Chooses the wrinkles.
    #[must_use]
    pub fn with_wrinkles(mut self, kind: Wrinkles) -> Self {
        self.kind = kind;
        self
    }

    /// The paper's model alone: gradients placed by the anchors, without the coarse deformation.
    #[must_use]
    pub fn plain(mut self) -> Self {
        self.is_plain = true;
        self
    }

    /// The model.
    pub fn model(&self) -> &Arc<DrapeModel> {
        &self.model
    }

    /// Forgets the past: the next frame is the first.
    pub fn restart(&mut self) {
        self.state = self.model.dynamics.start();
        if let (Some(course), Some(coarse)) = (&mut self.course, &self.model.coarse) {
            course.state = coarse.learned.inputs.start();
        }
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
        if let (Some(course), Some(coarse)) = (&mut self.course, &model.coarse) {
            course.step(coarse, self.kind, pose);
        }
        self.finish(pose, body)
    }

    /// The vertices, from the expanded wrinkles and κ.
    fn finish(&mut self, pose: &Pose, body: &[Vec3]) -> &[Vec3] {
        let Self { model, fitting, gradients, vertices, .. } = self;
        let to_anchors = |x: &[Vec3]| translation(&model.garment.anchors, x, body);
        match (&mut self.course, &model.coarse) {
            (Some(course), Some(coarse)) if !self.is_plain => {
                fitting.write_reference(
                    (&model.wrinkle, &model.reconstruction),
                    (pose, &to_anchors),
                    gradients,
                    &mut course.places,
                );
                coarse.displace(pose, &course.coefficients, &mut course.scratch, &mut course.places);
                fitting.compose(&model.wrinkle, (pose, &self.wrinkles), gradients);
                coarse.reconstruct(gradients, &course.places, vertices);
            }
            _ => {
                fitting.compose(&model.wrinkle, (pose, &self.wrinkles), gradients);
                model.reconstruction.reconstruct(gradients, vertices);
                let way = to_anchors(vertices);
                fitting.place(pose, way, vertices);
            }
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
    /// For the mean body, on which wrinkles are learned, and its number of vertices.
    ///
    /// # Errors
    /// As [`Synthesis::new`].
    pub fn new(model: Arc<DrapeModel>, body_vertex_count: usize) -> Result<Self, GarmentError> {
        let basis = model.wrinkle.basis.to_f32();
        let mut synthesis = Synthesis::new(model, &[], body_vertex_count)?;
        // Wrinkles are gradients from the template itself.
        let count = synthesis.fitting.shape_deformations.len();
        let mut unchanged = vec![Mat3::IDENTITY; count];
        synthesis.model.wrinkle.frames.clone().into_tangents(&mut unchanged);
        if synthesis.model.coarse.is_none() {
            synthesis.fitting.shape_deformations = unchanged;
        }
        Ok(Self { synthesis, basis })
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
        let Synthesis { model, fitting, course, gradients, wrinkles, scratch, .. } = &mut self.synthesis;
        model.wrinkle.expand(&coefficients, scratch, wrinkles);
        if let (Some(course), Some(coarse)) = (course, &model.coarse) {
            let to_anchors = |x: &[Vec3]| translation(&model.garment.anchors, x, body);
            let learned = (&model.wrinkle, &model.reconstruction);
            fitting.write_reference(learned, (pose, &to_anchors), gradients, &mut course.places);
            course.coefficients = coarse.coefficients_of(pose, &course.places, truth);
        }
        self.synthesis.finish(pose, body)
    }
}
