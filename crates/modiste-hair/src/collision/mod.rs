//! Hair that went into the body comes out again, in the space of its coefficients (Guan §5).
//!
//! `E(y) = π₁ p(y) + π₂ ‖y − y₀‖² + π₃ s(y)` (eq. 29): penetration, nearness to the prediction, and roots on the scalp. Method A
//! descends the gradient of a robust error; method B solves a few small least-squares problems. Both take any sequence whose
//! points are linear in a few coefficients, cloth as well as hair: [`Subspace`].

mod descent;
mod least_squares;
mod measure;
mod subspace;

pub use descent::{DescentOptions, descend};
pub use least_squares::{SolveReport, solve};
pub use measure::{CoefficientDeviation, Penetration, penetration_by_vertices, penetration_exact};
pub use subspace::{Correspondence, Subspace};

/// π₂ is taken times this. The text gives π₁ = 0.08 and π₂ = 0.13, but no unit of the coefficients. With components of unit
/// length `‖y − y₀‖²` is the sum over all points of how far they are moved, and outweighs any penetration: hair stays where it is.
/// Taken so, the thesis's range of π₂ moves our coefficients by what it reports, 1.3 to 5.5 % (fig. 6.7).
const PRIOR_UNIT: f64 = 1e-3;

/// Weights of eq. 29 and the sub-sampling factor of eq. 33.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CollisionOptions {
    /// π₁, of penetration.
    pub penetration: f64,
    /// π₂, of nearness to the prediction, in a thousandth of the unit of the others (see `PRIOR_UNIT`).
    pub prior: f64,
    /// π₃, of the roots.
    pub roots: f64,
    /// τ: every so many guides are looked at.
    pub every: usize,
    /// Rounds of method B.
    pub rounds: usize,
    /// Distance that points are to keep from the surface (m); 0 in the text.
    pub margin: f64,
}

impl Default for CollisionOptions {
    /// The thesis's values (§6).
    fn default() -> Self {
        Self { penetration: 0.08, prior: 0.13, roots: 1.5, every: 1, rounds: 4, margin: 0.0 }
    }
}

impl CollisionOptions {
    /// Weight of `‖y − y₀‖²` beside the squares of distances (m²) of points.
    fn prior_weight(&self, subspace: &Subspace) -> f64 {
        PRIOR_UNIT * self.prior * subspace.size()
    }

    /// The thesis's sub-sampling: 1, 5 and 15 for 198, 962 and 3,980 guides (table 6.2).
    pub fn for_guides(count: usize) -> Self {
        let every = match count {
            0..=400 => 1,
            401..=2000 => 5,
            _ => 15,
        };
        Self { every, ..Self::default() }
    }
}
