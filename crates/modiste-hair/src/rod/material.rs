//! What hair is made of, per unit of mass.

use serde::{Deserialize, Serialize};

use crate::HairError;
use crate::error::check_range;

/// Gravity (m/s²).
pub(crate) const GRAVITY: f64 = 9.81;

/// Bending length (m) of the stiffest and of the softest hair. A single human hair of 70–80 µm has 4–6 cm; a guide stands for
/// a lock, stiffer when hairs stick together, softer when they slip.
const BENDING_LENGTHS: [f64; 2] = [0.11, 0.035];

/// What hair is made of. All strengths are divided by the mass per length, which then drops out.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Length (m) at which a horizontal hair bends noticeably under its own weight: (EI / (μ g))^⅓.
    pub bending_length: f64,
    /// Twisting over bending stiffness, GJ / EI: 2/3 for a round rod that keeps its volume.
    pub twist_ratio: f64,
    /// Stiffness at the root over that beyond: what a comb and styling leave.
    pub root_stiffness: f64,
    /// Air drag: rate (1/s) at which hair takes on the velocity of the air.
    pub drag: f64,
    /// Coulomb friction against skin.
    pub friction: f64,
    /// Rate (1/s) at which neighbouring guides take on each other's velocity: friction of hair on hair.
    pub cohesion: f64,
}

impl Material {
    /// Hair of a softness factor: 0 is the stiffest of the training sets, 1 the softest.
    ///
    /// # Errors
    /// A factor outside −0.5 to 1.5, beyond which the stiffness is no longer that of hair.
    pub fn of_softness(softness: f64) -> Result<Self, HairError> {
        check_range("softness", softness, -0.5, 1.5)?;
        let [stiff, soft] = BENDING_LENGTHS;
        Ok(Self {
            bending_length: stiff * (soft / stiff).powf(softness),
            twist_ratio: 2.0 / 3.0,
            root_stiffness: 40.0,
            drag: 3.0,
            friction: 0.25,
            cohesion: 6.0,
        })
    }

    /// Bending stiffness over mass per length, EI / μ (m⁴/s²).
    pub fn bending(&self) -> f64 {
        GRAVITY * self.bending_length.powi(3)
    }
}
