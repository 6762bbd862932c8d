//! The elastic waist band: where it sits, and how its cloth is gathered to the body.

use modiste_core::{Vec2, Vec3};

use super::Mannequin;
use crate::cut::CutGarment;
use crate::{Attachment, BodyCollider, BodyPoint};

/// The band sits this share of the stature below the waist (at the navel).
const BELOW_WAIST: f64 = 0.017;

/// The front of the band sits lower than the back, per metre of depth.
const TILT: f64 = 0.10;

/// Height of the band above the body's surface (m).
const OFFSET: f64 = 0.0025;

/// Stiffness of each hold (N/m): a hand's weight moves the band by millimetres.
const STIFFNESS: f64 = 120.0;

/// The elastic is this much shorter than the body's girth under it.
const ELASTIC_SHARE: f64 = 0.985;

/// Depth of the band below the top edge (m), and where its gathering has died out.
const BAND_DEPTH: f64 = 0.03;
const GATHER_DEPTH: f64 = 0.11;

/// Holds of the waist band's vertices to the body at the height of the waist; empty where there is no band.
pub(super) fn hold(cut: &CutGarment, positions: &[Vec3], body: &Mannequin, collider: &BodyCollider) -> Vec<Attachment> {
    let height = body.waist_height() - BELOW_WAIST * body.stature();
    let vertices = band_vertices(cut);
    let middle = vertices.iter().map(|&v| positions[v as usize].z).sum::<f64>() / vertices.len().max(1) as f64;
    vertices
        .into_iter()
        .filter_map(|vertex| {
            let x = positions[vertex as usize];
            let target = Vec3::new(x.x, height - TILT * (x.z - middle), x.z);
            let (point, _) = collider.closest(target, 0.3)?;
            Some(Attachment { vertex, point, offset: OFFSET, stiffness: STIFFNESS })
        })
        .collect()
}

/// The vertices of the band, ascending.
pub(super) fn band_vertices(cut: &CutGarment) -> Vec<u32> {
    let mut vertices: Vec<u32> = cut.waist_band().iter().flatten().copied().collect();
    vertices.sort_unstable();
    vertices.dedup();
    vertices
}

/// The rest faces of a size with the band gathered (or let out) to the length of the holds on this body.
pub(super) fn gathered_rest_faces(cut: &CutGarment, size: usize, holds: &[Attachment], body: &Mannequin) -> Vec<[Vec2; 3]> {
    let mut rest = cut.rest_faces(size);
    if holds.is_empty() {
        return rest;
    }
    let surface = |point: &BodyPoint| -> Vec3 {
        let corners = body.topology.faces()[point.face as usize].map(|v| body.vertices[v as usize]);
        (0..3).map(|c| point.barycentric[c] * corners[c]).sum()
    };
    let place = |vertex: u32| holds.iter().find(|h| h.vertex == vertex).map(|h| surface(&h.point));
    let worn: f64 =
        cut.waist_band().iter().filter_map(|&[a, b]| Some(place(a)?.distance(place(b)?))).sum();
    let edges: Vec<(usize, [Vec2; 2])> = waist_edges(cut, size);
    let flat: f64 = edges.iter().map(|(_, [a, b])| a.distance(*b)).sum();
    let scale = (ELASTIC_SHARE * worn / flat).clamp(0.6, 1.4);
    let points = cut.points(size);
    for (panel, range) in cut.face_ranges().enumerate() {
        for face in range {
            let corners = cut.loose_topology().faces()[face];
            let centre = corners.iter().map(|&v| points[v as usize]).sum::<Vec2>() / 3.0;
            let nearest = edges
                .iter()
                .filter(|(owner, _)| *owner == panel)
                .map(|(_, [a, b])| distance_to_segment(centre, *a, *b))
                .fold(f64::INFINITY, f64::min);
            let share = ((GATHER_DEPTH - nearest) / (GATHER_DEPTH - BAND_DEPTH)).clamp(0.0, 1.0);
            let factor = 1.0 + (scale - 1.0) * share * share * (3.0 - 2.0 * share);
            rest[face].iter_mut().for_each(|corner| corner.x *= factor);
        }
    }
    rest
}

/// The segments of the band's edges in panel space, with their panel.
fn waist_edges(cut: &CutGarment, size: usize) -> Vec<(usize, [Vec2; 2])> {
    let points = cut.points(size);
    let mut edges = Vec::new();
    for id in &cut.pattern().waist_band {
        let start = cut.panel_range(id.panel).start;
        let run = cut.panels()[id.panel].edge_vertices(id.edge);
        for pair in run.windows(2) {
            edges.push((id.panel, [pair[0], pair[1]].map(|v| points[start + v as usize])));
        }
    }
    edges
}

fn distance_to_segment(p: Vec2, a: Vec2, b: Vec2) -> f64 {
    let along = b - a;
    let t = ((p - a).dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    p.distance(a + t * along)
}
