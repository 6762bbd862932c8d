//! Training sets: a garment on many bodies in the template pose, and on one body through many motions.
//!
//! [`Wardrobe`] dresses and simulates; [`generate`] fills a folder with what a DRAPE model learns from, one simulation per
//! core, and picks up where an earlier run stopped.

mod draw;
mod error;
mod folder;
mod generate;
mod import;
mod sequences;
mod wardrobe;

pub use draw::{draw_eases, draw_shapes};
pub use error::TrainingError;
pub use generate::{Dropped, Summary, TrainingOptions, generate};
pub use import::{ImportedMotion, ImportedShape, Importer};
pub use sequences::{HELD_OUT_CLIPS, Sequence, TRAINING_CLIPS, Window, held_out_sequences, training_sequences};
pub use wardrobe::{Simulation, Wardrobe, simulated_frames};
