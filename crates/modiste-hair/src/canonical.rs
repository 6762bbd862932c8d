//! The space that hair is learned in: where the bust is and which way it faces taken away (Guan eq. 15–16).

use modiste_body::{Body, Part, Pose};
use modiste_core::{Mat3, Vec3, centroid};

use crate::HairError;
use crate::scalp::skull_middle;

/// Vertices that stand for the bust in its principal components, N_n.
pub const TRACKED: usize = 420;
/// Chest below this part of its height is left out: hair hardly reaches it and it breathes with the hips.
const UPPER_CHEST: f64 = 0.45;
/// A head is seen to face forwards by what lies this far before the middle of the skull and behind it (m).
const FACE: f64 = 0.03;

/// Furthest that the way of a bust in one frame may differ from that in the frame before (m), 14 g at 30 frames a second, and
/// furthest that its turn may (rad). People who run, jump and shake their heads stay below 0.06 m and 0.4 rad.
const JERK: [f64; 2] = [0.15, 1.0];
/// Furthest that the tracked vertices may move within the bust from one frame to the next (m, root of mean square); below
/// 0.07 m in captured motion.
const TWITCH: f64 = 0.15;

/// Where a bust is: mean position `p_t` and heading `r_t` about Y, 0 towards +Z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Mean of the tracked vertices (m), p_t.
    pub position: Vec3,
    /// Heading of the head (rad), r_t.
    pub heading: f64,
}

/// The vertices by which a bust is followed, on a body of any shape.
///
/// The model is learned on one body. Another body's tracked vertices are first carried to where that body's would be in the
/// same pose: less the difference of the two shapes at rest, turned with the part that each vertex belongs to.
#[derive(Debug, Clone, PartialEq)]
pub struct BustTrack {
    vertices: Vec<u32>,
    parts: Vec<Part>,
    front: Vec<usize>,
    back: Vec<usize>,
    /// This body's rest vertices less the reference's (m).
    offsets: Vec<Vec3>,
}

impl Frame {
    /// `R_y(r)`: world from canonical.
    pub fn rotation(&self) -> Mat3 {
        Mat3::from_rotation_y(self.heading)
    }

    /// A point of the world in canonical space.
    pub fn to_canonical(&self, world: Vec3) -> Vec3 {
        self.rotation().transpose() * (world - self.position)
    }

    /// A point of canonical space in the world.
    pub fn to_world(&self, canonical: Vec3) -> Vec3 {
        self.rotation() * canonical + self.position
    }

    /// Whether a bust cannot have come from `before`, the older first, to here by moving: the clip has been cut, or the person
    /// was put elsewhere. `shift` is by how much the coefficients of the bust have changed (m).
    pub fn is_cut(&self, before: [&Self; 2], shift: f64) -> bool {
        let way = |from: &Self, to: &Self| to.position - from.position;
        let turn = |from: &Self, to: &Self| (to.heading - from.heading).sin().atan2((to.heading - from.heading).cos());
        let [older, newer] = before;
        let jerk = way(newer, self).distance(way(older, newer));
        let twist = (turn(newer, self) - turn(older, newer)).abs();
        !(jerk <= JERK[0] && twist <= JERK[1] && shift <= TWITCH * (TRACKED as f64).sqrt())
    }

    /// `z_{t,j}` of eq. 21: how the bust has moved since frame `earlier`, seen from there.
    pub fn since(&self, earlier: &Self) -> [f64; 5] {
        let moved = earlier.rotation().transpose() * (self.position - earlier.position);
        let (sine, cosine) = (self.heading - earlier.heading).sin_cos();
        [moved.x, moved.y, moved.z, sine, cosine]
    }
}

impl BustTrack {
    /// The vertices of the body that a model is learned on.
    ///
    /// # Errors
    /// A body without head or chest.
    pub fn reference(body: &Body) -> Result<Self, HairError> {
        let parts = body.model().vertex_parts();
        let x = body.rest_vertices();
        let heights = (0..x.len()).filter(|&v| parts[v] == Part::Chest).map(|v| x[v].y);
        let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| (low.min(y), high.max(y)));
        let floor = low + UPPER_CHEST * (high - low);
        let eligible: Vec<usize> = (0..x.len())
            .filter(|&v| match parts[v] {
                Part::Head | Part::Neck | Part::LeftShoulder | Part::RightShoulder => true,
                Part::Chest => x[v].y >= floor,
                _ => false,
            })
            .collect();
        if eligible.len() < TRACKED {
            return Err(HairError::data("bust", format!("{TRACKED} vertices or more"), eligible.len()));
        }
        // Each next vertex is the one furthest from those before: even, whatever the mesh.
        let mut chosen = vec![eligible[0]];
        let mut distances = vec![f64::INFINITY; eligible.len()];
        while chosen.len() < TRACKED {
            let last = x[chosen[chosen.len() - 1]];
            let mut next = (0, -1.0);
            for (index, &vertex) in eligible.iter().enumerate() {
                distances[index] = distances[index].min(x[vertex].distance_squared(last));
                if distances[index] > next.1 {
                    next = (index, distances[index]);
                }
            }
            chosen.push(eligible[next.0]);
        }
        let vertices: Vec<u32> = chosen.iter().map(|&v| v as u32).collect();
        let rest: Vec<Vec3> = chosen.iter().map(|&v| x[v]).collect();
        Self::of_vertices(body, &vertices, &rest)
    }

    /// The same vertices on another body; `reference` are their positions on the body of the model, at rest (m).
    ///
    /// # Errors
    /// Vertices that the body does not have.
    pub fn of_vertices(body: &Body, vertices: &[u32], reference: &[Vec3]) -> Result<Self, HairError> {
        let rest = body.rest_vertices();
        if let Some(&vertex) = vertices.iter().find(|&&vertex| vertex as usize >= rest.len()) {
            return Err(HairError::data("vertex of the bust", format!("one of {}", rest.len()), vertex));
        }
        if reference.len() != vertices.len() {
            return Err(HairError::data("positions of the bust at rest", vertices.len(), reference.len()));
        }
        let parts: Vec<Part> = vertices.iter().map(|&v| body.model().vertex_parts()[v as usize]).collect();
        let own: Vec<Vec3> = vertices.iter().map(|&v| rest[v as usize]).collect();
        let shift = centroid(&own) - centroid(reference);
        let offsets = own.iter().zip(reference).map(|(own, reference)| *own - *reference - shift).collect();
        let middle = skull_middle(body);
        let side = |wanted: f64| -> Vec<usize> {
            (0..vertices.len())
                .filter(|&i| {
                    parts[i] == Part::Head && wanted * (own[i].z - middle.z) > FACE && own[i].y > middle.y - 0.05
                })
                .collect()
        };
        let (front, back) = (side(1.0), side(-1.0));
        if front.is_empty() || back.is_empty() {
            return Err(HairError::data("head", "vertices before and behind its middle", "none"));
        }
        Ok(Self { vertices: vertices.to_vec(), parts, front, back, offsets })
    }

    /// The vertices of the body that are followed.
    pub fn vertices(&self) -> &[u32] {
        &self.vertices
    }

    /// Which of the tracked vertices are the head's.
    pub fn head(&self) -> Vec<u32> {
        (0u32..).zip(&self.parts).filter(|(_, part)| **part == Part::Head).map(|(index, _)| index).collect()
    }

    /// Where the bust is, and its tracked vertices in canonical space (m), of a posed body.
    pub fn canonical(&self, body: &[Vec3], pose: &Pose) -> (Frame, Vec<Vec3>) {
        let turns = pose.world_rotations();
        let points: Vec<Vec3> = self
            .vertices
            .iter()
            .zip(&self.parts)
            .zip(&self.offsets)
            .map(|((&vertex, part), &offset)| body[vertex as usize] - turns[part.index()] * offset)
            .collect();
        let mean = |indices: &[usize]| indices.iter().map(|&i| points[i]).sum::<Vec3>() / indices.len() as f64;
        let ahead = mean(&self.front) - mean(&self.back);
        let frame = Frame { position: centroid(&points), heading: ahead.x.atan2(ahead.z) };
        let canonical = points.iter().map(|&point| frame.to_canonical(point)).collect();
        (frame, canonical)
    }
}
