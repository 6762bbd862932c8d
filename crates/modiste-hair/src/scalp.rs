//! The scalp of our heads, and roots spread evenly over it.

use modiste_body::{Body, Part};
use modiste_core::{Mat3, Topology, Vec3, bounds, corners, face_areas, seeded_rng, uniform};

use crate::HairError;

/// Height of the hairline (degrees above the horizon, seen from the middle of the skull) by azimuth from the front: over
/// the forehead, round the temples, above and behind the ears, down to the nape.
const HAIRLINE: [(f64, f64); 9] = [
    (0.0, 33.0),
    (28.0, 34.0),
    (50.0, 27.0),
    (68.0, 13.0),
    (95.0, 11.0),
    (112.0, -4.0),
    (125.0, -18.0),
    (150.0, -31.0),
    (180.0, -35.0),
];
/// The middle of the skull: so far below its top, and so far before its back, in parts of height and depth of the head.
const MIDDLE: [f64; 2] = [0.42, 0.46];
/// Candidates per root that the evenly spread ones are chosen from.
const CANDIDATES: usize = 24;
/// The most roots that may be asked for.
pub const MOST_ROOTS: usize = 20_000;

/// A point of the skin where a guide is rooted; it moves with its face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Root {
    /// Face of the body.
    pub face: u32,
    /// Where on the face; sums to 1.
    pub barycentric: [f64; 3],
}

/// A part of the scalp, whose hair may have a length of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Region {
    /// Over the forehead and the temples.
    Front,
    /// Over and behind the ears.
    Sides,
    /// Down to the nape.
    Back,
}

impl Region {
    /// All regions.
    pub const ALL: [Self; 3] = [Self::Front, Self::Sides, Self::Back];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Front => "front",
            Self::Sides => "sides",
            Self::Back => "back",
        }
    }

    /// The region of this name, if there is one.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|region| region.name() == name)
    }

    /// The region in a direction from the middle of the skull.
    pub fn of(direction: Vec3) -> Self {
        match azimuth(direction) {
            angle if angle < 55.0 => Self::Front,
            angle if angle < 125.0 => Self::Sides,
            _ => Self::Back,
        }
    }
}

/// The middle of the skull (m) of a body in the template pose.
pub fn skull_middle(body: &Body) -> Vec3 {
    let parts = body.model().vertex_parts();
    let head: Vec<Vec3> =
        body.rest_vertices().iter().zip(parts).filter(|(_, part)| **part == Part::Head).map(|(v, _)| *v).collect();
    let (low, high) = bounds(&head).unwrap_or((Vec3::ZERO, Vec3::ONE));
    let [down, forwards] = MIDDLE;
    Vec3::new(0.5 * (low.x + high.x), high.y - down * (high.y - low.y), low.z + forwards * (high.z - low.z))
}

/// Whether a direction from the middle of the skull meets the scalp.
pub fn is_scalp(direction: Vec3) -> bool {
    elevation(direction) >= hairline(azimuth(direction))
}

/// Degrees above the horizon.
pub(crate) fn elevation(direction: Vec3) -> f64 {
    direction.y.atan2(direction.x.hypot(direction.z)).to_degrees()
}

/// Degrees from the front, 0 to 180, the same on both sides.
fn azimuth(direction: Vec3) -> f64 {
    direction.x.abs().atan2(direction.z).to_degrees()
}

fn hairline(azimuth: f64) -> f64 {
    let pair = HAIRLINE.windows(2).find(|pair| azimuth <= pair[1].0).unwrap_or(&HAIRLINE[HAIRLINE.len() - 2..]);
    let part = ((azimuth - pair[0].0) / (pair[1].0 - pair[0].0)).clamp(0.0, 1.0);
    pair[0].1 + part * (pair[1].1 - pair[0].1)
}

/// `count` roots spread evenly over the scalp: each is the candidate furthest from those before it, so that the first of
/// many are even too.
///
/// # Errors
/// No root or more than [`MOST_ROOTS`], or a body whose head has no scalp.
pub fn spread_roots(body: &Body, count: usize, seed: u64) -> Result<Vec<Root>, HairError> {
    if !(1..=MOST_ROOTS).contains(&count) {
        return Err(HairError::data("guides on the scalp", format!("1 to {MOST_ROOTS}"), count));
    }
    let topology = body.model().topology();
    let x = body.rest_vertices();
    let middle = skull_middle(body);
    let scalp: Vec<u32> = (0u32..)
        .zip(topology.faces())
        .filter(|(face, vertices)| {
            body.model().face_parts()[*face as usize] == Part::Head
                && vertices.iter().any(|&vertex| is_scalp(x[vertex as usize] - middle))
        })
        .map(|(face, _)| face)
        .collect();
    let candidates = candidates(topology, x, &scalp, middle, count * CANDIDATES, seed);
    if candidates.len() < count {
        return Err(HairError::data("scalp", format!("room for {count} roots"), "a bald head"));
    }
    Ok(furthest_first(&candidates, count).into_iter().map(|index| candidates[index].0).collect())
}

/// Random points of the scalp, evenly by area.
fn candidates(
    topology: &Topology,
    x: &[Vec3],
    scalp: &[u32],
    middle: Vec3,
    count: usize,
    seed: u64,
) -> Vec<(Root, Vec3)> {
    let areas = face_areas(topology, x);
    let mut sums = Vec::with_capacity(scalp.len());
    let mut total = 0.0;
    for &face in scalp {
        total += areas[face as usize];
        sums.push(total);
    }
    let mut rng = seeded_rng(seed);
    let mut found = Vec::with_capacity(count);
    // Faces at the rim lie partly beyond the hairline, so some tries fail.
    for _ in 0..4 * count {
        if found.len() == count || scalp.is_empty() {
            break;
        }
        let at = uniform(&mut rng) * total;
        let face = scalp[sums.partition_point(|&sum| sum < at).min(scalp.len() - 1)];
        let (root, across) = (uniform(&mut rng).sqrt(), uniform(&mut rng));
        let barycentric = [1.0 - root, root * (1.0 - across), root * across];
        let root = Root { face, barycentric };
        let point = root.position(topology, x);
        if is_scalp(point - middle) {
            found.push((root, point));
        }
    }
    found
}

/// Greedy: each next point is the one furthest from all chosen before; the first is the topmost.
fn furthest_first(candidates: &[(Root, Vec3)], count: usize) -> Vec<usize> {
    let top = (0..candidates.len()).max_by(|&a, &b| candidates[a].1.y.total_cmp(&candidates[b].1.y)).unwrap_or(0);
    let mut chosen = vec![top];
    let mut distances = vec![f64::INFINITY; candidates.len()];
    while chosen.len() < count {
        let last = candidates[chosen[chosen.len() - 1]].1;
        let mut next = (0, -1.0);
        for (index, distance) in distances.iter_mut().enumerate() {
            *distance = distance.min(candidates[index].1.distance_squared(last));
            if *distance > next.1 {
                next = (index, *distance);
            }
        }
        chosen.push(next.0);
    }
    chosen
}

impl Root {
    /// Where it is (m) while the body's vertices are at `x`.
    pub fn position(&self, topology: &Topology, x: &[Vec3]) -> Vec3 {
        let triangle = corners(topology.faces()[self.face as usize], x);
        (0..3).map(|i| self.barycentric[i] * triangle[i]).sum()
    }

    /// A right-handed frame that moves with the face: first edge, across, outward normal.
    pub fn frame(&self, topology: &Topology, x: &[Vec3]) -> Mat3 {
        let [a, b, c] = corners(topology.faces()[self.face as usize], x);
        let along = (b - a).normalize_or(Vec3::X);
        let normal = (b - a).cross(c - a).normalize_or(Vec3::Y);
        Mat3::from_cols(along, normal.cross(along), normal)
    }
}

/// The `wanted` nearest other roots of each root, nearest first.
pub fn nearest_roots(positions: &[Vec3], wanted: usize) -> Vec<Vec<u32>> {
    (0..positions.len())
        .map(|index| {
            let mut others: Vec<(f64, u32)> = (0u32..)
                .zip(positions)
                .filter(|(other, _)| *other as usize != index)
                .map(|(other, position)| (position.distance_squared(positions[index]), other))
                .collect();
            let wanted = wanted.min(others.len());
            if wanted > 0 && wanted < others.len() {
                others.select_nth_unstable_by(wanted - 1, |a, b| a.0.total_cmp(&b.0));
            }
            others.truncate(wanted);
            others.sort_by(|a, b| a.0.total_cmp(&b.0));
            others.into_iter().map(|(_, other)| other).collect()
        })
        .collect()
}
