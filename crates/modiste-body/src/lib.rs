//! Bodies: population, SCAPE, measurements, motion.

mod part;
mod pose;

pub use part::Part;
pub use pose::{Motion, Pose};
