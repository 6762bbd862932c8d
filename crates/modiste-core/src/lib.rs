//! Meshes, numerics, queries and the CPU rasteriser of Modiste. No files, no command line.
//!
//! Lengths are metres, angles radians, Y is up. Topology is constant and shared; positions live beside it as slices with
//! one point per vertex, so a function takes `(&Topology, &[Vec3])` and works for any pose. Solves run in f64, stored
//! bases are f32, i16 or i8. Everything is deterministic: the number of threads changes no bit of a result.
//!
//! | what | where |
//! |---|---|
//! | meshes | [`Topology`], [`Mesh`], [`vertex_normals`], [`volume`], [`mean_curvature`], [`connected_components`], [`boundary_loops`], [`shapes`] |
//! | deformation gradients (DRAPE eq. 1 and 3) | [`deformation_gradients`], [`GradientReconstruction`], [`ScreenedReconstruction`] |
//! | nearest point, ray, inside, crossing | [`TriangleBvh`], [`signed_distance()`], [`closest_point_on_triangle`], [`deepest_on_triangle`], [`triangle_separation`] |
//! | distances along the surface | [`geodesic_distances`] |
//! | slices and girths | [`slice_by_plane`], [`chain_segments`], [`convex_hull_2d`], [`polygon_perimeter`] |
//! | rotations | [`rotation_from_vector`], [`vector_from_rotation`], [`nearest_rotation`], [`swing_twist`], [`align_rigid`] |
//! | sparse systems | [`SparseMatrix`], [`SparseCholesky`], [`BlockSystem`] (conjugate gradients) |
//! | dense systems | [`Matrix`], [`ridge`], [`solve_spd`], [`symmetric_eigen`], [`largest_eigenvalue_magnitude`], [`thin_svd`] |
//! | learned bases | [`Pca`], [`QuantisedBasis`] |
//! | random numbers, quantiles, progress | [`seeded_rng`], [`normal`], [`quantile()`], [`Progress`] |
//! | pictures | [`render`] |
//!
//! One-shot functions serve a single call; where a model is used again and again there is a type that prepares once:
//! [`GradientReconstruction`] and [`SparseCholesky`] factor, [`TriangleBvh`] builds and refits.
//!
//! ```
//! use modiste_core::{GradientReconstruction, Vec3, deformation_gradients, shapes::icosphere, volume};
//!
//! let sphere = icosphere(3);
//! let tall: Vec<Vec3> = sphere.vertices.iter().map(|&p| p * Vec3::new(1.0, 2.0, 1.0)).collect();
//! let gradients = deformation_gradients(&sphere.topology, &sphere.vertices, &tall);
//! let solver = GradientReconstruction::new(&sphere.topology, &sphere.vertices)?;
//! let mut rebuilt = vec![Vec3::ZERO; tall.len()];
//! solver.reconstruct(&gradients, &mut rebuilt);
//! assert!((volume(&sphere.topology, &rebuilt) / sphere.volume() - 2.0).abs() < 1e-9);
//! # Ok::<(), modiste_core::SolveError>(())
//! ```

mod bvh;
mod components;
mod conjugate_gradients;
mod curvature;
mod deepest;
mod deformation;
mod dense;
mod error;
mod geodesic;
mod lanes;
mod mesh;
mod pca;
mod polygon;
mod progress;
mod quantile;
mod quantised;
pub mod render;
mod rng;
mod rotation;
mod separation;
pub mod shapes;
mod signed_distance;
mod slice;
mod sparse_cholesky;
mod sparse_matrix;
mod topology;
mod triangle;

pub use bvh::{RayHit, SurfacePoint, TriangleBvh, triangles_cross, winding_number_exact};
pub use components::{boundary_loops, connected_components};
pub use conjugate_gradients::{BlockSystem, CgReport};
pub use curvature::mean_curvature;
pub use deepest::{Sounding, deepest_on_triangle};
pub use deformation::{EdgeSystem, GradientReconstruction, Place, ScreenedReconstruction, deformation_gradients};
pub use dense::{Matrix, ThinSvd, largest_eigenvalue_magnitude, ridge, solve_spd, symmetric_eigen, thin_svd};
pub use error::SolveError;
pub use geodesic::geodesic_distances;
pub use glam::{DAffine3 as Affine3, DMat2 as Mat2, DMat3 as Mat3, DQuat as Quat, DVec2 as Vec2, DVec3 as Vec3};
pub use lanes::Lanes;
pub use mesh::{
    Mesh, bounds, centroid, corners, face_areas, face_normals, surface_area, vertex_areas, vertex_normals,
    vertex_normals_into, volume,
};
pub use pca::Pca;
pub use polygon::{convex_hull_2d, polygon_area, polygon_contains, polygon_perimeter};
pub use progress::{Progress, Silent};
pub use quantile::quantile;
pub use quantised::{QuantisedBasis, Step};
pub use rng::{Rng, below, normal, seeded_rng, shuffle, uniform};
pub use rotation::{
    align_rigid, angle_between, cross_matrix, mean_rotation, nearest_rotation, polar_decomposition, quat_from_vector,
    rotation_between, rotation_from_vector, swing_twist, vector_from_quat, vector_from_rotation,
};
pub use separation::triangle_separation;
pub use signed_distance::{pseudonormal, signed_distance};
pub use slice::{SliceLoop, SliceSegment, chain_segments, slice_by_plane};
pub use sparse_cholesky::SparseCholesky;
pub use sparse_matrix::SparseMatrix;
pub use topology::{Adjacency, Edge, Topology, TopologyError};
pub use triangle::{
    closest_point_on_segment, closest_point_on_triangle, closest_points_of_segments, line_triangle,
    segment_crosses_triangle, solid_angle_fraction,
};

/// Keeps `faer` on the calling thread: the programs run one job per core, and sums must not depend on thread counts.
fn sequential() {
    faer::set_global_parallelism(faer::Par::Seq);
}
