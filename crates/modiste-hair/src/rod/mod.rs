//! Hair physics: what the model is learned from.

mod block;
mod lanes;
mod material;
mod simulation;
#[cfg(test)]
mod validate;
mod wind;

pub use material::Material;
pub use simulation::{Simulation, SimulationOptions};
pub use wind::{FULL_WIND, Wind};
