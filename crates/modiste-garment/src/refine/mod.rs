//! From the predicted garment to one that is worn: outside the body, over other garments (DRAPE §5; Guan 2013, ch. 5 §4).

pub mod anchors;
mod band;
mod cloud;
mod contact;
mod contacts;
mod cover;
#[cfg(test)]
mod crossing_tests;
mod crossings;
mod crowding;
mod descent;
mod exact;
mod exposure;
mod fit;
mod folds;
mod home;
mod lanes;
mod layers;
mod nearest;
mod normals;
mod obstacle;
mod paper;
mod patches;
pub mod penetration;
mod region;
mod rings;
mod shows;
mod tears;
mod walk;
mod warp;
mod way_out;

pub(crate) use contacts::MOST;
pub(crate) use cover::Cover;
pub use exact::{ExactOptions, ExactReport, Left};
pub use fit::{Below, Fit, FitOptions};
pub use layers::upper_body;
pub use obstacle::Obstacle;
pub use paper::PaperOptions;
pub use penetration::Penetration;
pub use warp::{DEFAULT_ACCURACY, Stiffness, WarpOptions};
