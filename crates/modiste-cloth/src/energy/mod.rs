//! Potential energies of the cloth: value, force and a definite approximation of the second derivative.

mod bending;
mod lanes;
mod membrane;
mod spring;

pub use bending::Hinge;
pub(crate) use lanes::{LaneLaw, MembraneLanes};
pub use membrane::Membrane;
#[cfg(test)]
pub(crate) use membrane::Viscosity;
pub(crate) use spring::{Spring, spring_force};
