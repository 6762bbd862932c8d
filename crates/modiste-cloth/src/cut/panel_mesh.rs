//! Triangulation of one panel: even boundary samples, an even cloud inside, constrained Delaunay.

use modiste_core::Vec2;
use spade::{AngleLimit, ConstrainedDelaunayTriangulation, Point2, RefinementParameters, Triangulation};

use crate::pattern::{Outline, signed_area};

/// Angle (degrees) below which a triangle is refined.
pub const MIN_ANGLE_DEGREES: f64 = 25.0;

/// Rounds of moving inner vertices to the mean of their neighbours.
const SMOOTHING_ROUNDS: usize = 12;

/// Seeds closer to the boundary than this share of the edge length are left out: they would make slivers.
const BOUNDARY_CLEARANCE: f64 = 0.55;

/// A triangulated panel.
#[derive(Debug, Clone, PartialEq)]
pub struct PanelMesh {
    /// Vertices in panel space (m): the boundary in loop order, then the inside.
    pub points: Vec<Vec2>,
    /// Triangles, counter-clockwise in panel space.
    pub faces: Vec<[u32; 3]>,
    /// How many segments each edge of the outline has.
    pub edge_segments: Vec<usize>,
}

impl PanelMesh {
    /// Number of boundary vertices; they come first, in loop order.
    pub fn boundary_count(&self) -> usize {
        self.edge_segments.iter().sum()
    }

    /// The vertices along an edge, from its start to its end.
    pub fn edge_vertices(&self, edge: usize) -> Vec<u32> {
        let first: usize = self.edge_segments[..edge].iter().sum();
        let count = self.boundary_count();
        (first..=first + self.edge_segments[edge]).map(|i| (i % count) as u32).collect()
    }

    /// Smallest angle of any triangle (degrees).
    pub fn min_angle_degrees(&self) -> f64 {
        let angle = |a: Vec2, b: Vec2, c: Vec2| (b - a).angle_to(c - a).abs().to_degrees();
        self.faces
            .iter()
            .map(|face| {
                let [a, b, c] = face.map(|v| self.points[v as usize]);
                angle(a, b, c).min(angle(b, c, a)).min(angle(c, a, b))
            })
            .fold(180.0, f64::min)
    }

    /// The mesh mirrored left to right for a panel that is the mirror image of this one, its loop reversed.
    pub fn mirrored(&self) -> Self {
        let boundary = self.boundary_count();
        // Boundary vertex 0 stays first; the others follow backwards.
        let old = |new: usize| if new < boundary { (boundary - new) % boundary } else { new };
        let points = (0..self.points.len()).map(|i| self.points[old(i)]).map(|p| Vec2::new(-p.x, p.y)).collect();
        // The map is its own inverse.
        let faces = self.faces.iter().map(|&[a, b, c]| [a, c, b].map(|v| old(v as usize) as u32)).collect();
        Self { points, faces, edge_segments: self.edge_segments.iter().rev().copied().collect() }
    }
}

/// The boundary vertices of an outline with these numbers of segments per edge, evenly spaced along each.
pub(super) fn boundary_points(outline: &Outline, edge_segments: &[usize]) -> Vec<Vec2> {
    let mut points = Vec::with_capacity(edge_segments.iter().sum());
    for (edge, &segments) in edge_segments.iter().enumerate() {
        let (start, end, curve) = outline.edge(edge);
        let fractions: Vec<f64> = (0..segments).map(|i| i as f64 / segments as f64).collect();
        points.extend(curve.points_at(start, end, &fractions));
    }
    points
}

/// Meshes an outline with the given numbers of segments per edge and about `edge_length` (m) inside.
///
/// Inner vertices start on a triangular lattice centred on x = 0, are smoothed under repeated Delaunay triangulation, and
/// whatever triangle is still sharper than [`MIN_ANGLE_DEGREES`] is refined without splitting the boundary.
pub fn mesh_panel(outline: &Outline, edge_segments: &[usize], edge_length: f64) -> PanelMesh {
    let boundary = boundary_points(outline, edge_segments);
    let mut points = boundary.clone();
    points.extend(lattice(&boundary, edge_length));
    let mut faces = triangulate(&points, &boundary);
    for _ in 0..SMOOTHING_ROUNDS {
        smooth(&mut points, boundary.len(), &faces);
        faces = triangulate(&points, &boundary);
    }
    let mesh = PanelMesh { points, faces, edge_segments: edge_segments.to_vec() };
    if mesh.min_angle_degrees() >= MIN_ANGLE_DEGREES { mesh } else { refine(&mesh, boundary.len()) }
}

/// Lattice points inside the polygon, clear of its boundary.
fn lattice(boundary: &[Vec2], edge_length: f64) -> Vec<Vec2> {
    let (low, high) = boundary.iter().fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
    let row_height = edge_length * 0.75f64.sqrt();
    let rows = ((high.y - low.y) / row_height).ceil() as i64;
    let columns = (low.x.abs().max(high.x.abs()) / edge_length).ceil() as i64 + 1;
    let mut points = Vec::new();
    for row in 0..=rows {
        let shift = if row % 2 == 0 { 0.0 } else { 0.5 };
        for column in -columns..=columns {
            let p = Vec2::new((column as f64 + shift) * edge_length, low.y + row as f64 * row_height);
            if is_inside(boundary, p) && distance_to(boundary, p) > BOUNDARY_CLEARANCE * edge_length {
                points.push(p);
            }
        }
    }
    points
}

/// Whether a point is inside a polygon (odd number of crossings of a ray to +x).
pub(super) fn is_inside(polygon: &[Vec2], p: Vec2) -> bool {
    let mut inside = false;
    for i in 0..polygon.len() {
        let (a, b) = (polygon[i], polygon[(i + 1) % polygon.len()]);
        if (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x) {
            inside = !inside;
        }
    }
    inside
}

fn distance_to(polygon: &[Vec2], p: Vec2) -> f64 {
    (0..polygon.len())
        .map(|i| {
            let (a, b) = (polygon[i], polygon[(i + 1) % polygon.len()]);
            let along = b - a;
            let t = ((p - a).dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            p.distance(a + t * along)
        })
        .fold(f64::INFINITY, f64::min)
}

type Cdt = ConstrainedDelaunayTriangulation<Point2<f64>>;

fn constrained(points: &[Vec2], boundary_count: usize) -> Option<Cdt> {
    let vertices = points.iter().map(|p| Point2::new(p.x, p.y)).collect();
    let edges = (0..boundary_count).map(|i| [i, (i + 1) % boundary_count]).collect();
    Cdt::bulk_load_cdt(vertices, edges).ok()
}

/// Constrained Delaunay triangles inside the boundary, counter-clockwise.
fn triangulate(points: &[Vec2], boundary: &[Vec2]) -> Vec<[u32; 3]> {
    let Some(cdt) = constrained(points, boundary.len()) else { return Vec::new() };
    inner_triangles(&cdt, boundary)
}

fn inner_triangles(cdt: &Cdt, boundary: &[Vec2]) -> Vec<[u32; 3]> {
    cdt.inner_faces()
        .filter_map(|face| {
            let corners = face.vertices();
            let positions = corners.map(|v| Vec2::new(v.position().x, v.position().y));
            let centre = (positions[0] + positions[1] + positions[2]) / 3.0;
            // Samples of a straight edge are collinear up to rounding; their slivers outside the panel have no area.
            let has_area = signed_area(&positions) > 1e-9 * positions[0].distance_squared(positions[1]);
            (has_area && is_inside(boundary, centre)).then(|| corners.map(|v| v.fix().index() as u32))
        })
        .collect()
}

/// Moves each inner vertex to the mean of its neighbours.
fn smooth(points: &mut [Vec2], boundary_count: usize, faces: &[[u32; 3]]) {
    let mut sums = vec![(Vec2::ZERO, 0.0); points.len()];
    for face in faces {
        for corner in 0..3 {
            let (a, b) = (face[corner] as usize, face[(corner + 1) % 3] as usize);
            sums[a].0 += points[b];
            sums[a].1 += 1.0;
            sums[b].0 += points[a];
            sums[b].1 += 1.0;
        }
    }
    for i in boundary_count..points.len() {
        if sums[i].1 > 0.0 {
            points[i] = sums[i].0 / sums[i].1;
        }
    }
}

/// Adds inner vertices until the angles are wide enough; the boundary stays as it is, for the seams.
fn refine(mesh: &PanelMesh, boundary_count: usize) -> PanelMesh {
    let boundary = &mesh.points[..boundary_count];
    let Some(mut cdt) = constrained(&mesh.points, boundary_count) else { return mesh.clone() };
    cdt.refine(
        RefinementParameters::<f64>::new()
            .with_angle_limit(AngleLimit::from_deg(MIN_ANGLE_DEGREES))
            .with_max_additional_vertices(mesh.points.len() / 4)
            .exclude_outer_faces(true)
            .keep_constraint_edges(),
    );
    let points: Vec<Vec2> = cdt.vertices().map(|v| Vec2::new(v.position().x, v.position().y)).collect();
    let refined =
        PanelMesh { faces: inner_triangles(&cdt, boundary), points, edge_segments: mesh.edge_segments.clone() };
    // Corners sharper than the limit cannot be refined away; keep the mesh without needless vertices then.
    if refined.min_angle_degrees() > mesh.min_angle_degrees() { refined } else { mesh.clone() }
}

#[cfg(test)]
mod tests {
    use super::{PanelMesh, mesh_panel};
    use crate::pattern::{draft_shorts, draft_tshirt, signed_area};
    use modiste_body::Gender;

    fn area(mesh: &PanelMesh) -> f64 {
        mesh.faces.iter().map(|f| signed_area(&f.map(|v| mesh.points[v as usize]))).sum()
    }

    #[test]
    fn panels_are_covered_by_well_shaped_triangles() {
        for pattern in [draft_tshirt(Gender::Female), draft_shorts(Gender::Male)] {
            for panel in &pattern.panels {
                let outline = &panel.outlines[pattern.template_size];
                for edge_length in [0.03, 0.015] {
                    let segments: Vec<usize> = (0..outline.vertices.len())
                        .map(|e| (outline.edge_length(e) / edge_length).round().max(1.0) as usize)
                        .collect();
                    let mesh = mesh_panel(outline, &segments, edge_length);
                    let boundary = signed_area(&mesh.points[..mesh.boundary_count()]).abs();
                    assert!((area(&mesh) - boundary).abs() < 1e-9 * boundary, "{}", panel.name);
                    assert!(mesh.faces.iter().all(|f| signed_area(&f.map(|v| mesh.points[v as usize])) > 0.0));
                    // A disk has F = 2V - B - 2.
                    assert_eq!(mesh.faces.len(), 2 * mesh.points.len() - mesh.boundary_count() - 2);
                    // The crotch points of the shorts are corners that a coarse boundary can not fill better.
                    let limit = if edge_length > 0.02 { 19.0 } else { 25.0 };
                    assert!(mesh.min_angle_degrees() > limit, "{} {}", panel.name, mesh.min_angle_degrees());
                }
            }
        }
    }

    #[test]
    fn a_mirrored_mesh_fits_the_mirrored_panel() {
        let pattern = draft_shorts(Gender::Female);
        let segments = vec![6; pattern.panels[0].edge_labels.len()];
        let left = mesh_panel(&pattern.panels[0].outlines[3], &segments, 0.03);
        let right = left.mirrored();
        let outline = &pattern.panels[2].outlines[3];
        let boundary = super::boundary_points(outline, &right.edge_segments);
        for (a, b) in boundary.iter().zip(&right.points) {
            assert!(a.distance(*b) < 1e-4);
        }
        assert!((area(&right) - area(&left)).abs() < 1e-12);
        assert_eq!(right.mirrored(), left);
    }
}
