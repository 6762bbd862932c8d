//! The last resort for a point inside a body whose parts may pass through each other: a point outside of all of them.

use modiste_core::Vec3;

use super::obstacle::Obstacle;

/// Each try goes further than the last by this.
const GROWTH: f64 = 1.5;
/// Nothing of a body is further from its own surface than this (m).
const FURTHEST: f64 = 4.0;

impl Obstacle {
    /// A point outside, `clearance` (m) from the surface that can be reached from outside where there is room.
    ///
    /// It stands on the nearest exposed point of the surface. In a crease the clearance leads into the other wall; then
    /// the point goes further, along the mean of both normals or of the surroundings, until it is out. A body is bounded,
    /// so it always gets out.
    pub(crate) fn way_out(&self, point: Vec3, clearance: f64, hint: &mut u32) -> Vec3 {
        let Some(at) = self.nearest_exposed(point, hint) else { return self.climb(point, &[Vec3::Y], clearance) };
        *hint = at.face;
        let face = self.topology().faces()[at.face as usize];
        let flat = self.face_normal(at.face);
        let round = (0..3).map(|i| at.barycentric[i] * self.vertex_normals()[face[i] as usize]).sum::<Vec3>();
        let straight = (at.point - point).normalize_or(flat);
        // Into the crease's other wall and off it again: the sum of both normals leads along the crease's middle.
        let beyond = self.nearest_face(at.point + 2.0 * clearance * flat).map_or(flat, |other| self.face_normal(other));
        let directions = [flat, (flat + beyond).normalize_or(flat), round.normalize_or(flat), straight];
        self.climb(at.point, &directions, clearance)
    }

    /// The first point outside on rays from a point, the shortest ones first.
    fn climb(&self, from: Vec3, directions: &[Vec3], clearance: f64) -> Vec3 {
        let mut length = clearance;
        while length < FURTHEST {
            let tries = directions.iter().map(|direction| from + length * *direction);
            if let Some(out) = tries.into_iter().find(|&end| !self.is_inside(end)) {
                return out;
            }
            length *= GROWTH;
        }
        from + FURTHEST * directions[0]
    }
}

#[cfg(test)]
mod tests {
    use crate::refine::obstacle::NO_HINT;
    use crate::refine::obstacle::tests::{crossing, union_distance};
    use modiste_core::{Vec3, normal, seeded_rng};

    #[test]
    fn from_everywhere_in_a_crossing_the_way_leads_out_and_is_short() {
        let body = crossing();
        let mut rng = seeded_rng(8);
        let (mut asked, mut worst) = (0, 0.0f64);
        while asked < 500 {
            let p = Vec3::new(0.8 + 0.3 * normal(&mut rng), 0.4 * normal(&mut rng), 0.4 * normal(&mut rng));
            if !body.is_inside(p) {
                continue;
            }
            asked += 1;
            let out = body.way_out(p, 0.0006, &mut NO_HINT.clone());
            assert!(!body.is_inside(out), "{p} {out}");
            worst = worst.max(out.distance(p) + union_distance(p));
        }
        // As near as the triangles along the crossing allow.
        assert!(worst < 0.08, "{worst}");
    }
}
