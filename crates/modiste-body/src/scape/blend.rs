//! The parts that triangles and vertices follow, and the triangles' rotations, blended where parts meet.

use modiste_core::{Mat3, Quat, Vec3};

use crate::Part;

/// Most parts that one triangle follows.
pub(crate) const BLEND_COUNT: usize = 4;

/// For each face (or vertex) the parts that it follows, with weights that sum to one; unused entries have weight 0.
#[derive(Debug, Clone, PartialEq)]
pub struct RotationBlend {
    /// Part indices per face or vertex, strongest first.
    pub(crate) parts: Vec<[u8; BLEND_COUNT]>,
    /// Their weights.
    pub(crate) weights: Vec<[f32; BLEND_COUNT]>,
}

impl RotationBlend {
    /// Keeps the strongest parts of each face; weights below `threshold` are dropped.
    pub fn from_part_weights(part_weights: &[[f64; Part::COUNT]], threshold: f64) -> Self {
        let mut blend =
            Self { parts: Vec::with_capacity(part_weights.len()), weights: Vec::with_capacity(part_weights.len()) };
        for weights in part_weights {
            let mut order: Vec<usize> = (0..Part::COUNT).collect();
            order.sort_by(|&a, &b| weights[b].total_cmp(&weights[a]).then(a.cmp(&b)));
            let (mut parts, mut kept) = ([order[0] as u8; BLEND_COUNT], [0.0; BLEND_COUNT]);
            for slot in 0..BLEND_COUNT {
                if slot == 0 || weights[order[slot]] >= threshold {
                    parts[slot] = order[slot] as u8;
                    kept[slot] = weights[order[slot]].max(if slot == 0 { f64::MIN_POSITIVE } else { 0.0 });
                }
            }
            let total: f64 = kept.iter().sum();
            blend.parts.push(parts);
            blend.weights.push(kept.map(|weight| (weight / total) as f32));
        }
        blend
    }

    /// Every face wholly on one part: plain SCAPE.
    pub fn rigid(face_parts: &[Part]) -> Self {
        let mut weights = [0.0; BLEND_COUNT];
        weights[0] = 1.0;
        Self {
            parts: face_parts.iter().map(|part| [part.index() as u8; BLEND_COUNT]).collect(),
            weights: vec![weights; face_parts.len()],
        }
    }

    /// The weighted mean of a vector per part.
    pub(crate) fn mean(&self, index: usize, of_parts: &[Vec3; Part::COUNT]) -> Vec3 {
        let (parts, weights) = (self.parts[index], self.weights[index].map(f64::from));
        if weights[0] >= 1.0 {
            return of_parts[usize::from(parts[0])];
        }
        // The stored weights sum to one but for their rounding; dividing keeps the mean of equal vectors exact.
        let sum: Vec3 = parts.iter().zip(weights).map(|(&part, weight)| of_parts[usize::from(part)] * weight).sum();
        sum / weights.iter().sum::<f64>()
    }

    /// The rotation of one face.
    ///
    /// Weighted mean of the parts' quaternions, each in the hemisphere of the strongest, normalised. Neighbouring parts
    /// are less than a half turn apart, so this stays within a few degrees of the geodesic mean.
    pub fn rotation(&self, face: usize, quaternions: &[Quat; Part::COUNT], matrices: &[Mat3; Part::COUNT]) -> Mat3 {
        let (parts, weights) = (self.parts[face], self.weights[face]);
        if weights[0] >= 1.0 {
            return matrices[parts[0] as usize];
        }
        let strongest = quaternions[parts[0] as usize];
        let mut sum = strongest * f64::from(weights[0]);
        for slot in 1..BLEND_COUNT {
            if weights[slot] == 0.0 {
                break;
            }
            let other = quaternions[parts[slot] as usize];
            let weight = f64::from(weights[slot]);
            sum += other * if other.dot(strongest) < 0.0 { -weight } else { weight };
        }
        // The strongest part weighs at least as much as any other and the others lie in its hemisphere: never zero.
        Mat3::from_quat(sum.normalize())
    }
}

#[cfg(test)]
mod tests {
    use modiste_core::{Mat3, Quat, Vec3};

    use super::RotationBlend;
    use crate::Part;

    #[test]
    fn equal_weights_turn_half_way() {
        let mut weights = [0.0; Part::COUNT];
        weights[Part::LeftUpperArm.index()] = 0.5;
        weights[Part::LeftForearm.index()] = 0.5;
        let blend = RotationBlend::from_part_weights(&[weights], 0.01);
        let mut quaternions = [Quat::IDENTITY; Part::COUNT];
        quaternions[Part::LeftForearm.index()] = -Quat::from_axis_angle(Vec3::Y, 2.4);
        let matrices = quaternions.map(Mat3::from_quat);
        let found = blend.rotation(0, &quaternions, &matrices);
        assert!((found - Mat3::from_rotation_y(1.2)).to_cols_array().iter().all(|x| x.abs() < 1e-12));
    }

    #[test]
    fn faint_parts_are_dropped() {
        let mut weights = [0.0; Part::COUNT];
        weights[Part::Chest.index()] = 0.995;
        weights[Part::Neck.index()] = 0.005;
        let blend = RotationBlend::from_part_weights(&[weights], 0.01);
        assert_eq!(blend, RotationBlend::rigid(&[Part::Chest]));
    }
}
