//! Q of SCAPE: how bending joints deforms the triangles around them, beyond rigid rotation.

use modiste_core::{Mat3, Matrix, SolveError, solve_spd};

use crate::{BodyError, Part, Pose};

/// Numbers that describe the rotation of one joint.
pub(crate) const FEATURES: usize = 4;

/// Numbers per (face, joint) pair: nine entries of Q for each feature.
pub(crate) const BLOCK: usize = 9 * FEATURES;

/// `Q_t = I + sum_j sum_k f_k(r_j) C_tjk` over the joints j next to the triangle (Anguelov et al. 2005, §4).
///
/// Anguelov et al. make Q linear in the rotation vectors `r_j`. Those grow without bound as a joint bends while the true
/// deformation follows sine and cosine of the angle, so the features here are the unit quaternion of the joint less the
/// identity, `2 (x, y, z, w - 1)`: the same to first order, plus one number that is even in the angle.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct PoseDeformation {
    /// Where the blocks of each face start; one more than there are faces.
    pub starts: Vec<u32>,
    /// The joint of each block, as the index of the part below it.
    pub joints: Vec<u8>,
    /// The coefficients of each block, `BLOCK` integers, feature after feature, each a column-major matrix.
    pub coefficients: Vec<i16>,
    /// What an integer step is worth.
    pub scale: f32,
}

/// The features of every joint of a pose.
pub(crate) type PoseFeatures = [[f32; FEATURES]; Part::COUNT];

/// The features of every joint; the pelvis, which turns the whole body, has none.
pub(crate) fn pose_features(pose: &Pose) -> PoseFeatures {
    let mut features = [[0.0; FEATURES]; Part::COUNT];
    for part in Part::ALL.into_iter().skip(1) {
        let rotation = pose.rotation(part);
        let shorter = if rotation.w < 0.0 { -rotation } else { rotation };
        features[part.index()] = [shorter.x, shorter.y, shorter.z, shorter.w - 1.0].map(|x| (2.0 * x) as f32);
    }
    features
}

/// The joints that may deform the triangles of `part`: its own, its children's, and through the short clavicles the
/// shoulders (the armpits belong to the chest, but the upper arms pull them).
pub(crate) fn neighbouring_joints(part: Part) -> Vec<Part> {
    let children = |of: Part| Part::ALL.into_iter().filter(move |child| child.parent() == Some(of));
    let mut joints = Vec::new();
    if part.parent().is_some() {
        joints.push(part);
    }
    for child in children(part) {
        joints.push(child);
        if matches!(child, Part::LeftShoulder | Part::RightShoulder) {
            joints.extend(children(child));
        }
    }
    if let Some(parent @ (Part::LeftShoulder | Part::RightShoulder)) = part.parent() {
        joints.push(parent);
    }
    joints
}

impl PoseDeformation {
    /// Q of every face the identity.
    pub(crate) fn none(face_count: usize) -> Self {
        Self { starts: vec![0; face_count + 1], joints: Vec::new(), coefficients: Vec::new(), scale: 1.0 }
    }

    /// Learns Q from example poses of one individual.
    ///
    /// `targets[i][t]` is what remains of triangle t in pose i after rotation. `ridge` weighs the squared coefficients
    /// against the mean squared residual. Blocks that never move an edge by more than `negligible` of its length are
    /// dropped.
    pub(crate) fn fit(
        face_parts: &[Part],
        poses: &[Pose],
        targets: &[Vec<Mat3>],
        ridge: f64,
        negligible: f64,
    ) -> Result<Self, SolveError> {
        let features: Vec<PoseFeatures> = poses.iter().map(pose_features).collect();
        let solvers: Vec<PartSolver> = Part::ALL
            .into_iter()
            .map(|part| PartSolver::new(neighbouring_joints(part), &features, ridge))
            .collect::<Result<_, _>>()?;
        let mut joints = Vec::new();
        let mut blocks: Vec<[f64; BLOCK]> = Vec::new();
        let mut starts = vec![0u32];
        for (face, part) in face_parts.iter().enumerate() {
            let solver = &solvers[part.index()];
            let coefficients = solver.solve(targets, face);
            for (slot, joint) in solver.joints.iter().enumerate() {
                let mut block = [0.0; BLOCK];
                for k in 0..FEATURES {
                    block[9 * k..9 * (k + 1)].copy_from_slice(&coefficients[slot * FEATURES + k]);
                }
                if reach(&block, *joint, &features) > negligible {
                    joints.push(joint.index() as u8);
                    blocks.push(block);
                }
            }
            starts.push(joints.len() as u32);
        }
        let largest = blocks.iter().flatten().fold(f64::MIN_POSITIVE, |largest, x| largest.max(x.abs()));
        let scale = largest / f64::from(i16::MAX);
        let coefficients = blocks.iter().flatten().map(|x| (x / scale).round() as i16).collect();
        Ok(Self { starts, joints, coefficients, scale: scale as f32 })
    }

    /// Checks the sizes and indices of stored coefficients for `face_count` faces.
    pub(crate) fn check(&self, face_count: usize) -> Result<(), BodyError> {
        let size = |what: &'static str, wanted: usize, found: usize| {
            if wanted == found { Ok(()) } else { Err(BodyError::Size { what, wanted: wanted.to_string(), found }) }
        };
        size("starts of the pose deformation", face_count + 1, self.starts.len())?;
        size("blocks of the pose deformation", self.starts[face_count] as usize, self.joints.len())?;
        size("coefficients of the pose deformation", self.joints.len() * BLOCK, self.coefficients.len())?;
        if self.starts.windows(2).any(|pair| pair[0] > pair[1]) {
            return Err(BodyError::Model("the pose deformation's blocks are out of order".to_owned()));
        }
        if self.joints.iter().any(|&joint| usize::from(joint) >= Part::COUNT) || !self.scale.is_finite() {
            return Err(BodyError::Model("the pose deformation names a joint that does not exist".to_owned()));
        }
        Ok(())
    }

    /// Q of one face; `None` where it is the identity in every pose.
    pub(crate) fn matrix(&self, face: usize, features: &PoseFeatures) -> Option<Mat3> {
        let range = self.starts[face] as usize..self.starts[face + 1] as usize;
        if range.is_empty() {
            return None;
        }
        let mut sum = [0.0f32; 9];
        for block in range {
            let feature = &features[self.joints[block] as usize];
            let coefficients = &self.coefficients[block * BLOCK..(block + 1) * BLOCK];
            for (k, weight) in feature.iter().enumerate() {
                for (entry, &c) in sum.iter_mut().zip(&coefficients[9 * k..9 * (k + 1)]) {
                    *entry += weight * f32::from(c);
                }
            }
        }
        Some(Mat3::IDENTITY + Mat3::from_cols_array(&sum.map(|entry| f64::from(entry * self.scale))))
    }
}

/// The largest change (spectral norm bounded by Frobenius) that a block makes in the example poses.
fn reach(block: &[f64; BLOCK], joint: Part, features: &[PoseFeatures]) -> f64 {
    let size = |feature: &PoseFeatures| {
        let weights = feature[joint.index()];
        let entries = (0..9).map(|i| (0..FEATURES).map(|k| f64::from(weights[k]) * block[9 * k + i]).sum::<f64>());
        entries.map(|entry| entry * entry).sum::<f64>().sqrt()
    };
    features.iter().map(size).fold(0.0, f64::max)
}

/// Ridge regression with the same regressors for every face of a part: `(XᵀX/n + λI)⁻¹ Xᵀ/n`, made once.
struct PartSolver {
    joints: Vec<Part>,
    /// Regressors by poses.
    solution_from_targets: Matrix,
}

impl PartSolver {
    fn new(joints: Vec<Part>, features: &[PoseFeatures], ridge: f64) -> Result<Self, SolveError> {
        let (count, width) = (features.len(), joints.len() * FEATURES);
        let x = Matrix::from_fn(count, width, |pose, column| {
            f64::from(features[pose][joints[column / FEATURES].index()][column % FEATURES])
        });
        let scaled = Matrix::from_fn(width, count, |column, pose| x[(pose, column)] / count as f64);
        let mut normal = scaled.matmul(&x);
        for i in 0..width {
            normal[(i, i)] += ridge;
        }
        Ok(Self { joints, solution_from_targets: solve_spd(&normal, &scaled)? })
    }

    /// Nine coefficients for each regressor.
    fn solve(&self, targets: &[Vec<Mat3>], face: usize) -> Vec<[f64; 9]> {
        let mut solution = vec![[0.0; 9]; self.joints.len() * FEATURES];
        for (pose, target) in targets.iter().enumerate() {
            let residual = (target[face] - Mat3::IDENTITY).to_cols_array();
            for (column, coefficients) in solution.iter_mut().enumerate() {
                let weight = self.solution_from_targets[(column, pose)];
                for (c, r) in coefficients.iter_mut().zip(&residual) {
                    *c += weight * r;
                }
            }
        }
        solution
    }
}

#[cfg(test)]
mod tests {
    use modiste_core::{Mat3, Vec3};

    use super::{FEATURES, PoseDeformation, neighbouring_joints, pose_features};
    use crate::{Part, Pose};

    fn poses() -> Vec<Pose> {
        (0..40)
            .map(|i| {
                let mut pose = Pose::template(Vec3::ZERO);
                for part in Part::ALL {
                    let t = i as f64 * 1.7 + part.index() as f64 * 0.9;
                    pose.rotations[part.index()] = Vec3::new(t.sin(), (1.3 * t).cos(), (2.1 * t).sin()) * 0.7;
                }
                pose
            })
            .collect()
    }

    #[test]
    fn every_part_but_the_pelvis_listens_to_its_own_joint() {
        for part in Part::ALL {
            assert_eq!(neighbouring_joints(part).contains(&part), part != Part::Pelvis);
        }
        assert!(neighbouring_joints(Part::Chest).contains(&Part::LeftUpperArm));
    }

    #[test]
    fn a_linear_law_is_recovered() {
        let poses = poses();
        let law = |pose: &Pose| {
            let features = pose_features(pose)[Part::LeftForearm.index()];
            let mut q = Mat3::IDENTITY;
            for k in 0..FEATURES {
                q += Mat3::from_cols(Vec3::X * 0.1, Vec3::Y * (k as f64 * 0.2), Vec3::ONE * 0.05)
                    * f64::from(features[k]);
            }
            q
        };
        let targets: Vec<Vec<Mat3>> = poses.iter().map(|pose| vec![law(pose), Mat3::IDENTITY]).collect();
        let face_parts = [Part::LeftForearm, Part::Head];
        let learned = PoseDeformation::fit(&face_parts, &poses, &targets, 1e-9, 1e-3).unwrap();
        assert_eq!(learned.joints, [Part::LeftForearm.index() as u8], "blocks that do nothing are dropped");
        let mut fresh = Pose::template(Vec3::ZERO);
        fresh.rotations[Part::LeftForearm.index()] = Vec3::new(0.4, -1.0, 0.3);
        let found = learned.matrix(0, &pose_features(&fresh)).unwrap();
        assert!((found - law(&fresh)).to_cols_array().iter().all(|x| x.abs() < 1e-4));
        assert_eq!(learned.matrix(1, &pose_features(&fresh)), None);
    }
}
