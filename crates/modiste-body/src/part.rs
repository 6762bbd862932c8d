//! The 19 rigid parts of the body and their kinematic tree.

use serde::{Deserialize, Serialize};

/// A rigid part of the body. The discriminant is its index in every per-part array.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[expect(missing_docs, reason = "the names say it")]
pub enum Part {
    Pelvis,
    Abdomen,
    Chest,
    Neck,
    Head,
    LeftShoulder,
    LeftUpperArm,
    LeftForearm,
    LeftHand,
    RightShoulder,
    RightUpperArm,
    RightForearm,
    RightHand,
    LeftThigh,
    LeftShin,
    LeftFoot,
    RightThigh,
    RightShin,
    RightFoot,
}

impl Part {
    /// Number of parts.
    pub const COUNT: usize = 19;

    /// All parts, parents before children, in index order.
    pub const ALL: [Self; Self::COUNT] = [
        Self::Pelvis,
        Self::Abdomen,
        Self::Chest,
        Self::Neck,
        Self::Head,
        Self::LeftShoulder,
        Self::LeftUpperArm,
        Self::LeftForearm,
        Self::LeftHand,
        Self::RightShoulder,
        Self::RightUpperArm,
        Self::RightForearm,
        Self::RightHand,
        Self::LeftThigh,
        Self::LeftShin,
        Self::LeftFoot,
        Self::RightThigh,
        Self::RightShin,
        Self::RightFoot,
    ];

    /// Index in per-part arrays.
    pub fn index(self) -> usize {
        self as usize
    }

    /// The part with this index, if there is one.
    pub fn from_index(index: usize) -> Option<Self> {
        Self::ALL.get(index).copied()
    }

    /// The part one step nearer to the root; `None` for the pelvis.
    pub fn parent(self) -> Option<Self> {
        Some(match self {
            Self::Pelvis => return None,
            Self::Abdomen | Self::LeftThigh | Self::RightThigh => Self::Pelvis,
            Self::Chest => Self::Abdomen,
            Self::Neck | Self::LeftShoulder | Self::RightShoulder => Self::Chest,
            Self::Head => Self::Neck,
            Self::LeftUpperArm => Self::LeftShoulder,
            Self::LeftForearm => Self::LeftUpperArm,
            Self::LeftHand => Self::LeftForearm,
            Self::RightUpperArm => Self::RightShoulder,
            Self::RightForearm => Self::RightUpperArm,
            Self::RightHand => Self::RightForearm,
            Self::LeftShin => Self::LeftThigh,
            Self::LeftFoot => Self::LeftShin,
            Self::RightShin => Self::RightThigh,
            Self::RightFoot => Self::RightShin,
        })
    }

    /// The name used in files, for example `left_upper_arm`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pelvis => "pelvis",
            Self::Abdomen => "abdomen",
            Self::Chest => "chest",
            Self::Neck => "neck",
            Self::Head => "head",
            Self::LeftShoulder => "left_shoulder",
            Self::LeftUpperArm => "left_upper_arm",
            Self::LeftForearm => "left_forearm",
            Self::LeftHand => "left_hand",
            Self::RightShoulder => "right_shoulder",
            Self::RightUpperArm => "right_upper_arm",
            Self::RightForearm => "right_forearm",
            Self::RightHand => "right_hand",
            Self::LeftThigh => "left_thigh",
            Self::LeftShin => "left_shin",
            Self::LeftFoot => "left_foot",
            Self::RightThigh => "right_thigh",
            Self::RightShin => "right_shin",
            Self::RightFoot => "right_foot",
        }
    }

    /// The part with this file name, if there is one.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|part| part.name() == name)
    }

    /// The part on the other side of the body; one in the middle is its own.
    #[must_use]
    pub fn mirrored(self) -> Self {
        let other = match self.name().split_once('_') {
            Some(("left", rest)) => format!("right_{rest}"),
            Some(("right", rest)) => format!("left_{rest}"),
            _ => return self,
        };
        Self::from_name(&other).unwrap_or(self)
    }
}

#[cfg(test)]
mod tests {
    use super::Part;

    #[test]
    fn parents_come_before_children_and_names_round_trip() {
        for (index, part) in Part::ALL.into_iter().enumerate() {
            assert_eq!(part.index(), index);
            assert_eq!(Part::from_name(part.name()), Some(part));
            assert!(part.parent().is_none_or(|parent| parent < part));
            assert_eq!(part.mirrored().mirrored(), part);
            assert_eq!(part.mirrored().parent(), part.parent().map(Part::mirrored));
        }
        assert_eq!(Part::LeftUpperArm.mirrored(), Part::RightUpperArm);
        assert_eq!(Part::Chest.mirrored(), Part::Chest);
    }
}
