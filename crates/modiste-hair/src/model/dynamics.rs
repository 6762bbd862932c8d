//! Hair of one frame after the other.

use std::sync::Arc;

use modiste_core::Vec3;

use super::HairModel;
use super::inputs::Inputs;
use super::matrix::StyleMatrix;
use crate::HairError;
use crate::canonical::Frame;
use crate::training::Factors;

/// Hair coefficients through time, of one style at a time.
#[derive(Debug, Clone)]
pub struct Dynamics {
    factors: Factors,
    matrix: StyleMatrix,
    /// Hair of the last two frames, the older first.
    hair: [Vec<f64>; 2],
    frames: [Frame; 2],
    /// Bust coefficients of the last frame.
    bust: Vec<f64>,
    inputs: Inputs,
    /// Largest magnitude of each input and each number of z.
    limits: Arc<[f64]>,
    /// Frames since the start, and since the last cut.
    seen: usize,
    since_cut: usize,
}

impl Dynamics {
    /// Hair of a style before its first frame.
    ///
    /// # Errors
    /// Factors that the model cannot show.
    pub fn new(model: &HairModel, factors: Factors) -> Result<Self, HairError> {
        Ok(Self::with_matrix(model, factors, model.style(&factors)?))
    }

    /// The same with a matrix that is at hand.
    pub(super) fn with_matrix(model: &HairModel, factors: Factors, matrix: StyleMatrix) -> Self {
        let frame = Frame { position: Vec3::ZERO, heading: 0.0 };
        Self {
            factors,
            matrix,
            hair: [Vec::new(), Vec::new()],
            frames: [frame; 2],
            bust: Vec::new(),
            inputs: Inputs::new(model.plain),
            limits: Arc::clone(&model.limits),
            seen: 0,
            since_cut: 0,
        }
    }

    /// Changes the style from the next frame on; the matrix is made anew only if the factors have changed.
    ///
    /// # Errors
    /// Factors that the model cannot show.
    pub fn restyle(&mut self, model: &HairModel, factors: Factors) -> Result<(), HairError> {
        if factors != self.factors {
            self.matrix = model.style(&factors)?;
            self.factors = factors;
        }
        Ok(())
    }

    /// The hair coefficients `y_t` of the next frame, from where the bust is and its coefficients (eq. 23).
    ///
    /// Where the bust cannot have moved there ([`Frame::is_cut`]), hair is carried along as it lies on the head, at rest.
    /// Inputs that go beyond what was learned from count as the furthest of that.
    pub fn step(&mut self, frame: Frame, bust: &[f64]) -> &[f64] {
        if self.since_cut >= 2 {
            let shift = self.bust.iter().zip(bust).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
            if frame.is_cut([&self.frames[0], &self.frames[1]], shift) {
                self.hair[0] = self.hair[1].clone();
                self.frames = [frame; 2];
                self.inputs.restart();
                self.since_cut = 0;
            }
        }
        let mut inputs = self.inputs.next(frame, bust);
        self.limit(&mut inputs, 0);
        let next = if self.seen < 2 {
            self.matrix.first(&inputs)
        } else {
            let count = inputs.len();
            let mut observed = inputs;
            observed.extend_from_slice(&self.hair[0]);
            observed.extend_from_slice(&self.hair[1]);
            let moves = observed.len();
            observed.extend(frame.since(&self.frames[0]));
            observed.extend(self.frames[1].since(&self.frames[0]));
            self.limit(&mut observed[moves..], count);
            self.matrix.predict(&observed)
        };
        self.hair.swap(0, 1);
        self.hair[1] = next;
        self.frames = [self.frames[1], frame];
        self.bust = bust.to_vec();
        self.seen += 1;
        self.since_cut += 1;
        &self.hair[1]
    }

    fn limit(&self, numbers: &mut [f64], first: usize) {
        for (number, &limit) in numbers.iter_mut().zip(&self.limits[first..]) {
            *number = number.clamp(-limit, limit);
        }
    }
}
