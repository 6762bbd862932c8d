//! What the model is learned from: sequences, the combinations of factors, and the simulated hair on disk.

mod cells;
mod folder;
mod sequences;

pub use cells::{Cell, Factors, WindDirection};
pub use folder::{Recipe, Recorded, TrainingFolder};
pub use sequences::{Sequence, sequences};
