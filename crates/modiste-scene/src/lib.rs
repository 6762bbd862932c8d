//! Dressed people: a body with garments is animated, drawn and exported.

mod animation;
mod error;
mod export;
mod machine;
mod person;
mod picture;
mod timing;

pub use animation::{Animation, GarmentFit, Penetration, Track};
pub use error::SceneError;
pub use export::{Report, SceneAccuracy, Subject, Times, file_names, report, write_results};
pub use machine::Machine;
pub use person::Person;
pub use timing::{Stage, Summary, Timing};
