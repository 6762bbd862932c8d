//! Hair, learned: Guan 2013, chapter 6, with the physics that it is learned from.
//!
//! A [`Groom`] is guides on a scalp, grown or [`carry`]-ed from a file. [`rod`] simulates them on a moving body, [`training`]
//! keeps what comes of it, [`model`] learns from that, [`collision`] lets hair out of the body in the space of its coefficients,
//! [`Finish`] makes sure of it point by point, and [`WornHair`] does all of that frame by frame.

mod canonical;
mod carry;
pub mod collision;
mod error;
mod evaluate;
mod finish;
mod groom;
mod guides;
pub mod model;
pub mod rod;
mod scalp;
mod space;
mod strands;
mod surface;
pub mod training;
mod wear;
pub use canonical::{BustTrack, Frame, TRACKED};
pub use carry::carry;
pub use error::HairError;
pub use evaluate::{CellError, evaluate};
pub use finish::{Finish, FinishReport, GAP};
pub use groom::{CLEARANCE, Groom, Style};
pub use guides::{Guides, POINTS, arc_length, resample};
pub use scalp::{MOST_ROOTS, Region, Root, is_scalp, nearest_roots, skull_middle, spread_roots};
pub use space::HairSpace;
pub use strands::FullHair;
pub use surface::{Bust, Contact, Surface};
pub use wear::{HairTimes, WornHair};
