//! The elastic waist band: where it sits, and how its cloth is gathered to the body.

use modiste_core::{Vec2, Vec3};

use super::Mannequin;
use crate::cut::CutGarment;
use crate::pattern::Fitting;
use crate::{Attachment, BodyCollider};

/// The front of the band sits lower than the back, per metre of depth.
const TILT: f64 = 0.10;

/// Height of the band above the body's surface (m).
const OFFSET: f64 = 0.0025;

/// Stiffness of each hold (N/m): a hand's weight moves the band by millimetres.
const STIFFNESS: f64 = 120.0;

/// What the whole band holds at most (N). An elastic of 15 N presses on the waist with 2π times as much, and cotton on skin rubs
/// with some 0.4 of that. When its wearer squats, the back of it is pulled down, or the seat would tear.
const GRIP: f64 = 40.0;

/// The elastic is this much shorter than the body's girth under it.
const ELASTIC_SHARE: f64 = 0.985;

/// Depth of the band below the top edge (m), and where its gathering has died out.
const BAND_DEPTH: f64 = 0.03;
const GATHER_DEPTH: f64 = 0.11;

/// Rounds of evening out the band around the body.
const SPACING_ROUNDS: usize = 60;

/// Holds of the waist band's vertices to the body at the height of the waist; empty where there is no band.
///
/// Along the band the holds are spaced as its cloth is, so that it is gathered evenly.
pub(super) fn hold(
    cut: &CutGarment,
    fitting: Fitting,
    positions: &[Vec3],
    body: &Mannequin,
    collider: &BodyCollider,
) -> Vec<Attachment> {
    let (ring, lengths) = ring(cut, fitting);
    let count = ring.len();
    let height = cut.pattern().band * body.stature();
    let mut places: Vec<Vec3> = ring.iter().map(|&v| positions[v as usize]).collect();
    let middle = places.iter().map(|p| p.z).sum::<f64>() / count.max(1) as f64;
    let level = |p: Vec3| Vec3::new(p.x, height - TILT * (p.z - middle), p.z);
    let surface = |p: Vec3| collider.closest(level(p), 0.3);
    for _ in 0..SPACING_ROUNDS {
        for i in 0..count {
            let (before, after) = ((i + count - 1) % count, (i + 1) % count);
            let share = lengths[before] / (lengths[before] + lengths[i]);
            let even = places[before].lerp(places[after], share);
            if let Some((point, _)) = surface(places[i].lerp(even, 0.5)) {
                places[i] = level(body.surface_point(&point));
            }
        }
    }
    let hold = |(&vertex, &place): (&u32, &Vec3)| {
        let (point, _) = surface(place)?;
        Some(Attachment { vertex, point, offset: OFFSET, stiffness: STIFFNESS, most: GRIP / count as f64 })
    };
    ring.iter().zip(&places).filter_map(hold).collect()
}

/// Holds of a band that keeps its place, as a sewn garment has it on its body.
pub(super) fn hold_in_place(band: &[u32], positions: &[Vec3], collider: &BodyCollider) -> Vec<Attachment> {
    let hold = |&vertex: &u32| {
        let (point, _) = collider.closest(positions[vertex as usize], 0.3)?;
        Some(Attachment { vertex, point, offset: OFFSET, stiffness: STIFFNESS, most: GRIP / band.len() as f64 })
    };
    band.iter().filter_map(hold).collect()
}

/// The band's vertices in order around the waist, and the rest length from each to the next (m).
fn ring(cut: &CutGarment, fitting: Fitting) -> (Vec<u32>, Vec<f64>) {
    let lengths = waist_edges(cut, fitting);
    let mut links: Vec<([u32; 2], f64)> =
        cut.waist_band().iter().zip(&lengths).map(|(&pair, (_, [a, b]))| (pair, a.distance(*b))).collect();
    let (mut order, mut steps) = (Vec::new(), Vec::new());
    let Some(&([first, _], _)) = links.first() else { return (order, steps) };
    let mut at = first;
    while let Some(index) = links.iter().position(|([a, b], _)| *a == at || *b == at) {
        let ([a, b], length) = links.swap_remove(index);
        order.push(at);
        steps.push(length);
        at = if a == at { b } else { a };
    }
    (order, steps)
}

/// The vertices of the band, ascending.
pub(super) fn band_vertices(cut: &CutGarment) -> Vec<u32> {
    let mut vertices: Vec<u32> = cut.waist_band().iter().flatten().copied().collect();
    vertices.sort_unstable();
    vertices.dedup();
    vertices
}

/// The rest faces of a size with the band gathered (or let out) to the length of the holds on this body.
pub(super) fn gathered_rest_faces(
    cut: &CutGarment,
    fitting: Fitting,
    holds: &[Attachment],
    body: &Mannequin,
) -> Vec<[Vec2; 3]> {
    let mut rest = cut.rest_faces(fitting);
    if holds.is_empty() {
        return rest;
    }
    let place = |vertex: u32| holds.iter().find(|h| h.vertex == vertex).map(|h| body.surface_point(&h.point));
    let worn: f64 = cut.waist_band().iter().filter_map(|&[a, b]| Some(place(a)?.distance(place(b)?))).sum();
    let edges: Vec<(usize, [Vec2; 2])> = waist_edges(cut, fitting);
    let flat: f64 = edges.iter().map(|(_, [a, b])| a.distance(*b)).sum();
    let scale = (ELASTIC_SHARE * worn / flat).clamp(0.6, 1.4);
    let points = cut.points(fitting);
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
fn waist_edges(cut: &CutGarment, fitting: Fitting) -> Vec<(usize, [Vec2; 2])> {
    let points = cut.points(fitting);
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
