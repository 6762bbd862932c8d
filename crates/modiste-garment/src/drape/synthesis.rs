//! The garment on one body, frame after frame (DRAPE eq. 7).

use std::sync::Arc;

use modiste_body::{Part, Pose};
use modiste_core::{EdgeSystem, GradientReconstruction, Lanes, Mat3, Vec3, corners};

use super::basis::BasisScratch;
use super::blend::Turns;
use super::coarse::{CoarseModel, MotionState};
use super::dynamics::DynamicsState;
use super::gradient::{PER_FACE, gradient_of_tangents};
use super::model::DrapeModel;
use super::shape::ShapeModel;
use super::training_set::Garment;
use super::wrinkle::WrinkleModel;
use crate::GarmentError;

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
    pub(super) shape_deformations: Vec<Mat3>,
    /// Where D takes the two edges of each face (m).
    edges: Vec<[Vec3; 2]>,
    /// Where the mean wrinkles take them from there.
    reference_edges: Vec<[Vec3; 2]>,
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
        let mut fitting = Self {
            shape_deformations,
            edges: Vec::new(),
            reference_edges: Vec::new(),
            offset: shape.predict_offset(body, ease),
            anchor_part: garment.anchor_part(),
        };
        fitting.deform_edges(garment, wrinkle);
        fitting
    }

    /// Finds where D takes the edges, and the mean wrinkles after it.
    pub(super) fn deform_edges(&mut self, garment: &Garment, wrinkle: &WrinkleModel) {
        let deform = |(face, deformation): (&[u32; 3], &Mat3)| {
            let [a, b, c] = corners(*face, &garment.template);
            [*deformation * (b - a), *deformation * (c - a)]
        };
        self.edges = garment.topology.faces().iter().zip(&self.shape_deformations).map(deform).collect();
        let faces = self.edges.iter().zip(wrinkle.mean.as_chunks::<PER_FACE>().0);
        self.reference_edges = faces
            .map(|(edges, mean)| {
                let gradient = gradient_of_tangents(mean);
                edges.map(|edge| gradient * edge)
            })
            .collect();
    }

    /// Makes the right-hand side of the garment with these wrinkles, a flat row.
    fn add_wrinkled(&self, system: &EdgeSystem, turns: &Turns<'_>, wrinkles: &[f32], right: &mut Vec<Lanes>) {
        let wrinkles = wrinkles.as_chunks::<PER_FACE>().0;
        system.start(right);
        for (face, (edges, wrinkles)) in self.edges.iter().zip(wrinkles).enumerate() {
            let (turn, gradient) = (turns.rotation(face), gradient_of_tangents(wrinkles));
            system.add_edges(face, edges.map(|edge| turn * (gradient * edge)), right);
        }
        self.add_ties(system, turns, wrinkles, right);
    }

    /// The same of the reference, with mean wrinkles.
    fn add_reference(&self, system: &EdgeSystem, turns: &Turns<'_>, mean: &[f32], right: &mut Vec<Lanes>) {
        system.start(right);
        for (face, edges) in self.reference_edges.iter().enumerate() {
            let turn = turns.rotation(face);
            system.add_edges(face, edges.map(|edge| turn * edge), right);
        }
        self.add_ties(system, turns, mean.as_chunks::<PER_FACE>().0, right);
    }

    fn add_ties(&self, system: &EdgeSystem, turns: &Turns<'_>, wrinkles: &[[f32; PER_FACE]], right: &mut [Lanes]) {
        let composed = |face: usize| {
            turns.rotation(face) * (gradient_of_tangents(&wrinkles[face]) * self.shape_deformations[face])
        };
        system.add_ties(composed, right);
    }

    /// Moves a garment to its place, from the way to the anchors of the body.
    fn place(&self, pose: &Pose, to_anchors: Vec3, vertices: &mut [Vec3]) {
        let shift = to_anchors + self.offset(pose);
        vertices.iter_mut().for_each(|vertex| *vertex += shift);
    }

    /// How far (m, world) the garment lies from the anchors of the body.
    fn offset(&self, pose: &Pose) -> Vec3 {
        pose.world_rotations()[self.anchor_part.index()] * self.offset
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
    pub(super) model: Arc<DrapeModel>,
    kind: Wrinkles,
    is_plain: bool,
    pub(super) fitting: Fitting,
    state: DynamicsState,
    /// ψ as it is shown.
    pub(super) coefficients: Vec<f64>,
    wrinkles: Vec<f32>,
    scratch: BasisScratch,
    right: Vec<Lanes>,
    vertices: Vec<Vec3>,
    /// The mean (m) of the anchors of the garment as it was made, less how far it lies from those of the body.
    from_anchors: Vec3,
    pub(super) course: Option<Course>,
}

/// The state of the coarse deformation, and its memory.
#[derive(Debug, Clone)]
pub(super) struct Course {
    state: MotionState,
    inputs: Vec<f64>,
    pub(super) coefficients: Vec<f64>,
    scratch: Vec<f32>,
    right: Vec<Lanes>,
    pub(super) places: Vec<Vec3>,
}

impl Course {
    fn new(coarse: &CoarseModel, vertex_count: usize) -> Self {
        Self {
            state: coarse.learned.inputs.start(),
            inputs: vec![0.0; coarse.learned.inputs.count()],
            coefficients: vec![0.0; coarse.count()],
            scratch: Vec::new(),
            right: Vec::new(),
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
            coefficients: Vec::new(),
            wrinkles: vec![0.0; model.wrinkle.mean.len()],
            right: Vec::new(),
            scratch: BasisScratch::default(),
            from_anchors: Vec3::ZERO,
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
        self.make(pose);
        self.place(body)
    }

    /// The first half of [`Self::step`], for which the body need not be there yet: the garment somewhere.
    pub(crate) fn make(&mut self, pose: &Pose) {
        let model = &self.model;
        let coefficients = match self.kind {
            Wrinkles::Dynamic => model.dynamics.step(&mut self.state, pose),
            Wrinkles::Static => model.dynamics.step_static(&mut self.state, pose),
        };
        self.coefficients.clear();
        self.coefficients.extend_from_slice(coefficients);
        if let (Some(course), Some(coarse)) = (&mut self.course, &model.coarse) {
            course.step(coarse, self.kind, pose);
        }
        self.finish(pose);
    }

    /// The second half of [`Self::step`]: brings the garment that was made to the body.
    pub(crate) fn place(&mut self, body: &[Vec3]) -> &[Vec3] {
        let anchors = &self.model.garment.anchors;
        let on_body = anchors.iter().map(|&[_, vertex]| body[vertex as usize]).sum::<Vec3>();
        let shift = on_body / anchors.len().max(1) as f64 - self.from_anchors;
        self.vertices.iter_mut().for_each(|vertex| *vertex += shift);
        &self.vertices
    }

    /// The vertices but for their place, from ψ and κ.
    ///
    /// [`Fitting::compose`] and the reconstructions from gradients say what is done; here no gradient is written down, and what
    /// places the garment is left for later, because a shift of all places shifts the result as much. The wrinkles and the places
    /// of the coarse deformation are found side by side.
    pub(crate) fn finish(&mut self, pose: &Pose) {
        let Self { model, fitting, coefficients, wrinkles, scratch, right, vertices, .. } = self;
        let turns = Turns::new(&model.wrinkle.blend, pose);
        let whole = &model.reconstruction;
        let anchors = &model.garment.anchors;
        let from_anchors = |x: &[Vec3]| {
            let sum = anchors.iter().map(|&[vertex, _]| x[vertex as usize]).sum::<Vec3>();
            sum / anchors.len().max(1) as f64 - fitting.offset(pose)
        };
        let mut wrinkle = |system: &EdgeSystem, right: &mut Vec<Lanes>| {
            model.wrinkle.expand(coefficients, scratch, wrinkles);
            fitting.add_wrinkled(system, &turns, wrinkles, right);
        };
        match (&mut self.course, &model.coarse) {
            (Some(course), Some(coarse)) if !self.is_plain => {
                let screened = coarse.reconstruction();
                let lay_out = || {
                    let Course { coefficients, scratch, right, places, .. } = &mut *course;
                    fitting.add_reference(whole.system(), &turns, &model.wrinkle.mean, right);
                    whole.solve(right, places);
                    let from = from_anchors(places);
                    coarse.displace(pose, coefficients, scratch, places);
                    from
                };
                let (from, ()) = rayon::join(lay_out, || wrinkle(screened.system(), right));
                self.from_anchors = from;
                screened.solve(&course.places, right, vertices);
            }
            _ => {
                wrinkle(whole.system(), right);
                whole.solve(right, vertices);
                self.from_anchors = from_anchors(vertices);
            }
        }
    }

    /// The vertices of the last frame (m, world).
    pub fn vertices(&self) -> &[Vec3] {
        &self.vertices
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use modiste_core::{Mat3, Silent, Vec3};

    use super::Synthesis;
    use crate::DrapeModel;
    use crate::drape::synthetic::{anchor_body, motion, training_set};
    use crate::drape::{DynamicsOptions, TrainOptions, WrinkleOptions};
    use crate::refine::anchors::translation;

    #[test]
    fn without_gradients_in_between_the_garment_is_the_same() {
        let options = TrainOptions {
            wrinkle: WrinkleOptions { min_count: 4, max_count: 8, ..WrinkleOptions::default() },
            dynamics: DynamicsOptions { ridges: vec![1e-3, 1e-1], ..DynamicsOptions::default() },
            ..TrainOptions::default()
        };
        let model = Arc::new(DrapeModel::train(&training_set(), &options, &Silent).unwrap().0);
        let mut fast = Synthesis::new(model.clone(), &[0.5, -0.5], 4).unwrap();
        let coarse = model.coarse.as_ref().unwrap();
        for pose in &motion(6, 20).frames {
            let body = anchor_body(pose);
            fast.step(pose, &body);
            let (fitting, course) = (&fast.fitting, fast.course.as_ref().unwrap());
            let to_anchors = |x: &[Vec3]| translation(&model.garment.anchors, x, &body);
            let mut gradients = vec![Mat3::IDENTITY; model.garment.topology.face_count()];
            let mut places = vec![Vec3::ZERO; model.garment.template.len()];
            let learned = (&model.wrinkle, &model.reconstruction);
            fitting.write_reference(learned, (pose, &to_anchors), &mut gradients, &mut places);
            coarse.displace(pose, &course.coefficients, &mut Vec::new(), &mut places);
            fitting.compose(&model.wrinkle, (pose, &fast.wrinkles), &mut gradients);
            let mut plain = places.clone();
            coarse.reconstruct(&gradients, &places, &mut plain);
            let furthest = fast.vertices.iter().zip(&plain).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
            assert!(furthest < 1e-9, "{furthest}");
        }
    }
}
