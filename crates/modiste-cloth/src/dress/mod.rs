//! Dressing: a garment laid around a body, sewn, and left to hang; then the same on other bodies.

mod band;
mod carry;
mod design;
#[cfg(test)]
mod dummy;
mod error;
mod inspect;
mod mannequin;
mod place;
mod ready_made;
mod settle;
mod sew;
mod tailor;

pub use carry::Carrier;
pub use design::{Design, DesignError};
pub use error::DressError;
pub use inspect::{DrapeQuality, inspect};
pub use mannequin::Mannequin;
pub use place::{place, thin_body};
pub use ready_made::{ReadyMade, ReadyMadeError};
pub use settle::{SettleOptions, Stage};
pub use sew::{SEAM_TOLERANCE, Sewn, sew};
pub use tailor::{Dressed, FlatGarment, SewnGarment, Tailor, TailorOptions, dress};
