//! Which captured clips a sequence comes from, so that what is chosen by clips held out is not chosen by what was learned.

use super::training_set::PoseSequence;

/// The clips that a sequence is a stretch of, or was put together of, by number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Clips(Vec<usize>);

/// How a sequence stands to a group of clips that is held out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Standing {
    /// It has nothing of them, and is learned from.
    Kept,
    /// It comes from them alone, and is tested on.
    HeldOut,
    /// It has something of them, and is left alone.
    Mixed,
}

impl Clips {
    /// Of each sequence, numbered by first appearance in the names: `kick-2` is the second stretch of `kick`, and
    /// `mixed_kick-2+walk` was put together of two clips.
    pub(crate) fn of<'a>(sequences: &'a [PoseSequence]) -> Vec<Self> {
        let mut known: Vec<&str> = Vec::new();
        let mut number = |stretch: &'a str| {
            let clip = match stretch.rsplit_once('-') {
                Some((clip, count)) if count.bytes().all(|byte| byte.is_ascii_digit()) => clip,
                _ => stretch,
            };
            known.iter().position(|other| *other == clip).unwrap_or_else(|| {
                known.push(clip);
                known.len() - 1
            })
        };
        let numbers = |sequence: &'a PoseSequence| {
            let stretches = sequence.name.strip_prefix("mixed_").unwrap_or(&sequence.name);
            Self(stretches.split('+').map(&mut number).collect())
        };
        sequences.iter().map(numbers).collect()
    }

    /// The same for the pieces of one sequence, each a clip of its own.
    pub(crate) fn piece(&self, index: usize) -> Self {
        Self(self.0.iter().map(|clip| clip + index).collect())
    }

    pub(crate) fn standing(&self, is_held_out: impl Fn(usize) -> bool) -> Standing {
        match self.0.iter().filter(|&&clip| is_held_out(clip)).count() {
            0 => Standing::Kept,
            all if all == self.0.len() => Standing::HeldOut,
            _ => Standing::Mixed,
        }
    }

    /// The numbers.
    pub(crate) fn numbers(&self) -> &[usize] {
        &self.0
    }
}

impl From<usize> for Clips {
    fn from(clip: usize) -> Self {
        Self(vec![clip])
    }
}

#[cfg(test)]
mod tests {
    use super::{Clips, Standing};
    use crate::drape::synthetic::training_set;

    #[test]
    fn stretches_of_a_clip_belong_together_and_mixtures_to_all_theirs() {
        let mut sequences = training_set().sequences;
        for (sequence, name) in sequences.iter_mut().zip(["kick", "kick-2", "walk-on", "walk", "mixed_walk+kick-13"]) {
            name.clone_into(&mut sequence.name);
        }
        let clips = Clips::of(&sequences);
        let numbers: Vec<&[usize]> = clips.iter().map(Clips::numbers).collect();
        assert_eq!(numbers[..5], [&[0][..], &[0], &[1], &[2], &[2, 0]]);
        let without_kicks = |clips: &Clips| clips.standing(|clip| clip == 0);
        assert_eq!(without_kicks(&clips[1]), Standing::HeldOut);
        assert_eq!(without_kicks(&clips[3]), Standing::Kept);
        assert_eq!(without_kicks(&clips[4]), Standing::Mixed);
    }
}
