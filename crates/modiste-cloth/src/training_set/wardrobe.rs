//! A garment ready for bodies of every shape and for motion.

use std::sync::Arc;

use modiste_body::{Body, Motion, Part, Pose, ScapeModel};
use modiste_core::Vec3;

use super::TrainingError;
use crate::dress::{Carrier, Dressed, Mannequin, Tailor, TailorOptions};
use crate::pattern::{GARMENTS, builtin};
use crate::{BodyCollider, ClothState, CollisionGroups, Solver};

/// Frames from the template pose to the first pose of a motion.
const LEAD_IN_FRAMES: usize = 24;

/// Frames in which a motion takes up speed after the lead-in.
const EASE_IN_FRAMES: usize = 10;

/// Cloth nearer than this to a limb in the template pose collides with it (m).
const NEAR: f64 = 0.02;

/// Stretch (99th percentile) beyond which a frame is no example to learn from.
const MAX_STRETCH: f64 = 0.25;

/// A garment dressed on the mean body, ready for other bodies and for motion.
///
/// The mean body is dressed from the flat panels once; every other body is dressed alike from it.
#[derive(Debug, Clone)]
pub struct Wardrobe {
    model: Arc<ScapeModel>,
    tailor: Tailor,
    mean: Mannequin,
    template: Dressed,
    carrier: Carrier,
    groups: CollisionGroups,
}

/// A garment through a motion.
#[derive(Debug, Clone)]
pub struct Simulation {
    /// The motion with its lead-in from the template pose.
    pub motion: Motion,
    /// Frames of the lead-in.
    pub lead_in: usize,
    /// Garment vertices in world (m), one list per frame.
    pub frames: Vec<Vec<Vec3>>,
    /// Largest 99th percentile of the edge stretch in any frame.
    pub worst_stretch: f64,
    /// Largest number of garment vertices inside the body in any frame.
    pub worst_inside: usize,
}

impl Wardrobe {
    /// Cuts the garment and dresses the mean body.
    ///
    /// # Errors
    /// An unknown garment, or a mean body that cannot be dressed.
    pub fn new(model: &Arc<ScapeModel>, garment: &str, options: TailorOptions) -> Result<Self, TrainingError> {
        let Some(pattern) = builtin(garment, model.gender()) else {
            return Err(TrainingError::Garment { name: garment.to_owned(), known: GARMENTS.join(", ") });
        };
        let tailor = Tailor::new(Arc::new(pattern?), options)?;
        let mean = Mannequin::from(&model.body(&[])?);
        let template = tailor.dress(&mean)?;
        template.quality.check()?;
        let carrier = Carrier::new(&template.state.positions, &mean.vertices);
        let groups = groups(&tailor, &mean, &template.state.positions);
        Ok(Self { model: Arc::clone(model), tailor, mean, template, carrier, groups })
    }

    /// The body model.
    pub fn model(&self) -> &Arc<ScapeModel> {
        &self.model
    }

    /// The garment and how it is put on.
    pub fn tailor(&self) -> &Tailor {
        &self.tailor
    }

    /// The mean body.
    pub fn mean(&self) -> &Mannequin {
        &self.mean
    }

    /// The garment on the mean body in the template pose.
    pub fn template(&self) -> &Dressed {
        &self.template
    }

    /// Anchors: each garment vertex with the body vertex nearest to it on the mean body.
    pub fn anchors(&self) -> Vec<[u32; 2]> {
        let nearest = |x: Vec3| {
            let distances = (0u32..).zip(&self.mean.vertices).map(|(i, v)| (v.distance_squared(x), i));
            distances.fold((f64::INFINITY, 0), |best, found| if found.0 < best.0 { found } else { best }).1
        };
        let positions = &self.template.state.positions;
        self.tailor.cut().anchors().iter().map(|&v| [v, nearest(positions[v as usize])]).collect()
    }

    /// The garment on a body of another shape in the template pose.
    ///
    /// # Errors
    /// The plain reason why this body must be left out.
    pub fn dress(&self, body: &Body) -> Result<Dressed, TrainingError> {
        let dressed = self.tailor.redress(&self.carrier, &self.template, &self.mean, &Mannequin::from(body))?;
        dressed.quality.check()?;
        Ok(dressed)
    }

    /// Simulates a dressed body through a motion, from the template pose on. `advance` hears of each frame.
    ///
    /// # Errors
    /// A motion without frames, cloth that diverges or is torn.
    pub fn simulate(
        &self,
        body: &Body,
        dressed: &Dressed,
        sequence: (&str, &Motion),
        advance: &dyn Fn(),
    ) -> Result<Simulation, TrainingError> {
        let (name, motion) = sequence;
        let motion = with_lead_in(body, motion).ok_or_else(|| TrainingError::NoFrames(name.to_owned()))?;
        let mut model = dressed.model.clone();
        model.set_collision_groups(self.groups.clone())?;
        let mut solver = Solver::new(&model, self.tailor.options().solver);
        let mut collider = BodyCollider::new(Arc::clone(self.model.topology()), body.rest_vertices())?;
        collider.set_face_parts(self.model.face_parts())?;
        let mut state: ClothState = dressed.state.clone();
        state.velocities.fill(Vec3::ZERO);
        let mut vertices = Vec::new();
        let mut simulation =
            Simulation { lead_in: LEAD_IN_FRAMES, frames: Vec::new(), worst_stretch: 0.0, worst_inside: 0, motion };
        for (frame, pose) in simulation.motion.frames.iter().enumerate() {
            body.pose(pose, &mut vertices);
            collider.advance_to(&vertices);
            let report = solver.step(&model, &mut state, &mut collider, 1.0 / simulation.motion.fps)?;
            let stretch = state.edge_stretch(&model).percentile_99;
            if stretch > MAX_STRETCH {
                return Err(TrainingError::Torn { frame, stretch });
            }
            simulation.worst_stretch = simulation.worst_stretch.max(stretch);
            simulation.worst_inside = simulation.worst_inside.max(report.inside);
            simulation.frames.push(state.positions.clone());
            advance();
        }
        Ok(simulation)
    }
}

/// The limbs that each cloth vertex collides with: those of its faces' parts, and those that it lies near.
///
/// Cloth that belongs to one limb lets another pass, or the shirt would be clamped between a hanging arm and the trunk and
/// torn when they part.
fn groups(tailor: &Tailor, body: &Mannequin, positions: &[Vec3]) -> CollisionGroups {
    let cut = tailor.cut();
    let mut groups = CollisionGroups::from_face_parts(cut.topology(), cut.face_parts());
    for (vertex, x) in positions.iter().enumerate() {
        for (v, &part) in body.vertices.iter().zip(&body.vertex_parts) {
            if v.distance_squared(*x) < NEAR * NEAR {
                groups.add(vertex, part);
            }
        }
    }
    groups
}

/// The motion led in from the template pose: a smooth transition, then the motion taking up speed.
fn with_lead_in(body: &Body, motion: &Motion) -> Option<Motion> {
    let first = motion.frames.first()?;
    let template = body.template_pose();
    let mut frames: Vec<Pose> = (1..=LEAD_IN_FRAMES)
        .map(|i| {
            let t = i as f64 / LEAD_IN_FRAMES as f64;
            template.interpolate(first, t * t * (3.0 - 2.0 * t))
        })
        .collect();
    // Quadratic time for the first frames, joined with equal speed: t²/2T up to T, then t − T/2.
    let ease = EASE_IN_FRAMES as f64;
    let last = motion.frames.len() - 1;
    for i in 1.. {
        let t = f64::from(i);
        let time = if t < ease { 0.5 * t * t / ease } else { t - 0.5 * ease };
        if time > last as f64 {
            break;
        }
        let before = (time.floor() as usize).min(last);
        frames.push(motion.frames[before].interpolate(&motion.frames[(before + 1).min(last)], time - before as f64));
    }
    Some(Motion { fps: motion.fps, frames })
}

/// All rotations of a motion as one array of shape (frames, parts, 3).
pub(super) fn rotations(motion: &Motion) -> Vec<f32> {
    let parts = motion.frames.iter().flat_map(|pose| pose.rotations[..Part::COUNT].iter());
    parts.flat_map(|rotation| rotation.as_vec3().to_array()).collect()
}
