//! Sewing patterns, their meshing, placing and stitching, and cloth physics.
//!
//! The physics makes training data: a [`ClothModel`] (constant), a [`ClothState`] (varies), a moving
//! [`BodyCollider`] and a [`Solver`] that advances the state by one frame at a time.

// Garments.
pub mod cut;
pub mod dress;
pub mod pattern;
pub mod training_set;

// Physics.
mod contact;
mod energy;
mod error;
mod material;
mod model;
mod solver;
mod state;
pub mod validate;

pub use contact::{BodyCollider, BodyPoint, CollisionGroups};
pub use energy::{Hinge, Membrane};
pub use error::ClothError;
pub use material::{Bend, Fabric, Stretch, Voigt};
pub use model::{Attachment, ClothModel, ElasticEdge, Seam};
pub use solver::{Solver, SolverOptions, StepReport};
pub use state::{ClothState, StretchStatistics};
