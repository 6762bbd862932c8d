//! Cutting a mesh with a plane.

use std::collections::BTreeMap;

use crate::{Topology, Vec3};

/// Where a plane crosses one face. Seen against the normal, the inside of the mesh is to the left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SliceSegment {
    /// The face.
    pub face: u32,
    /// The two ends (m).
    pub ends: [Vec3; 2],
    /// The mesh edge on which each end lies, smaller vertex first. Segments that share an edge are neighbours.
    pub edges: [[u32; 2]; 2],
}

/// A polyline in a plane.
#[derive(Debug, Clone, PartialEq)]
pub struct SliceLoop {
    /// Its points in order (m); of a closed one the first is not repeated.
    pub points: Vec<Vec3>,
    /// Whether the last point is joined to the first.
    pub closed: bool,
}

impl SliceLoop {
    /// Its length (m).
    pub fn length(&self) -> f64 {
        let open: f64 = self.points.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
        match (self.closed, self.points.first(), self.points.last()) {
            (true, Some(first), Some(last)) => open + first.distance(*last),
            _ => open,
        }
    }
}

/// The segments in which a plane crosses the faces for which `keep` holds, in the order of the faces.
///
/// A vertex exactly in the plane counts as above it, so that loops close and no segment is found twice.
pub fn slice_by_plane(
    topology: &Topology,
    x: &[Vec3],
    point: Vec3,
    normal: Vec3,
    mut keep: impl FnMut(usize) -> bool,
) -> Vec<SliceSegment> {
    let heights: Vec<f64> = x.iter().map(|&p| (p - point).dot(normal)).collect();
    let above = |vertex: u32| heights[vertex as usize] >= 0.0;
    let crossing = |a: u32, b: u32| {
        // One direction for both faces at the edge, so that their ends agree to the last bit.
        let (a, b) = (a.min(b), a.max(b));
        let (ha, hb) = (heights[a as usize], heights[b as usize]);
        (x[a as usize].lerp(x[b as usize], ha / (ha - hb)), [a, b])
    };
    let mut segments = Vec::new();
    for (face, &corners) in topology.faces().iter().enumerate() {
        let sides = corners.map(above);
        if sides[0] == sides[1] && sides[1] == sides[2] || !keep(face) {
            continue;
        }
        // The corner that is alone on its side.
        let alone = (0..3).find(|&i| sides[i] != sides[(i + 1) % 3] && sides[i] != sides[(i + 2) % 3]).unwrap_or(0);
        let (apex, next, previous) = (corners[alone], corners[(alone + 1) % 3], corners[(alone + 2) % 3]);
        let (to_next, to_previous) = (crossing(apex, next), crossing(apex, previous));
        let (from, to) = if sides[alone] { (to_next, to_previous) } else { (to_previous, to_next) };
        segments.push(SliceSegment { face: face as u32, ends: [from.0, to.0], edges: [from.1, to.1] });
    }
    segments
}

/// Joins segments at their mesh edges into loops; open ones remain where a neighbour is missing.
pub fn chain_segments(segments: &[SliceSegment]) -> Vec<SliceLoop> {
    let mut by_edge: BTreeMap<[u32; 2], Vec<usize>> = BTreeMap::new();
    for (index, segment) in segments.iter().enumerate() {
        for edge in segment.edges {
            by_edge.entry(edge).or_default().push(index);
        }
    }
    let mut used = vec![false; segments.len()];
    let mut loops = Vec::new();
    // First from the ends that have no neighbour, then around what is left.
    let has_neighbour = |segment: &SliceSegment, end: usize| by_edge[&segment.edges[end]].len() > 1;
    let starts =
        |wanted: bool| segments.iter().enumerate().flat_map(move |(index, _)| [(index, 0, wanted), (index, 1, wanted)]);
    for (start, end, open) in starts(true).chain(starts(false)) {
        if used[start] || open && has_neighbour(&segments[start], end) {
            continue;
        }
        let mut points = vec![segments[start].ends[end]];
        let (mut index, mut exit) = (start, 1 - end);
        let closed = loop {
            used[index] = true;
            let edge = segments[index].edges[exit];
            let neighbour = by_edge[&edge].iter().copied().find(|&other| !used[other]);
            let Some(next) = neighbour else {
                let closed = edge == segments[start].edges[end] && index != start;
                if !closed {
                    points.push(segments[index].ends[exit]);
                }
                break closed;
            };
            points.push(segments[index].ends[exit]);
            exit = if segments[next].edges[0] == edge { 1 } else { 0 };
            index = next;
        };
        loops.push(SliceLoop { points, closed });
    }
    loops
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::{chain_segments, slice_by_plane};
    use crate::shapes::{grid, icosphere, torus};
    use crate::{Vec2, Vec3, polygon_area};

    #[test]
    fn a_sphere_is_cut_in_a_circle() {
        let mesh = icosphere(5);
        for height in [0.0, 0.3, -0.8] {
            let normal = Vec3::new(0.2, 1.0, -0.3).normalize();
            let segments = slice_by_plane(&mesh.topology, &mesh.vertices, height * normal, normal, |_| true);
            let loops = chain_segments(&segments);
            assert_eq!(loops.len(), 1);
            assert!(loops[0].closed && loops[0].points.len() == segments.len());
            let circumference = TAU * (1.0f64 - height * height).sqrt();
            assert!((loops[0].length() / circumference - 1.0).abs() < 2e-3);
            for p in &loops[0].points {
                assert!((p.dot(normal) - height).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_torus_is_cut_in_two_circles_that_run_opposite_ways() {
        let mesh = torus(0.8, 0.3, 100, 60);
        let segments = slice_by_plane(&mesh.topology, &mesh.vertices, Vec3::ZERO, Vec3::Y, |_| true);
        let mut areas: Vec<f64> = chain_segments(&segments)
            .iter()
            .map(|ring| {
                assert!(ring.closed);
                // Seen from +Y, with X to the right, Z points down.
                let corners: Vec<Vec2> = ring.points.iter().map(|p| Vec2::new(p.x, -p.z)).collect();
                polygon_area(&corners)
            })
            .collect();
        areas.sort_by(f64::total_cmp);
        assert_eq!(areas.len(), 2);
        assert!((areas[0] / (-TAU / 2.0 * 0.25) - 1.0).abs() < 2e-3);
        assert!((areas[1] / (TAU / 2.0 * 1.21) - 1.0).abs() < 2e-3);
    }

    #[test]
    fn a_filter_leaves_open_pieces_and_a_sheet_gives_a_line() {
        let sphere = icosphere(3);
        let faces = sphere.topology.faces();
        let right = |face: usize| faces[face].iter().all(|&v| sphere.vertices[v as usize].x > 0.0);
        let half = chain_segments(&slice_by_plane(&sphere.topology, &sphere.vertices, Vec3::ZERO, Vec3::Y, right));
        assert_eq!(half.len(), 1);
        assert!(!half[0].closed && half[0].length() > 2.5 && half[0].length() < 3.2);
        let sheet = grid(7, 5);
        let point = Vec3::new(0.0, 0.37, 0.0);
        let line = chain_segments(&slice_by_plane(&sheet.topology, &sheet.vertices, point, Vec3::Y, |_| true));
        assert_eq!(line.len(), 1);
        assert!(!line[0].closed && (line[0].length() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn vertices_in_the_plane_do_not_break_the_loop() {
        // The torus has rings of vertices exactly at y = 0, the grid rows at multiples of 1/4.
        let mesh = torus(0.5, 0.2, 12, 8);
        let loops = chain_segments(&slice_by_plane(&mesh.topology, &mesh.vertices, Vec3::ZERO, Vec3::Y, |_| true));
        assert_eq!(loops.len(), 2);
        assert!(loops.iter().all(|ring| ring.closed));
        let sheet = grid(4, 4);
        let at_row = slice_by_plane(&sheet.topology, &sheet.vertices, Vec3::new(0.0, 0.5, 0.0), Vec3::Y, |_| true);
        assert_eq!(chain_segments(&at_row).len(), 1);
    }
}
