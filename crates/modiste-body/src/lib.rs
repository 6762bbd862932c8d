//! Bodies: population, SCAPE, measurements, motion.

mod contact;
mod error;
mod gender;
pub mod make;
pub mod makehuman;
pub mod measure;
pub mod motion;
mod part;
pub mod population;
mod pose;
pub mod recover;
pub mod registration;
pub mod scape;

pub use error::BodyError;
pub use gender::Gender;
pub use makehuman::MakeHumanModel;
pub use measure::{MeasureError, MeasureTemplate, Measurements, Quantity, measure};
pub use part::Part;
pub use pose::{Motion, Pose, rotation_vector};
pub use scape::{Body, PoseScratch, ScapeModel};
