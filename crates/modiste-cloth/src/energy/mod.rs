//! Potential energies of the cloth: value, force and a definite approximation of the second derivative.

mod bending;
mod lanes;
mod membrane;
mod spring;

pub use bending::Hinge;
pub use membrane::Membrane;
pub(crate) use lanes::{LaneLaw, MembraneLanes};
#[cfg(test)]
pub(crate) use membrane::Viscosity;
pub(crate) use spring::{Spring, spring_force};
