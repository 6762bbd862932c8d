//! Reads the directions off their surface, continues them where the topologies differ, and checks the result.

use modiste_core::{SolveError, SparseCholesky, TriangleBvh, Vec3};
use serde::Serialize;

use super::{Registration, RegistrationError, ScanShapes, Target, is_comparable};
use crate::makehuman::{BODY_VERTEX_COUNT, Offsets};
use crate::population::SoftDirections;
use crate::{MakeHumanModel, Part};

/// Weight that holds matched vertices to the value read off, against the edges that continue the field.
const HOLD: f64 = 30.0;

/// How far a registered vertex may lie from their surface to be read off (m).
const REACH: f64 = 0.05;

/// The scan directions on the points of our topology, in our template pose.
///
/// # Errors
/// When the continuation cannot be solved.
pub fn carry(
    model: &MakeHumanModel,
    scans: &ScanShapes,
    registration: &Registration,
) -> Result<SoftDirections, RegistrationError> {
    let target = Target::new(&scans.topology, &scans.template);
    let places: Vec<Option<(u32, [f64; 3])>> = registration
        .vertices
        .iter()
        .zip(&registration.matched)
        .map(|(&p, &matched)| {
            let found = if matched { target.tree.closest_point(target.vertices, p, REACH) } else { None };
            found.map(|found| (found.face, found.barycentric))
        })
        .collect();
    let continuation = continuation(model, &places)?;
    let directions = scans
        .directions
        .iter()
        .map(|direction| {
            let read_off = |(vertex, place): (usize, &Option<(u32, [f64; 3])>)| {
                place.map_or(Vec3::ZERO, |(face, barycentric)| {
                    let corners = target.topology.faces()[face as usize].map(|corner| direction[corner as usize]);
                    let theirs: Vec3 = corners.iter().zip(barycentric).map(|(d, b)| *d * b).sum();
                    HOLD * (registration.theirs_from_ours[vertex].transpose() * theirs)
                })
            };
            let mut field: Vec<Vec3> = places.iter().enumerate().map(read_off).collect();
            continuation.solve_points(&mut field);
            let joints = joint_displacements(model, &field);
            field.extend(joints);
            Offsets::from_dense(&field)
        })
        .collect();
    Ok(SoftDirections { directions })
}

/// `Σ_edges |d_i - d_j|² + HOLD Σ_matched |d_i - read off|²`: harmonic where nothing is read off.
fn continuation(model: &MakeHumanModel, places: &[Option<(u32, [f64; 3])>]) -> Result<SparseCholesky, SolveError> {
    let mut triplets = Vec::new();
    for edge in model.topology().edges() {
        let [a, b] = edge.vertices.map(|vertex| vertex as usize);
        // Between two matched vertices the values read off stand as they are.
        if places[a].is_some() && places[b].is_some() {
            continue;
        }
        triplets.extend([(a, a, 1.0), (b, b, 1.0), (a.max(b), a.min(b), -1.0)]);
    }
    for (vertex, place) in places.iter().enumerate() {
        triplets.push((vertex, vertex, if place.is_some() { HOLD } else { 1e-9 }));
    }
    SparseCholesky::new(places.len(), &triplets)
}

/// A joint moves with the vertices that its two parts share: mean weighted by the product of their skin weights. The
/// pelvis moves with the mean of its own vertices.
fn joint_displacements(model: &MakeHumanModel, field: &[Vec3]) -> [Vec3; Part::COUNT] {
    let mut sums = [(Vec3::ZERO, 0.0); Part::COUNT];
    for (weights, &d) in model.skin_weights().iter().zip(field) {
        for &(part, weight) in weights {
            let other = part.parent().unwrap_or(part);
            let share = weights.iter().find(|entry| entry.0 == other).map_or(0.0, |entry| entry.1 * weight);
            let (sum, total) = &mut sums[part.index()];
            *sum += share * d;
            *total += share;
        }
    }
    sums.map(|(sum, total)| if total > 0.0 { sum / total } else { Vec3::ZERO })
}

/// How near carried shapes lie to theirs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CarriedCheck {
    /// Root mean square distance (m) from our vertices on trunk and limbs to their mean surface.
    pub template_rms: f64,
    /// The same for each direction at +2 and -2 standard deviations (m).
    pub direction_rms: Vec<[f64; 2]>,
    /// Largest of them.
    pub worst_rms: f64,
    /// Share of the vertices on trunk and limbs that were matched.
    pub matched_share: f64,
}

/// Distances between carried shapes and theirs at ±2 standard deviations of each direction, on trunk and limbs (hands
/// and head excluded, where the topologies differ).
pub fn check(
    model: &MakeHumanModel,
    scans: &ScanShapes,
    registration: &Registration,
    soft: &SoftDirections,
) -> CarriedCheck {
    let compared: Vec<usize> = (0..BODY_VERTEX_COUNT).filter(|&v| is_comparable(model.vertex_parts()[v])).collect();
    let mut tree = TriangleBvh::new(&scans.topology, &scans.template);
    let mut rms = |ours: &[Vec3], theirs: &[Vec3]| {
        tree.refit(theirs);
        let squared = |&vertex: &usize| {
            let found = tree.closest_point(theirs, ours[vertex], 1.0);
            found.map_or(1.0, |found| found.distance * found.distance)
        };
        (compared.iter().map(squared).sum::<f64>() / compared.len().max(1) as f64).sqrt()
    };
    let template_rms = rms(&registration.vertices, &scans.template);
    let mut direction_rms = Vec::new();
    for (theirs, ours) in scans.directions.iter().zip(&soft.directions) {
        let mut dense = vec![Vec3::ZERO; BODY_VERTEX_COUNT + Part::COUNT];
        ours.add_to(1.0, &mut dense);
        direction_rms.push([2.0, -2.0].map(|coefficient| {
            let moved = |(vertex, &p): (usize, &Vec3)| {
                p + coefficient * (registration.theirs_from_ours[vertex] * dense[vertex])
            };
            let our_body: Vec<Vec3> = registration.vertices.iter().enumerate().map(moved).collect();
            let their_body: Vec<Vec3> = scans.template.iter().zip(theirs).map(|(p, d)| *p + coefficient * *d).collect();
            rms(&our_body, &their_body)
        }));
    }
    let matched = compared.iter().filter(|&&vertex| registration.matched[vertex]).count();
    CarriedCheck {
        template_rms,
        worst_rms: direction_rms.iter().flatten().copied().fold(0.0, f64::max),
        direction_rms,
        matched_share: matched as f64 / compared.len().max(1) as f64,
    }
}
