//! SCAPE: bodies of any shape in any pose from one triangle-wise model (Anguelov et al. 2005; DRAPE §1, Guan ch. 3 §2).
//!
//! Every template triangle is deformed by `A = R D Q`: `Q` the pose-dependent deformation (learned, linear in the
//! rotations of the neighbouring joints), `D` the body's shape (PCA over a population), `R` the rotation of its part.
//! The mesh that fits the deformed triangles best comes from one prefactored sparse least-squares solve (DRAPE eq. 3).
//!
//! One thing is added to the paper. There, `R` is constant on a part, so `Q` alone has to turn the triangles of a bent
//! joint part of the way, and a linear `Q` shears and shrinks them when the bend is strong. Here the `R` of a triangle
//! near a joint is the blend of the rotations of the parts that meet there, by the skin weights, and `Q` learns only what
//! remains. Away from joints the two agree. [`train`] can make both, and [`evaluate`] compares them.

mod blend;
mod body;
pub mod evaluate;
mod file;
mod joints;
mod model;
mod pose_deformation;
mod shape_gradient;
mod skin;
#[cfg(test)]
pub(crate) mod synthetic;
pub mod train;
mod training_poses;

pub use body::Body;
pub use file::Provenance;
pub use model::ScapeModel;
pub use skin::{Skin, SkinWeights};
