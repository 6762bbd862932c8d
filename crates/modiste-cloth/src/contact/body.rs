//! Contact of cloth vertices with the body: which surfaces each vertex meets, and what happens between two of them.

use super::collider::{BodyCollider, EVERYWHERE, Touch};
use super::groups::CollisionGroups;
use super::surface::{ContactForce, ContactLaw, Outcome, Plane, Surface};
use modiste_core::Vec3;

/// Distance (m) from the body at which vertices are still followed: farther than cloth gets within a frame.
const REACH: f64 = 0.3;

/// Surfaces farther away than this (m) are not refreshed in every substep.
const REFRESH: f64 = 0.007;

/// Vertices that stay farther away than this (m) within the frame look for another nearest place every [`FAR_PERIOD`] frames only.
const FAR: f64 = 0.02;
const FAR_PERIOD: usize = 4;

/// A vertex nearer to its surface than this (m) does not go over to one that faces the other way.
const LOYALTY: f64 = 0.03;

/// Distance (m) at which a surface that faces the first one is looked for, beyond what moves within the frame.
const OPPOSITE_REACH: f64 = 0.008;

/// The most (m) that motion adds to [`OPPOSITE_REACH`].
const OPPOSITE_MOTION: f64 = 0.05;

/// A vertex deeper (m) than this inside the opposite surface is let through: two limbs overlap there.
const YIELD_DEPTH: f64 = 0.004;

/// Least share of the thickness that cloth keeps from its own surface in a pinch.
const PINCH_SHARE: f64 = 0.15;

/// The contact of every cloth vertex with the body, kept from step to step.
///
/// A vertex follows the part of the surface that it lies on; where a second surface faces it from the other side (arm and
/// trunk, thigh and thigh) it keeps the middle, and where the two overlap it stays with the first.
#[derive(Debug, Clone, Default)]
pub(crate) struct BodyContacts {
    contacts: Vec<Contact>,
    /// Frames so far.
    frame: usize,
    /// Vertices that the projections of the last substep moved.
    pub(crate) projected: usize,
    /// Deepest distance below the surface that they found (m).
    pub(crate) deepest: f64,
}

/// What one vertex remembers of the body.
#[derive(Debug, Clone, Copy, Default)]
struct Contact {
    own: Option<Surface>,
    opposite: Option<Surface>,
    /// Planes of the substep under way.
    planes: [Option<Plane>; 2],
    /// Distance at which repulsion begins in the substep under way (m).
    thickness: f64,
}

impl BodyContacts {
    /// Finds the surfaces of every vertex anew, at the start of a frame.
    pub(crate) fn search(
        &mut self,
        body: &BodyCollider,
        groups: Option<&CollisionGroups>,
        (x, v): (&[Vec3], &[Vec3]),
        dt: f64,
    ) {
        self.contacts.resize(x.len(), Contact::default());
        self.frame += 1;
        for (vertex, contact) in self.contacts.iter_mut().enumerate() {
            let home = groups.map_or(EVERYWHERE, |groups| groups.home(vertex));
            let motion = v[vertex].length() * dt + body.frame_motion();
            let is_due = (vertex + self.frame).is_multiple_of(FAR_PERIOD);
            let far = if is_due { f64::INFINITY } else { FAR + motion };
            let own = match contact.own {
                Some(known) => Some(follow(body, &known, x[vertex], home, far)),
                None => body.search(x[vertex], REACH, home, None).map(|touch| Surface::new(body, &touch)),
            };
            let allowed = groups.map_or(EVERYWHERE, |groups| groups.allowed(vertex));
            let motion = motion.min(OPPOSITE_MOTION);
            let opposite = own.and_then(|own| {
                let normal = own.world_normal(body);
                let touch = body.search(x[vertex], OPPOSITE_REACH + motion, allowed, Some(normal))?;
                let known = contact.opposite.filter(|known| known.point.face == touch.point.face);
                Some(known.map_or_else(|| Surface::new(body, &touch), |known| known.moved_to(body, &touch)))
            });
            *contact = Contact { own, opposite, planes: [None; 2], thickness: 0.0 };
        }
    }

    /// Forces and stiffness on `vertex` that goes from `start` to `predicted` within a substep, and by `fall` farther if its weight
    /// alone acts on it.
    #[inline]
    pub(crate) fn force(
        &mut self,
        vertex: usize,
        body: &BodyCollider,
        law: &ContactLaw,
        area: f64,
        (start, predicted, fall): (Vec3, Vec3, Vec3),
    ) -> [Option<ContactForce>; 2] {
        let contact = &mut self.contacts[vertex];
        contact.planes = [None; 2];
        contact.thickness = law.thickness;
        let reach = REFRESH + 2.0 * predicted.distance(start) + body.substep_motion();
        let near = |surface: &Option<Surface>| surface.filter(|surface| surface.distance <= reach);
        let Some(own) = near(&contact.own) else { return [None, None] };
        let first = own.plane(body);
        contact.planes[0] = Some(first);
        let second = near(&contact.opposite).map(|surface| surface.plane(body));
        // Between two surfaces both give way alike; where they overlap the vertex stays on its own.
        let second = second.filter(|plane| plane.gap(start + plane.carried) > -YIELD_DEPTH);
        let mut thickness = law.thickness;
        if let Some(second) = &second {
            let room = first.gap(predicted) + second.gap(predicted);
            thickness = (0.5 * room).clamp(PINCH_SHARE * law.thickness, law.thickness);
            if room > 0.0 {
                contact.planes[1] = Some(*second);
            }
        }
        contact.thickness = thickness;
        let own_law = ContactLaw { thickness, ..*law };
        // The other limb has cloth of its own between: it presses, but does not drag.
        let opposite_law = ContactLaw { static_friction: 0.0, sliding_friction: 0.0, ..own_law };
        let on = |surface: &Option<Surface>, plane: &mut Option<Plane>, law: &ContactLaw| {
            let (surface, plane) = (surface.as_ref()?, plane.as_mut()?);
            surface.force(plane, law, area, (start, predicted, fall))
        };
        let [first, second] = &mut contact.planes;
        [on(&contact.own, first, &own_law), on(&contact.opposite, second, &opposite_law)]
    }

    /// Takes the outcome of a substep: remembers repulsion and friction, and moves vertices that are too close out.
    #[expect(clippy::too_many_arguments, reason = "state, body and step are separate by intent")]
    pub(crate) fn finish(
        &mut self,
        body: &BodyCollider,
        law: &ContactLaw,
        areas: &[f64],
        start: &[Vec3],
        (x, v): (&mut [Vec3], &mut [Vec3]),
        h: f64,
    ) {
        self.projected = 0;
        self.deepest = 0.0;
        for (vertex, contact) in self.contacts.iter_mut().enumerate() {
            let law = ContactLaw { thickness: contact.thickness, ..*law };
            let substep = Outcome { body, law: &law, area: areas[vertex], start: start[vertex], h };
            let (x, v) = (&mut x[vertex], &mut v[vertex]);
            // The opposite surface first: its own has the last word.
            for (surface, plane) in [(&mut contact.opposite, contact.planes[1]), (&mut contact.own, contact.planes[0])]
            {
                let Some(surface) = surface else { continue };
                let Some(plane) = plane else {
                    surface.pass(x.distance(start[vertex]) + body.substep_motion());
                    continue;
                };
                if let Some(depth) = surface.finish(&plane, &substep, REFRESH, (x, v)) {
                    self.projected += 1;
                    self.deepest = self.deepest.max(depth);
                }
            }
            // Going round a limb, the opposite surface may come to face the same way: then there is no pinch.
            if let (Some(own), Some(opposite)) = (&contact.own, &contact.opposite)
                && own.world_normal(body).dot(opposite.world_normal(body)) > 0.0
            {
                contact.opposite = None;
            }
        }
    }

    /// Number of vertices within `distance` (m) of the body.
    pub(crate) fn count_within(&self, distance: f64) -> usize {
        self.contacts.iter().filter(|contact| contact.own.is_some_and(|own| own.distance < distance)).count()
    }

    /// Number of vertices below the surface that they lie on.
    pub(crate) fn count_inside(&self, body: &BodyCollider, x: &[Vec3]) -> usize {
        let near = |contact: &Contact| contact.own.filter(|own| own.distance < REFRESH);
        let vertices = x.iter().zip(&self.contacts).filter_map(|(x, contact)| Some((*x, near(contact)?)));
        vertices.filter(|(x, own)| body.walk(*x, own.point.face).distance < 0.0).count()
    }

    /// Number of vertices between two surfaces that leave less than twice the thickness, or overlap.
    pub(crate) fn count_pinched(&self, thickness: f64) -> usize {
        let room = |contact: &Contact| Some(contact.own?.distance + contact.opposite?.distance);
        self.contacts.iter().filter(|contact| room(contact).is_some_and(|room| room < 2.0 * thickness)).count()
    }
}

/// Where the surface of `known` is now seen from `x`: near by, or anywhere on the limbs of `home` if that is closer and
/// faces the same way. Beyond `far` (m) near by is enough.
fn follow(body: &BodyCollider, known: &Surface, x: Vec3, home: u8, far: f64) -> Surface {
    let near = body.walk(x, known.point.face);
    if near.distance > far {
        return known.moved_to(body, &near);
    }
    let anywhere = body.search(x, near.distance.abs(), home, None);
    let better = |touch: &Touch| near.distance > LOYALTY || touch.normal.dot(near.normal) > 0.0;
    match anywhere.filter(better) {
        Some(touch) => known.moved_to(body, &touch),
        None => known.moved_to(body, &near),
    }
}
