//! The last resort for a point inside a body whose parts may pass through each other: a point outside of all of them.

use modiste_core::Vec3;

use super::obstacle::Obstacle;

/// Each try goes further than the last by this.
const GROWTH: f64 = 1.5;
/// Nothing of a body is further from its own surface than this (m).
const FURTHEST: f64 = 4.0;

/// How far a landing is drawn from the nearest point of a face to its middle when there is no room where it is.
const TO_THE_MIDDLE: [f64; 3] = [0.0, 0.5, 1.0];

/// How often the part of that way that is not needed is halved.
const HALVINGS: usize = 3;

impl Obstacle {
    /// A point outside, `clearance` (m) above the surface near the nearest exposed face that has so much room over its
    /// middle.
    ///
    /// In a crease the clearance leads into the other wall; such faces are passed over for the next nearest. Should no
    /// face have room, one goes up until nothing of the body is left, so that it always leads out.
    pub(crate) fn way_out(&self, point: Vec3, clearance: f64, hint: &mut u32) -> Vec3 {
        self.way_out_where((point, f64::INFINITY), clearance, hint, |_| true)
            .unwrap_or_else(|| self.climb(point, clearance))
    }

    /// [`Self::way_out`] to a face `within` (m) that `accept` says yes to, if there is one with room.
    pub(crate) fn way_out_where(
        &self,
        (point, within): (Vec3, f64),
        clearance: f64,
        hint: &mut u32,
        accept: impl Fn(u32) -> bool,
    ) -> Option<Vec3> {
        let has_room =
            |face: u32, _| accept(face) && self.has_exposed_corner(face) && self.is_open_above(face, clearance);
        let at = self.nearest_where((point, within), hint, has_room)?;
        let middle = self.middle(at.face);
        let landing = |share: f64| at.point.lerp(middle, share) + clearance * self.face_normal(at.face);
        let is_free = |share: f64| {
            let landing = landing(share);
            self.sees_outside(landing, at.face) || !self.is_inside(landing)
        };
        let first = TO_THE_MIDDLE.into_iter().position(is_free)?;
        let mut free = TO_THE_MIDDLE[first];
        if first > 0 {
            // As near to the rim as can be told, and a last step away from it, as rounding may take it back.
            let mut taken = TO_THE_MIDDLE[first - 1];
            for _ in 0..HALVINGS {
                let share = free.midpoint(taken);
                if is_free(share) { free = share } else { taken = share }
            }
            let share = 2.0 * free - taken;
            free = if is_free(share) { share } else { TO_THE_MIDDLE[first] };
        }
        Some(landing(free))
    }

    /// The first point outside straight above.
    fn climb(&self, from: Vec3, clearance: f64) -> Vec3 {
        let mut length = clearance;
        while length < FURTHEST && self.is_inside(from + length * Vec3::Y) {
            length *= GROWTH;
        }
        from + length * Vec3::Y
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
