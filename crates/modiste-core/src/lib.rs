//! Meshes, numerics, queries and the CPU rasteriser. No files, no command line.

mod topology;

pub use glam::{DAffine3 as Affine3, DMat2 as Mat2, DMat3 as Mat3, DQuat as Quat, DVec2 as Vec2, DVec3 as Vec3};
pub use topology::{Adjacency, Edge, Topology, TopologyError};
