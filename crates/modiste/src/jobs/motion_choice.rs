//! Which motion a person makes.

use std::path::PathBuf;

use modiste_body::motion::{RetargetOptions, generate, resample, retarget};
use modiste_body::{Body, BodyError, Motion};
use modiste_core::Progress;
use modiste_io::bvh;
use serde::{Deserialize, Serialize};

use crate::limits::check_range;
use crate::{JobError, LONGEST_SECONDS};

/// A motion that the program makes itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[expect(missing_docs, reason = "the names say it")]
pub enum Action {
    Walk,
    Turn,
    RaiseArms,
    Squat,
    Kick,
    Jump,
}

/// Which motion a person makes.
#[derive(Debug, Clone, PartialEq)]
pub enum MotionChoice {
    /// One that the program makes itself.
    Action(Action),
    /// A BVH file, packed by gzip or not.
    File(PathBuf),
}

/// How much of a motion is wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Length {
    /// Seconds.
    Seconds(f64),
    /// Frames at the rate of the result.
    Frames(usize),
}

/// Length of an action (s) when none is asked for.
const ACTION_SECONDS: f64 = 4.0;
/// Shortest action (s) that is made; what is asked for beyond that is cut from its start.
const SHORTEST_ACTION: f64 = 2.0;

impl Action {
    /// All actions.
    pub const ALL: [Self; 6] = [Self::Walk, Self::Turn, Self::RaiseArms, Self::Squat, Self::Kick, Self::Jump];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Walk => "walk",
            Self::Turn => "turn",
            Self::RaiseArms => "raise-arms",
            Self::Squat => "squat",
            Self::Kick => "kick",
            Self::Jump => "jump",
        }
    }

    fn motion(self, body: &Body, seconds: f64) -> Result<Motion, BodyError> {
        let seconds = seconds.max(SHORTEST_ACTION);
        match self {
            Self::Walk => generate::walk(body, seconds),
            Self::Turn => generate::turn(body, seconds),
            Self::RaiseArms => generate::raise_arms(body, seconds),
            Self::Squat => generate::squat(body, seconds),
            Self::Kick => generate::kick(body, seconds),
            Self::Jump => generate::jump(body, seconds),
        }
    }
}

impl Length {
    fn seconds(self, fps: f64) -> f64 {
        match self {
            Self::Seconds(seconds) => seconds,
            Self::Frames(frames) => frames as f64 / fps,
        }
    }

    /// Refuses lengths that no animation has.
    pub(crate) fn check(self, fps: f64) -> Result<(), JobError> {
        check_range("length of the animation", self.seconds(fps), (0.03, LONGEST_SECONDS), "s")
    }

    /// Number of frames.
    pub(crate) fn frames(self, fps: f64) -> usize {
        match self {
            Self::Seconds(seconds) => (seconds * fps).round().max(1.0) as usize,
            Self::Frames(frames) => frames,
        }
    }
}

impl MotionChoice {
    /// What the report calls it.
    pub(crate) fn name(&self) -> String {
        match self {
            Self::Action(action) => action.name().to_owned(),
            Self::File(path) => path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned(),
        }
    }

    /// The motion of a body at `fps`, no longer than `length`; what is odd about it goes to `progress`.
    ///
    /// # Errors
    /// A file that cannot be read or used, or a length that no animation has.
    pub fn motion(
        &self,
        body: &Body,
        length: Option<Length>,
        fps: f64,
        progress: &dyn Progress,
    ) -> Result<Motion, JobError> {
        if let Some(length) = length {
            length.check(fps)?;
        }
        let mut motion = match self {
            Self::Action(action) => {
                let seconds = length.map_or(ACTION_SECONDS, |length| length.seconds(fps));
                resample(&action.motion(body, seconds)?, fps)
            }
            Self::File(path) => {
                let options = RetargetOptions { fps, ..RetargetOptions::default() };
                retarget(&bvh::read(path)?, body, &options, progress).map_err(JobError::in_file(path))?
            }
        };
        if let Some(length) = length {
            motion.frames.truncate(length.frames(fps));
        }
        check_range("length of the motion", motion.duration(), (0.0, LONGEST_SECONDS), "s")?;
        Ok(motion)
    }
}
