//! Fabrics: what the cloth is made of.

mod bend;
mod fabric;
pub(crate) mod library;
mod stretch;

pub use bend::Bend;
pub use fabric::Fabric;
pub use stretch::{Stretch, Voigt};
