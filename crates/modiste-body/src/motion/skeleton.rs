//! The skeletons of the motion files that are known, and how their joints map to our parts.

use modiste_core::Vec3;
use modiste_io::bvh::BvhClip;

use super::leg::Side;
use crate::{BodyError, Part};

/// A family of skeletons with the same joint names.
#[derive(Debug)]
pub(crate) struct Family {
    /// What it is called.
    pub name: &'static str,
    /// The joint whose rotation each part takes, in part order.
    parts: [&'static str; Part::COUNT],
    /// Joints that are known and not needed.
    others: &'static [&'static str],
    /// The joint at the ball of each foot, where there is one; else the foot's end site is used.
    toes: [Option<&'static str>; 2],
}

impl Family {
    pub(crate) const ALL: [Self; 2] = [
        Self {
            name: "CMU (31 joints, MotionBuilder names)",
            // The chain from hips to chest has three joints in the file and two in the body: the abdomen takes what the
            // lower two have turned.
            parts: [
                "Hips",
                "Spine",
                "Spine1",
                "Neck1",
                "Head",
                "LeftShoulder",
                "LeftArm",
                "LeftForeArm",
                "LeftHand",
                "RightShoulder",
                "RightArm",
                "RightForeArm",
                "RightHand",
                "LeftUpLeg",
                "LeftLeg",
                "LeftFoot",
                "RightUpLeg",
                "RightLeg",
                "RightFoot",
            ],
            others: &[
                "LHipJoint",
                "RHipJoint",
                "LowerBack",
                "Neck",
                "LeftToeBase",
                "RightToeBase",
                "LeftFingerBase",
                "LeftHandIndex1",
                "LFingers",
                "LThumb",
                "RightFingerBase",
                "RightHandIndex1",
                "RFingers",
                "RThumb",
            ],
            toes: [Some("LeftToeBase"), Some("RightToeBase")],
        },
        Self {
            name: "DAZ (43 joints)",
            parts: [
                "hip", "abdomen", "chest", "neck", "head", "lCollar", "lShldr", "lForeArm", "lHand", "rCollar",
                "rShldr", "rForeArm", "rHand", "lThigh", "lShin", "lFoot", "rThigh", "rShin", "rFoot",
            ],
            others: &[
                "leftEye", "rightEye", "lButtock", "rButtock", "lThumb1", "lThumb2", "lIndex1", "lIndex2", "lMid1",
                "lMid2", "lRing1", "lRing2", "lPinky1", "lPinky2", "rThumb1", "rThumb2", "rIndex1", "rIndex2", "rMid1",
                "rMid2", "rRing1", "rRing2", "rPinky1", "rPinky2",
            ],
            toes: [None, None],
        },
    ];

    fn knows(&self, joint: &str) -> bool {
        self.parts.contains(&joint) || self.others.contains(&joint)
    }

    /// The name with some joints by which a user recognises the family.
    fn described(&self) -> String {
        format!("{}, with {}, {}, …", self.name, self.parts[0], self.parts[Part::LeftThigh.index()])
    }

    /// The joint whose rotation a part takes.
    #[cfg(test)]
    pub(crate) fn joint_name(&self, part: Part) -> &'static str {
        self.parts[part.index()]
    }
}

/// A clip whose joints have been matched with our parts.
#[derive(Debug)]
pub(crate) struct Source<'a> {
    clip: &'a BvhClip,
    family: &'static Family,
    /// Joint of each part.
    joints: [usize; Part::COUNT],
    /// Rest position of every joint (clip units).
    rest: Vec<Vec3>,
}

impl<'a> Source<'a> {
    pub(crate) fn new(clip: &'a BvhClip) -> Result<Self, BodyError> {
        static FAMILIES: [Family; 2] = Family::ALL;
        let known = |family: &Family| clip.joints.iter().filter(|joint| family.knows(&joint.name)).count();
        let [first, second] = &FAMILIES;
        let family = if known(second) > known(first) { second } else { first };
        if let Some(joint) = clip.joints.iter().find(|joint| !family.knows(&joint.name)) {
            let known = FAMILIES.iter().map(Family::described).collect::<Vec<_>>().join(" and ");
            return Err(BodyError::UnknownJoint { joint: joint.name.clone(), known });
        }
        let mut joints = [0; Part::COUNT];
        for (place, name) in joints.iter_mut().zip(family.parts) {
            *place = clip.joint(name).ok_or(BodyError::MissingJoint { family: family.name, joint: name })?;
        }
        let mut rest: Vec<Vec3> = Vec::with_capacity(clip.joints.len());
        for joint in &clip.joints {
            rest.push(joint.parent.map_or(Vec3::ZERO, |parent| rest[parent]) + joint.offset);
        }
        let channels = clip.channel_count();
        if let Some((index, frame)) = clip.frames.iter().enumerate().find(|(_, frame)| frame.len() != channels) {
            return Err(BodyError::Motion(format!("frame {index} has {} values, not {channels}", frame.len())));
        }
        let source = Self { clip, family, joints, rest };
        for side in Side::BOTH {
            for (part, far) in
                [(side.thigh(), side.shin()), (side.shin(), side.foot()), (side.upper_arm(), side.forearm())]
            {
                if !(source.rest_bone(part, far).length() > 0.0) {
                    return Err(BodyError::Motion(format!(
                        "the rest pose has no length from {} to {}",
                        part.name(),
                        far.name()
                    )));
                }
            }
        }
        Ok(source)
    }

    pub(crate) fn clip(&self) -> &'a BvhClip {
        self.clip
    }

    /// Index of the clip's joint for a part.
    pub(crate) fn joint(&self, part: Part) -> usize {
        self.joints[part.index()]
    }

    /// From one part's joint to another's in the clip's rest pose (clip units).
    pub(crate) fn rest_bone(&self, part: Part, far: Part) -> Vec3 {
        self.rest[self.joint(far)] - self.rest[self.joint(part)]
    }

    /// From the ankle towards the toes in the clip's rest pose (clip units); straight ahead if the file does not say.
    pub(crate) fn rest_foot(&self, side: Side) -> Vec3 {
        let ankle = self.joint(side.foot());
        let toes = self.family.toes[side.index()].and_then(|name| self.clip.joint(name));
        match (toes, self.clip.joints[ankle].end_site) {
            (Some(toes), _) => self.rest[toes] - self.rest[ankle],
            (None, Some(end)) => end,
            (None, None) => Vec3::Z,
        }
    }
}
