//! Hair of one frame after the other.

use modiste_core::Vec3;

use super::HairModel;
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
    seen: usize,
}

impl Dynamics {
    /// Hair of a style before its first frame.
    ///
    /// # Errors
    /// Factors that the model cannot show.
    pub fn new(model: &HairModel, factors: Factors) -> Result<Self, HairError> {
        Ok(Self::with_matrix(factors, model.style(&factors)?))
    }

    /// The same with a matrix that is at hand.
    pub(super) fn with_matrix(factors: Factors, matrix: StyleMatrix) -> Self {
        let frame = Frame { position: Vec3::ZERO, heading: 0.0 };
        Self { factors, matrix, hair: [Vec::new(), Vec::new()], frames: [frame; 2], seen: 0 }
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

    /// The hair coefficients `y_t` of the next frame, from where the bust is and its coefficients `x_t` (eq. 23).
    pub fn step(&mut self, frame: Frame, bust: &[f64]) -> &[f64] {
        let next = if self.seen < 2 {
            self.matrix.first(bust)
        } else {
            let mut observed = bust.to_vec();
            observed.extend_from_slice(&self.hair[0]);
            observed.extend_from_slice(&self.hair[1]);
            observed.extend(frame.since(&self.frames[0]));
            observed.extend(self.frames[1].since(&self.frames[0]));
            self.matrix.predict(&observed)
        };
        self.hair.swap(0, 1);
        self.hair[1] = next;
        self.frames = [self.frames[1], frame];
        self.seen += 1;
        &self.hair[1]
    }
}
