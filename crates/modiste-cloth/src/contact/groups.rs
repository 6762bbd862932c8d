//! Which limbs of the body a cloth vertex lies on and may touch.

use modiste_body::Part;
use modiste_core::Topology;

/// Limbs that can press against each other: trunk with head, each arm, each leg.
pub(crate) const LIMB_COUNT: usize = 5;

/// All limbs.
const ALL: u8 = u8::MAX;

/// The limb that a part belongs to.
pub(crate) fn limb(part: Part) -> usize {
    match part {
        Part::Pelvis | Part::Abdomen | Part::Chest | Part::Neck | Part::Head => 0,
        // The shoulder girdle lies under the shirt's yoke whatever the arm does.
        Part::LeftShoulder | Part::RightShoulder => 0,
        Part::LeftUpperArm | Part::LeftForearm | Part::LeftHand => 1,
        Part::RightUpperArm | Part::RightForearm | Part::RightHand => 2,
        Part::LeftThigh | Part::LeftShin | Part::LeftFoot => 3,
        Part::RightThigh | Part::RightShin | Part::RightFoot => 4,
    }
}

/// For every cloth vertex the limbs that it covers, where it looks for its surface first, and the limbs that it may touch.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CollisionGroups {
    home: Vec<u8>,
    allowed: Vec<u8>,
}

impl CollisionGroups {
    /// Takes the limbs of the faces at each vertex as those it covers; it may touch all.
    pub fn from_face_parts(topology: &Topology, face_parts: &[Part]) -> Self {
        let mut home = vec![0u8; topology.vertex_count()];
        for (corners, part) in topology.faces().iter().zip(face_parts) {
            for &vertex in corners {
                home[vertex as usize] |= 1 << limb(*part);
            }
        }
        Self { allowed: vec![ALL; home.len()], home }
    }

    /// Lets a vertex touch only the limbs of these parts.
    pub fn allow_only(&mut self, vertex: usize, parts: &[Part]) {
        self.allowed[vertex] = parts.iter().fold(0, |mask, part| mask | 1 << limb(*part));
        self.home[vertex] &= self.allowed[vertex];
    }

    /// Number of cloth vertices.
    pub fn vertex_count(&self) -> usize {
        self.home.len()
    }

    /// Lets a vertex also collide with the limb of `part`: cloth that lies near a joint of two limbs.
    pub fn add(&mut self, vertex: usize, part: Part) {
        self.home[vertex] |= 1 << limb(part);
    }

    /// Bit set of the limbs (trunk, left arm, right arm, left leg, right leg) that a vertex covers.
    pub fn home(&self, vertex: usize) -> u8 {
        self.home[vertex]
    }

    /// Bit set of the limbs that a vertex may touch.
    pub fn allowed(&self, vertex: usize) -> u8 {
        self.allowed[vertex]
    }
}

#[cfg(test)]
mod tests {
    use super::CollisionGroups;
    use modiste_body::Part;
    use modiste_core::Topology;

    #[test]
    fn seam_vertices_cover_both_limbs_until_told_otherwise() {
        let topology = Topology::new(4, vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        let mut groups = CollisionGroups::from_face_parts(&topology, &[Part::Chest, Part::LeftUpperArm]);
        assert_eq!([0, 1, 2, 3].map(|v| groups.home(v)), [0b11, 0b01, 0b11, 0b10]);
        groups.allow_only(0, &[Part::LeftForearm]);
        assert_eq!((groups.home(0), groups.allowed(0)), (0b10, 0b10));
    }
}
