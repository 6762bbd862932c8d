//! The motions of the long run.

use std::collections::BTreeSet;
use std::path::PathBuf;

use anyhow::{Context, Result};
use modiste::{Action, Length, MotionChoice, Sources};
use modiste_body::{Body, Motion};
use modiste_cloth::training_set::TRAINING_CLIPS;
use modiste_core::Silent;

use super::FRAMES;
use crate::shell::workspace_root;

/// Frames a second.
const FPS: f64 = 30.0;

/// A captured clip, or an action that the program makes itself.
#[derive(Debug, Clone)]
pub(super) struct Clip {
    pub(super) name: String,
    /// The file of a captured one.
    pub(super) file: Option<PathBuf>,
    /// Whether garments were learned from it.
    pub(super) trained: bool,
}

/// `count` captured clips, those that no garment was learned from first; made motions where there are too few.
pub(super) fn clips(count: usize) -> Result<Vec<Clip>> {
    let sources = Sources { data: workspace_root().join("../shared/data"), ..Sources::default() };
    let files = match sources.mocap() {
        Some(folder) => modiste_io::list_folder(folder)?,
        None => Vec::new(),
    };
    let trained: BTreeSet<&str> = TRAINING_CLIPS.iter().map(|window| window.clip).collect();
    let mut clips: Vec<Clip> = files
        .into_iter()
        .filter_map(|file| {
            let name = file.file_name()?.to_str()?.strip_suffix(".bvh.gz")?.to_owned();
            Some(Clip { trained: trained.contains(name.as_str()), file: Some(file), name })
        })
        .collect();
    clips.sort_by(|a, b| (a.trained, &a.name).cmp(&(b.trained, &b.name)));
    clips.truncate(count);
    for index in clips.len()..count {
        let (round, action) = (index / Action::ALL.len(), Action::ALL[index % Action::ALL.len()]);
        clips.push(Clip { name: format!("made-{}-{round}", action.name()), file: None, trained: false });
    }
    Ok(clips)
}

impl Clip {
    /// [`FRAMES`] frames from the middle of the motion; one that is shorter goes there and back again.
    pub(super) fn motion(&self, body: &Body) -> Result<Motion> {
        let action = Action::ALL.into_iter().find(|action| self.name.contains(action.name()));
        let (choice, length) = match &self.file {
            Some(file) => (MotionChoice::File(file.clone()), None),
            None => (MotionChoice::Action(action.unwrap_or(Action::Walk)), Some(Length::Seconds(6.0))),
        };
        let motion = choice.motion(body, length, FPS, &Silent).with_context(|| format!("motion {}", self.name))?;
        let first = motion.frames.len().saturating_sub(FRAMES) / 2;
        let there = motion.frames[first..].iter();
        let frames = there.clone().chain(there.rev()).cycle().take(FRAMES).cloned().collect();
        Ok(Motion { fps: motion.fps, frames })
    }
}
