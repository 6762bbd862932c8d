//! Dressed people: a body with garments is animated, drawn and exported.

mod animation;
mod dresser;
mod error;
mod export;
mod machine;
mod person;
mod picture;
mod timing;

pub use animation::{Animation, GarmentFit, Penetration, Track};
pub use dresser::Dresser;
pub use error::SceneError;
pub use export::{Report, SceneAccuracy, Subject, Times, file_names, report, write_results};
pub use machine::{Machine, peak_memory, reset_peak_memory};
pub use person::Person;
pub use timing::{Stage, Summary, Timing};
