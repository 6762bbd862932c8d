//! The factored clothing model of DRAPE (Guan et al. 2012, §4; Guan 2013, ch. 5 §3).

mod amplitudes;
mod basis;
mod blend;
mod clips;
mod coarse;
mod dynamics;
mod dynamics_training;
mod features;
mod file;
mod gradient;
mod leave_one_out;
mod load;
mod mirror;
mod model;
mod pose_kernel;
mod projection;
mod resample;
mod shape;
mod synthesis;
#[cfg(test)]
pub(crate) mod synthetic;
#[cfg(test)]
mod tests;
mod training_set;
mod wrinkle;

pub use coarse::CoarseOptions;
pub use dynamics::{Dynamics, DynamicsState};
pub use dynamics_training::{DynamicsOptions, DynamicsTraining};
pub use features::{InputOptions, PoseInputs};
pub use file::KIND;
pub use leave_one_out::{LeaveOneOut, Placement, leave_one_out};
pub use model::{DrapeModel, Provenance, TrainOptions};
pub use pose_kernel::PoseKernel;
pub use projection::Projection;
pub use shape::{ShapeModel, ShapeOptions};
pub use synthesis::{Synthesis, Wrinkles};
pub use training_set::{Garment, PoseSequence, ShapeSample, TrainingSet};
pub use wrinkle::{WrinkleModel, WrinkleOptions, wrinkle_gradients};
