//! What an outer garment lies on: the body above the waist and the garments below (Guan ch. 5 §4, "Details").

use std::collections::VecDeque;

use modiste_body::Part;
use modiste_core::{Mat3, Topology, Vec3, centroid};

use crate::GarmentError;

/// The vertices of the body that are reached from the head without passing the waist, ascending.
///
/// At the waist all edges of trunk and thighs are cut that cross the plane through the waist band of the lower garment,
/// everything in the template pose. Hands may hang at that height; they are not cut off. Done once per body and garment.
///
/// # Errors
/// No waist band, no head, or a waist that does not part the body: the breadth-first search reached the feet.
pub fn upper_body(
    topology: &Topology,
    vertex_parts: &[Part],
    body: &[Vec3],
    waist_band: &[Vec3],
) -> Result<Vec<u32>, GarmentError> {
    if waist_band.len() < 3 {
        return Err(GarmentError::data("waist band of the lower garment", "at least 3 vertices", waist_band.len()));
    }
    let (origin, normal) = plane(waist_band);
    let may_cut = |vertex: usize| {
        matches!(vertex_parts[vertex], Part::Pelvis | Part::Abdomen | Part::Chest | Part::LeftThigh | Part::RightThigh)
    };
    let is_above = |vertex: usize| normal.dot(body[vertex] - origin) > 0.0;
    let is_cut = |a: usize, b: usize| may_cut(a) && may_cut(b) && is_above(a) != is_above(b);
    let head = vertex_parts.iter().position(|&part| part == Part::Head);
    let head = head.ok_or_else(|| GarmentError::data("body", "a vertex of the head", "none"))?;
    let mut reached = vec![false; body.len()];
    let mut queue = VecDeque::from([head]);
    reached[head] = true;
    while let Some(vertex) = queue.pop_front() {
        for &neighbour in topology.neighbours(vertex) {
            let neighbour = neighbour as usize;
            if !reached[neighbour] && !is_cut(vertex, neighbour) {
                reached[neighbour] = true;
                queue.push_back(neighbour);
            }
        }
    }
    let foot = |vertex: &usize| matches!(vertex_parts[*vertex], Part::LeftFoot | Part::RightFoot);
    if let Some(vertex) = (0..body.len()).filter(|&vertex| reached[vertex]).find(foot) {
        let found = format!("vertex {vertex} of a foot reached from the head");
        return Err(GarmentError::data("waist of the body", "a closed ring of vertices", found));
    }
    Ok((0..body.len() as u32).filter(|&vertex| reached[vertex as usize]).collect())
}

/// A plane through points that lie roughly in a ring: its centroid and unit normal, upwards.
fn plane(points: &[Vec3]) -> (Vec3, Vec3) {
    let origin = centroid(points);
    let mut spread = Mat3::ZERO;
    for point in points {
        let offset = *point - origin;
        spread += Mat3::from_cols(offset * offset.x, offset * offset.y, offset * offset.z);
    }
    // The normal (a, 1, c) that minimises Σ (n·offset)²: y = -(a x + c z).
    let (xx, xz, zz) = (spread.x_axis.x, spread.x_axis.z, spread.z_axis.z);
    let (xy, zy) = (spread.x_axis.y, spread.z_axis.y);
    let determinant = xx * zz - xz * xz;
    if determinant.abs() < 1e-12 {
        return (origin, Vec3::Y);
    }
    let a = (xz * zy - zz * xy) / determinant;
    let c = (xz * xy - xx * zy) / determinant;
    (origin, Vec3::new(a, 1.0, c).normalize_or(Vec3::Y))
}

#[cfg(test)]
mod tests {
    use super::{plane, upper_body};
    use modiste_body::Part;
    use modiste_core::shapes::icosphere;
    use modiste_core::{Mesh, Quat, Vec3};

    /// An egg of a body: head on top, feet below.
    fn body() -> (Mesh, Vec<Part>) {
        let mesh = icosphere(5);
        let part = |y: f64| match y {
            y if y > 0.8 => Part::Head,
            y if y < -0.9 => Part::LeftFoot,
            y if y < -0.3 => Part::LeftThigh,
            _ => Part::Abdomen,
        };
        let parts = mesh.vertices.iter().map(|vertex| part(vertex.y)).collect();
        let vertices = mesh.vertices.iter().map(|v| Vec3::new(0.2, 0.35, 0.2) * *v).collect();
        (Mesh { vertices, ..mesh }, parts)
    }

    fn ring(radius: f64, tilt: f64) -> Vec<Vec3> {
        let turn = Quat::from_rotation_x(tilt);
        (0..20).map(|i| turn * (Quat::from_rotation_y(f64::from(i) * 0.314) * Vec3::new(radius, 0.0, 0.0))).collect()
    }

    #[test]
    fn the_plane_of_a_tilted_ring_is_found() {
        let (origin, normal) = plane(&ring(0.15, 0.3));
        assert!(origin.length() < 1e-3);
        assert!(normal.distance(Quat::from_rotation_x(0.3) * Vec3::Y) < 1e-2);
    }

    #[test]
    fn the_search_stops_at_the_waist() {
        let (mesh, parts) = body();
        let upper = upper_body(&mesh.topology, &parts, &mesh.vertices, &ring(0.2, 0.1)).unwrap();
        let heights = upper.iter().map(|&vertex| mesh.vertices[vertex as usize].y);
        assert!(heights.fold(f64::INFINITY, f64::min) > -0.02);
        assert!(upper.len() > 4000);
    }

    #[test]
    fn a_waist_that_does_not_part_the_body_is_refused() {
        let (mesh, parts) = body();
        let low: Vec<Vec3> = ring(0.2, 0.0).iter().map(|v| *v - Vec3::new(0.0, 0.45, 0.0)).collect();
        let error = upper_body(&mesh.topology, &parts, &mesh.vertices, &low).unwrap_err();
        assert!(error.to_string().contains("foot reached"), "{error}");
        assert!(upper_body(&mesh.topology, &parts, &mesh.vertices, &[]).is_err());
    }
}
