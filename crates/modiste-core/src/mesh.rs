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
