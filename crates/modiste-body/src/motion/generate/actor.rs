//! A body that is told where its pelvis, feet and arms are.

use modiste_core::{Quat, Vec3};

use crate::motion::leg::{Side, leg_bones, place_foot};
use crate::{Body, Part, Pose};

/// Share of the leg's length between hip and ankle when standing: knees soft, not locked.
const STANDING_LEG: f64 = 0.985;

/// An arm by its angles (radians) in the frame of the chest; all zero is straight down.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Arm {
    /// Away from the body, sideways.
    pub out: f64,
    /// Forwards.
    pub swing: f64,
    /// Bend of the elbow.
    pub elbow: f64,
    /// Lift of the shoulder.
    pub shrug: f64,
}

/// A foot in the world.
#[derive(Debug, Clone, Copy)]
pub(super) struct Foot {
    /// Where the ankle is (m).
    pub ankle: Vec3,
    /// Turn about the vertical (radians), 0 as in the template pose.
    pub yaw: f64,
    /// Toes down (radians).
    pub pitch: f64,
}

/// What an actor is told for one frame.
#[derive(Debug, Clone)]
pub(super) struct Figure {
    /// Where the pelvis joint is (m).
    pub pelvis: Vec3,
    /// Turn of the pelvis in the world.
    pub pelvis_turn: Quat,
    /// Turn of abdomen, chest, neck and head, each relative to the one below.
    pub spine: [Quat; 4],
    /// Left and right.
    pub arms: [Arm; 2],
    /// Left and right.
    pub feet: [Foot; 2],
}

/// A body with the lengths that movements are made from.
#[derive(Debug)]
pub(super) struct Actor<'a> {
    body: &'a Body,
    /// Per side: from the ankle to the point under it where the toes (heel) touch the floor, in the template pose (m).
    toe_from_ankle: [Vec3; 2],
    heel_from_ankle: [Vec3; 2],
    stance: f64,
}

/// Room (m) between the legs of somebody who stands at ease.
const LEG_GAP: f64 = 0.012;

/// How far apart the ankles stand: x of the left one (m).
///
/// A little more than the hip joints; further where the thighs need it. At a share `f` of the way from hip to ankle the
/// bone is at `hip + f (ankle - hip)`, and the skin inside of it must stay clear of the middle by half the gap.
fn stance(body: &Body) -> f64 {
    let joint = |part: Part| body.rest_joints()[part.index()];
    let [hip, knee, ankle] = [Part::LeftThigh, Part::LeftShin, Part::LeftFoot].map(joint);
    let least = 0.5 * (hip.x - joint(Part::RightThigh).x) + 0.012;
    let bone = |y: f64| {
        let [above, below] = if y > knee.y { [hip, knee] } else { [knee, ankle] };
        above.x + (below.x - above.x) * (above.y - y) / (above.y - below.y)
    };
    let needed = body.model().vertex_parts().iter().zip(body.rest_vertices()).filter_map(|(part, x)| {
        let share = (hip.y - x.y) / (hip.y - ankle.y);
        let on_leg = matches!(part, Part::LeftThigh | Part::LeftShin) && (0.3..0.9).contains(&share);
        on_leg.then(|| hip.x + (bone(x.y) - x.x + 0.5 * LEG_GAP - hip.x) / share)
    });
    needed.fold(least, f64::max).min(least + 0.12)
}

impl<'a> Actor<'a> {
    pub(super) fn new(body: &'a Body) -> Self {
        let mut toe_from_ankle = [Vec3::ZERO; 2];
        let mut heel_from_ankle = [Vec3::ZERO; 2];
        for side in Side::BOTH {
            let ankle = body.rest_joints()[side.foot().index()];
            let of_foot =
                body.model().vertex_parts().iter().zip(body.rest_vertices()).filter(|(part, _)| **part == side.foot());
            let (back, front) =
                of_foot.fold((ankle.z, ankle.z), |(back, front), (_, x)| (back.min(x.z), front.max(x.z)));
            // Toes and heel are round: they touch a little inside of where the foot ends.
            let inset = 0.08 * (front - back);
            toe_from_ankle[side.index()] = Vec3::new(0.0, -ankle.y, front - inset - ankle.z);
            heel_from_ankle[side.index()] = Vec3::new(0.0, -ankle.y, back + inset - ankle.z);
        }
        Self { body, toe_from_ankle, heel_from_ankle, stance: stance(body) }
    }

    fn rest(&self, part: Part) -> Vec3 {
        self.body.rest_joints()[part.index()]
    }

    /// Joints in the template pose (m).
    pub(super) fn rest_joints(&self) -> &[Vec3; Part::COUNT] {
        self.body.rest_joints()
    }

    /// Length of the left leg from hip to ankle (m).
    pub(super) fn leg_length(&self) -> f64 {
        leg_bones(self.body.rest_joints(), Side::Left).iter().sum()
    }

    /// Height of the ankle over the floor when the foot is flat (m).
    pub(super) fn ankle_height(&self, side: Side) -> f64 {
        self.rest(side.foot()).y
    }

    /// Where the ankles stand: the left one's x (m).
    pub(super) fn stance(&self) -> f64 {
        self.stance
    }

    /// From the pelvis joint to a hip joint (m).
    pub(super) fn hip_from_pelvis(&self, side: Side) -> Vec3 {
        self.rest(side.thigh()) - self.rest(Part::Pelvis)
    }

    /// A flat foot in the standing pose.
    pub(super) fn planted(&self, side: Side) -> Foot {
        let z = self.rest(side.foot()).z - self.rest(Part::Pelvis).z;
        Foot { ankle: Vec3::new(side.sign() * self.stance(), self.ankle_height(side), z), yaw: 0.0, pitch: 0.0 }
    }

    /// The foot rolled over its toes (pitch above 0) or its heel (below) from where it stands flat.
    pub(super) fn rolled(&self, side: Side, flat: Foot, pitch: f64) -> Foot {
        let pivot = if pitch > 0.0 { self.toe_from_ankle } else { self.heel_from_ankle }[side.index()];
        let yaw = Quat::from_rotation_y(flat.yaw);
        let ankle = flat.ankle + yaw * (pivot - Quat::from_rotation_x(pitch) * pivot);
        Foot { ankle, pitch: flat.pitch + pitch, ..flat }
    }

    /// The highest the pelvis joint can be (m), for the leg to reach its ankle.
    pub(super) fn highest_pelvis(&self, side: Side, figure: &Figure) -> f64 {
        let hip = figure.pelvis + figure.pelvis_turn * self.hip_from_pelvis(side);
        let ankle = figure.feet[side.index()].ankle;
        let length = STANDING_LEG * leg_bones(self.body.rest_joints(), side).iter().sum::<f64>();
        let across = (hip.x - ankle.x).powi(2) + (hip.z - ankle.z).powi(2);
        ankle.y + (length * length - across).max(0.0).sqrt() - (hip.y - figure.pelvis.y)
    }

    /// Standing at ease above the origin.
    pub(super) fn standing(&self) -> Figure {
        let arm = Arm { out: 0.16, swing: 0.02, elbow: 0.3, shrug: 0.0 };
        let mut figure = Figure {
            pelvis: Vec3::ZERO,
            pelvis_turn: Quat::IDENTITY,
            spine: [Quat::IDENTITY; 4],
            arms: [arm; 2],
            feet: Side::BOTH.map(|side| self.planted(side)),
        };
        figure.pelvis.y =
            Side::BOTH.into_iter().map(|side| self.highest_pelvis(side, &figure)).fold(f64::INFINITY, f64::min);
        figure
    }

    /// The pose that does what the figure says.
    pub(super) fn pose(&self, figure: &Figure) -> Pose {
        let mut pose = Pose::template(figure.pelvis);
        pose.set_rotation(Part::Pelvis, figure.pelvis_turn);
        for (part, turn) in [Part::Abdomen, Part::Chest, Part::Neck, Part::Head].into_iter().zip(figure.spine) {
            pose.set_rotation(part, turn);
        }
        for side in Side::BOTH {
            self.place_arm(&mut pose, side, figure.arms[side.index()]);
            let foot = figure.feet[side.index()];
            let turn = Quat::from_rotation_y(foot.yaw) * Quat::from_rotation_x(foot.pitch);
            // The knee points between where the pelvis faces and where the foot does.
            let facing = figure.pelvis_turn * Vec3::Z;
            let forwards = (super::horizontal(facing).normalize_or_zero() + Quat::from_rotation_y(foot.yaw) * Vec3::Z)
                .normalize_or(facing);
            place_foot(&mut pose, self.body.rest_joints(), side, foot.ankle, turn, forwards);
        }
        pose
    }

    fn place_arm(&self, pose: &mut Pose, side: Side, arm: Arm) {
        let upper = (self.rest(side.forearm()) - self.rest(side.upper_arm())).normalize_or(Vec3::NEG_Y);
        let lower = (self.rest(side.hand()) - self.rest(side.forearm())).normalize_or(Vec3::NEG_Y);
        let hanging = Vec3::new(side.sign() * arm.out.sin(), -arm.out.cos(), 0.0);
        let wanted = Quat::from_rotation_x(-arm.swing) * hanging;
        let shrug = Quat::from_rotation_z(side.sign() * arm.shrug);
        pose.set_rotation(side.shoulder(), shrug);
        pose.set_rotation(side.upper_arm(), shrug.conjugate() * Quat::from_rotation_arc(upper, wanted));
        // The elbow's axis in the template pose bends the forearm forwards.
        let hinge = upper.cross(Vec3::Z).normalize_or(Vec3::NEG_X);
        pose.set_rotation(side.forearm(), Quat::from_axis_angle(hinge, arm.elbow - upper.angle_between(lower)));
    }
}
