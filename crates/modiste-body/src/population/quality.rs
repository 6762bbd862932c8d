//! Whether a body is a proper surface: no degenerate face, no part through another.

use modiste_core::{Topology, TriangleBvh, Vec3, corners};
use serde::Serialize;

use crate::Part;

/// Smallest area of a face that is not degenerate (m²): a thousandth of a square millimetre.
const SMALLEST_AREA: f64 = 1e-9;

/// Defects of one body.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct MeshQuality {
    /// Faces without area or with a vertex that is not finite.
    pub degenerate_faces: usize,
    /// Pairs of faces that cross, outside the excluded parts.
    pub crossings: Vec<[u32; 2]>,
}

impl MeshQuality {
    /// Whether there is no defect.
    pub fn is_clean(&self) -> bool {
        self.degenerate_faces == 0 && self.crossings.is_empty()
    }
}

/// Looks for degenerate faces on the whole body and for crossing faces outside head, hands and feet.
///
/// Those are left out because MakeHuman's base itself crosses there, in lips and eyelids, between fingers and toes,
/// in details that no garment touches.
pub fn mesh_quality(topology: &Topology, face_parts: &[Part], vertices: &[Vec3]) -> MeshQuality {
    let degenerate = |face: &&[u32; 3]| {
        let [a, b, c] = corners(**face, vertices);
        // Not-a-number compares as degenerate too.
        !((b - a).cross(c - a).length() > 2.0 * SMALLEST_AREA)
    };
    let degenerate_faces = topology.faces().iter().filter(degenerate).count();
    let tested: Vec<u32> =
        (0u32..).zip(face_parts).filter(|(_, part)| !is_excluded(**part)).map(|(face, _)| face).collect();
    let crossings = TriangleBvh::of_faces(topology, vertices, &tested).self_intersections(vertices);
    MeshQuality { degenerate_faces, crossings }
}

fn is_excluded(part: Part) -> bool {
    matches!(part, Part::Head | Part::LeftHand | Part::RightHand | Part::LeftFoot | Part::RightFoot)
}
