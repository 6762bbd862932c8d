//! The posed individual that Q is learned from: an artist-weighted skin with corrections that keep its volume.
//!
//! No scans of people in many poses are free, so the examples are made: the mean body of the population is posed with
//! MakeHuman's own skin weights. Linear blending makes joints collapse and dual quaternions (Kavan et al. 2008) make them
//! bulge; the mean of the two does little of either. What creases are left are smoothed away and the detail of the rest
//! surface is put back in the frame of each vertex (Mancewicz et al. 2014, "Delta Mush").

use std::sync::Arc;

use modiste_core::{Mat3, Quat, Topology, Vec3, vertex_normals};

use crate::{Part, Pose};

/// Rounds of smoothing; each replaces a vertex by the mean of itself and of its neighbours' mean.
const SMOOTHING_ROUNDS: usize = 10;

/// The parts that move each vertex, with weights that sum to one.
pub type SkinWeights = Vec<Vec<(Part, f64)>>;

/// One individual's skin, ready to be posed.
#[derive(Debug, Clone)]
pub struct Skin {
    topology: Arc<Topology>,
    vertices: Vec<Vec3>,
    joints: [Vec3; Part::COUNT],
    weights: SkinWeights,
    /// Detail of the rest surface over its smoothed self, in the frame of each smoothed vertex (m).
    details: Vec<Vec3>,
}

impl Skin {
    /// A skin from a body in the template pose (m), its joints (m) and its weights.
    pub fn new(
        topology: Arc<Topology>,
        vertices: Vec<Vec3>,
        joints: [Vec3; Part::COUNT],
        weights: SkinWeights,
    ) -> Self {
        let smooth = smoothed(&topology, &vertices);
        let frames = frames(&topology, &smooth);
        let details = (0..vertices.len()).map(|v| frames[v].transpose() * (vertices[v] - smooth[v])).collect();
        Self { topology, vertices, joints, weights, details }
    }

    /// The joints in the template pose (m).
    pub fn joints(&self) -> &[Vec3; Part::COUNT] {
        &self.joints
    }

    /// The vertices (m) in a pose, the pelvis joint at `pose.root_translation`.
    pub fn pose(&self, pose: &Pose) -> Vec<Vec3> {
        let rotations = pose.world_quaternions();
        let joints = pose.joints(&self.joints);
        let translations: [Vec3; Part::COUNT] = std::array::from_fn(|p| joints[p] - rotations[p] * self.joints[p]);
        let blended: Vec<Vec3> = (self.vertices.iter().zip(&self.weights))
            .map(|(&x, weights)| {
                0.5 * (linear_blend(x, weights, &rotations, &translations)
                    + dual_blend(x, weights, &rotations, &translations))
            })
            .collect();
        let smooth = smoothed(&self.topology, &blended);
        let frames = frames(&self.topology, &smooth);
        (0..smooth.len()).map(|v| smooth[v] + frames[v] * self.details[v]).collect()
    }
}

fn linear_blend(x: Vec3, weights: &[(Part, f64)], rotations: &[Quat], translations: &[Vec3]) -> Vec3 {
    weights.iter().map(|&(part, weight)| (rotations[part.index()] * x + translations[part.index()]) * weight).sum()
}

/// Dual quaternion blending (Kavan et al. 2008): the weighted sum of unit dual quaternions, normalised.
fn dual_blend(x: Vec3, weights: &[(Part, f64)], rotations: &[Quat], translations: &[Vec3]) -> Vec3 {
    let Some(&(first, _)) = weights.first() else { return x };
    let pivot = rotations[first.index()];
    let (mut real, mut dual) = (Quat::from_xyzw(0.0, 0.0, 0.0, 0.0), Quat::from_xyzw(0.0, 0.0, 0.0, 0.0));
    for &(part, weight) in weights {
        let (rotation, shift) = (rotations[part.index()], translations[part.index()]);
        let signed = if rotation.dot(pivot) < 0.0 { -weight } else { weight };
        real += rotation * signed;
        dual += (Quat::from_xyzw(shift.x, shift.y, shift.z, 0.0) * rotation) * (0.5 * signed);
    }
    let length = real.length();
    let (real, dual) = (real * (1.0 / length), dual * (1.0 / length));
    let shift = (dual * real.conjugate()) * 2.0;
    real * x + shift.xyz()
}

fn smoothed(topology: &Topology, vertices: &[Vec3]) -> Vec<Vec3> {
    let mut current = vertices.to_vec();
    let mut next = current.clone();
    for _ in 0..SMOOTHING_ROUNDS {
        for (v, place) in next.iter_mut().enumerate() {
            let around = topology.neighbours(v);
            if !around.is_empty() {
                let mean = around.iter().map(|&n| current[n as usize]).sum::<Vec3>() / around.len() as f64;
                *place = 0.5 * (current[v] + mean);
            }
        }
        std::mem::swap(&mut current, &mut next);
    }
    current
}

/// A rotation per vertex that moves with the surface: its normal and the direction of its first edge.
fn frames(topology: &Topology, vertices: &[Vec3]) -> Vec<Mat3> {
    let normals = vertex_normals(topology, vertices);
    (0..vertices.len())
        .map(|v| {
            let normal = normals[v];
            let edge = topology.neighbours(v).first().map_or(Vec3::X, |&n| vertices[n as usize] - vertices[v]);
            let tangent = (edge - normal * edge.dot(normal)).normalize_or_zero();
            if normal == Vec3::ZERO || tangent == Vec3::ZERO {
                return Mat3::IDENTITY;
            }
            Mat3::from_cols(normal, tangent, normal.cross(tangent))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use modiste_core::Vec3;

    use crate::Pose;
    use crate::scape::synthetic;

    #[test]
    fn the_template_pose_and_rigid_motion_are_exact() {
        let skin = synthetic::skin();
        let rest = synthetic::vertices();
        let mut pose = Pose::template(synthetic::joints()[0]);
        for (x, y) in skin.pose(&pose).iter().zip(&rest) {
            assert!(x.distance(*y) < 1e-12);
        }
        pose.rotations[0] = Vec3::new(0.4, 1.1, -0.6);
        pose.root_translation += Vec3::ONE;
        let turn = pose.rotation(crate::Part::Pelvis);
        for (x, y) in skin.pose(&pose).iter().zip(&rest) {
            assert!(x.distance(turn * (*y - synthetic::joints()[0]) + pose.root_translation) < 1e-12);
        }
    }

    #[test]
    fn a_bent_tube_keeps_its_volume() {
        let (skin, topology) = (skin_of_arm(), synthetic::topology());
        let mut pose = Pose::template(synthetic::joints()[0]);
        let before = modiste_core::volume(&topology, &skin.pose(&pose));
        pose.rotations[crate::Part::LeftForearm.index()] = Vec3::new(0.0, -1.3, 0.0);
        let after = modiste_core::volume(&topology, &skin.pose(&pose));
        assert!((after / before - 1.0).abs() < 0.03, "{}", after / before);
    }

    fn skin_of_arm() -> super::Skin {
        synthetic::skin()
    }
}
