//! Learned clothing: DRAPE and the fit to the body.
//!
//! `drape` learns a garment from simulated examples and makes it for any body shape and motion; `refine` pushes it out of
//! the body and of the garments below it; `check` judges the result without them. No physics runs here.

pub mod check;
pub mod drape;
mod error;
mod evaluation;
mod flags;
mod outfit;
pub mod refine;
pub mod report;

pub use drape::{DrapeModel, Garment, Synthesis, TrainOptions, TrainingSet, Wrinkles};
pub use error::GarmentError;
pub use evaluation::{Evaluation, MeanFigures, MotionFigures};
pub use flags::GarmentFlags;
pub use outfit::{FrameReport, LayerReport, Outfit, Wearer};
