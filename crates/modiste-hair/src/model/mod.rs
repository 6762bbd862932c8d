//! The learned hair: bases of hair and bust, and the multilinear model between them.

mod blocks;
mod bust;
mod densify;
mod dynamics;
mod expansion;
mod file;
mod inputs;
mod learn;
mod matrix;
mod tensor;

use std::sync::Arc;

use modiste_body::Body;
use modiste_core::{Pca, QuantisedBasis, Vec3};

pub use blocks::Blocks;
pub use bust::BustState;
pub use dynamics::Dynamics;
pub use expansion::Expansion;
pub use file::Provenance;
pub use inputs::Inputs;
pub use learn::{LearnOptions, Learned, learn};
pub use matrix::{Layout, MOVES, Ridge, StyleMatrix};
pub use tensor::{NModeSvd, Tensor};

use crate::canonical::{BustTrack, Frame};
use crate::scalp::Root;
use crate::space::HairSpace;
use crate::training::{Cell, Factors};
use crate::{HairError, POINTS};

/// Learned hair of one family of styles.
#[derive(Debug)]
pub struct HairModel {
    /// Name, such as `long`.
    pub(crate) name: String,
    pub(crate) fps: f64,
    pub(crate) roots: Vec<Root>,
    pub(crate) cells: Vec<Cell>,
    pub(crate) bust_vertices: Vec<u32>,
    /// Positions of the tracked vertices at rest on the body that the hair was learned on (m).
    pub(crate) bust_rest: Vec<Vec3>,
    pub(crate) bust: Pca,
    /// Whether it is that of the thesis alone.
    pub(crate) plain: bool,
    pub(crate) space: HairSpace,
    /// Largest magnitude of each input and each number of z: somewhat beyond what was seen in training.
    pub(crate) limits: Arc<[f64]>,
    pub(crate) mean: Vec<f32>,
    pub(crate) basis: QuantisedBasis<i8>,
    pub(crate) std_devs: Vec<f64>,
    pub(crate) blocks: Blocks,
    /// Of each cell.
    pub(crate) ridges: Vec<Ridge>,
    pub(crate) seed: u64,
    pub(crate) expansion: Expansion,
}

impl HairModel {
    /// Name, such as `long`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Frames per second at which it was learned.
    pub fn fps(&self) -> f64 {
        self.fps
    }

    /// Number of guides, N_g.
    pub fn guide_count(&self) -> usize {
        self.roots.len()
    }

    /// Where the guides are rooted.
    pub fn roots(&self) -> &[Root] {
        &self.roots
    }

    /// The combinations of factors that it was learned from.
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// Seed of its training set.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// Noise that the regression allows for in each cell.
    pub fn ridges(&self) -> &[Ridge] {
        &self.ridges
    }

    /// Whether it is the model of the thesis alone: hair in the canonical space of the bust, and no inputs but its coefficients.
    pub fn is_plain(&self) -> bool {
        self.plain
    }

    /// The space that the hair's components live in.
    pub fn space(&self) -> &HairSpace {
        &self.space
    }

    /// Sizes of the parts of an augmented vector.
    pub fn layout(&self) -> Layout {
        Layout { inputs: Inputs::count(self.plain, self.bust.count()), hair: self.basis.count() }
    }

    /// Standard deviation of each hair coefficient over the training set (m), largest first.
    pub fn std_devs(&self) -> &[f64] {
        &self.std_devs
    }

    /// The basis in expandable form.
    pub fn expansion(&self) -> &Expansion {
        &self.expansion
    }

    /// Mean hair in its space (m), μ^h.
    pub fn mean(&self) -> &[f32] {
        &self.mean
    }

    /// Components of the hair, Q^h.
    pub fn basis(&self) -> &QuantisedBasis<i8> {
        &self.basis
    }

    /// The bust of a body as this model sees it.
    ///
    /// # Errors
    /// A body without the vertices.
    pub fn track(&self, body: &Body) -> Result<BustTrack, HairError> {
        BustTrack::of_vertices(body, &self.bust_vertices, &self.bust_rest)
    }

    /// A bust as this model sees it, from its tracked vertices in canonical space (m): see [`BustTrack::canonical`].
    pub fn bust_state(&self, frame: Frame, canonical: Vec<Vec3>) -> BustState {
        BustState::new(&self.space, &self.bust, frame, canonical)
    }

    /// Coefficients of hair in its space, three numbers a point (m).
    pub fn hair_coefficients(&self, numbers: &[f32]) -> Vec<f64> {
        let n = self.mean.len();
        let centred: Vec<f32> = numbers.iter().zip(&self.mean).map(|(a, b)| a - b).collect();
        self.basis
            .values()
            .chunks_exact(n)
            .zip(self.basis.scales())
            .map(|(row, &scale)| {
                let sum: f64 = row.iter().zip(&centred).map(|(&q, &c)| f64::from(f32::from(q) * c)).sum();
                sum * f64::from(scale)
            })
            .collect()
    }

    /// The matrix of a style.
    ///
    /// # Errors
    /// Factors that the model cannot show.
    pub fn style(&self, factors: &Factors) -> Result<StyleMatrix, HairError> {
        let weights = factors.weights(&self.cells)?;
        StyleMatrix::new(&self.blocks, &weights, self.layout(), Ridge::between(&self.ridges, &weights))
    }

    /// λ_max of each style of a grid over length and softness (§4.1), row by row of length; `steps` intervals each way.
    ///
    /// # Errors
    /// An iteration that does not converge.
    pub fn stability(&self, steps: usize) -> Result<Vec<(f64, f64, f64)>, HairError> {
        let mut grid = Vec::new();
        let single = self.cells.iter().filter(|cell| cell.wind.is_none()).count() < 4;
        for row in 0..=steps {
            for column in 0..=steps {
                let [length, softness] =
                    if single { [1.0, 1.0] } else { [row, column].map(|index| index as f64 / steps.max(1) as f64) };
                let lambda = self.style(&Factors::new(length, softness))?.largest_eigenvalue()?;
                grid.push((length, softness, lambda));
                if single {
                    return Ok(grid);
                }
            }
        }
        Ok(grid)
    }

    /// Number of points of a frame.
    pub fn point_count(&self) -> usize {
        self.roots.len() * POINTS
    }

    /// Shared by those who wear it.
    pub fn shared(self) -> Arc<Self> {
        Arc::new(self)
    }
}
