//! Hair of one frame after the other.

use std::sync::Arc;

use super::HairModel;
use super::bust::BustState;
use super::inputs::Inputs;
use super::matrix::StyleMatrix;
use crate::HairError;
use crate::training::Factors;

/// Hair coefficients through time, of one style at a time.
#[derive(Debug, Clone)]
pub struct Dynamics {
    factors: Factors,
    matrix: StyleMatrix,
    /// Hair of the last two frames, the older first.
    hair: [Vec<f64>; 2],
    /// The bust in the last two frames, the older first.
    busts: [Option<BustState>; 2],
    inputs: Inputs,
    /// Largest magnitude of each input and each number of z.
    limits: Arc<[f64]>,
    /// Frames since the start or the last cut.
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
        Self {
            factors,
            matrix,
            hair: [Vec::new(), Vec::new()],
            busts: [None, None],
            inputs: Inputs::new(model.plain),
            limits: Arc::clone(&model.limits),
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

    /// The hair coefficients `y_t` of the next frame, from the bust in it (eq. 23).
    ///
    /// Where the bust cannot have moved there ([`Frame::is_cut`](crate::Frame::is_cut)), hair is carried along as it lies on
    /// the head, at rest. Inputs that go beyond what was learned from count as the furthest of that.
    pub fn step(&mut self, bust: &BustState) -> &[f64] {
        if let [Some(older), Some(newer)] = &self.busts
            && self.since_cut >= 2
            && bust.frame.is_cut([&older.frame, &newer.frame], bust.shift(newer))
        {
            self.hair[0] = self.hair[1].clone();
            self.busts = [Some(bust.clone()), Some(bust.clone())];
            self.inputs.restart();
            self.since_cut = 0;
        }
        let mut inputs = self.inputs.next(bust);
        self.limit(&mut inputs, 0);
        let next = if let [Some(older), Some(newer)] = &self.busts {
            let count = inputs.len();
            let mut observed = inputs;
            observed.extend_from_slice(&self.hair[0]);
            observed.extend_from_slice(&self.hair[1]);
            let moves = observed.len();
            observed.extend(bust.frame.since(&older.frame));
            observed.extend(newer.frame.since(&older.frame));
            self.limit(&mut observed[moves..], count);
            self.matrix.predict(&observed)
        } else {
            self.matrix.first(&inputs)
        };
        self.hair.swap(0, 1);
        self.hair[1] = next;
        self.busts.swap(0, 1);
        self.busts[1] = Some(bust.clone());
        self.since_cut += 1;
        &self.hair[1]
    }

    fn limit(&self, numbers: &mut [f64], first: usize) {
        for (number, &limit) in numbers.iter_mut().zip(&self.limits[first..]) {
            *number = number.clamp(-limit, limit);
        }
    }
}
