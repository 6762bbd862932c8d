//! Skin that shows through: vertices of a surface above the triangles of cloth that should cover them.

use modiste_core::{Topology, Vec3};
use rayon::prelude::*;

use super::contact::Contact;
use super::contacts::Site;
use super::cover::Ground;

/// Vertices may show through cloth whose corners are at most this far from the surface (m).
const SHOW_REACH: f64 = 0.012;
/// Product of the normals at two corners of a triangle below which the surface is curved there.
const CURVED: f64 = 0.97;
/// Product of the direction away from a surface with the outer normal of cloth below which the surface is on its outer side.
const FROM_OUTSIDE: f64 = -0.3;
/// Depth below the cloth that vertices are sent to (m).
pub(crate) const SHOW_CLEARANCE: f64 = 0.001;
/// Ridges lower than this above the cloth (m) are left: a fifth of what the guarantee allows.
const LEAST: f64 = 1e-4;
/// Faces that one thread takes at a time.
const FACES_AT_ONCE: usize = 256;

/// A triangle of cloth, the side it is pressed to, and how far (m) a vertex of a surface is past it at most.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lift {
    pub(crate) face: [u32; 3],
    pub(crate) normal: Vec3,
    pub(crate) height: f64,
}

/// What is looked for above the triangles of cloth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Show {
    /// Vertices, above triangles with a corner that has moved since the last time.
    Vertices,
    /// Those, and ridges that pass through any triangle between their vertices.
    Ridges,
}

/// The triangles of cloth that something of the surfaces below is above.
pub(crate) fn find_lifts(
    topology: &Topology,
    sites: &mut [Site],
    grounds: &[Ground<'_>],
    (garment, show): (&[Vec3], Show),
    lifts: &mut Lifts,
) {
    let known: &[Site] = sites;
    let is_new = |face: &[u32; 3]| face.iter().any(|&vertex| known[vertex as usize].fresh);
    let runs = topology.faces().par_chunks(FACES_AT_ONCE);
    lifts.of_runs.resize_with(runs.len(), Vec::new);
    runs.zip(&mut lifts.of_runs).for_each(|(faces, lifts)| {
        lifts.clear();
        let asked = faces.iter().filter(|face| show == Show::Ridges || is_new(face));
        lifts.extend(asked.filter_map(|face| lift(*face, known, grounds, (garment, show))));
    });
    sites.iter_mut().for_each(|site| site.fresh = false);
}

/// Triangles of cloth with something above them, found side by side in runs of faces.
#[derive(Debug, Clone, Default)]
pub(crate) struct Lifts {
    of_runs: Vec<Vec<Lift>>,
}

impl Lifts {
    /// All of them, in the order of the faces.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &Lift> {
        self.of_runs.iter().flatten()
    }
}

/// The vertices tried are those of the nearest faces of the corners, and where the surface is curved there, or ends under the
/// triangle as a waist band does, those around them.
fn lift(face: [u32; 3], sites: &[Site], grounds: &[Ground<'_>], (garment, show): (&[Vec3], Show)) -> Option<Lift> {
    let contacts = face.map(|vertex| sites[vertex as usize].contacts.nearest());
    let [Some(a), Some(b), Some(c)] = contacts else { return None };
    let nearest = [a, b, c];
    if nearest.iter().any(|(_, contact)| contact.distance >= SHOW_REACH || contact.pinched) {
        return None;
    }
    let product = |i: usize, j: usize| nearest[i].1.normal.dot(nearest[j].1.normal);
    let ends = nearest.iter().any(|(owner, _)| *owner != nearest[0].0);
    let turn = product(0, 1).min(product(1, 2)).min(product(2, 0));
    let corners = face.map(|vertex| garment[vertex as usize]);
    let squared = |i: usize, j: usize| corners[i].distance_squared(corners[j]);
    let rises = SHOW_CLEARANCE + rise(squared(0, 1).max(squared(1, 2)).max(squared(2, 0)), turn);
    if !ends && nearest.iter().all(|(_, contact)| contact.distance >= rises) {
        return None;
    }
    let outer = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
    let looks_around = ends || turn < CURVED;
    let (mut height, mut way): (f64, Vec3) = (0.0, Vec3::ZERO);
    for (index, (owner, contact)) in nearest.into_iter().enumerate() {
        // Corners often have the same nearest face.
        if nearest[..index].iter().any(|other| (other.0, other.1.face) == (owner, contact.face)) {
            continue;
        }
        let ground = &grounds[owner];
        let obstacle = ground.obstacle;
        // What presses on cloth from outside, as a hand does on the hip, is to stay there.
        let normal = if contact.normal.dot(outer) < FROM_OUTSIDE { -outer } else { outer };
        let level = normal.dot(corners[0]);
        // Most are below, or no higher than one that was found, which is told first.
        let mut try_vertex = |vertex: u32| {
            let bare = normal.dot(obstacle.vertices()[vertex as usize]) - level;
            if bare + ground.height(vertex) < height {
                return;
            }
            let point = ground.vertex(vertex);
            let above = normal.dot(point - corners[0]);
            if above > height
                && obstacle.vertex_normals()[vertex as usize].dot(normal) > 0.2
                && is_over(corners, outer, point)
            {
                (height, way) = (above, normal);
            }
        };
        if looks_around {
            obstacle.ring(contact.face).iter().copied().for_each(&mut try_vertex);
        } else {
            obstacle.topology().faces()[contact.face as usize].into_iter().for_each(&mut try_vertex);
        }
    }
    if show == Show::Ridges && turn < CURVED && height == 0.0 {
        (height, way) = ridge(corners, nearest, grounds).unwrap_or((height, way));
    }
    // Centimetres above the cloth are no show-through, but another limb.
    (height > 0.0 && height < SHOW_REACH).then_some(Lift { face, normal: way, height })
}

/// How high (m) a ridge passes over a triangle between its corners, which have these contacts, and the way off it.
fn ridge(corners: [Vec3; 3], contacts: [(usize, &Contact); 3], grounds: &[Ground<'_>]) -> Option<(f64, Vec3)> {
    let sound = |point: Vec3, beside: &[(usize, &Contact)]| {
        let is_new = |index: usize| beside[..index].iter().all(|other| other.1.face != beside[index].1.face);
        let beside = (0..beside.len()).filter(|&index| is_new(index)).map(|index| beside[index]);
        let around = beside.filter_map(|(owner, contact)| grounds[owner].touch_around(point, contact.face));
        let found = around.min_by(|a, b| a.distance.abs().total_cmp(&b.distance.abs()));
        found.filter(|found| found.distance < -LEAST).map(|found| (-found.distance, found.normal))
    };
    let sides = [[0, 1], [1, 2], [2, 0]].into_iter().filter(|&[i, j]| {
        let turn = contacts[i].1.normal.dot(contacts[j].1.normal);
        rise(corners[i].distance_squared(corners[j]), turn) > contacts[i].1.distance.min(contacts[j].1.distance)
    });
    let mut points = sides.map(|[i, j]| (corners[i].midpoint(corners[j]), [contacts[i], contacts[j]])).peekable();
    // Over the middle only with a side.
    points.peek()?;
    let middle = sound((corners[0] + corners[1] + corners[2]) / 3.0, &contacts);
    let found = points.filter_map(|(point, beside)| sound(point, &beside)).chain(middle);
    found.max_by(|a, b| a.0.total_cmp(&b.0))
}

/// How far (m) a surface may rise between two points, the square of whose distance is given (m²), and whose normals have a
/// product of `turn`.
///
/// An arc that turns by θ over a chord L is at most about Lθ/8 above it; twice that, for surfaces that are not round.
fn rise(squared: f64, turn: f64) -> f64 {
    // 1 - cos θ ≥ 0.2 θ² up to a half turn.
    0.25 * (squared * (1.0 - turn).max(0.0) / 0.2).sqrt()
}

/// Whether a point is straight above or below a triangle.
fn is_over(corners: [Vec3; 3], normal: Vec3, point: Vec3) -> bool {
    (0..3).all(|corner| {
        let (from, to) = (corners[corner], corners[(corner + 1) % 3]);
        normal.dot((to - from).cross(point - from)) >= 0.0
    })
}

#[cfg(test)]
mod tests {
    use super::is_over;
    use modiste_core::Vec3;

    #[test]
    fn only_points_over_the_triangle_are_over_it() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let is_over = |x: f64, y: f64, z: f64| is_over(corners, Vec3::Z, Vec3::new(x, y, z));
        assert!(is_over(0.2, 0.2, 0.1) && is_over(0.2, 0.2, -0.1));
        assert!(!is_over(0.8, 0.8, 0.1) && !is_over(-0.1, 0.2, 0.0));
    }
}
