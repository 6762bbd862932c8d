//! Mean curvature by the cotangent operator.

use crate::{Topology, Vec3, mesh::corners};

/// Absolute mean curvature per vertex (1/m); zero at the boundary and at vertices without faces.
///
/// `H = |sum_j (cot a_ij + cot b_ij)(x_i - x_j)| / (4 A_i)` with the mixed Voronoi area `A_i`
/// (Meyer, Desbrun, Schröder, Barr 2003, eq. 8 and fig. 4). 1/r on a sphere, 1/(2r) on a cylinder.
/// A boundary vertex has only part of its ring, so the operator means nothing there.
pub fn mean_curvature(topology: &Topology, x: &[Vec3]) -> Vec<f64> {
    let mut laplacian = vec![Vec3::ZERO; topology.vertex_count()];
    let mut areas = vec![0.0; topology.vertex_count()];
    for &face in topology.faces() {
        let p = corners(face, x);
        let double_area = (p[1] - p[0]).cross(p[2] - p[0]).length();
        if double_area <= f64::MIN_POSITIVE {
            continue;
        }
        let cotangents = [0, 1, 2].map(|i| {
            let (to_next, to_previous) = (p[(i + 1) % 3] - p[i], p[(i + 2) % 3] - p[i]);
            to_next.dot(to_previous) / double_area
        });
        for corner in 0..3 {
            let (next, previous) = ((corner + 1) % 3, (corner + 2) % 3);
            let vertex = face[corner] as usize;
            // The edge to `next` is opposite `previous`, and the other way round.
            let (to_next, to_previous) = (p[corner] - p[next], p[corner] - p[previous]);
            laplacian[vertex] += cotangents[previous] * to_next + cotangents[next] * to_previous;
            areas[vertex] += if cotangents.iter().all(|&cotangent| cotangent >= 0.0) {
                (cotangents[previous] * to_next.length_squared() + cotangents[next] * to_previous.length_squared())
                    / 8.0
            } else if cotangents[corner] < 0.0 {
                double_area / 4.0
            } else {
                double_area / 8.0
            };
        }
    }
    let mut curvature: Vec<f64> = laplacian
        .iter()
        .zip(&areas)
        .map(|(sum, &area)| if area > 0.0 { sum.length() / (4.0 * area) } else { 0.0 })
        .collect();
    for edge in topology.edges().iter().filter(|edge| edge.faces[1].is_none()) {
        for vertex in edge.vertices {
            curvature[vertex as usize] = 0.0;
        }
    }
    curvature
}
