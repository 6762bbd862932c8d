//! Triangle meshes: normals, area, volume, centroid.

use std::sync::Arc;

use crate::{Topology, Vec3};

/// A triangle mesh: shared topology with one position per vertex (m).
#[derive(Debug, Clone)]
pub struct Mesh {
    /// Which vertices make which triangles.
    pub topology: Arc<Topology>,
    /// Vertex positions (m), one per vertex of the topology.
    pub vertices: Vec<Vec3>,
}

impl Mesh {
    /// Unit normal per face; see [`face_normals`].
    pub fn face_normals(&self) -> Vec<Vec3> {
        face_normals(&self.topology, &self.vertices)
    }

    /// Unit normal per vertex; see [`vertex_normals`].
    pub fn vertex_normals(&self) -> Vec<Vec3> {
        vertex_normals(&self.topology, &self.vertices)
    }

    /// Enclosed volume (m³); see [`volume`].
    pub fn volume(&self) -> f64 {
        volume(&self.topology, &self.vertices)
    }
}

/// The three corners of a face.
#[inline]
pub fn corners(face: [u32; 3], x: &[Vec3]) -> [Vec3; 3] {
    face.map(|vertex| x[vertex as usize])
}

/// Twice the area vector of a triangle: its normal times twice its area (m²).
pub(crate) fn double_area_vector([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a)
}

/// Unit outward normal per face; zero where the face has no area.
pub fn face_normals(topology: &Topology, x: &[Vec3]) -> Vec<Vec3> {
    topology.faces().iter().map(|&face| double_area_vector(corners(face, x)).normalize_or_zero()).collect()
}

/// Unit normal per vertex, the area-weighted mean over its faces; zero where that mean vanishes.
pub fn vertex_normals(topology: &Topology, x: &[Vec3]) -> Vec<Vec3> {
    let mut normals = Vec::new();
    vertex_normals_into(topology, x, &mut normals);
    normals
}

/// [`vertex_normals`] into a buffer that is used again from frame to frame.
pub fn vertex_normals_into(topology: &Topology, x: &[Vec3], normals: &mut Vec<Vec3>) {
    normals.clear();
    normals.resize(topology.vertex_count(), Vec3::ZERO);
    for &face in topology.faces() {
        let area = double_area_vector(corners(face, x));
        for vertex in face {
            normals[vertex as usize] += area;
        }
    }
    for normal in normals {
        *normal = normal.normalize_or_zero();
    }
}

/// Area per face (m²).
pub fn face_areas(topology: &Topology, x: &[Vec3]) -> Vec<f64> {
    topology.faces().iter().map(|&face| 0.5 * double_area_vector(corners(face, x)).length()).collect()
}

/// Area of the whole surface (m²).
pub fn surface_area(topology: &Topology, x: &[Vec3]) -> f64 {
    face_areas(topology, x).iter().sum()
}

/// A third of the area of the faces around each vertex (m²); sums to the surface area.
pub fn vertex_areas(topology: &Topology, x: &[Vec3]) -> Vec<f64> {
    let mut areas = vec![0.0; topology.vertex_count()];
    for (&face, area) in topology.faces().iter().zip(face_areas(topology, x)) {
        for vertex in face {
            areas[vertex as usize] += area / 3.0;
        }
    }
    areas
}

/// Enclosed volume (m³), positive when faces wind counter-clockwise seen from outside.
///
/// Divergence theorem, summed about the first vertex. Of an open mesh it depends on that vertex.
pub fn volume(topology: &Topology, x: &[Vec3]) -> f64 {
    let Some(&origin) = x.first() else { return 0.0 };
    let six_volumes: f64 = topology
        .faces()
        .iter()
        .map(|&face| {
            let [a, b, c] = corners(face, x).map(|p| p - origin);
            a.dot(b.cross(c))
        })
        .sum();
    six_volumes / 6.0
}

/// Mean of the points; zero if there are none.
pub fn centroid(x: &[Vec3]) -> Vec3 {
    if x.is_empty() { Vec3::ZERO } else { x.iter().sum::<Vec3>() / x.len() as f64 }
}

/// Smallest and largest coordinates of the points; `None` if there are none.
pub fn bounds(x: &[Vec3]) -> Option<(Vec3, Vec3)> {
    let &first = x.first()?;
    Some(x.iter().fold((first, first), |(low, high), &p| (low.min(p), high.max(p))))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::{bounds, centroid, face_areas, face_normals, surface_area, vertex_areas, vertex_normals, volume};
    use crate::shapes::{grid, icosphere, torus};
    use crate::{Topology, Vec3, rotation_from_vector};

    #[test]
    fn volume_and_area_approach_those_of_the_smooth_shapes() {
        // The error falls by four when the edges are halved.
        let mut last = f64::INFINITY;
        for subdivisions in 2..6 {
            let sphere = icosphere(subdivisions);
            let error = (sphere.volume() / (4.0 / 3.0 * PI) - 1.0).abs();
            assert!(error < 0.3 * last);
            last = error;
        }
        assert!(last < 1e-3);
        let ring = torus(0.8, 0.3, 200, 100);
        assert!((ring.volume() / (2.0 * PI * PI * 0.8 * 0.09) - 1.0).abs() < 1e-3);
        assert!((surface_area(&ring.topology, &ring.vertices) / (4.0 * PI * PI * 0.8 * 0.3) - 1.0).abs() < 1e-3);
    }

    #[test]
    fn rigid_motion_keeps_volume_and_area_and_turns_normals() {
        let mesh = torus(0.8, 0.3, 30, 20);
        let rotation = rotation_from_vector(Vec3::new(0.3, -1.0, 0.4));
        let moved: Vec<Vec3> = mesh.vertices.iter().map(|&p| rotation * p + Vec3::new(10.0, 20.0, -5.0)).collect();
        assert!((volume(&mesh.topology, &moved) - mesh.volume()).abs() < 1e-12);
        for (turned, plain) in vertex_normals(&mesh.topology, &moved).iter().zip(mesh.vertex_normals()) {
            assert!(turned.distance(rotation * plain) < 1e-12);
        }
    }

    #[test]
    fn normals_of_a_sphere_point_outwards() {
        let mesh = icosphere(4);
        for (n, p) in mesh.vertex_normals().iter().zip(&mesh.vertices) {
            assert!(n.distance(*p) < 2e-2);
        }
        for (n, face) in mesh.face_normals().iter().zip(mesh.topology.faces()) {
            assert!((n.length() - 1.0).abs() < 1e-12 && n.dot(mesh.vertices[face[0] as usize]) > 0.9);
        }
    }

    #[test]
    fn vertex_areas_sum_to_the_area() {
        let mesh = grid(7, 3);
        assert!((vertex_areas(&mesh.topology, &mesh.vertices).iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(face_areas(&mesh.topology, &mesh.vertices).iter().all(|area| (area - 1.0 / 42.0).abs() < 1e-12));
    }

    #[test]
    fn faces_without_area_and_empty_meshes_do_no_harm() {
        let flat = Topology::new(3, vec![[0, 1, 2]]).unwrap();
        let x = [Vec3::ZERO, Vec3::X, 2.0 * Vec3::X];
        assert_eq!(face_normals(&flat, &x), [Vec3::ZERO]);
        assert_eq!(vertex_normals(&flat, &x), [Vec3::ZERO; 3]);
        let nothing = Topology::new(0, Vec::new()).unwrap();
        assert!(volume(&nothing, &[]).abs() < 1e-300);
        assert_eq!((centroid(&[]), bounds(&[])), (Vec3::ZERO, None));
        assert_eq!(bounds(&x), Some((Vec3::ZERO, 2.0 * Vec3::X)));
    }
}
