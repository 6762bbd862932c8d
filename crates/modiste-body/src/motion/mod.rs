//! Motion: reading captured motion onto our bodies, cleaning it, and making it without a file.

pub mod filter;
mod floor;
mod leg;
mod retarget;
mod skeleton;
#[cfg(test)]
pub(crate) mod test_body;

pub use filter::resample;
pub use floor::place_on_floor;
pub use retarget::{RetargetOptions, known_skeletons, retarget};
