//! Motion: reading captured motion onto our bodies, cleaning it, and making it without a file.

mod blend;
mod clear;
pub mod filter;
mod floor;
pub mod generate;
mod leg;
mod retarget;
mod skeleton;
#[cfg(test)]
pub(crate) mod test_body;

pub use blend::{concatenate, from_template, transition};
pub use clear::{DEFAULT_GAP, clear_limbs};
pub use filter::resample;
pub use floor::place_on_floor;
pub use retarget::{RetargetOptions, known_skeletons, retarget};
