//! One vertex against one place of the body's surface: repulsion, Coulomb friction and a last projection.

use super::collider::{BodyCollider, BodyPoint, Touch};
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
    /// How far a pressure moves free cloth within a substep (m/Pa): its length squared over the mass per area.
    pub(crate) mobility: f64,
}

/// Share of the thickness below which a vertex is moved out at once.
const MIN_GAP_SHARE: f64 = 0.25;

/// Stiffness of sticking over that of repulsion.
const STICK_SHARE: f64 = 0.5;

/// Depth (m) below the plane of contact from which a vertex is first brought back to that plane: the nearest place of the
/// surface might be on the far side of a limb.
const DEEP: f64 = 0.004;

/// The most (m) that a vertex is moved out at once; more would jerk its neighbours.
const LONGEST_STEP: f64 = 0.008;

/// How often a vertex is moved out in a substep.
const CREASE_ROUNDS: usize = 4;

/// A place of the surface as a vertex remembers it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Surface {
    /// The material point.
    pub(super) point: BodyPoint,
    /// Signed distance (m); a lower bound where it is not refreshed.
    pub(super) distance: f64,
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
pub(super) struct Plane {
    place: Vec3,
    /// How far the place goes within the substep (m).
    pub(super) carried: Vec3,
    normal: Vec3,
    stick: Vec3,
    /// Whether it pushed in this substep.
    active: bool,
}

/// Force and stiffness of one contact.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ContactForce {
    pub(crate) force: Vec3,
    pub(crate) block: Mat3A,
}

/// What a substep has left to a vertex.
pub(super) struct Outcome<'a> {
    pub(super) body: &'a BodyCollider,
    pub(super) law: &'a ContactLaw,
    pub(super) area: f64,
    pub(super) start: Vec3,
    pub(super) h: f64,
}

impl Plane {
    /// Signed distance (m).
    #[inline]
    pub(super) fn gap(&self, x: Vec3) -> f64 {
        self.normal.dot(x - self.place)
    }
}

impl Surface {
    pub(super) fn new(body: &BodyCollider, touch: &Touch) -> Self {
        Self::with(body, touch, Vec3::ZERO, 0.0, false)
    }

    /// The same contact seen at another place.
    pub(super) fn moved_to(&self, body: &BodyCollider, touch: &Touch) -> Self {
        Self::with(body, touch, self.plane(body).stick, self.force, self.slipping)
    }

    fn with(body: &BodyCollider, touch: &Touch, stick: Vec3, force: f64, slipping: bool) -> Self {
        let frame = body.face_frame(touch.point.face);
        let local = |v: Vec3| frame.map(|axis| axis.dot(v));
        Self {
            point: touch.point,
            distance: touch.distance,
            normal: local(touch.normal),
            stick: local(tangential(stick, touch.normal)),
            force,
            slipping,
        }
    }

    pub(super) fn world_normal(&self, body: &BodyCollider) -> Vec3 {
        to_world(&body.face_frame(self.point.face), &self.normal)
    }

    pub(super) fn plane(&self, body: &BodyCollider) -> Plane {
        let (place, before) = body.place(&self.point);
        let frame = body.face_frame(self.point.face);
        let [normal, stick] = [&self.normal, &self.stick].map(|v| to_world(&frame, v));
        Plane { place, carried: place - before, normal, stick, active: false }
    }

    /// Force and stiffness on a vertex that goes from `start` to `predicted` within a substep, or `None` out of reach.
    ///
    /// Repulsion `k (thickness - gap)` along the normal. Friction is a spring from where the vertex last held, whose
    /// stiffness is lowered so that its force at the predicted place is at most the coefficient times the last repulsion.
    /// `fall` is what the weight alone adds to the way: cloth that is about to fall onto the surface touches it.
    #[inline]
    pub(super) fn force(
        &self,
        plane: &mut Plane,
        law: &ContactLaw,
        area: f64,
        (start, predicted, fall): (Vec3, Vec3, Vec3),
    ) -> Option<ContactForce> {
        let gap = plane.gap(predicted);
        if gap + plane.normal.dot(fall).min(0.0) >= law.thickness {
            return None;
        }
        plane.active = true;
        let stiffness = law.stiffness * area;
        let repulsion = stiffness * (law.thickness - gap);
        let stick = plane.stick + tangential(predicted - start - plane.carried, plane.normal);
        let friction = if self.slipping { law.sliding_friction } else { law.static_friction };
        let hold = STICK_SHARE * stiffness;
        let limit = friction * self.force;
        let length = stick.length();
        if hold * length <= limit {
            let force = plane.normal * repulsion - stick * hold;
            return Some(ContactForce { force, block: contact_block(plane.normal, stiffness, hold) });
        }
        // Sliding friction turns with the way but does not grow along it. Only cloth that friction would stop and turn
        // back within the substep is held along its way too.
        let along = stick / length;
        let hold = limit / length;
        let free = 1.0 - (limit / area * law.mobility / length).min(1.0);
        let force = plane.normal * repulsion - along * limit;
        let block = contact_block(plane.normal, stiffness, hold) - outer(along, hold * free);
        Some(ContactForce { force, block })
    }

    /// Notes that vertex and body came closer by at most `motion` (m) while out of reach.
    pub(super) fn pass(&mut self, motion: f64) {
        self.distance -= motion;
        self.force = 0.0;
    }

    /// Takes the outcome of a substep; returns how deep (m) below the surface the vertex was if it had to be moved out.
    pub(super) fn finish(
        &mut self,
        plane: &Plane,
        substep: &Outcome<'_>,
        refresh: f64,
        (x, v): (&mut Vec3, &mut Vec3),
    ) -> Option<f64> {
        let Outcome { body, law, area, start, h } = *substep;
        let moved = *x - start - plane.carried;
        let gap = plane.gap(*x);
        self.distance = (self.distance - moved.length()).max(gap.min(self.distance));
        if self.distance > refresh {
            self.force = 0.0;
            return None;
        }
        let stiffness = law.stiffness * area;
        let force = if plane.active { stiffness * (law.thickness - gap).max(0.0) } else { 0.0 };
        let mut stick = if force > 0.0 { plane.stick + tangential(moved, plane.normal) } else { Vec3::ZERO };
        let friction = if self.slipping { law.sliding_friction } else { law.static_friction };
        let hold = STICK_SHARE * stiffness * stick.length();
        let slipping = hold > friction * force;
        if slipping {
            stick *= law.sliding_friction * force / hold;
        }
        if gap < -DEEP {
            *x -= plane.normal * gap.max(-LONGEST_STEP);
        }
        let mut touch = body.walk(*x, self.point.face);
        let min_gap = MIN_GAP_SHARE * law.thickness;
        let mut depth = None;
        // In a crease the way out of one side leads into the other.
        for _ in 0..CREASE_ROUNDS {
            if touch.distance >= min_gap {
                break;
            }
            depth = Some((-touch.distance).max(-gap).max(depth.unwrap_or(0.0)));
            *x += touch.normal * (min_gap - touch.distance).min(LONGEST_STEP);
            let (place, before) = body.place(&touch.point);
            let approach = touch.normal.dot(*v - (place - before) / h);
            *v -= touch.normal * approach.min(0.0);
            touch = body.walk(*x, touch.point.face);
        }
        *self = Self::with(body, &touch, stick, force, slipping);
        depth
    }
}

fn to_world(frame: &[Vec3; 3], v: &[f64; 3]) -> Vec3 {
    frame[0] * v[0] + frame[1] * v[1] + frame[2] * v[2]
}

fn tangential(v: Vec3, normal: Vec3) -> Vec3 {
    v - normal * v.dot(normal)
}

#[expect(clippy::cast_possible_truncation, reason = "the inner solve runs in f32")]
fn contact_block(normal: Vec3, repulsion: f64, hold: f64) -> Mat3A {
    outer(normal, repulsion - hold) + Mat3A::from_diagonal(glam::Vec3::splat(hold as f32))
}

/// `scale v vᵀ`.
#[expect(clippy::cast_possible_truncation, reason = "the inner solve runs in f32")]
fn outer(v: Vec3, scale: f64) -> Mat3A {
    let v = v.as_vec3a();
    Mat3A::from_cols(v * v.x, v * v.y, v * v.z) * scale as f32
}
