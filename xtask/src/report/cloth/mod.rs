//! `cargo xtask report physics`: whether the simulation that garments are learned from behaves like cloth.

pub(super) mod convergence;
pub(super) mod cost;
mod discs;
pub(super) mod fabrics;
pub(super) mod wear;
