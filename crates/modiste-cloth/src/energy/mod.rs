//! Potential energies of the cloth: value, force and a definite approximation of the second derivative.

mod bending;
mod membrane;
mod spring;

pub use bending::Hinge;
pub use membrane::Membrane;
pub(crate) use membrane::Viscosity;
pub(crate) use spring::{Spring, spring_force};
