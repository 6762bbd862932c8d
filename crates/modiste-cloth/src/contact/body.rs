//! Contact of cloth vertices with the body: repulsion within the thickness, Coulomb friction, and a last projection.

use super::collider::{BodyCollider, BodyPoint, EVERYWHERE, Touch};
use super::groups::CollisionGroups;
use glam::Mat3A;
use modiste_core::Vec3;

/// How contact resists.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ContactLaw {
    /// Distance from the body at which repulsion begins (m).
    pub(crate) thickness: f64,
    /// Repulsion per area and depth (Pa/m).
    pub(crate) stiffness: f64,
    /// Coulomb coefficient of cloth that rests.
    pub(crate) static_friction: f64,
    /// Coulomb coefficient of cloth that slides.
    pub(crate) sliding_friction: f64,
}

/// Share of the thickness below which a vertex is moved out at once.
const MIN_GAP_SHARE: f64 = 0.25;

/// Stiffness of sticking over that of repulsion.
const STICK_SHARE: f64 = 0.5;

/// Distance (m) from the body at which vertices are still followed: farther than cloth gets within a frame.
const REACH: f64 = 0.3;

/// Depth (m) below the plane of contact from which a vertex is first brought back to that plane: the nearest place of the
/// surface might be on the far side of a limb.
const DEEP: f64 = 0.004;

/// Closest places farther away than this (m) are not refreshed in every substep.
const REFRESH: f64 = 0.006;

/// The contact of every cloth vertex with the body, kept from step to step.
#[derive(Debug, Clone, Default)]
pub(crate) struct BodyContacts {
    contacts: Vec<Option<VertexContact>>,
    /// Planes of the substep under way.
    planes: Vec<Option<Plane>>,
    /// Vertices that the last projection moved.
    pub(crate) projected: usize,
    /// Deepest distance below the surface that the last projection found (m).
    pub(crate) deepest: f64,
}

/// What one vertex remembers of the body.
#[derive(Debug, Clone, Copy)]
struct VertexContact {
    point: BodyPoint,
    distance: f64,
    /// Outward normal in the frame of the face.
    normal: [f64; 3],
    /// Stretch of the friction spring in the frame of the face (m).
    stick: [f64; 3],
    /// Repulsion at the end of the last substep (N).
    force: f64,
    slipping: bool,
}

/// The plane that a vertex meets in one substep.
#[derive(Debug, Clone, Copy)]
struct Plane {
    place: Vec3,
    carried: Vec3,
    normal: Vec3,
    stick: Vec3,
}

/// Force and stiffness of one contact.
pub(crate) struct ContactForce {
    pub(crate) force: Vec3,
    pub(crate) block: Mat3A,
}

impl VertexContact {
    fn new(touch: &Touch, frame: &[Vec3; 3], stick: Vec3, force: f64, slipping: bool) -> Self {
        let local = |v: Vec3| frame.map(|axis| axis.dot(v));
        Self {
            point: touch.point,
            distance: touch.distance,
            normal: local(touch.normal),
            stick: local(stick - touch.normal * stick.dot(touch.normal)),
            force,
            slipping,
        }
    }

    fn plane(&self, body: &BodyCollider) -> Plane {
        let (place, before) = body.place(&self.point);
        let frame = body.face_frame(self.point.face);
        let world = |v: &[f64; 3]| frame[0] * v[0] + frame[1] * v[1] + frame[2] * v[2];
        Plane { place, carried: place - before, normal: world(&self.normal), stick: world(&self.stick) }
    }
}

impl BodyContacts {
    /// Finds the closest place of every vertex anew, at the start of a frame.
    pub(crate) fn search(&mut self, body: &BodyCollider, groups: Option<&CollisionGroups>, x: &[Vec3]) {
        self.contacts.resize(x.len(), None);
        self.planes.resize(x.len(), None);
        for (vertex, slot) in self.contacts.iter_mut().enumerate() {
            let mask = groups.map_or(EVERYWHERE, |groups| groups.home(vertex));
            let known = slot.take();
            let near = known.map(|contact| body.walk(x[vertex], contact.point.face));
            let bound = near.map_or(REACH, |touch| REACH.min(touch.distance.abs()));
            let touch = body.search(x[vertex], bound, mask).or(near.filter(|touch| touch.distance.abs() <= REACH));
            *slot = touch.map(|touch| {
                let frame = body.face_frame(touch.point.face);
                let (stick, force, slipping) = known.map_or((Vec3::ZERO, 0.0, false), |contact| {
                    (contact.plane(body).stick, contact.force, contact.slipping)
                });
                VertexContact::new(&touch, &frame, stick, force, slipping)
            });
        }
    }

    /// Force and stiffness on `vertex` that goes from `start` to `predicted` within a substep, or `None` without contact.
    ///
    /// Repulsion `k (thickness - gap)` along the normal. Friction is a spring from where the vertex last held, whose
    /// stiffness is lowered so that its force at the predicted place is at most the coefficient times the last repulsion.
    #[inline]
    pub(crate) fn force(
        &mut self,
        vertex: usize,
        body: &BodyCollider,
        law: &ContactLaw,
        area: f64,
        (start, predicted): (Vec3, Vec3),
    ) -> Option<ContactForce> {
        let contact = self.contacts[vertex].as_ref()?;
        // What is farther than it can go stays without a plane.
        if contact.distance > REFRESH + 2.0 * predicted.distance(start) + body.fastest() {
            self.planes[vertex] = None;
            return None;
        }
        let plane = contact.plane(body);
        self.planes[vertex] = Some(plane);
        let gap = plane.normal.dot(predicted - plane.place);
        if gap >= law.thickness {
            return None;
        }
        let stiffness = law.stiffness * area;
        let repulsion = stiffness * (law.thickness - gap);
        let stick = plane.stick + tangential(predicted - start - plane.carried, plane.normal);
        let friction = if contact.slipping { law.sliding_friction } else { law.static_friction };
        let hold = STICK_SHARE * stiffness;
        let limit = friction * contact.force;
        let length = stick.length();
        let hold = if hold * length > limit { limit / length } else { hold };
        Some(ContactForce {
            force: plane.normal * repulsion - stick * hold,
            block: contact_block(plane.normal, stiffness, hold),
        })
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
        for (vertex, slot) in self.contacts.iter_mut().enumerate() {
            let Some(contact) = slot else { continue };
            let Some(plane) = self.planes[vertex] else {
                contact.distance -= x[vertex].distance(start[vertex]) + body.fastest();
                contact.force = 0.0;
                continue;
            };
            let moved = x[vertex] - start[vertex] - plane.carried;
            contact.distance -= moved.length();
            if contact.distance > REFRESH {
                contact.force = 0.0;
                continue;
            }
            let gap = plane.normal.dot(x[vertex] - plane.place);
            let stiffness = law.stiffness * areas[vertex];
            let force = stiffness * (law.thickness - gap).max(0.0);
            let mut stick = if force > 0.0 { plane.stick + tangential(moved, plane.normal) } else { Vec3::ZERO };
            let friction = if contact.slipping { law.sliding_friction } else { law.static_friction };
            let hold = STICK_SHARE * stiffness * stick.length();
            let slipping = hold > friction * force;
            if slipping {
                stick *= law.sliding_friction * force / hold;
            }
            if gap < -DEEP {
                x[vertex] -= plane.normal * gap;
            }
            let touch = body.walk(x[vertex], contact.point.face);
            let frame = body.face_frame(touch.point.face);
            let min_gap = MIN_GAP_SHARE * law.thickness;
            if touch.distance < min_gap {
                self.projected += 1;
                self.deepest = self.deepest.max(-touch.distance);
                x[vertex] += touch.normal * (min_gap - touch.distance);
                let (place, before) = body.place(&touch.point);
                let approach = touch.normal.dot(v[vertex] - (place - before) / h);
                v[vertex] -= touch.normal * approach.min(0.0);
            }
            *contact = VertexContact::new(&touch, &frame, stick, force, slipping);
        }
    }

    /// Number of vertices within `distance` (m) of the body.
    pub(crate) fn count_within(&self, distance: f64) -> usize {
        self.contacts.iter().flatten().filter(|contact| contact.distance < distance).count()
    }

    /// Number of vertices below the surface.
    pub(crate) fn count_inside(&self, body: &BodyCollider, x: &[Vec3]) -> usize {
        let near = self.contacts.iter().enumerate().filter(|(_, c)| c.is_some_and(|c| c.distance < REFRESH));
        near.filter(|(vertex, contact)| contact.is_some_and(|c| body.walk(x[*vertex], c.point.face).distance < 0.0))
            .count()
    }
}

fn tangential(v: Vec3, normal: Vec3) -> Vec3 {
    v - normal * v.dot(normal)
}

#[expect(clippy::cast_possible_truncation, reason = "the inner solve runs in f32")]
fn contact_block(normal: Vec3, repulsion: f64, hold: f64) -> Mat3A {
    let n = normal.as_vec3a();
    let outer = Mat3A::from_cols(n * n.x, n * n.y, n * n.z);
    outer * (repulsion - hold) as f32 + Mat3A::IDENTITY * hold as f32
}
