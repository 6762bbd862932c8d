//! On which side of a limb cloth belongs: the side of the skin that it is worn on.
//!
//! An arm that lies against the trunk, with the shirt between them, may hold vertices of the shirt. The nearest skin is then
//! often the outer side of the arm; pushed there, the shirt would be worn over the arm.

use modiste_body::Part;
use modiste_core::Vec3;

use super::contact::Contact;
use super::cover::Ground;
use super::obstacle::Obstacle;

/// Cloth is worn on skin that is no further from it at rest than this (m).
const WORN_REACH: f64 = 0.15;
/// Cloth that would have to go further than this (m) to the skin that it is worn on takes the nearest way out instead.
const FURTHEST_HOME: f64 = 0.12;

/// Between limbs that are further apart than this (m) cloth hangs as it likes, and skin is not told further away to face other.
const MOST_ROOM: f64 = 0.0218;
/// Cloth further from the other limb than half of that (m) is on its own side of the middle.
const HALF_REACH: f64 = 0.5 * MOST_ROOM;
/// Skin that is no further from cloth at rest than this (m) is beside what it is worn on, in the crotch or under the arm.
const BESIDE: f64 = 0.04;
/// Product of the normals of skin that faces other skin.
const FACING: f64 = -0.3;

/// Where skin begins to be seen from (m above it).
const JUST_ABOVE: f64 = 1e-4;

/// Where a vertex of cloth is worn.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Home {
    /// Its place (m) on the body at rest.
    at: Vec3,
    limb: Limb,
}

/// Parts that cloth can lie on together. The skin of trunk and leg is one for it: a hem lies on a raised thigh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Limb {
    Trunk,
    LeftArm,
    RightArm,
    LeftLeg,
    RightLeg,
}

impl Limb {
    fn of(part: Part) -> Self {
        match part {
            Part::LeftUpperArm | Part::LeftForearm | Part::LeftHand => Self::LeftArm,
            Part::RightUpperArm | Part::RightForearm | Part::RightHand => Self::RightArm,
            Part::LeftThigh | Part::LeftShin | Part::LeftFoot => Self::LeftLeg,
            Part::RightThigh | Part::RightShin | Part::RightFoot => Self::RightLeg,
            _ => Self::Trunk,
        }
    }

    /// Whether cloth on one of them never lies on the other.
    fn is_foreign(self, other: Self) -> bool {
        let is_leg = |limb| matches!(limb, Self::LeftLeg | Self::RightLeg);
        self != other && !(self == Self::Trunk && is_leg(other)) && !(other == Self::Trunk && is_leg(self))
    }
}

/// The homes of the vertices of a garment, from its place (m) on the body at rest and the parts of its faces.
pub(crate) fn homes(rest: &[Vec3], faces: &[[u32; 3]], face_parts: &[Part]) -> Vec<Home> {
    let mut homes: Vec<Home> = rest.iter().map(|&at| Home { at, limb: Limb::Trunk }).collect();
    for (face, &part) in faces.iter().zip(face_parts) {
        face.iter().for_each(|&vertex| homes[vertex as usize].limb = Limb::of(part));
    }
    homes
}

impl Ground<'_> {
    /// Lets skin of another limb, as a point is in contact with it, begin at the middle between it and the skin that the
    /// cloth is worn on, with what lies on that, where the two face each other closely. `hint` is that of
    /// [`Obstacle::leads_astray`].
    pub(crate) fn leave_half(&self, point: Vec3, contact: &mut Contact, home: &Home, hint: &mut u32) {
        let body = self.obstacle;
        let is_near = !contact.pinched && contact.distance < HALF_REACH;
        if !is_near || !body.is_across(contact.face, home) || body.room(contact.face) > MOST_ROOM {
            return;
        }
        let is_own = |face: u32, _| !body.is_across(face, home);
        let within = MOST_ROOM - contact.distance;
        let Some(own) = body.nearest_where((point, within), hint, is_own) else { return };
        let own_distance = own.distance - self.height_of(own.face);
        if body.face_normal(own.face).dot(contact.normal) < FACING && contact.distance < own_distance {
            let half = 0.5 * (contact.distance + own_distance);
            contact.room = half;
            contact.raised += half;
            contact.distance -= half;
        }
    }
}

impl Obstacle {
    /// Whether cloth is worn on a face, by where it is at rest.
    fn is_home(&self, face: u32, home: &Home) -> bool {
        let corner = self.topology().faces()[face as usize][0];
        self.at_rest(corner).is_none_or(|(at, _)| at.distance_squared(home.at) < WORN_REACH * WORN_REACH)
    }

    /// Whether a face is of a limb that the cloth is not worn on.
    pub(crate) fn is_foreign(&self, face: u32, home: &Home) -> bool {
        let corner = self.topology().faces()[face as usize][0];
        self.at_rest(corner).is_some_and(|(_, part)| home.limb.is_foreign(Limb::of(part))) && !self.is_home(face, home)
    }

    /// Whether a face is of another limb than the cloth is worn on, and not beside it at rest.
    pub(crate) fn is_across(&self, face: u32, home: &Home) -> bool {
        let corner = self.topology().faces()[face as usize][0];
        self.at_rest(corner).is_some_and(|(at, part)| {
            home.limb.is_foreign(Limb::of(part)) && at.distance_squared(home.at) > BESIDE * BESIDE
        })
    }

    /// Whether cloth at a point with this contact is in a limb, or behind it, that it is not worn on, and would be left on the
    /// side away from the skin that it is worn on. `hint` is the face of that skin which was nearest when the same point was
    /// last asked about.
    pub(crate) fn leads_astray(&self, point: Vec3, contact: &Contact, home: Option<&Home>, hint: &mut u32) -> bool {
        let Some(home) = home.filter(|home| self.is_foreign(contact.face, home)) else { return false };
        let worn_on = self.nearest_where((point, FURTHEST_HOME), hint, |face, _| self.is_home(face, home));
        worn_on.is_some_and(|at| {
            let normal = self.face_normal(at.face);
            normal.dot(contact.normal) > 0.0
                && (contact.distance < 0.0 || self.passes_between(at.point + JUST_ABOVE * normal, point))
        })
    }

    /// [`Obstacle::way_out`] to the skin that cloth is worn on, if that is near. `hint` becomes the face there; `own` is that of
    /// [`Self::leads_astray`].
    pub(crate) fn way_home(
        &self,
        point: Vec3,
        clearance: f64,
        [hint, own]: [&mut u32; 2],
        home: Option<&Home>,
    ) -> Vec3 {
        let is_near = |way: &Vec3| way.distance_squared(point) < FURTHEST_HOME * FURTHEST_HOME;
        let way = home.and_then(|home| {
            self.way_out_where((point, FURTHEST_HOME), clearance, own, |face| self.is_home(face, home))
        });
        match way.filter(is_near) {
            Some(way) => {
                *hint = *own;
                way
            }
            None => self.way_out(point, clearance, hint),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::homes;
    use crate::refine::cover::Ground;
    use crate::refine::obstacle::{NO_HINT, Obstacle};
    use modiste_body::Part;
    use modiste_core::shapes::icosphere;
    use modiste_core::{Topology, Vec3};
    use std::sync::Arc;

    /// A trunk of 10 cm and a forearm of 3 cm, apart at rest; posed, the arm lies against the trunk's side with 4 mm between.
    fn body() -> Obstacle {
        let ball = icosphere(4);
        let count = ball.vertices.len() as u32;
        let faces = ball.topology.faces().iter();
        let both = faces.clone().copied().chain(faces.map(|face| face.map(|vertex| vertex + count))).collect();
        let parts: Vec<Part> = (0..2 * ball.topology.face_count())
            .map(|face| if face < ball.topology.face_count() { Part::Abdomen } else { Part::LeftForearm })
            .collect();
        let with_arm_at = |x: f64| -> Vec<Vec3> {
            let vertices = ball.vertices.iter();
            vertices.clone().map(|v| 0.1 * *v).chain(vertices.map(|v| 0.03 * *v + x * Vec3::X)).collect()
        };
        let topology = Arc::new(Topology::new(2 * ball.vertices.len(), both).unwrap());
        let mut body = Obstacle::body(topology, &parts, &parts, &with_arm_at(0.5));
        body.update(&with_arm_at(0.134));
        body
    }

    #[test]
    fn a_shirt_in_an_arm_leaves_it_towards_the_trunk_and_a_sleeve_does_not() {
        let body = body();
        // Nearer to the outer side of the arm than to the inner one.
        let point = Vec3::new(0.14, 0.002, 0.001);
        let contact = body.touch(point, 1.0, &mut NO_HINT.clone()).unwrap();
        assert!(contact.distance < 0.0 && contact.normal.x > 0.0, "{contact:?}");
        let face = [[0, 0, 0]];
        let shirt = homes(&[Vec3::new(0.105, 0.0, 0.0)], &face, &[Part::Abdomen])[0];
        assert!(body.leads_astray(point, &contact, Some(&shirt), &mut NO_HINT.clone()));
        let way = body.way_home(point, 0.0006, [&mut NO_HINT.clone(), &mut NO_HINT.clone()], Some(&shirt));
        assert!(way.x < 0.104 && way.length() > 0.1 && !body.is_inside(way), "{way}");
        let sleeve = homes(&[Vec3::new(0.535, 0.0, 0.0)], &face, &[Part::LeftForearm])[0];
        assert!(!body.leads_astray(point, &contact, Some(&sleeve), &mut NO_HINT.clone()));
        assert!(!body.leads_astray(point, &contact, None, &mut NO_HINT.clone()));
        // Behind the arm, too, a shirt is on the wrong side of it; on the near side it is not.
        let behind = Vec3::new(0.166, 0.0, 0.0);
        assert!(body.leads_astray(
            behind,
            &body.touch(behind, 1.0, &mut NO_HINT.clone()).unwrap(),
            Some(&shirt),
            &mut NO_HINT.clone()
        ));
        let before = Vec3::new(0.106, 0.0, 0.001);
        assert!(!body.leads_astray(
            before,
            &body.touch(before, 1.0, &mut NO_HINT.clone()).unwrap(),
            Some(&shirt),
            &mut NO_HINT.clone()
        ));
        // Between the two each has half of the room, 4 mm.
        let ground = Ground { obstacle: &body, cover: None };
        let close = Vec3::new(0.103, 0.0, 0.001);
        let contact = body.touch(close, 1.0, &mut NO_HINT.clone()).unwrap();
        let mut halved = contact;
        ground.leave_half(close, &mut halved, &shirt, &mut NO_HINT.clone());
        assert!(
            (halved.room - 0.002).abs() < 2e-4 && (halved.distance + halved.raised - contact.distance).abs() < 1e-12,
            "{halved:?}"
        );
        assert!((halved.distance + 0.001).abs() < 3e-4 && halved.normal.x < -0.9, "{halved:?}");
        let mut own = contact;
        ground.leave_half(close, &mut own, &sleeve, &mut NO_HINT.clone());
        assert_eq!(own, contact);
        // A hem lies on a raised thigh.
        let hem = homes(&[Vec3::new(0.105, 0.0, 0.0)], &face, &[Part::LeftThigh])[0];
        let leg = homes(&[Vec3::new(0.105, 0.0, 0.0)], &face, &[Part::Pelvis])[0];
        assert!(!hem.limb.is_foreign(leg.limb) && !leg.limb.is_foreign(hem.limb));
    }
}
