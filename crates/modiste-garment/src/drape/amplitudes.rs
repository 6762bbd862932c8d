//! How strongly each wrinkle is shown; not in the paper.
//!
//! Least squares foretell the mean of all wrinkles that go with a pose, which is flatter than each of them. So every ψ has a
//! factor that gives back some of the spread which it has in motions that were held out, and all of them together as much as
//! it takes that those motions look as wrinkled as simulated ones. More is not better: a fold that cannot be foreseen
//! is wrong wherever it is shown.

use modiste_body::Pose;
use modiste_core::{GradientReconstruction, Mat3, Vec3, mean_curvature};
use rayon::prelude::*;

use super::basis::BasisScratch;
use super::coarse::{CoarseModel, Reference};
use super::synthesis::Fitting;
use super::training_set::{Garment, PoseSequence};
use super::wrinkle::WrinkleModel;

/// The mean curvature that the factors are to give held-out motions, as a share of that of the simulation.
const ENOUGH_CURVATURE: f64 = 1.0;

/// Held-out frames, spread evenly, that are looked at.
const MOST_FRAMES: usize = 120;

/// Halvings of the interval in which the bound of the factors is sought.
const HALVINGS: u32 = 8;

/// What runs of the dynamics make of motions that they were learned without.
#[derive(Debug, Clone)]
pub(crate) struct HeldOutRuns {
    /// For every ψ the sum of squares in the simulations of these motions.
    pub(crate) truth: Vec<f64>,
    /// The same of the runs with dynamics.
    pub(crate) dynamic: Vec<f64>,
    /// The same of the runs without.
    pub(crate) fixed: Vec<f64>,
    /// Frames of the runs with dynamics.
    pub(crate) frames: Vec<HeldOutFrame>,
}

/// One frame of such a run.
#[derive(Debug, Clone)]
pub(crate) struct HeldOutFrame {
    /// Place of its motion among those that were learned from.
    pub(crate) sequence: usize,
    /// Its place in the motion.
    pub(crate) frame: usize,
    /// ψ as it was run, without a factor.
    pub(crate) wrinkles: Vec<f64>,
}

/// A factor on each ψ, in runs with dynamics and without. The latter are no larger: what spreads too wide from the pose alone
/// is held down, and what the pose foretells less well than the past does is not raised to make up for it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Amplitudes {
    pub(crate) dynamic: Vec<f64>,
    pub(crate) fixed: Vec<f64>,
}

impl HeldOutRuns {
    /// The factors, at least one and at most `most`, with the least bound for which `is_enough` holds of those with
    /// dynamics.
    pub(crate) fn amplitudes(&self, most: f64, is_enough: impl Fn(&[f64]) -> bool) -> Amplitudes {
        let factors = |made: &[f64], bound: f64| -> Vec<f64> {
            let factor = |(truth, made): (&f64, &f64)| (truth / made.max(f64::MIN_POSITIVE)).sqrt().clamp(1.0, bound);
            self.truth.iter().zip(made).map(factor).collect()
        };
        let (mut low, mut high) = (1.0, most.max(1.0));
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            *(if is_enough(&factors(&self.dynamic, middle)) { &mut high } else { &mut low }) = middle;
        }
        let dynamic = factors(&self.dynamic, high);
        let fixed =
            factors(&self.fixed, high).iter().zip(&dynamic).map(|(fixed, dynamic)| fixed.min(*dynamic)).collect();
        Amplitudes { dynamic, fixed }
    }
}

impl Amplitudes {
    /// With factors on top, one per ψ.
    pub(crate) fn times(mut self, gains: &[f64]) -> Self {
        for amplitudes in [&mut self.dynamic, &mut self.fixed] {
            amplitudes.iter_mut().zip(gains).for_each(|(amplitude, gain)| *amplitude *= gain);
        }
        self
    }
}

/// Held-out frames as meshes, on the mean body.
pub(crate) struct Looks<'a> {
    garment: &'a Garment,
    fitting: &'a Fitting,
    wrinkle: &'a WrinkleModel,
    surface: Surface<'a>,
    frames: Vec<Frame<'a>>,
    /// Sum over these frames of the mean curvature (1/m) of their simulations.
    truth: f64,
}

/// How gradients become a mesh.
#[derive(Clone, Copy)]
pub(crate) enum Surface<'a> {
    /// By themselves.
    Plain(&'a GradientReconstruction),
    /// With the coarse shape of other places, which are less bent than those of a simulation, too.
    Coarse(&'a CoarseModel, &'a Reference<'a>),
}

struct Frame<'a> {
    pose: &'a Pose,
    wrinkles: &'a [f64],
    /// Where the coarse deformation puts the vertices; empty without one.
    places: Vec<Vec3>,
}

impl<'a> Looks<'a> {
    pub(crate) fn new(
        garment: &'a Garment,
        fitting: &'a Fitting,
        (wrinkle, surface): (&'a WrinkleModel, Surface<'a>),
        sequences: &'a [PoseSequence],
        runs: &'a HeldOutRuns,
    ) -> Self {
        let stride = runs.frames.len().div_ceil(MOST_FRAMES).max(1);
        let chosen: Vec<&HeldOutFrame> = runs.frames.iter().step_by(stride).collect();
        let simulated = |at: &&HeldOutFrame| curvature(garment, &sequences[at.sequence].frames[at.frame]);
        let truth = chosen.par_iter().map(simulated).sum();
        let frame = |at: &&'a HeldOutFrame| {
            let sequence = &sequences[at.sequence];
            let places = match surface {
                Surface::Plain(_) => Vec::new(),
                Surface::Coarse(coarse, reference) => {
                    let poses = &sequence.motion.frames[..=at.frame];
                    coarse.places(reference, poses, &sequence.body_anchors[at.frame])
                }
            };
            Frame { pose: &sequence.motion.frames[at.frame], wrinkles: &at.wrinkles, places }
        };
        let frames = chosen.par_iter().map(frame).collect();
        Self { garment, fitting, wrinkle, surface, frames, truth }
    }

    /// Whether they are wrinkled enough with these factors.
    pub(crate) fn are_wrinkled(&self, factors: &[f64]) -> bool {
        let made: f64 = self.frames.par_iter().map(|frame| curvature(self.garment, &self.made(frame, factors))).sum();
        made >= ENOUGH_CURVATURE * self.truth
    }

    fn made(&self, frame: &Frame<'_>, factors: &[f64]) -> Vec<Vec3> {
        let shown: Vec<f64> = frame.wrinkles.iter().zip(factors).map(|(value, factor)| value * factor).collect();
        let mut flat = vec![0.0; self.wrinkle.mean.len()];
        self.wrinkle.expand(&shown, &mut BasisScratch::default(), &mut flat);
        let mut gradients = vec![Mat3::IDENTITY; self.garment.topology.face_count()];
        self.fitting.compose(self.wrinkle, (frame.pose, &flat), &mut gradients);
        let mut out = vec![Vec3::ZERO; self.garment.template.len()];
        match self.surface {
            Surface::Plain(reconstruction) => reconstruction.reconstruct(&gradients, &mut out),
            Surface::Coarse(coarse, _) => coarse.reconstruct(&gradients, &frame.places, &mut out),
        }
        out
    }
}

/// Mean over the vertices (m) of the mean curvature (1/m).
fn curvature(garment: &Garment, vertices: &[Vec3]) -> f64 {
    mean_curvature(&garment.topology, vertices).iter().sum::<f64>() / vertices.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::{HeldOutRuns, Looks, Surface};
    use crate::drape::blend::blend_parts;
    use crate::drape::model::reconstruction;
    use crate::drape::synthesis::Fitting;
    use crate::drape::synthetic::training_set;
    use crate::drape::{ShapeModel, ShapeOptions, WrinkleModel, WrinkleOptions};

    fn runs(truth: &[f64], dynamic: &[f64], fixed: &[f64]) -> HeldOutRuns {
        let [truth, dynamic, fixed] = [truth, dynamic, fixed].map(<[f64]>::to_vec);
        HeldOutRuns { truth, dynamic, fixed, frames: Vec::new() }
    }

    #[test]
    fn no_more_of_what_cannot_be_foreseen_is_shown_than_it_takes() {
        let made = [6.0, 0.25, 0.0001];
        let runs = runs(&[6.0, 1.0, 3.0], &made, &made);
        let shown = |factors: &[f64]| factors.iter().zip(&made).map(|(f, m)| f * f * m).sum::<f64>();
        let found = runs.amplitudes(200.0, |factors| shown(factors) >= 8.7).dynamic;
        assert!((found[0] - 1.0).abs() < 1e-12, "{found:?}");
        assert!((found[1] - 2.0).abs() < 1e-12, "a fold that is there gets its whole spread: {found:?}");
        assert!(found[2] < 3e4f64.sqrt(), "{found:?}");
        assert!((8.7..9.2).contains(&shown(&found)), "{found:?}");
        let never = runs.amplitudes(3.0, |_| false).dynamic;
        assert_eq!(never, [1.0, 2.0, 3.0]);
        let paper = runs.amplitudes(1.0, |_| false);
        assert_eq!((paper.dynamic, paper.fixed), (vec![1.0; 3], vec![1.0; 3]));
    }

    #[test]
    fn the_pose_alone_is_held_down_where_it_would_overshoot_and_raised_nowhere() {
        let found = runs(&[4.0, 4.0, 4.0], &[1.0, 1.0, 4.0], &[4.0, 0.25, 1.0]).amplitudes(10.0, |_| false);
        assert_eq!(found.dynamic, [2.0, 2.0, 1.0]);
        assert_eq!(found.fixed, [1.0, 2.0, 1.0]);
        assert_eq!(found.times(&[1.0, 1.0, 1.5]).fixed, [1.0, 2.0, 1.5]);
    }

    #[test]
    fn frames_at_their_true_wrinkles_are_wrinkled_and_flattened_ones_are_not() {
        let set = training_set();
        let options = WrinkleOptions { variance: 0.999, pattern_count: 8, ..WrinkleOptions::default() };
        let blend = blend_parts(&set.garment, options.blend_width).unwrap();
        let (wrinkle, truth) = WrinkleModel::train(&set.garment, blend.faces, &set.sequences, &options).unwrap();
        let shape = ShapeModel::train(&set.garment, &set.shapes, &ShapeOptions::default()).unwrap();
        let fitting = Fitting::new(&set.garment, &shape, &wrinkle, (&[], 0.0));
        let reconstruction = reconstruction(&set.garment).unwrap();
        let frame = |frame: usize| super::HeldOutFrame { sequence: 0, frame, wrinkles: truth[0][frame].clone() };
        let runs = HeldOutRuns { frames: (0..20).map(frame).collect(), ..runs(&[], &[], &[]) };
        let looks =
            Looks::new(&set.garment, &fitting, (&wrinkle, Surface::Plain(&reconstruction)), &set.sequences, &runs);
        let factors = |factor: f64| vec![factor; wrinkle.count()];
        assert!(looks.are_wrinkled(&factors(1.5)));
        assert!(!looks.are_wrinkled(&factors(0.0)));
    }
}
