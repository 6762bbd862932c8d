//! Sewing patterns, their meshing, placing and stitching, and cloth physics.

pub mod pattern;
