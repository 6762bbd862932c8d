//! The physics against what is known: closed forms, Coulomb's law, conservation, convergence and time.
//!
//! Every function runs small simulations with the public solver and returns its figures; the tests hold them to bounds and
//! the report prints them.

mod drape;
mod dynamics;
mod fabrics;
mod friction;
mod sheet;
mod strips;
mod wear;

pub use drape::{DrapeOptions, DrapeRun, drape};
pub use dynamics::{Conservation, Convergence, conservation, convergence};
pub use fabrics::{BendTest, Cut, StripTest, bend_test, strip_test};
pub use friction::{Incline, incline};
pub use strips::{Comparison, cantilever, clamped_strip, hanging_strip, loaded_strip};
pub use wear::{DropFigures, sphere_drop};

use crate::ClothError;
use serde::Serialize;

/// All figures of the physics that need no body model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PhysicsFigures {
    /// Elongation of a strip under its own weight.
    pub hanging_strip: Comparison,
    /// Elongation of a strip under a load at its end.
    pub loaded_strip: Comparison,
    /// Energy of a strip stretched between clamps.
    pub clamped_strip: Comparison,
    /// Sag of a stiff strip held at one end.
    pub stiff_cantilever: Comparison,
    /// Sag of a soft strip held at one end.
    pub soft_cantilever: Comparison,
    /// Sheets on inclined planes below and above the critical angle.
    pub inclines: Vec<Incline>,
    /// Momentum of free cloth, and what a turn of the whole scene changes.
    pub conservation: Conservation,
    /// A swinging sheet at growing numbers of substeps.
    pub convergence: Convergence,
    /// Squares of cloth dropped on a sphere.
    pub drops: Vec<DropFigures>,
}

/// Runs all of them; `vertex_counts` are the sizes of the dropped squares.
///
/// # Errors
/// What the solver refuses.
pub fn figures(vertex_counts: &[usize]) -> Result<PhysicsFigures, ClothError> {
    Ok(PhysicsFigures {
        hanging_strip: hanging_strip()?,
        loaded_strip: loaded_strip()?,
        clamped_strip: clamped_strip()?,
        stiff_cantilever: cantilever(1e-3)?,
        soft_cantilever: cantilever(5e-5)?,
        inclines: [0.8, 0.95, 1.1, 1.5].into_iter().map(incline).collect::<Result<_, _>>()?,
        conservation: conservation()?,
        convergence: convergence()?,
        drops: vertex_counts.iter().map(|&count| sphere_drop(count)).collect::<Result<_, _>>()?,
    })
}
