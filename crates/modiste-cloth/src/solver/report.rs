//! What happened in a step.

use serde::{Deserialize, Serialize};

/// Counts of one frame.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct StepReport {
    /// Conjugate-gradient iterations of all substeps.
    pub iterations: usize,
    /// Substeps whose linear solve ran into the limit of iterations.
    pub unconverged: usize,
    /// Vertices within the contact thickness of the body at the end.
    pub contacts: usize,
    /// Vertices moved out of the body by the last projection, over all substeps.
    pub projected: usize,
    /// Deepest place below the surface that a projection found (m).
    pub deepest: f64,
    /// Vertices below the body's surface at the end.
    pub inside: usize,
    /// Vertices between two surfaces of the body that leave less than twice the thickness, or overlap.
    pub pinched: usize,
    /// Pairs of vertex and face of the cloth that were watched for contact with itself.
    pub self_pairs: usize,
    /// Vertices slowed to the speed limit, over all substeps.
    pub slowed: usize,
    /// Largest speed at the end (m/s).
    pub max_speed: f64,
    /// Widest seam at the end beyond its rest length (m).
    pub widest_seam: f64,
    /// Sentences about what deserves a look.
    pub warnings: Vec<String>,
}
