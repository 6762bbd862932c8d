//! The learned garment: everything that dresses any body in any pose.

use std::borrow::Cow;

use modiste_body::Pose;
use modiste_core::{GradientReconstruction, Mat3, Progress, Vec3};

use super::amplitudes::{Looks, Surface};
use super::blend::blend_parts;
use super::clips::Clips;
use super::coarse::{CoarseModel, CoarseOptions};
use super::dynamics::Dynamics;
use super::dynamics_training::{DynamicsOptions, DynamicsTraining, learn};
use super::mirror::Mirror;
use super::shape::{ShapeModel, ShapeOptions};
use super::synthesis::Fitting;
use super::training_set::{Garment, PoseSequence, TrainingSet};
use super::wrinkle::{WrinkleModel, WrinkleOptions};
use crate::refine::anchors::offset;
use crate::{Evaluation, GarmentError};

/// How a garment is learned.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TrainOptions {
    /// The shape of the garment from that of the body.
    pub shape: ShapeOptions,
    /// The space of wrinkles.
    pub wrinkle: WrinkleOptions,
    /// The dynamics of the wrinkles.
    pub dynamics: DynamicsOptions,
    /// Where the cloth as a whole goes.
    pub coarse: CoarseOptions,
    /// Does not learn from the mirror images of the motions too.
    pub one_sided: bool,
}

/// Where a model comes from.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Provenance {
    /// Seed of the training set.
    pub seed: u64,
    /// Content hashes of what it was made from, by name.
    pub sources: Vec<(String, String)>,
    /// About how many vertices the garment was to have when it was cut, where that is known.
    pub vertex_count: Option<usize>,
    /// Licence of the model file.
    pub licence: String,
    /// Command that makes it again.
    pub command: String,
}

/// A garment learned by DRAPE. Constant; share it by `Arc`.
#[derive(Debug, Clone)]
pub struct DrapeModel {
    pub(crate) garment: Garment,
    pub(crate) shape: ShapeModel,
    pub(crate) wrinkle: WrinkleModel,
    /// `None` is the paper.
    pub(crate) coarse: Option<CoarseModel>,
    pub(crate) dynamics: Dynamics,
    pub(crate) fps: f64,
    pub(crate) ease: f64,
    /// Where the model comes from.
    pub provenance: Provenance,
    /// What it was measured to be worth, if it was.
    pub evaluation: Option<Evaluation>,
    pub(crate) reconstruction: GradientReconstruction,
}

pub(super) fn reconstruction(garment: &Garment) -> Result<GradientReconstruction, GarmentError> {
    GradientReconstruction::new(&garment.topology, &garment.template)
        .map_err(GarmentError::solve("reconstruction matrix"))
}

/// The motions of a set, and after them their mirror images if the garment has two like sides.
fn with_mirror_images(set: &TrainingSet) -> Cow<'_, [PoseSequence]> {
    let Some(mirror) = Mirror::new(&set.garment) else { return Cow::Borrowed(&set.sequences) };
    let images = set.sequences.iter().map(|sequence| mirror.sequence(&set.garment, sequence));
    Cow::Owned(set.sequences.iter().cloned().chain(images).collect())
}

impl DrapeModel {
    /// Learns shape, wrinkles and dynamics from a training set.
    ///
    /// # Errors
    /// A training set that does not fit together or is too small, or a solve that fails.
    pub fn train(
        set: &TrainingSet,
        options: &TrainOptions,
        progress: &dyn Progress,
    ) -> Result<(Self, DynamicsTraining), GarmentError> {
        set.check()?;
        let stage = format!("learn {} {}", set.garment.gender.name(), set.garment.name);
        progress.start(&stage, 4);
        let shape = ShapeModel::train(&set.garment, &set.shapes, &options.shape)?;
        progress.advance(&stage, 1);
        let sequences = if options.one_sided { Cow::Borrowed(&set.sequences[..]) } else { with_mirror_images(set) };
        let blend = blend_parts(&set.garment, options.wrinkle.blend_width)?;
        let (wrinkle, coefficients) = WrinkleModel::train(&set.garment, blend.faces, &sequences, &options.wrinkle)?;
        progress.advance(&stage, 2);
        let clips = Clips::of(&sequences);
        let motions: Vec<_> = clips.into_iter().zip(sequences.iter().map(|sequence| &sequence.motion)).collect();
        let (mut dynamics, training, runs) =
            learn(&set.garment.face_parts, &motions, &coefficients, &options.dynamics)?;
        progress.advance(&stage, 3);
        let reconstruction = reconstruction(&set.garment)?;
        let fitting = Fitting::new(&set.garment, &shape, &wrinkle, (&[], 0.0));
        let reference = |pose: &Pose, anchors: &[Vec3], out: &mut [Vec3]| {
            let to_anchors = |x: &[Vec3]| -offset(&set.garment.anchors, x, anchors);
            let mut gradients = vec![Mat3::IDENTITY; set.garment.topology.face_count()];
            fitting.write_reference((&wrinkle, &reconstruction), (pose, &to_anchors), &mut gradients, out);
        };
        let coarse = if options.coarse.count > 0 {
            Some(CoarseModel::train(&set.garment, blend.vertices, &sequences, &options.coarse, &reference)?)
        } else {
            None
        };
        if options.dynamics.max_amplitude > 1.0 {
            let surface = match &coarse {
                Some(coarse) => Surface::Coarse(coarse, &reference),
                None => Surface::Plain(&reconstruction),
            };
            let looks = Looks::new(&set.garment, &fitting, (&wrinkle, surface), &sequences, &runs);
            let is_enough = |factors: &[f64]| looks.are_wrinkled(factors);
            let amplitudes = runs.amplitudes(options.dynamics.max_amplitude, is_enough);
            // The space holds the frames that were looked at, as it was learned from them.
            dynamics = dynamics.shown_at(&amplitudes.times(&wrinkle.fine_gains()));
        }
        if training.spectral_radius < training.learned_spectral_radius {
            progress.warn(&format!(
                "{stage}: the wrinkle dynamics had a spectral radius of {:.4} and were weighed down to {:.4}",
                training.learned_spectral_radius, training.spectral_radius
            ));
        }
        let provenance = Provenance {
            seed: set.seed,
            sources: set.sources.clone(),
            vertex_count: set.vertex_count,
            ..Provenance::default()
        };
        let model = Self::assemble(set.garment.clone(), shape, (wrinkle, coarse), dynamics, set.fps(), provenance)?;
        progress.finish(&stage);
        Ok((model, training))
    }

    /// Puts the learned parts together and factors the matrix of eq. 3.
    pub(crate) fn assemble(
        garment: Garment,
        shape: ShapeModel,
        (wrinkle, coarse): (WrinkleModel, Option<CoarseModel>),
        mut dynamics: Dynamics,
        fps: f64,
        provenance: Provenance,
    ) -> Result<Self, GarmentError> {
        garment.check()?;
        dynamics.limit_to(wrinkle.std_devs());
        let reconstruction = reconstruction(&garment)?;
        Ok(Self {
            garment,
            shape,
            wrinkle,
            coarse,
            dynamics,
            fps,
            ease: 0.0,
            provenance,
            evaluation: None,
            reconstruction,
        })
    }

    /// The garment cut slimmer, down to -1, or looser, up to 1: how [`crate::Synthesis`] makes it. It is not stored.
    ///
    /// # Errors
    /// An ease out of this range, or a garment that was learned in one cut alone.
    pub fn with_ease(mut self, ease: f64) -> Result<Self, GarmentError> {
        let what = || format!("ease of {}", self.garment.name);
        if !(-1.0..=1.0).contains(&ease) {
            return Err(GarmentError::data(what(), "a number from -1 (slim) over 0 (regular) to 1 (loose)", ease));
        }
        if ease.abs() > 0.0 && !self.shape.has_ease() {
            let wanted =
                "0, as the garment was learned in one cut alone (a mesh, or a pattern without slim and loose cuts)";
            return Err(GarmentError::data(what(), wanted, ease));
        }
        self.ease = ease;
        Ok(self)
    }

    /// How the garment is cut, from slim, -1, to loose, 1.
    pub fn ease(&self) -> f64 {
        self.ease
    }

    /// The mesh and how it is tied to the body.
    pub fn garment(&self) -> &Garment {
        &self.garment
    }

    /// Garment shape from body shape.
    pub fn shape(&self) -> &ShapeModel {
        &self.shape
    }

    /// The space of wrinkles.
    pub fn wrinkle(&self) -> &WrinkleModel {
        &self.wrinkle
    }

    /// Wrinkles from motion.
    pub fn dynamics(&self) -> &Dynamics {
        &self.dynamics
    }

    /// Part of the variance of the coarse deformation on held-out motions that its regression misses; `None` where there is
    /// no coarse deformation.
    pub fn coarse_held_out_error(&self) -> Option<f64> {
        self.coarse.as_ref().map(|coarse| coarse.learned.held_out_error)
    }

    /// Frames a second of the motions that it was learned from; it must be run at the same rate.
    pub fn fps(&self) -> f64 {
        self.fps
    }
}
