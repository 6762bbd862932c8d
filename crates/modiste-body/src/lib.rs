//! Bodies: population, SCAPE, measurements, motion.

mod error;
mod gender;
pub mod motion;
mod part;
mod pose;
pub mod scape;

pub use error::BodyError;
pub use gender::Gender;
pub use part::Part;
pub use pose::{Motion, Pose, rotation_vector};
pub use scape::{Body, ScapeModel};
