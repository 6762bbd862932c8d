//! Full hair from guides (Guan §2, after the interpolation of hair modelling packages).

use modiste_body::Body;
use modiste_core::{Vec3, normal, seeded_rng};

use crate::scalp::{Root, spread_roots};
use crate::{HairError, POINTS};

/// Guides that a strand follows.
const FOLLOWED: usize = 3;
/// Guides that part by more than this on their first third (m) are not mixed: between them is a parting.
const PARTING: f64 = 0.06;
/// How far strands stray from the mean of their guides at the tip (m).
const STRAY: f64 = 0.004;

/// Which guides each strand follows, and how much.
#[derive(Debug, Clone, PartialEq)]
pub struct FullHair {
    roots: Vec<Root>,
    followed: Vec<[(u32, f64); FOLLOWED]>,
    stray: Vec<Vec3>,
}

impl FullHair {
    /// `count` strands over the scalp of a body whose guides have these roots; `guides` shows where they part (m).
    ///
    /// # Errors
    /// As [`spread_roots`].
    pub fn new(body: &Body, guide_roots: &[Root], guides: &[Vec3], count: usize, seed: u64) -> Result<Self, HairError> {
        let (topology, rest) = (body.model().topology(), body.rest_vertices());
        let at: Vec<Vec3> = guide_roots.iter().map(|root| root.position(topology, rest)).collect();
        let roots = spread_roots(body, count, seed)?;
        let mut rng = seeded_rng(seed ^ 0x5354_5241);
        let mut stray = Vec::with_capacity(count);
        let followed = roots
            .iter()
            .map(|root| {
                stray.push(STRAY * Vec3::new(normal(&mut rng), normal(&mut rng), normal(&mut rng)));
                follow(root.position(topology, rest), &at, guides)
            })
            .collect();
        Ok(Self { roots, followed, stray })
    }

    /// Where the strands are rooted.
    pub fn roots(&self) -> &[Root] {
        &self.roots
    }

    /// The guides that each strand follows, with their weights.
    pub(crate) fn followed(&self) -> &[[(u32, f64); FOLLOWED]] {
        &self.followed
    }

    /// Number of strands.
    pub fn count(&self) -> usize {
        self.roots.len()
    }

    /// All strands (m), `POINTS` each: the guides' way from their roots, from where each strand is rooted in the posed `body`.
    pub fn points(&self, topology: &modiste_core::Topology, body: &[Vec3], guides: &[Vec3]) -> Vec<Vec3> {
        let mut points = Vec::with_capacity(self.roots.len() * POINTS);
        for ((root, followed), stray) in self.roots.iter().zip(&self.followed).zip(&self.stray) {
            let start = root.position(topology, body);
            for point in 0..POINTS {
                let along = point as f64 / (POINTS - 1) as f64;
                let way: Vec3 = followed
                    .iter()
                    .map(|&(guide, weight)| {
                        let first = guide as usize * POINTS;
                        weight * (guides[first + point] - guides[first])
                    })
                    .sum();
                // The offset of the roots closes towards the tips, where strands of a lock meet.
                points.push(start + way + along * *stray);
            }
        }
        points
    }
}

fn follow(root: Vec3, at: &[Vec3], guides: &[Vec3]) -> [(u32, f64); FOLLOWED] {
    let mut near: Vec<(f64, u32)> = (0u32..).zip(at).map(|(guide, p)| (p.distance_squared(root), guide)).collect();
    let wanted = FOLLOWED.min(near.len());
    near.select_nth_unstable_by(wanted - 1, |a, b| a.0.total_cmp(&b.0));
    near.truncate(wanted);
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    let way = |guide: u32| {
        let first = guide as usize * POINTS;
        guides[first + POINTS / 3] - guides[first]
    };
    let lead = near[0].1;
    let mut followed = [(lead, 0.0); FOLLOWED];
    let mut total = 0.0;
    for (slot, &(distance, guide)) in followed.iter_mut().zip(&near) {
        if way(guide).distance(way(lead)) <= PARTING {
            *slot = (guide, 1.0 / (distance + 1e-6));
            total += slot.1;
        }
    }
    for slot in &mut followed {
        slot.1 /= total;
    }
    followed
}
