//! Triangles of cloth that cross a surface between corners that are all outside: an edge across a thin limb, a ridge.

use modiste_core::{Topology, Vec3, corners};
use rayon::prelude::*;

use super::contacts::Site;
use super::cover::Ground;
use super::warp::Push;

/// Depths below this (m) are left: a fifth of what the guarantee allows.
const TOLERANCE: f64 = 1e-4;
/// Where cloth that crossed is sent to, above the surface (m).
const CLEARANCE: f64 = 3e-4;
/// Other limbs are no nearer to a face than it has room less this (m).
const ROOM_MARGIN: f64 = 0.003;
/// Triangles are sounded at points no further apart than this (m) along their sides.
const SPACING: f64 = 0.003;
/// Most parts of a side.
const MOST_PARTS: f64 = 24.0;
/// Cloth deeper than this (m) has been caught, by limbs that closed around it; it is not pulled through them.
const DEEPEST: f64 = 0.02;
/// Faces that one thread takes at a time.
const FACES_AT_ONCE: usize = 256;

/// The deepest point of a triangle of cloth that crosses a surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Crossing {
    face: [u32; 3],
    /// Shares of the corners in the point; 0 for a corner that is held.
    shares: [f64; 3],
    /// The way (m) that leads it out.
    way: Vec3,
}

impl Crossing {
    /// The corners of the triangle.
    pub(crate) fn face(&self) -> [u32; 3] {
        self.face
    }

    /// How deep the point is (m).
    pub(crate) fn depth(&self) -> f64 {
        self.way.length() - CLEARANCE
    }

    /// Pushes that ask the corners for the way that the point must go, the nearer ones more.
    pub(crate) fn pushes(&self, weight: f64) -> impl Iterator<Item = Push> {
        let gap = self.way.length();
        let normal = self.way / gap;
        let corners = self.face.into_iter().zip(self.shares).filter(|(_, share)| *share > 0.0);
        corners.map(move |(vertex, share)| Push { vertex, normal, gap, weight: share * weight })
    }

    /// The least steps of the corners that bring the point out.
    pub(crate) fn steps(&self) -> impl Iterator<Item = (u32, Vec3)> {
        let squares: f64 = self.shares.iter().map(|share| share * share).sum();
        let way = self.way / squares.max(0.2);
        self.face.into_iter().zip(self.shares).map(move |(vertex, share)| (vertex, share * way))
    }
}

/// Triangles that cross a surface, found side by side in runs of faces.
#[derive(Debug, Clone, Default)]
pub(crate) struct Crossings {
    of_runs: Vec<Vec<Crossing>>,
}

impl Crossings {
    /// All of them, in the order of the faces.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &Crossing> {
        self.of_runs.iter().flatten()
    }
}

/// The triangles of cloth that cross a surface below, as far as they can be moved out of it, of those with a corner that has
/// `moved`.
pub(crate) fn find_crossings(
    topology: &Topology,
    sites: &[Site],
    grounds: &[Ground<'_>],
    (garment, moved): (&[Vec3], &[bool]),
    crossings: &mut Crossings,
) {
    let has_moved = |face: &&[u32; 3]| face.iter().any(|&vertex| moved[vertex as usize]);
    let find = |&face: &[u32; 3]| {
        let triangle = corners(face, garment);
        let meets = |owner: usize| {
            may_cross(face, triangle, sites, owner, grounds) && grounds[owner].obstacle.crosses(triangle)
        };
        (0..grounds.len()).filter(|&owner| meets(owner)).find_map(|owner| sound(face, triangle, sites, owner, grounds))
    };
    let runs = topology.faces().par_chunks(FACES_AT_ONCE);
    crossings.of_runs.resize_with(runs.len(), || Vec::with_capacity(FACES_AT_ONCE));
    runs.zip(&mut crossings.of_runs).for_each(|(faces, crossings)| {
        crossings.clear();
        crossings.extend(faces.iter().filter(has_moved).filter_map(find));
    });
}

/// Whether a surface may cross a triangle, by what is known about its corners.
///
/// No point of the triangle is further from a corner than its longest side is long by √3. Where the surface turns little from
/// corner to corner and has room before it, it rises between them by no more than an arc.
fn may_cross(face: [u32; 3], triangle: [Vec3; 3], sites: &[Site], owner: usize, grounds: &[Ground<'_>]) -> bool {
    let sites = face.map(|vertex| &sites[vertex as usize]);
    if sites.iter().all(|site| site.exit.is_some()) {
        return false;
    }
    let longest = longest_side(triangle);
    if sites.iter().any(|site| site.exit.is_some()) {
        return owner == 0;
    }
    let contacts = sites.map(|site| site.contacts.of(owner as u8));
    let [Some(a), Some(b), Some(c)] = contacts else { return contacts.iter().flatten().count() > 0 };
    let nearest = [a, b, c].map(|contact| contact.distance + contact.raised);
    let least = nearest.into_iter().fold(f64::INFINITY, f64::min);
    if least > 0.58 * longest {
        return false;
    }
    let turn = a.normal.dot(b.normal).min(b.normal.dot(c.normal)).min(c.normal.dot(a.normal));
    // 1 - cos θ ≥ 0.2 θ² up to a half turn, and an arc over a chord L rises by Lθ/8: twice that, for what is not round.
    let angle = ((1.0 - turn).max(0.0) / 0.2).sqrt();
    let is_open = |contact: &&super::contact::Contact| {
        grounds[owner].obstacle.room(contact.face) > least + 0.58 * longest + ROOM_MARGIN
    };
    least < 0.25 * longest * angle || ![a, b, c].iter().all(is_open)
}

fn longest_side(triangle: [Vec3; 3]) -> f64 {
    let side = |i: usize, j: usize| triangle[i].distance_squared(triangle[j]);
    side(0, 1).max(side(1, 2)).max(side(2, 0)).sqrt()
}

/// The deepest of points all over a triangle.
fn sound(
    face: [u32; 3],
    triangle: [Vec3; 3],
    sites: &[Site],
    owner: usize,
    grounds: &[Ground<'_>],
) -> Option<Crossing> {
    let sites = face.map(|vertex| &sites[vertex as usize]);
    let obstacle = grounds[owner].obstacle;
    let mut deepest = (TOLERANCE, None);
    let mut hint = sites.iter().find_map(|site| site.contacts.of(owner as u8)).map(|contact| contact.face)?;
    let parts = (longest_side(triangle) / SPACING).ceil().clamp(2.0, MOST_PARTS) as u32;
    for i in 0..=parts {
        for j in 0..=parts - i {
            let shares = [i, j, parts - i - j].map(|part| f64::from(part) / f64::from(parts));
            if shares.contains(&1.0) {
                continue;
            }
            let point = shares[0] * triangle[0] + shares[1] * triangle[1] + shares[2] * triangle[2];
            let Some(contact) = obstacle.touch(point, DEEPEST, &mut hint) else { continue };
            let depth = -(contact.distance + obstacle.thickness());
            if !contact.pinched && depth > deepest.0 {
                deepest = (depth, Some((shares, (depth + CLEARANCE) * contact.normal)));
            }
        }
    }
    let (shares, way) = deepest.1?;
    let free = |corner: usize| if sites[corner].exit.is_some() { 0.0 } else { shares[corner] };
    Some(Crossing { face, shares: [0, 1, 2].map(free), way })
}
