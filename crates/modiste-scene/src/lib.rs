//! Dressed people: a body with garments is animated, drawn and exported.

mod animation;
mod crowd;
mod dresser;
mod error;
mod export;
mod fit_map;
mod fit_picture;
mod format;
mod hair;
mod machine;
mod person;
mod picture;
mod timing;

pub use animation::{Animation, FlaggedFrames, GarmentFit, Penetration, Track};
pub use crowd::{CrowdPicture, Place, scatter};
pub use dresser::Dresser;
pub use error::SceneError;
pub use export::{Contents, Report, SceneAccuracy, Subject, Times, file_names, report, write_results};
pub use fit_map::{FitMap, GarmentMap, Region, RegionFit, Verdict};
pub use fit_picture::Layer;
pub use format::Format;
pub use hair::{HairReport, HairTrack, WornStyle};
pub use machine::{Machine, Memory, reset_peak_memory};
pub use person::Person;
pub use timing::{Stage, Summary, Timing, time_frames};
