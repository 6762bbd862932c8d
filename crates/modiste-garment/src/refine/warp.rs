//! The smooth warp: where to move the vertices of a garment so that some of them get where they must.

use modiste_core::{Mat3, Topology, Vec3};

use super::descent::{Descent, MAX_ITERATIONS, Normal};
use super::lanes::{Lanes, lanes_of_columns};
use super::region::Region;

/// How far a warp reaches and how exactly it is solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WarpOptions {
    /// Rings of vertices around the constrained ones that may move. The warp dies out by about e a ring.
    pub rings: usize,
    /// Residual, relative to the right-hand side, at which the solution is accepted.
    pub accuracy: f64,
}

impl Default for WarpOptions {
    fn default() -> Self {
        Self { rings: 8, accuracy: DEFAULT_ACCURACY }
    }
}

/// A thousandth of a push of a centimetre is a hundredth of a millimetre.
pub const DEFAULT_ACCURACY: f64 = 1e-3;

/// Weights of the two terms that hold a warp back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stiffness {
    /// Weight of the smoothness of the warp, λ_s.
    pub smooth: f64,
    /// Weight of the warp itself, λ_d.
    pub damping: f64,
}

/// Asks a vertex to move by `gap` (m) along a unit normal: the term `weight (n·u - gap)²`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Push {
    pub(crate) vertex: u32,
    pub(crate) normal: Vec3,
    pub(crate) gap: f64,
    pub(crate) weight: f64,
}

/// Asks a vertex to move by an offset (m): the term `weight |u - offset|²`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pull {
    pub(crate) vertex: u32,
    pub(crate) offset: Vec3,
    pub(crate) weight: f64,
}

/// Minimises, over the warp `u` of the vertices,
/// `Σ w (n·u - g)² + λ_s Σ |u_i - mean of u_j over neighbours|² + λ_d Σ |u_i|² + Σ w |u - o|²` (DRAPE §5).
///
/// Conjugate gradients with the 3×3 blocks of the diagonal for preconditioner, on the neighbourhood of the pushed
/// vertices only; u is zero elsewhere. They run in f32, which is twice as fast and as good as the accuracies that a fit asks
/// for; where more is wanted, what is left of the right-hand side is found in f64 and solved for again.
#[derive(Debug, Clone)]
pub(crate) struct Warp {
    topology: std::sync::Arc<Topology>,
    /// One over the number of neighbours: L = 1 - (mean over neighbours).
    shares: Vec<f64>,
    /// The diagonal of LᵀL.
    diagonal: Vec<f64>,
    region: Region,
    scratch: Scratch,
    descent: Descent,
}

/// Memory of a solve, in the numbers of the region.
#[derive(Debug, Clone, Default)]
struct Scratch {
    /// One over the number of all neighbours, of region and ring.
    shares: Vec<f32>,
    /// What pushes and pulls add to the diagonal, of the vertices that have any.
    blocks: Vec<Mat3>,
    /// The same in f32, with the damping, and the inverse of the whole block of the diagonal.
    columns: Vec<[Lanes; 3]>,
    inverse_columns: Vec<[Lanes; 3]>,
    /// One over the diagonal, of the vertices that have none.
    inverse: Vec<f32>,
    right: Vec<Vec3>,
    /// What the solution leaves of the right-hand side.
    rest: Vec<Vec3>,
    /// The solution so far.
    solution: Vec<Vec3>,
    bent: Vec<Vec3>,
}

impl Warp {
    pub(crate) fn new(topology: &std::sync::Arc<Topology>) -> Self {
        let n = topology.vertex_count();
        let shares: Vec<f64> = (0..n).map(|vertex| 1.0 / topology.neighbours(vertex).len().max(1) as f64).collect();
        // Column i of L has 1 on the diagonal and the share of each neighbour, whose rows it is in.
        let square_of = |&other: &u32| shares[other as usize].powi(2);
        let diagonal = (0..n).map(|i| 1.0 + topology.neighbours(i).iter().map(square_of).sum::<f64>()).collect();
        Self {
            topology: topology.clone(),
            shares,
            diagonal,
            region: Region::new(n),
            scratch: Scratch::default(),
            descent: Descent::default(),
        }
    }

    /// The vertices that the last solve could move, ascending.
    pub(crate) fn region(&self) -> &[u32] {
        self.region.members()
    }

    /// Solves for `warp` (m, one per vertex), which is zero outside the region afterwards. Returns the number of iterations.
    pub(crate) fn solve(
        &mut self,
        stiffness: Stiffness,
        pushes: &[Push],
        pulls: &[Pull],
        options: WarpOptions,
        warp: &mut [Vec3],
    ) -> usize {
        warp.fill(Vec3::ZERO);
        let constrained = pushes.iter().map(|push| push.vertex).chain(pulls.iter().map(|pull| pull.vertex));
        self.region.grow(&self.topology, constrained, options.rings);
        if self.region.members().is_empty() {
            return 0;
        }
        self.prepare(stiffness, pushes, pulls);
        let iterations = self.iterate(stiffness, options.accuracy);
        for (&vertex, &u) in self.region.vertices().iter().zip(&self.scratch.solution) {
            warp[vertex as usize] = u;
        }
        iterations
    }

    /// Blocks of the diagonal, their inverses, and the right-hand side.
    fn prepare(&mut self, stiffness: Stiffness, pushes: &[Push], pulls: &[Pull]) {
        let Scratch { shares, blocks, columns, inverse_columns, inverse, right, .. } = &mut self.scratch;
        let (count, constrained) = (self.region.members().len(), self.region.constrained());
        let vertices = self.region.vertices();
        shares.clear();
        shares.extend(vertices.iter().map(|&vertex| self.shares[vertex as usize] as f32));
        blocks.clear();
        blocks.resize(constrained, Mat3::ZERO);
        right.clear();
        right.resize(count, Vec3::ZERO);
        for push in pushes {
            let i = self.region.place(push.vertex);
            let weighted = push.weight * push.normal;
            blocks[i] += Mat3::from_cols(weighted * push.normal.x, weighted * push.normal.y, weighted * push.normal.z);
            right[i] += push.gap * weighted;
        }
        for pull in pulls {
            let i = self.region.place(pull.vertex);
            blocks[i] += Mat3::from_diagonal(Vec3::splat(pull.weight));
            right[i] += pull.weight * pull.offset;
        }
        let level = |vertex: u32| stiffness.smooth * self.diagonal[vertex as usize] + stiffness.damping;
        let damping = Mat3::from_diagonal(Vec3::splat(stiffness.damping));
        columns.clear();
        columns.extend(blocks.iter().map(|block| lanes_of_columns(*block + damping)));
        inverse_columns.clear();
        inverse_columns.extend(blocks.iter().zip(vertices).map(|(block, &vertex)| {
            lanes_of_columns((*block + Mat3::from_diagonal(Vec3::splat(level(vertex)))).inverse())
        }));
        inverse.clear();
        inverse.extend(vertices[constrained..count].iter().map(|&vertex| level(vertex).recip() as f32));
    }

    /// Solves to a share of the right-hand side, in as many runs in f32 as it takes. Returns the number of iterations.
    fn iterate(&mut self, stiffness: Stiffness, accuracy: f64) -> usize {
        let Self { region, scratch, descent, .. } = self;
        let length = |right: &[Vec3]| right.iter().map(|left| left.length_squared()).sum::<f64>().sqrt();
        scratch.solution.clear();
        scratch.solution.resize(region.members().len(), Vec3::ZERO);
        scratch.rest.clone_from(&scratch.right);
        let mut left = length(&scratch.rest);
        let wanted = accuracy * left;
        let mut iterations = 0;
        while left > wanted && iterations < MAX_ITERATIONS {
            let share = (wanted / left).max(BEST_IN_F32);
            let right = scratch.rest.iter().map(|rest| Lanes::from_vec3(*rest / left));
            iterations += descent.run(&scratch.system(region, stiffness), right, share);
            for (sum, step) in scratch.solution.iter_mut().zip(descent.step()) {
                *sum += left * step.to_vec3();
            }
            // What a run says of itself is believed where it was not asked for its last digits.
            if share > BEST_IN_F32 {
                break;
            }
            scratch.find_rest(region, stiffness, &self.shares);
            left = length(&scratch.rest);
        }
        iterations
    }
}

impl Scratch {
    fn system<'a>(&'a self, region: &'a Region, stiffness: Stiffness) -> Normal<'a> {
        let (starts, neighbours) = region.adjacency();
        Normal {
            smooth: stiffness.smooth as f32,
            damping: stiffness.damping as f32,
            starts,
            neighbours,
            shares: &self.shares,
            columns: &self.columns,
            inverse_columns: &self.inverse_columns,
            inverse: &self.inverse,
        }
    }

    /// What the solution leaves of the right-hand side.
    fn find_rest(&mut self, region: &Region, stiffness: Stiffness, shares_of_all: &[f64]) {
        let Self { blocks, right, rest, solution, bent, .. } = self;
        let (starts, neighbours) = region.adjacency();
        let around = |i: usize| neighbours[starts[i] as usize..starts[i + 1] as usize].iter().map(|&j| j as usize);
        let share = |i: usize| shares_of_all[region.vertices()[i] as usize];
        let of = |i: usize| solution.get(i).copied().unwrap_or_default();
        bent.clear();
        bent.extend((0..region.vertices().len()).map(|i| of(i) - share(i) * around(i).map(of).sum::<Vec3>()));
        for i in 0..solution.len() {
            let back: Vec3 = around(i).map(|j| share(j) * bent[j]).sum();
            let block = blocks.get(i).map_or(Vec3::ZERO, |block| *block * solution[i]);
            rest[i] = right[i] - stiffness.smooth * (bent[i] - back) - stiffness.damping * solution[i] - block;
        }
    }
}

/// The least residual that a run in f32 is asked for.
const BEST_IN_F32: f64 = 1e-4;

#[cfg(test)]
mod tests {
    use super::{Pull, Push, Stiffness, Warp, WarpOptions};
    use modiste_core::shapes::icosphere;
    use modiste_core::{Matrix, Vec3, normal, seeded_rng, solve_spd};

    /// Some pushes and pulls near one pole of a sphere.
    fn constraints(vertices: &[Vec3]) -> (Vec<Push>, Vec<Pull>) {
        let mut rng = seeded_rng(4);
        let near = (0u32..).zip(vertices).filter(|(_, v)| v.y > 0.7);
        let mut pushes: Vec<Push> = near
            .map(|(vertex, v)| Push { vertex, normal: *v, gap: 0.01 * (1.0 + normal(&mut rng)), weight: 1.0 })
            .collect();
        pushes.push(Push { normal: Vec3::X, weight: 3.0, ..pushes[0] });
        let pulls = vec![Pull { vertex: pushes[1].vertex, offset: Vec3::new(0.01, 0.0, 0.02), weight: 0.2 }];
        (pushes, pulls)
    }

    /// The same minimum by a dense solve of the normal equations.
    fn dense(topology: &modiste_core::Topology, stiffness: Stiffness, pushes: &[Push], pulls: &[Pull]) -> Vec<Vec3> {
        let n = topology.vertex_count();
        let laplacian = Matrix::from_fn(n, n, |i, j| {
            let neighbours = topology.neighbours(i);
            if i == j {
                1.0
            } else if neighbours.contains(&(j as u32)) {
                -1.0 / neighbours.len() as f64
            } else {
                0.0
            }
        });
        let smooth = laplacian.transpose_matmul(&laplacian);
        let mut a = Matrix::from_fn(3 * n, 3 * n, |i, j| {
            let same = if i == j { stiffness.damping } else { 0.0 };
            same + if i % 3 == j % 3 { stiffness.smooth * smooth[(i / 3, j / 3)] } else { 0.0 }
        });
        let mut b = Matrix::zeros(3 * n, 1);
        for push in pushes {
            let (at, normal) = (3 * push.vertex as usize, push.normal.to_array());
            for i in 0..3 {
                b[(at + i, 0)] += push.weight * push.gap * normal[i];
                for j in 0..3 {
                    a[(at + i, at + j)] += push.weight * normal[i] * normal[j];
                }
            }
        }
        for pull in pulls {
            let (at, offset) = (3 * pull.vertex as usize, pull.offset.to_array());
            for i in 0..3 {
                b[(at + i, 0)] += pull.weight * offset[i];
                a[(at + i, at + i)] += pull.weight;
            }
        }
        let x = solve_spd(&a, &b).unwrap();
        (0..n).map(|i| Vec3::new(x[(3 * i, 0)], x[(3 * i + 1, 0)], x[(3 * i + 2, 0)])).collect()
    }

    #[test]
    fn conjugate_gradients_reach_the_dense_solution_at_any_accuracy() {
        let sphere = icosphere(2);
        let (pushes, pulls) = constraints(&sphere.vertices);
        let stiffness = Stiffness { smooth: 4.0, damping: 0.8 };
        let wanted = dense(&sphere.topology, stiffness, &pushes, &pulls);
        let scale = wanted.iter().map(|u| u.length()).fold(0.0, f64::max);
        let mut warp = vec![Vec3::ZERO; wanted.len()];
        for accuracy in [1e-2, 1e-4, 1e-6, 1e-9] {
            let mut solver = Warp::new(&sphere.topology);
            solver.solve(stiffness, &pushes, &pulls, WarpOptions { rings: 99, accuracy }, &mut warp);
            let error = warp.iter().zip(&wanted).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
            assert!(error < 3.0 * accuracy * scale, "{accuracy}: {error} of {scale}");
        }
    }

    #[test]
    fn a_few_rings_are_as_good_as_the_whole_mesh() {
        let sphere = icosphere(4);
        let (pushes, pulls) = constraints(&sphere.vertices);
        let pushes: Vec<Push> =
            pushes.into_iter().filter(|push| sphere.vertices[push.vertex as usize].y > 0.95).collect();
        let stiffness = Stiffness { smooth: 4.0, damping: 0.8 };
        let mut solver = Warp::new(&sphere.topology);
        let mut run = |rings: usize| {
            let mut warp = vec![Vec3::ZERO; sphere.vertices.len()];
            solver.solve(stiffness, &pushes, &pulls[..0], WarpOptions { rings, accuracy: 1e-9 }, &mut warp);
            warp
        };
        let (local, whole) = (run(8), run(1000));
        let scale = whole.iter().map(|u| u.length()).fold(0.0, f64::max);
        let error = local.iter().zip(&whole).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        assert!(error < 1e-3 * scale, "{error} of {scale}");
        assert!(local.iter().filter(|u| **u == Vec3::ZERO).count() > 500, "far vertices do not move");
    }
}
