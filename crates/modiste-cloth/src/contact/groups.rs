//! Which limbs a cloth vertex belongs to, for cloth that is pinched between two of them.

use modiste_body::Part;
use modiste_core::Topology;

/// Limbs that can press against each other: trunk with head, each arm, each leg.
pub(crate) const LIMB_COUNT: usize = 5;

/// The limb that a part belongs to.
pub(crate) fn limb(part: Part) -> usize {
    match part {
        Part::Pelvis | Part::Abdomen | Part::Chest | Part::Neck | Part::Head => 0,
        Part::LeftShoulder | Part::LeftUpperArm | Part::LeftForearm | Part::LeftHand => 1,
        Part::RightShoulder | Part::RightUpperArm | Part::RightForearm | Part::RightHand => 2,
        Part::LeftThigh | Part::LeftShin | Part::LeftFoot => 3,
        Part::RightThigh | Part::RightShin | Part::RightFoot => 4,
    }
}

/// For every cloth vertex the limbs that it covers: contact with them is exact, contact with the others yields in a pinch.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CollisionGroups {
    home: Vec<u8>,
}

impl CollisionGroups {
    /// Takes the limbs of the faces at each vertex.
    pub fn from_face_parts(topology: &Topology, face_parts: &[Part]) -> Self {
        let mut home = vec![0u8; topology.vertex_count()];
        for (corners, part) in topology.faces().iter().zip(face_parts) {
            for &vertex in corners {
                home[vertex as usize] |= 1 << limb(*part);
            }
        }
        Self { home }
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
}
