//! On which side of a surface a point lies, from its nearest point.

use crate::mesh::{corners, double_area_vector};
use crate::{SurfacePoint, Topology, Vec3};

/// The normal that tells inside from outside at a point of the surface; not of unit length.
///
/// Within a face its normal, on an edge the sum of those of its faces, at a vertex the sum weighted by the angles of the
/// faces (Bærentzen and Aanæs 2005). A plain mean would get sharp corners wrong.
pub fn pseudonormal(topology: &Topology, x: &[Vec3], at: &SurfacePoint) -> Vec3 {
    let face = topology.faces()[at.face as usize];
    let unit_normal = |face: [u32; 3]| double_area_vector(corners(face, x)).normalize_or_zero();
    let on = at.barycentric.map(|coordinate| coordinate > 0.0);
    match on.iter().filter(|&&positive| positive).count() {
        1 => {
            let vertex = (0..3).find(|&i| on[i]).map_or(face[0], |i| face[i]);
            let around = topology.vertex_faces(vertex as usize).iter().map(|&index| topology.faces()[index as usize]);
            around.map(|face| corner_angle(face, vertex, x) * unit_normal(face)).sum()
        }
        2 => {
            let off = (0..3).find(|&i| !on[i]).unwrap_or(0);
            let (a, b) = (face[(off + 1) % 3], face[(off + 2) % 3]);
            let around = topology.vertex_faces(a as usize).iter().map(|&index| topology.faces()[index as usize]);
            around.filter(|corners| corners.contains(&b)).map(unit_normal).sum()
        }
        _ => unit_normal(face),
    }
}

/// Distance of `p` from its nearest point `at` of a surface (m), negative inside.
///
/// The sign is right for closed surfaces that do not cross themselves, and near any surface away from its boundary.
pub fn signed_distance(topology: &Topology, x: &[Vec3], p: Vec3, at: &SurfacePoint) -> f64 {
    if (p - at.point).dot(pseudonormal(topology, x, at)) < 0.0 { -at.distance } else { at.distance }
}

/// Angle of a face at one of its vertices (rad).
fn corner_angle(face: [u32; 3], vertex: u32, x: &[Vec3]) -> f64 {
    let corner = (0..3).find(|&i| face[i] == vertex).unwrap_or(0);
    let [apex, next, previous] = [0, 1, 2].map(|i| x[face[(corner + i) % 3] as usize]);
    let (a, b) = (next - apex, previous - apex);
    a.cross(b).length().atan2(a.dot(b))
}

#[cfg(test)]
mod tests {
    use super::signed_distance;
    use crate::shapes::{icosphere, torus};
    use crate::{Topology, TriangleBvh, Vec3, normal, seeded_rng, winding_number_exact};

    #[test]
    fn the_sign_agrees_with_the_winding_number() {
        // A tetrahedron with a needle-sharp tip, where plain vertex normals fail, and round shapes.
        let tip = Topology::new(4, vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]).unwrap();
        let corners = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [1.5, 0.7, 2.0]].map(Vec3::from_array);
        let (sphere, ring) = (icosphere(1), torus(0.7, 0.3, 7, 5));
        let mut rng = seeded_rng(3);
        for (topology, x) in
            [(&tip, &corners[..]), (&*sphere.topology, &sphere.vertices[..]), (&*ring.topology, &ring.vertices[..])]
        {
            let tree = TriangleBvh::new(topology, x);
            for _ in 0..2000 {
                let p = Vec3::new(normal(&mut rng), normal(&mut rng), normal(&mut rng));
                let at = tree.closest_point(x, p, f64::INFINITY).unwrap();
                let inside = winding_number_exact(topology, x, p) > 0.5;
                assert_eq!(signed_distance(topology, x, p, &at) < 0.0, inside, "{p}");
            }
        }
    }

    #[test]
    fn the_distance_of_a_sphere_is_the_radius_less_one() {
        let mesh = icosphere(5);
        let tree = TriangleBvh::new(&mesh.topology, &mesh.vertices);
        for radius in [0.1, 0.5, 0.9, 1.1, 3.0] {
            let p = radius * Vec3::new(0.3, -0.5, 0.8).normalize();
            let at = tree.closest_point(&mesh.vertices, p, f64::INFINITY).unwrap();
            assert!((signed_distance(&mesh.topology, &mesh.vertices, p, &at) - (radius - 1.0)).abs() < 1e-3);
        }
    }
}
