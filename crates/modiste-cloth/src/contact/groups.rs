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

/// For every cloth vertex the limbs that it lies on, and those that may press on it from the other side.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CollisionGroups {
    home: Vec<u8>,
    allowed: Vec<u8>,
}

impl CollisionGroups {
    /// Takes the limbs of the faces at each vertex as those it lies on; all may press on it.
    pub fn from_face_parts(topology: &Topology, face_parts: &[Part]) -> Self {
        let mut home = vec![0u8; topology.vertex_count()];
        for (corners, part) in topology.faces().iter().zip(face_parts) {
            for &vertex in corners {
                home[vertex as usize] |= 1 << limb(*part);
            }
        }
        Self { allowed: vec![ALL; home.len()], home }
    }

    /// Lets limbs that a vertex does not lie on pass it.
    pub fn let_others_pass(&mut self) {
        self.allowed.clone_from(&self.home);
    }

    /// Number of cloth vertices.
    pub fn vertex_count(&self) -> usize {
        self.home.len()
    }

    /// Lets a vertex also lie on the limb of `part`: cloth near a joint of two limbs.
    pub fn add(&mut self, vertex: usize, part: Part) {
        self.home[vertex] |= 1 << limb(part);
        self.allowed[vertex] |= self.home[vertex];
    }

    /// Lets the limb of `part` press on a vertex that does not lie on it.
    pub fn press(&mut self, vertex: usize, part: Part) {
        self.allowed[vertex] |= 1 << limb(part);
    }

    /// Whether a vertex lies on the limb of `part`.
    pub fn lies_on(&self, vertex: usize, part: Part) -> bool {
        self.home[vertex] & 1 << limb(part) != 0
    }

    /// Whether a vertex lies on the twin of the limb of `part`, and not on the trunk that joins them.
    pub fn is_of_twin(&self, vertex: usize, part: Part) -> bool {
        let twin = match limb(part) {
            0 => return false,
            limb @ (1 | 3) => limb + 1,
            limb => limb - 1,
        };
        let home = self.home[vertex];
        home & (1 << twin) != 0 && home & (1 << limb(Part::Pelvis)) == 0
    }

    /// Bit set of the limbs (trunk, left arm, right arm, left leg, right leg) that a vertex lies on.
    pub fn home(&self, vertex: usize) -> u8 {
        self.home[vertex]
    }

    /// Bit set of the limbs that may press on a vertex, those that it lies on among them.
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
    fn seam_vertices_lie_on_both_limbs() {
        let topology = Topology::new(4, vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        let mut groups = CollisionGroups::from_face_parts(&topology, &[Part::Chest, Part::LeftUpperArm]);
        assert_eq!([0, 1, 2, 3].map(|v| groups.home(v)), [0b11, 0b01, 0b11, 0b10]);
        groups.let_others_pass();
        groups.add(3, Part::LeftThigh);
        assert_eq!([0, 1, 2, 3].map(|v| groups.home(v)), [0b11, 0b01, 0b11, 0b1010]);
        assert_eq!([0, 1, 2, 3].map(|v| groups.allowed(v)), [0b11, 0b01, 0b11, 0b1010]);
        assert!(groups.is_of_twin(3, Part::RightShin) && !groups.is_of_twin(3, Part::LeftShin));
        assert!(!groups.is_of_twin(0, Part::RightHand) && !groups.is_of_twin(3, Part::Chest));
        groups.press(3, Part::RightShin);
        assert_eq!((groups.home(3), groups.allowed(3)), (0b1010, 0b11010));
    }
}
