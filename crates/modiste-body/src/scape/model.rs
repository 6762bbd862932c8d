//! The learned model of one gender.

use std::sync::Arc;

use modiste_core::{GradientReconstruction, Mat3, QuantisedBasis, Topology, Vec3};

use super::Body;
use super::blend::RotationBlend;
use super::pose_deformation::PoseDeformation;
use crate::contact::SkinContact;
use crate::{BodyError, Gender, Part};

/// The SCAPE model of one gender: constant, shared by [`Arc`].
#[derive(Debug)]
pub struct ScapeModel {
    pub(crate) data: ModelData,
    pub(crate) topology: Arc<Topology>,
    reconstruction: GradientReconstruction,
    pub(crate) contact: SkinContact,
    /// Change of the vertices per standard deviation of each coefficient.
    shape_directions: Vec<Vec<Vec3>>,
}

/// What is learned and stored; [`ScapeModel`] adds what follows from it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ModelData {
    pub gender: Gender,
    pub faces: Vec<[u32; 3]>,
    /// The mean body in the template pose (m): pelvis joint above the origin, feet at y = 0.
    pub template: Vec<Vec3>,
    pub face_parts: Vec<Part>,
    pub vertex_parts: Vec<Part>,
    pub blend: RotationBlend,
    /// Mean of D over the population, nine numbers per face, column-major.
    pub shape_mean: Vec<f32>,
    /// Change of D per standard deviation of each coefficient.
    pub shape_basis: QuantisedBasis,
    pub pose_deformation: PoseDeformation,
    /// Joint of each part as weighted mean of vertices of the template pose; weights sum to one.
    pub joints: Vec<Vec<(u32, f32)>>,
    /// For each part the vertices that move with it alone; weights sum to one, empty if there are none.
    pub cores: Vec<Vec<(u32, f32)>>,
    /// The parts that each vertex follows.
    pub vertex_blend: RotationBlend,
}

impl ScapeModel {
    /// Checks what was learned or read, and prefactors the reconstruction.
    pub(crate) fn new(data: ModelData) -> Result<Arc<Self>, BodyError> {
        data.check()?;
        let topology = Topology::new(data.template.len(), data.faces.clone())
            .map_err(|problem| BodyError::Model(format!("faces: {problem}")))?;
        let reconstruction = GradientReconstruction::new(&topology, &data.template)?;
        let contact = SkinContact::new(&topology, &data.template, &data.vertex_parts, &data.face_parts);
        let topology = Arc::new(topology);
        let mut model = Self { data, topology, reconstruction, contact, shape_directions: Vec::new() };
        model.shape_directions = model.compute_shape_directions();
        Ok(Arc::new(model))
    }

    /// Which gender it was learned from.
    pub fn gender(&self) -> Gender {
        self.data.gender
    }

    /// The triangles of every body of this model.
    pub fn topology(&self) -> &Arc<Topology> {
        &self.topology
    }

    /// The part of each triangle.
    pub fn face_parts(&self) -> &[Part] {
        &self.data.face_parts
    }

    /// The part of each vertex.
    pub fn vertex_parts(&self) -> &[Part] {
        &self.data.vertex_parts
    }

    /// Number of shape coefficients β.
    pub fn shape_count(&self) -> usize {
        self.data.shape_basis.count()
    }

    /// Vertices of the mean body in the template pose (m), feet at y = 0.
    pub fn template(&self) -> &[Vec3] {
        &self.data.template
    }

    /// Change of the vertices in the template pose (m) per standard deviation of each shape coefficient.
    ///
    /// The mesh in the template pose is linear in D and D is linear in β, so these are exact. Centroids do not move.
    pub fn shape_directions(&self) -> &[Vec<Vec3>] {
        &self.shape_directions
    }

    /// A body with these shape coefficients (β, in standard deviations); missing ones are 0.
    ///
    /// # Errors
    /// More coefficients than [`Self::shape_count`], or one that is not finite.
    pub fn body(self: &Arc<Self>, shape: &[f64]) -> Result<Body, BodyError> {
        Body::new(Arc::clone(self), shape)
    }

    /// D of every face for a shape.
    pub(crate) fn shape_gradients(&self, shape: &[f64]) -> Vec<Mat3> {
        let mut numbers = vec![0.0; self.data.shape_mean.len()];
        self.data.shape_basis.expand(&self.data.shape_mean, shape, &mut numbers);
        numbers
            .chunks_exact(9)
            .map(|chunk| Mat3::from_cols_array(&std::array::from_fn(|i| f64::from(chunk[i]))))
            .collect()
    }

    /// The mesh that fits the gradients best (m), centroid at the origin.
    pub(crate) fn reconstruct(&self, gradients: &[Mat3], out: &mut Vec<Vec3>) {
        out.resize(self.data.template.len(), Vec3::ZERO);
        self.reconstruction.reconstruct(gradients, out);
    }

    /// Joints of a body in the template pose (m).
    pub(crate) fn regress_joints(&self, vertices: &[Vec3]) -> [Vec3; Part::COUNT] {
        std::array::from_fn(|part| weighted_mean(&self.data.joints[part], vertices))
    }

    /// Where the core of each part lies (m); zero for a part without one.
    pub(crate) fn part_cores(&self, vertices: &[Vec3]) -> [Vec3; Part::COUNT] {
        std::array::from_fn(|part| weighted_mean(&self.data.cores[part], vertices))
    }

    fn compute_shape_directions(&self) -> Vec<Vec<Vec3>> {
        let zero = vec![0.0; self.data.shape_mean.len()];
        let mut numbers = zero.clone();
        (0..self.shape_count())
            .map(|k| {
                let mut unit = vec![0.0; k + 1];
                unit[k] = 1.0;
                self.data.shape_basis.expand(&zero, &unit, &mut numbers);
                let gradients: Vec<Mat3> = numbers
                    .chunks_exact(9)
                    .map(|chunk| Mat3::from_cols_array(&std::array::from_fn(|i| f64::from(chunk[i]))))
                    .collect();
                let mut direction = Vec::new();
                self.reconstruct(&gradients, &mut direction);
                direction
            })
            .collect()
    }
}

/// Weighted mean of some vertices (m).
pub(crate) fn weighted_mean(weights: &[(u32, f32)], vertices: &[Vec3]) -> Vec3 {
    // The stored weights sum to one but for their rounding; dividing keeps the mean exact under translation.
    if weights.is_empty() {
        return Vec3::ZERO;
    }
    let total: f64 = weights.iter().map(|&(_, weight)| f64::from(weight)).sum();
    weights.iter().map(|&(vertex, weight)| vertices[vertex as usize] * f64::from(weight)).sum::<Vec3>() / total
}

impl ModelData {
    fn check(&self) -> Result<(), BodyError> {
        let (vertices, faces) = (self.template.len(), self.faces.len());
        let size = |what: &'static str, wanted: usize, found: usize| {
            if wanted == found { Ok(()) } else { Err(BodyError::Size { what, wanted: wanted.to_string(), found }) }
        };
        size("face parts", faces, self.face_parts.len())?;
        size("vertex parts", vertices, self.vertex_parts.len())?;
        size("blended parts", faces, self.blend.parts.len())?;
        size("blend weights", faces, self.blend.weights.len())?;
        size("blended parts of vertices", vertices, self.vertex_blend.parts.len())?;
        size("blend weights of vertices", vertices, self.vertex_blend.weights.len())?;
        size("mean shape deformation", 9 * faces, self.shape_mean.len())?;
        size("shape basis", 9 * faces, self.shape_basis.dimensions())?;
        size("joints", Part::COUNT, self.joints.len())?;
        size("cores", Part::COUNT, self.cores.len())?;
        self.pose_deformation.check(faces)?;
        let problem = |what: &str| Err(BodyError::Model(what.to_owned()));
        if self.template.iter().any(|x| !x.is_finite()) || self.shape_mean.iter().any(|x| !x.is_finite()) {
            return problem("the template or the mean shape holds a number that is not finite");
        }
        for blend in [&self.blend, &self.vertex_blend] {
            if blend.parts.iter().flatten().any(|&part| usize::from(part) >= Part::COUNT) {
                return problem("a face or vertex follows a part that does not exist");
            }
            if blend.weights.iter().any(|w| !((w.iter().sum::<f32>() - 1.0).abs() < 1e-3 && w[0] > 0.0)) {
                return problem("the part weights of a face or vertex do not sum to one");
            }
        }
        if self.cores[Part::Pelvis.index()].is_empty() {
            return problem("no vertex moves with the pelvis alone");
        }
        for weights in self.joints.iter().chain(self.cores.iter().filter(|core| !core.is_empty())) {
            if weights.iter().any(|&(vertex, weight)| vertex as usize >= vertices || !weight.is_finite()) {
                return problem("a joint names a vertex that does not exist, or a weight that is not finite");
            }
            let sum: f64 = weights.iter().map(|&(_, weight)| f64::from(weight)).sum();
            if (sum - 1.0).abs() > 1e-3 {
                return problem("the weights of a joint do not sum to one");
            }
        }
        Ok(())
    }
}
