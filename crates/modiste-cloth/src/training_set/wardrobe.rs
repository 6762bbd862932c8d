//! A garment ready for bodies of every shape and for motion.

use std::sync::Arc;

use modiste_body::{Body, Motion, Part, Pose, ScapeModel};
use modiste_core::Vec3;

use super::TrainingError;
use crate::dress::{Carrier, Design, Dressed, Mannequin, Tailor, TailorOptions};
use crate::{BodyCollider, ClothState, CollisionGroups, Solver};

/// Frames from the template pose to the first pose of a motion.
const LEAD_IN_FRAMES: usize = 24;

/// Frames in which a motion takes up speed after the lead-in.
const EASE_IN_FRAMES: usize = 10;

/// Cloth nearer than this to a limb in the template pose collides with it (m).
const NEAR: f64 = 0.02;

/// Stretch (99th percentile) at which a simulation ends: the garment would not come back from it.
pub(super) const TORN: f64 = 0.3;

/// Stretch (99th percentile) beyond which a frame is no example to learn from.
const MAX_STRETCH: f64 = 0.12;

/// Frames beside one that is overstretched which are no example either: cloth does not tear from one frame to the next, nor
/// come back at once.
const TORN_MARGIN: usize = 5;

/// Fewest frames, lead-in left out, that are worth learning from.
const SHORTEST_RUN: usize = 12;

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
    /// The motion with its lead-in from the template pose, as far as it was simulated.
    pub motion: Motion,
    /// Frames of the lead-in.
    pub lead_in: usize,
    /// Garment vertices in world (m), one list per frame.
    pub frames: Vec<Vec<Vec3>>,
    /// The body vertices of the garment's anchors in world (m), one list per frame.
    pub body_anchors: Vec<Vec<Vec3>>,
    /// 99th percentile of the edge stretch in each frame.
    pub stretch: Vec<f64>,
    /// Number of garment vertices inside the body in each frame.
    pub inside: Vec<usize>,
}

impl Simulation {
    /// The longest run of frames that can be learned from: nothing inside the body, nothing overstretched.
    ///
    /// # Errors
    /// No such run that is long enough.
    pub fn soundest(&self) -> Result<Self, TrainingError> {
        self.longest_run(|frame| {
            let around = frame.saturating_sub(TORN_MARGIN)..self.stretch.len().min(frame + TORN_MARGIN + 1);
            self.stretch[around].iter().all(|&stretch| stretch <= MAX_STRETCH) && self.inside[frame] == 0
        })
    }

    /// The longest run of frames that are sound.
    pub(super) fn longest_run(&self, is_sound: impl Fn(usize) -> bool) -> Result<Self, TrainingError> {
        let (mut longest, mut start) = (0..0, 0);
        for frame in 0..=self.frames.len() {
            if frame == self.frames.len() || !is_sound(frame) {
                if frame - start > longest.len() {
                    longest = start..frame;
                }
                start = frame + 1;
            }
        }
        let lead_in = self.lead_in.saturating_sub(longest.start).min(longest.len());
        if longest.len() < lead_in + SHORTEST_RUN {
            let frames = longest.len() - lead_in;
            return Err(TrainingError::Unsound { frames, wanted: SHORTEST_RUN });
        }
        Ok(Self {
            motion: self.motion.slice(longest.clone()),
            lead_in,
            frames: self.frames[longest.clone()].to_vec(),
            body_anchors: self.body_anchors[longest.clone()].to_vec(),
            stretch: self.stretch[longest.clone()].to_vec(),
            inside: self.inside[longest].to_vec(),
        })
    }
}

impl Wardrobe {
    /// Cuts the garment, or takes it as it is, and dresses the mean body.
    ///
    /// # Errors
    /// A pattern that cannot be cut, or a mean body that cannot be dressed.
    pub fn new(
        model: &Arc<ScapeModel>,
        design: impl Into<Design>,
        options: TailorOptions,
    ) -> Result<Self, TrainingError> {
        let tailor = Tailor::new(design, options)?;
        let mean = Mannequin::from(&model.body(&[])?);
        // Dressed again like every other body, so that its drape is one of them.
        let sewn = tailor.dress(&mean)?;
        let template =
            tailor.redress(&Carrier::new(&sewn.state.positions, &mean.vertices), &sewn, &mean, (&mean, 0.0))?;
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
        anchored(self.tailor.anchors(), &self.template.state.positions, &self.mean)
    }

    /// The garment on a body of another shape in the template pose, with an ease from -1 (slim) to 1 (loose).
    ///
    /// # Errors
    /// The plain reason why this body must be left out.
    pub fn dress(&self, body: &Body, ease: f64) -> Result<Dressed, TrainingError> {
        let dressed = self.tailor.redress(&self.carrier, &self.template, &self.mean, (&Mannequin::from(body), ease))?;
        dressed.quality.check()?;
        Ok(dressed)
    }

    /// Simulates a dressed body through a motion, from the template pose on. `advance` hears of each frame.
    ///
    /// Where the garment is torn the simulation ends, with the frames before.
    ///
    /// # Errors
    /// A motion without frames, or cloth that diverges.
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
        let anchors = self.anchors();
        let (mut frames, mut body_anchors) = (Vec::new(), Vec::new());
        let (mut stretch, mut inside) = (Vec::new(), Vec::new());
        for pose in &motion.frames {
            body.pose(pose, &mut vertices);
            collider.advance_to(&vertices);
            let report = solver.step(&model, &mut state, &mut collider, 1.0 / motion.fps)?;
            let stretched = state.edge_stretch(&model).percentile_99;
            if stretched > TORN {
                break;
            }
            stretch.push(stretched);
            inside.push(report.inside);
            frames.push(state.positions.clone());
            body_anchors.push(anchors.iter().map(|&[_, vertex]| vertices[vertex as usize]).collect());
            advance();
        }
        let motion = motion.slice(0..frames.len());
        Ok(Simulation { motion, lead_in: LEAD_IN_FRAMES, frames, body_anchors, stretch, inside })
    }
}

/// The limbs that each cloth vertex lies on: those of its faces' parts, those that it lies near, and the nearest.
///
/// Cloth stays on the limbs that it covers and lets others pass, or the shirt would be clamped between a hanging arm and
/// the trunk and torn when they part, and a hand that grazes the hip would be dressed in the shorts. The cloth of one leg
/// does not go over to the other: it would ride up as they pass each other.
fn groups(tailor: &Tailor, body: &Mannequin, positions: &[Vec3]) -> CollisionGroups {
    let mut groups = CollisionGroups::from_face_parts(tailor.topology(), tailor.face_parts());
    groups.let_others_pass();
    for (vertex, part) in tailor.covers() {
        groups.add(vertex as usize, part);
    }
    for (vertex, x) in positions.iter().enumerate() {
        let mut nearest = (f64::INFINITY, Part::Pelvis);
        let mut near = [false; Part::COUNT];
        for (v, &part) in body.vertices.iter().zip(&body.vertex_parts) {
            let squared = v.distance_squared(*x);
            if squared < nearest.0 {
                nearest = (squared, part);
            }
            if squared < NEAR * NEAR {
                near[part.index()] = true;
            }
        }
        near[nearest.1.index()] = true;
        for part in Part::ALL.into_iter().filter(|part| near[part.index()]) {
            if groups.is_of_twin(vertex, part) {
                groups.press(vertex, part);
            } else {
                groups.add(vertex, part);
            }
        }
        // A thigh that is lifted carries the hem of a shirt; the skin of the groin gives way to both.
        if groups.lies_on(vertex, Part::Pelvis) {
            groups.press(vertex, Part::LeftThigh);
            groups.press(vertex, Part::RightThigh);
        }
    }
    groups
}

/// Each of some garment vertices with the body vertex nearest to it.
pub(super) fn anchored(vertices: &[u32], positions: &[Vec3], body: &Mannequin) -> Vec<[u32; 2]> {
    let nearest = |x: Vec3| {
        let distances = (0u32..).zip(&body.vertices).map(|(i, v)| (v.distance_squared(x), i));
        distances.fold((f64::INFINITY, 0), |best, found| if found.0 < best.0 { found } else { best }).1
    };
    vertices.iter().map(|&v| [v, nearest(positions[v as usize])]).collect()
}

/// How many frames simulating a motion takes, its lead-in among them.
pub fn simulated_frames(motion: &Motion) -> usize {
    motion.frames.len() + LEAD_IN_FRAMES + EASE_IN_FRAMES / 2 - 1
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

#[cfg(test)]
mod tests {
    use super::{LEAD_IN_FRAMES, Simulation, TORN_MARGIN};
    use crate::training_set::TrainingError;
    use modiste_body::{Motion, Pose};
    use modiste_core::Vec3;

    /// A simulation whose frames bear their numbers.
    fn simulation(count: usize) -> Simulation {
        let number = |frame: usize| Vec3::new(frame as f64, 0.0, 0.0);
        Simulation {
            motion: Motion { fps: 30.0, frames: (0..count).map(|frame| Pose::template(number(frame))).collect() },
            lead_in: LEAD_IN_FRAMES,
            frames: (0..count).map(|frame| vec![number(frame)]).collect(),
            body_anchors: vec![Vec::new(); count],
            stretch: vec![0.05; count],
            inside: vec![0; count],
        }
    }

    #[test]
    fn the_longest_sound_run_is_kept_with_its_poses_and_its_part_of_the_lead_in() {
        let mut run = simulation(100);
        assert_eq!(run.soundest().unwrap().frames.len(), 100);
        run.stretch[90] = 0.15;
        let kept = run.soundest().unwrap();
        assert_eq!((kept.frames.len(), kept.lead_in), (85, LEAD_IN_FRAMES), "not those just before either");
        run.inside[9] = 1;
        let kept = run.soundest().unwrap();
        assert_eq!((kept.frames.len(), kept.lead_in), (75, LEAD_IN_FRAMES - 10));
        assert!((kept.frames[0][0].x - 10.0).abs() < 1e-12);
        assert!((kept.motion.frames[0].root_translation.x - 10.0).abs() < 1e-12);
        assert_eq!((kept.stretch.len(), kept.inside.len()), (75, 75));
        run.inside[40] = 2;
        let kept = run.soundest().unwrap();
        assert_eq!((kept.frames.len(), kept.lead_in), (44, 0));
    }

    #[test]
    fn a_run_that_is_hardly_longer_than_the_lead_in_is_refused() {
        let mut run = simulation(60);
        run.stretch[LEAD_IN_FRAMES + 5 + TORN_MARGIN..].fill(0.2);
        assert!(matches!(run.soundest(), Err(TrainingError::Unsound { frames: 5, .. })));
        run.stretch.fill(0.2);
        assert!(matches!(run.soundest(), Err(TrainingError::Unsound { frames: 0, .. })));
    }
}
