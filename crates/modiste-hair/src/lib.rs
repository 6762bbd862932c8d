//! Hair.
mod canonical;
mod error;
mod groom;
mod guides;
pub mod model;
pub mod rod;
mod scalp;
mod surface;
pub mod training;
pub use canonical::{BustTrack, Frame, TRACKED};
pub use error::HairError;
pub use groom::{CLEARANCE, Groom, Style};
pub use guides::{Guides, POINTS, arc_length, resample};
pub use scalp::{MOST_ROOTS, Root, is_scalp, nearest_roots, skull_middle, spread_roots};
pub use surface::{Bust, Contact, Surface};
