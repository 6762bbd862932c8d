//! What a user of the solver may set.

use crate::error::{ClothError, check_not_negative, check_positive};
use serde::{Deserialize, Serialize};

/// Settings of the solver.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SolverOptions {
    /// Steps per frame.
    pub substeps: usize,
    /// Acceleration (m/s²).
    pub gravity: [f64; 3],
    /// Distance from the body at which repulsion begins (m).
    pub thickness: f64,
    /// Repulsion per area and depth (Pa/m).
    pub contact_stiffness: f64,
    /// Coulomb coefficient of cloth that slides on the body.
    pub friction: f64,
    /// Coulomb coefficient of cloth that rests on the body.
    pub static_friction: f64,
    /// Factor on the damping times of the fabric.
    pub damping: f64,
    /// Drag of still air per area and speed (kg/(m² s)).
    pub air_drag: f64,
    /// Whether the cloth collides with itself.
    pub self_contact: bool,
    /// Distance that the cloth keeps from itself (m).
    pub self_thickness: f64,
    /// Vertices are not let go faster than this (m/s).
    pub max_speed: f64,
    /// The linear solve stops where the root mean square of what it leaves out, as an acceleration, is below this (m/s²).
    ///
    /// It weighs each residual force by what one Gauss-Seidel sweep there and back moves.
    pub tolerance: f64,
    /// Conjugate-gradient iterations in a substep, at most.
    pub max_iterations: usize,
}

impl Default for SolverOptions {
    fn default() -> Self {
        Self {
            substeps: 8,
            gravity: [0.0, -9.81, 0.0],
            thickness: 0.002,
            contact_stiffness: 1.0e6,
            friction: 0.35,
            static_friction: 0.4,
            damping: 1.0,
            air_drag: 0.1,
            self_contact: false,
            self_thickness: 0.002,
            max_speed: 20.0,
            tolerance: 1.0,
            max_iterations: 60,
        }
    }
}

impl SolverOptions {
    pub(crate) fn check(&self) -> Result<(), ClothError> {
        check_positive("substeps", self.substeps as f64)?;
        check_positive("max_iterations", self.max_iterations as f64)?;
        check_positive("thickness", self.thickness)?;
        check_positive("self_thickness", self.self_thickness)?;
        check_positive("contact_stiffness", self.contact_stiffness)?;
        check_positive("max_speed", self.max_speed)?;
        check_positive("tolerance", self.tolerance)?;
        check_not_negative("friction", self.friction)?;
        check_not_negative("static_friction", self.static_friction)?;
        check_not_negative("damping", self.damping)?;
        check_not_negative("air_drag", self.air_drag)
    }
}
