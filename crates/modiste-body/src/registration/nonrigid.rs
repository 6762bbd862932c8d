//! Second stage: every vertex moves smoothly onto their surface.

use modiste_core::{SolveError, SparseCholesky, SparseMatrix, Topology, Vec3, vertex_normals};

use super::{Target, is_comparable};
use crate::MakeHumanModel;

/// Stiffness of the displacement field, from round to round: enough rounds that correspondences settle before the
/// field may follow detail.
const STIFFNESS: [f64; 12] = [100.0, 100.0, 30.0, 30.0, 10.0, 10.0, 3.0, 3.0, 1.0, 1.0, 0.3, 0.3];

/// Weight of the distance along the surface against that across it: lets points slide, but not without end.
const SLIDE: f64 = 0.05;

/// How far (m) a corresponding point may lie.
const REACH: f64 = 0.03;

/// Non-rigid iterative closest points: `min Σ w (n·(x + d - c))² + SLIDE |x + d - c|² + stiffness |L d|²` over the
/// displacements `d` from `start` (m), `L` the uniform Laplacian; correspondences anew each round.
pub(super) fn fit(model: &MakeHumanModel, start: &[Vec3], target: &Target<'_>) -> Result<Vec<Vec3>, SolveError> {
    let smoothness = laplacian(model.topology())?.gram();
    let mut vertices = start.to_vec();
    for stiffness in STIFFNESS {
        let normals = vertex_normals(model.topology(), &vertices);
        let mut triplets: Vec<(usize, usize, f64)> = Vec::with_capacity(3 * smoothness.len() + 6 * start.len());
        for &(row, column, value) in smoothness.iter().filter(|entry| entry.0 >= entry.1) {
            triplets.extend((0..3).map(|axis| (3 * row + axis, 3 * column + axis, stiffness * value)));
        }
        let mut rhs = vec![0.0; 3 * start.len()];
        for vertex in 0..start.len() {
            // Everything is held a little, so that the matrix is definite where nothing corresponds.
            let mut block = modiste_core::Mat3::from_diagonal(Vec3::splat(1e-6));
            let corresponding = is_comparable(model.vertex_parts()[vertex])
                .then(|| target.closest(vertices[vertex], normals[vertex], REACH, 0.6))
                .flatten();
            if let Some(found) = corresponding {
                let n = found.normal;
                let data = modiste_core::Mat3::from_cols(n * n.x, n * n.y, n * n.z)
                    + modiste_core::Mat3::from_diagonal(Vec3::splat(SLIDE));
                block += data;
                let pull = data * (found.point - start[vertex]);
                for axis in 0..3 {
                    rhs[3 * vertex + axis] = pull[axis];
                }
            }
            for column in 0..3 {
                for row in column..3 {
                    triplets.push((3 * vertex + row, 3 * vertex + column, block.col(column)[row]));
                }
            }
        }
        SparseCholesky::new(3 * start.len(), &triplets)?.solve(&mut rhs);
        for (vertex, d) in vertices.iter_mut().zip(rhs.chunks_exact(3)).enumerate().map(|(i, (v, d))| ((i, v), d)) {
            *vertex.1 = start[vertex.0] + Vec3::new(d[0], d[1], d[2]);
        }
    }
    Ok(vertices)
}

/// Uniform Laplacian: a vertex minus the mean of its neighbours.
fn laplacian(topology: &Topology) -> Result<SparseMatrix, SolveError> {
    let count = topology.vertex_count();
    let mut triplets = Vec::new();
    for vertex in 0..count {
        let neighbours = topology.neighbours(vertex);
        triplets.push((vertex, vertex, 1.0));
        let share = -1.0 / neighbours.len().max(1) as f64;
        triplets.extend(neighbours.iter().map(|&other| (vertex, other as usize, share)));
    }
    SparseMatrix::from_triplets(count, count, &triplets)
}
