//! The space whose principal components hair has: that of the thesis, or one that turns with the head.

use modiste_core::{Affine3, Mat3, Vec3, align_rigid, centroid};

use crate::canonical::Frame;

/// Where hair lies still when it moves with the head.
///
/// In the canonical space of the thesis only the heading is taken away (eq. 15), and each nod turns all hair, which no linear
/// components hold. Here the whole pose of the head is taken away; which way is down, the bust tells, which stays as it was.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HairSpace {
    /// Which of the tracked vertices are the head's; none in the space of the thesis.
    head: Vec<u32>,
    /// Where these are on the body that the hair was learned on, at rest (m).
    rest: Vec<Vec3>,
}

impl HairSpace {
    /// The space of the thesis: hair lies as in the canonical space of the bust.
    pub fn of_bust() -> Self {
        Self::default()
    }

    /// The space of the head; `head` are its vertices among those tracked, and `rest` all tracked ones at rest (m).
    pub fn of_head(head: Vec<u32>, rest: &[Vec3]) -> Self {
        let rest = head.iter().map(|&vertex| rest[vertex as usize]).collect();
        Self { head, rest }
    }

    /// The vertices of the head among those tracked; empty in the space of the thesis.
    pub fn head(&self) -> &[u32] {
        &self.head
    }

    /// Where a bust is, with its heading by the axis through the ears, and tracked vertices in that canonical space (m).
    ///
    /// Eq. 15 turns the face to +Z. Somebody who looks at their feet has no such heading, and somebody who bends further
    /// faces backwards all of a sudden; their ears are where they were. In the space of the thesis nothing changes.
    pub fn level(&self, frame: Frame, canonical: Vec<Vec3>) -> (Frame, Vec<Vec3>) {
        if self.head.is_empty() {
            return (frame, canonical);
        }
        let left = self.pose(&canonical).matrix3.x_axis;
        let turn = (-left.z).atan2(left.x);
        let back = Mat3::from_rotation_y(-turn);
        let heading = frame.heading + turn;
        (Frame { heading, ..frame }, canonical.into_iter().map(|p| back * p).collect())
    }

    /// Canonical space from this one, for tracked vertices that lie so in canonical space (m). The origin is the middle of
    /// the head.
    pub fn pose(&self, canonical: &[Vec3]) -> Affine3 {
        if self.head.is_empty() {
            return Affine3::IDENTITY;
        }
        let now: Vec<Vec3> = self.head.iter().map(|&vertex| canonical[vertex as usize]).collect();
        let (turn, _) = align_rigid(&self.rest, &now);
        Affine3::from_mat3_translation(turn, centroid(&now))
    }

    /// Hair that lies so in canonical space, in this one: three numbers a point (m), by the inverse of its pose.
    pub fn carry(&self, hair_from_canonical: &Affine3, hair: &[f32]) -> Vec<f32> {
        if self.head.is_empty() {
            return hair.to_vec();
        }
        let points = hair.as_chunks::<3>().0.iter();
        let carried = points.map(|p| hair_from_canonical.transform_point3(Vec3::from_array(p.map(f64::from))));
        carried.flat_map(|p| p.to_array().map(|x| x as f32)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::HairSpace;
    use crate::canonical::Frame;
    use modiste_core::{Affine3, Mat3, Vec3};

    #[test]
    fn the_ears_tell_the_heading_of_a_head_that_looks_down_or_back_between_the_legs() {
        let rest: Vec<Vec3> =
            (0..20).map(|i| Vec3::new(f64::from(i % 3), f64::from(i % 5), 0.3 * f64::from(i % 7))).collect();
        let space = HairSpace::of_head((0..20).collect(), &rest);
        for nod in [0.0, 1.2, 1.8, 2.6] {
            let turned = Mat3::from_rotation_y(0.4) * Mat3::from_rotation_x(nod);
            let canonical: Vec<Vec3> = rest.iter().map(|p| turned * *p).collect();
            let (frame, level) = space.level(Frame { position: Vec3::X, heading: 1.0 }, canonical);
            assert!((frame.heading - 1.4).abs() < 1e-9, "{nod}: {}", frame.heading);
            assert!(level.iter().zip(&rest).all(|(a, b)| a.distance(Mat3::from_rotation_x(nod) * *b) < 1e-9));
        }
    }

    #[test]
    fn hair_that_moves_with_the_head_lies_still() {
        let rest: Vec<Vec3> =
            (0..20).map(|i| Vec3::new(f64::from(i % 3), f64::from(i % 5), 0.3 * f64::from(i % 7))).collect();
        let space = HairSpace::of_head(vec![2, 5, 6, 9, 11, 17], &rest);
        let hair = [Vec3::new(0.3, 2.0, 1.0), Vec3::new(-0.4, 0.5, 0.1)];
        let mut seen = Vec::new();
        for angle in [0.0, 0.7, -1.9] {
            let nod = Affine3::from_mat3_translation(Mat3::from_rotation_x(angle), Vec3::new(0.1, angle, 0.4));
            let now: Vec<Vec3> = rest.iter().map(|p| nod.transform_point3(*p)).collect();
            let moved: Vec<f32> =
                hair.iter().flat_map(|p| nod.transform_point3(*p).to_array()).map(|x| x as f32).collect();
            seen.push(space.carry(&space.pose(&now).inverse(), &moved));
        }
        for other in &seen[1..] {
            assert!(seen[0].iter().zip(other).all(|(a, b)| (a - b).abs() < 1e-5), "{seen:?}");
        }
        let plain = HairSpace::of_bust();
        assert_eq!(plain.pose(&rest), Affine3::IDENTITY);
    }
}
