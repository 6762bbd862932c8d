//! One body: a shape, ready to be posed.

use std::sync::Arc;

use modiste_core::{Mat3, Vec3};
use rayon::prelude::*;

use super::ScapeModel;
use super::pose_deformation::pose_features;
use crate::contact::ContactScratch;
use crate::pose::joint_positions;
use crate::{BodyError, Part, Pose};

/// Faces that one thread takes at a time.
const FACES_AT_ONCE: usize = 1024;

/// Coefficients beyond this many standard deviations are refused: nothing like them was ever seen.
const LARGEST_COEFFICIENT: f64 = 20.0;

/// Memory for posing a body again and again.
#[derive(Debug, Clone, Default)]
pub struct PoseScratch {
    gradients: Vec<Mat3>,
    contact: ContactScratch,
}

/// A body of one shape, ready to be posed.
#[derive(Debug, Clone)]
pub struct Body {
    model: Arc<ScapeModel>,
    shape: Vec<f64>,
    /// D of every face.
    gradients: Arc<[Mat3]>,
    rest_vertices: Vec<Vec3>,
    rest_joints: [Vec3; Part::COUNT],
    /// From the joint of each part to the part's core, in the template pose (m).
    core_from_joint: [Vec3; Part::COUNT],
}

impl Body {
    pub(crate) fn new(model: Arc<ScapeModel>, shape: &[f64]) -> Result<Self, BodyError> {
        if shape.len() > model.shape_count() {
            let wanted = format!("at most {}", model.shape_count());
            return Err(BodyError::Size { what: "shape coefficients", wanted, found: shape.len() });
        }
        if let Some((index, &found)) = shape.iter().enumerate().find(|(_, x)| !(x.abs() <= LARGEST_COEFFICIENT)) {
            let wanted = format!("-{LARGEST_COEFFICIENT} to {LARGEST_COEFFICIENT} standard deviations");
            return Err(BodyError::Value { what: format!("shape coefficient {index}"), wanted, found });
        }
        let mut full = shape.to_vec();
        full.resize(model.shape_count(), 0.0);
        let gradients: Arc<[Mat3]> = model.shape_gradients(&full).into();
        let mut rest_vertices = Vec::new();
        model.reconstruct(&gradients, &mut rest_vertices);
        let pelvis = model.regress_joints(&rest_vertices)[Part::Pelvis.index()];
        let floor = rest_vertices.iter().map(|vertex| vertex.y).fold(f64::INFINITY, f64::min);
        let offset = Vec3::new(-pelvis.x, -floor, -pelvis.z);
        for vertex in &mut rest_vertices {
            *vertex += offset;
        }
        let rest_joints = model.regress_joints(&rest_vertices);
        let cores = model.part_cores(&rest_vertices);
        let core_from_joint = std::array::from_fn(|part| cores[part] - rest_joints[part]);
        Ok(Self { model, shape: full, gradients, rest_vertices, rest_joints, core_from_joint })
    }

    /// The shape coefficients β, in standard deviations, all of them.
    pub fn shape(&self) -> &[f64] {
        &self.shape
    }

    /// The model that the body belongs to.
    pub fn model(&self) -> &Arc<ScapeModel> {
        &self.model
    }

    /// Vertices in the template pose (m): the pelvis joint above the origin, the feet at y = 0.
    pub fn rest_vertices(&self) -> &[Vec3] {
        &self.rest_vertices
    }

    /// Joint of each part in the template pose (m).
    pub fn rest_joints(&self) -> &[Vec3; Part::COUNT] {
        &self.rest_joints
    }

    /// The pose that reproduces [`Self::rest_vertices`].
    pub fn template_pose(&self) -> Pose {
        Pose::template(self.rest_joints[Part::Pelvis.index()])
    }

    /// Joint of each part (m) in a pose, by the kinematic tree.
    pub fn joints(&self, pose: &Pose) -> [Vec3; Part::COUNT] {
        pose.joints(&self.rest_joints)
    }

    /// Writes the vertices (m) in a pose: the mesh that fits `R D Q` best, every part held where its joint is, the pelvis
    /// joint at `pose.root_translation`; and where skin meets skin, both give way.
    pub fn pose(&self, pose: &Pose, out: &mut Vec<Vec3>) {
        self.pose_with(pose, &mut PoseScratch::default(), out);
    }

    /// [`Self::pose`] with memory that is kept from frame to frame, so that none is asked for.
    pub fn pose_with(&self, pose: &Pose, scratch: &mut PoseScratch, out: &mut Vec<Vec3>) {
        self.deform(pose, &mut scratch.gradients, out);
        self.model.contact.give_way(self.model.topology(), &self.rest_vertices, &mut scratch.contact, out);
    }

    /// Writes the vertices (m) in a pose as the model alone has them: skin passes through skin.
    pub fn pose_without_contact(&self, pose: &Pose, out: &mut Vec<Vec3>) {
        self.deform(pose, &mut Vec::new(), out);
    }

    fn deform(&self, pose: &Pose, scratch: &mut Vec<Mat3>, out: &mut Vec<Vec3>) {
        let data = &self.model.data;
        let quaternions = pose.world_quaternions();
        let matrices = quaternions.map(Mat3::from_quat);
        let features = pose_features(pose);
        scratch.resize(self.gradients.len(), Mat3::IDENTITY);
        let faces = scratch.par_iter_mut().zip(self.gradients.par_iter()).enumerate().with_min_len(FACES_AT_ONCE);
        faces.for_each(|(face, (gradient, shape))| {
            let rotation = data.blend.rotation(face, &quaternions, &matrices);
            *gradient = match data.pose_deformation.matrix(face, &features) {
                Some(pose_deformation) => rotation * (*shape * pose_deformation),
                None => rotation * *shape,
            };
        });
        self.model.reconstruct(scratch, out);
        let joints = joint_positions(&self.rest_joints, pose.root_translation, &quaternions);
        self.hold_parts(&joints, &matrices, out);
    }

    /// Moves each part's core to where the kinematic tree has it, and what lies between parts along, by the skin weights.
    ///
    /// The least-squares solve leaves the mesh free to drift: an error of a few millimetres in the triangles of a bent
    /// joint moves everything beyond it. Only the pelvis has to be held (it has no other place), but holding every part
    /// keeps hands and feet where the pose says. The corrections differ between neighbouring parts by millimetres.
    fn hold_parts(&self, joints: &[Vec3; Part::COUNT], matrices: &[Mat3; Part::COUNT], out: &mut [Vec3]) {
        let data = &self.model.data;
        let found = self.model.part_cores(out);
        let pelvis = Part::Pelvis.index();
        let offsets: [Vec3; Part::COUNT] = std::array::from_fn(|part| {
            let part = if data.cores[part].is_empty() { pelvis } else { part };
            joints[part] + matrices[part] * self.core_from_joint[part] - found[part]
        });
        for (vertex, x) in out.iter_mut().enumerate() {
            *x += data.vertex_blend.mean(vertex, &offsets);
        }
    }
}

#[cfg(test)]
mod tests {
    use modiste_core::{Quat, Vec3, centroid};

    use crate::scape::synthetic;
    use crate::{BodyError, Part, Pose};

    #[test]
    fn zero_shape_in_zero_pose_is_the_template() {
        let model = synthetic::model();
        let body = model.body(&[]).unwrap();
        let mut posed = Vec::new();
        body.pose(&body.template_pose(), &mut posed);
        for ((x, rest), template) in posed.iter().zip(body.rest_vertices()).zip(model.template()) {
            assert!(x.distance(*rest) < 1e-9);
            assert!(rest.distance(*template) < 1e-5, "{rest} {template}");
        }
    }

    #[test]
    fn turning_the_root_turns_the_mesh() {
        let body = synthetic::model().body(&[1.0, -0.5]).unwrap();
        let mut pose = body.template_pose();
        pose.rotations[Part::LeftForearm.index()] = Vec3::new(0.2, -0.9, 0.1);
        let turn = Quat::from_scaled_axis(Vec3::new(0.4, 2.0, -0.3));
        let mut turned = Pose { root_translation: Vec3::new(3.0, 1.0, -2.0), ..pose.clone() };
        turned.set_rotation(Part::Pelvis, turn);
        let (mut before, mut after) = (Vec::new(), Vec::new());
        body.pose(&pose, &mut before);
        body.pose(&turned, &mut after);
        for (x, y) in before.iter().zip(&after) {
            let wanted = turn * (*x - pose.root_translation) + turned.root_translation;
            assert!(wanted.distance(*y) < 1e-9);
        }
    }

    #[test]
    fn the_shape_directions_are_the_derivative_of_the_body() {
        let model = synthetic::model();
        let (zero, bent) = (model.body(&[]).unwrap(), model.body(&[0.7, -1.1]).unwrap());
        let (from, to) = (centroid(zero.rest_vertices()), centroid(bent.rest_vertices()));
        for v in 0..zero.rest_vertices().len() {
            let linear = zero.rest_vertices()[v] - from + model.shape_directions()[0][v] * 0.7
                - model.shape_directions()[1][v] * 1.1;
            assert!(linear.distance(bent.rest_vertices()[v] - to) < 1e-5);
        }
    }

    #[test]
    fn joints_come_out_of_the_vertices() {
        let body = synthetic::model().body(&[]).unwrap();
        let length = body.rest_vertices().iter().map(|x| x.x).fold(f64::NEG_INFINITY, f64::max);
        let joints = synthetic::joints_of(length);
        let offset = body.rest_joints()[0] - joints[0];
        for part in Part::ALL {
            assert!(body.rest_joints()[part.index()].distance(joints[part.index()] + offset) < 5e-3, "{part:?}");
        }
    }

    #[test]
    fn impossible_shapes_are_refused() {
        let model = synthetic::model();
        assert!(matches!(model.body(&[0.0; 99]), Err(BodyError::Size { .. })));
        assert!(matches!(model.body(&[0.0, f64::NAN]), Err(BodyError::Value { .. })));
        assert!(matches!(model.body(&[1e9]), Err(BodyError::Value { .. })));
    }
}
