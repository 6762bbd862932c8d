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

#[cfg(test)]
mod tests {
    use super::mean_curvature;
    use crate::shapes::{grid, icosphere, torus};
    use crate::{Vec3, rotation_from_vector};

    #[test]
    fn a_sphere_has_one_over_its_radius() {
        let mesh = icosphere(4);
        for radius in [0.1, 1.0, 3.0] {
            let x: Vec<Vec3> = mesh.vertices.iter().map(|&p| radius * p).collect();
            for h in mean_curvature(&mesh.topology, &x) {
                assert!((h * radius - 1.0).abs() < 1e-2, "{h}");
            }
        }
    }

    #[test]
    fn a_cylinder_has_half_of_that_and_a_plane_none() {
        let sheet = grid(40, 40);
        let radius = 0.5;
        let bent: Vec<Vec3> = sheet
            .vertices
            .iter()
            .map(|p| Vec3::new(radius * (p.x / radius).sin(), p.y, radius * (p.x / radius).cos()))
            .collect();
        let inside = |p: &Vec3| p.x > 0.01 && p.x < 0.99 && p.y > 0.01 && p.y < 0.99;
        for (flat, h) in sheet.vertices.iter().zip(mean_curvature(&sheet.topology, &bent)) {
            let expected = if inside(flat) { 0.5 / radius } else { 0.0 };
            assert!((h - expected).abs() < 1e-3, "{flat} {h}");
        }
        assert!(mean_curvature(&sheet.topology, &sheet.vertices).iter().all(|h| *h < 1e-9));
    }

    #[test]
    fn a_torus_has_the_mean_of_its_principal_curvatures() {
        let (major, minor) = (0.8, 0.3);
        let mesh = torus(major, minor, 160, 120);
        for (p, h) in mesh.vertices.iter().zip(mean_curvature(&mesh.topology, &mesh.vertices)) {
            // 1/r across the tube, cos(t)/(R + r cos(t)) around the axis.
            let from_axis = p.x.hypot(p.z);
            let expected = 0.5 * (1.0 / minor + (from_axis - major) / minor / from_axis);
            assert!((h / expected - 1.0).abs() < 2e-2, "{h} {expected}");
        }
    }

    #[test]
    fn rigid_motion_changes_nothing() {
        let mesh = torus(0.8, 0.3, 20, 12);
        let rotation = rotation_from_vector(Vec3::new(1.0, 2.0, 0.5));
        let moved: Vec<Vec3> = mesh.vertices.iter().map(|&p| rotation * p + Vec3::splat(2.0)).collect();
        let pairs =
            mean_curvature(&mesh.topology, &moved).into_iter().zip(mean_curvature(&mesh.topology, &mesh.vertices));
        assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-10));
    }
}
