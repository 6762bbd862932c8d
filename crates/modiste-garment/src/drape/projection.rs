//! The wrinkles of a given mesh, as far as the learned space has them.

use std::sync::Arc;

use modiste_body::Pose;
use modiste_core::{Mat3, Vec3};

use super::model::DrapeModel;
use super::synthesis::Synthesis;
use crate::GarmentError;
use crate::refine::anchors::translation;

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
            synthesis.fitting.deform_edges(&synthesis.model.garment, &synthesis.model.wrinkle);
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
        let Synthesis { model, fitting, course, .. } = &mut self.synthesis;
        if let (Some(course), Some(coarse)) = (course, &model.coarse) {
            let to_anchors = |x: &[Vec3]| translation(&model.garment.anchors, x, body);
            let learned = (&model.wrinkle, &model.reconstruction);
            let mut gradients = vec![Mat3::IDENTITY; fitting.shape_deformations.len()];
            fitting.write_reference(learned, (pose, &to_anchors), &mut gradients, &mut course.places);
            course.coefficients = coarse.coefficients_of(pose, &course.places, truth);
        }
        self.synthesis.coefficients = coefficients;
        self.synthesis.finish(pose);
        self.synthesis.place(body)
    }
}
