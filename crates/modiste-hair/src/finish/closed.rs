//! A skin with its openings closed, so that inside and outside are whole numbers everywhere.

use std::sync::Arc;

use modiste_core::{Topology, Vec3, boundary_loops, centroid};

/// The faces of a surface and of the caps over its openings: the waist and the elbows, where a bust was cut from its body.
///
/// Each opening is closed by a fan from the middle of its rim.
#[derive(Debug, Clone)]
pub(super) struct Closed {
    /// Faces of the surface first, then those of the caps.
    pub(super) faces: Vec<[u32; 3]>,
    /// Faces of the surface itself.
    pub(super) own: usize,
    /// Vertices of the rim around each opening.
    rims: Vec<Vec<u32>>,
    topology: Arc<Topology>,
}

impl Closed {
    pub(super) fn new(topology: &Arc<Topology>) -> Self {
        let rims = boundary_loops(topology);
        let mut faces = topology.faces().to_vec();
        for (apex, rim) in (topology.vertex_count() as u32..).zip(&rims) {
            // The cap runs along the rim the other way than the faces do.
            faces.extend((0..rim.len()).map(|i| [rim[(i + 1) % rim.len()], rim[i], apex]));
        }
        Self { faces, own: topology.face_count(), rims, topology: Arc::clone(topology) }
    }

    /// Whether it was made from this topology.
    pub(super) fn is_of(&self, topology: &Arc<Topology>) -> bool {
        Arc::ptr_eq(&self.topology, topology)
    }

    /// Positions (m) of the vertices and, after them, of the middles of the caps.
    pub(super) fn positions(&self, x: &[Vec3], out: &mut Vec<Vec3>) {
        out.clear();
        out.extend_from_slice(x);
        for rim in &self.rims {
            let around: Vec<Vec3> = rim.iter().map(|&vertex| x[vertex as usize]).collect();
            out.push(centroid(&around));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Closed;
    use modiste_core::shapes::icosphere;
    use modiste_core::{Topology, Vec3, winding_number_exact};
    use std::sync::Arc;

    #[test]
    fn a_ball_with_two_holes_is_closed_again() {
        let ball = icosphere(3);
        let faces =
            ball.topology.faces().iter().filter(|face| face.iter().all(|&v| ball.vertices[v as usize].y.abs() < 0.8));
        let open = Arc::new(Topology::new(ball.vertices.len(), faces.copied().collect()).unwrap());
        let closed = Closed::new(&open);
        let mut x = Vec::new();
        closed.positions(&ball.vertices, &mut x);
        assert_eq!(x.len(), ball.vertices.len() + 2);
        let whole = Topology::new(x.len(), closed.faces.clone()).unwrap();
        assert!(whole.edges().iter().all(|edge| edge.faces[1].is_some()));
        for (p, inside) in [(Vec3::ZERO, 1.0), (0.5 * Vec3::Y, 1.0), (0.95 * Vec3::Y, 0.0), (2.0 * Vec3::X, 0.0)] {
            assert!((winding_number_exact(&whole, &x, p) - inside).abs() < 1e-9, "{p}");
        }
    }
}
