//! Sewing patterns, their meshing, placing and stitching, and cloth physics.

pub mod cut;
pub mod pattern;
