//! The smooth warp: where to move the vertices of a garment so that some of them get where they must.

use modiste_core::{Mat3, Topology, Vec3};

use super::lanes::{Lanes, dot, lanes_of_columns};

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
    scratch: Scratch,
}

/// Memory of a solve.
///
/// What is solved for lies close together: the vertices are numbered anew, first those that are pushed or pulled, then the
/// rest of the region, then the ring around it, where a warp of the region bends the cloth.
#[derive(Debug, Clone, Default)]
struct Scratch {
    region: Vec<u32>,
    ring: Vec<u32>,
    /// Where each vertex is.
    sides: Vec<Side>,
    /// The new number of each vertex of region and ring.
    places: Vec<u32>,
    /// The vertices of region and ring by their new numbers.
    vertices: Vec<u32>,
    /// Where the neighbours of each begin, and the end of the last.
    starts: Vec<u32>,
    /// Neighbours in region and ring, by their new numbers.
    neighbours: Vec<u32>,
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
    bent_exactly: Vec<Vec3>,
    step: Vec<Lanes>,
    residual: Vec<Lanes>,
    preconditioned: Vec<Lanes>,
    image: Vec<Lanes>,
    /// Zero in the ring.
    direction: Vec<Lanes>,
    /// L of the direction.
    bent: Vec<Lanes>,
    /// The same, times the share.
    shared: Vec<Lanes>,
}

/// Where a vertex is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
enum Side {
    #[default]
    Outside,
    Constrained,
    Region,
    Ring,
}

impl Warp {
    pub(crate) fn new(topology: &std::sync::Arc<Topology>) -> Self {
        let n = topology.vertex_count();
        let shares: Vec<f64> = (0..n).map(|vertex| 1.0 / topology.neighbours(vertex).len().max(1) as f64).collect();
        // Column i of L has 1 on the diagonal and the share of each neighbour, whose rows it is in.
        let square_of = |&other: &u32| shares[other as usize].powi(2);
        let diagonal = (0..n).map(|i| 1.0 + topology.neighbours(i).iter().map(square_of).sum::<f64>()).collect();
        let scratch = Scratch { sides: vec![Side::Outside; n], places: vec![0; n], ..Scratch::default() };
        Self { topology: topology.clone(), shares, diagonal, scratch }
    }

    /// The vertices that the last solve could move, ascending.
    pub(crate) fn region(&self) -> &[u32] {
        &self.scratch.region
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
        self.grow_region(pushes, pulls, options.rings);
        if self.scratch.region.is_empty() {
            return 0;
        }
        self.number();
        self.prepare(stiffness, pushes, pulls);
        let iterations = self.iterate(stiffness, options.accuracy);
        for (&vertex, &u) in self.scratch.vertices.iter().zip(&self.scratch.solution) {
            warp[vertex as usize] = u;
        }
        iterations
    }

    /// The constrained vertices and some rings around them.
    fn grow_region(&mut self, pushes: &[Push], pulls: &[Pull], rings: usize) {
        let Scratch { region, ring, sides, vertices, .. } = &mut self.scratch;
        region.clear();
        ring.clear();
        sides.fill(Side::Outside);
        let mut add = |vertex: u32, side: Side, list: &mut Vec<u32>| {
            if sides[vertex as usize] == Side::Outside {
                sides[vertex as usize] = side;
                list.push(vertex);
            }
        };
        pushes.iter().for_each(|push| add(push.vertex, Side::Constrained, region));
        pulls.iter().for_each(|pull| add(pull.vertex, Side::Constrained, region));
        let mut last = 0;
        for _ in 0..rings {
            let end = region.len();
            for index in last..end {
                for &neighbour in self.topology.neighbours(region[index] as usize) {
                    add(neighbour, Side::Region, region);
                }
            }
            last = end;
        }
        for &vertex in &region[last..] {
            for &neighbour in self.topology.neighbours(vertex as usize) {
                add(neighbour, Side::Ring, ring);
            }
        }
        // In order of the vertices, memory is read in order.
        region.clear();
        ring.clear();
        vertices.clear();
        for (vertex, side) in (0u32..).zip(&*sides) {
            match side {
                Side::Outside => {}
                Side::Constrained => {
                    region.push(vertex);
                    vertices.push(vertex);
                }
                Side::Region => region.push(vertex),
                Side::Ring => ring.push(vertex),
            }
        }
        vertices.extend(region.iter().filter(|&&vertex| sides[vertex as usize] == Side::Region));
        vertices.extend(&*ring);
    }

    /// Notes who is next to whom by the new numbers.
    fn number(&mut self) {
        let Scratch { sides, places, vertices, starts, neighbours, shares, .. } = &mut self.scratch;
        vertices.iter().zip(0u32..).for_each(|(&vertex, place)| places[vertex as usize] = place);
        shares.clear();
        shares.extend(vertices.iter().map(|&vertex| self.shares[vertex as usize] as f32));
        neighbours.clear();
        starts.clear();
        starts.push(0);
        for &vertex in &*vertices {
            let around = self.topology.neighbours(vertex as usize).iter().map(|&other| other as usize);
            // Nothing moves in the ring, so its vertices need not know of each other.
            let is_ring = sides[vertex as usize] == Side::Ring;
            let counts = |other: &usize| match sides[*other] {
                Side::Outside => false,
                Side::Ring => !is_ring,
                Side::Constrained | Side::Region => true,
            };
            neighbours.extend(around.filter(counts).map(|other| places[other]));
            starts.push(neighbours.len() as u32);
        }
    }

    /// Blocks of the diagonal, their inverses, and the right-hand side.
    fn prepare(&mut self, stiffness: Stiffness, pushes: &[Push], pulls: &[Pull]) {
        let Scratch { region, places, vertices, blocks, columns, inverse_columns, inverse, right, sides, .. } =
            &mut self.scratch;
        let constrained = vertices.iter().take_while(|&&vertex| sides[vertex as usize] == Side::Constrained).count();
        blocks.clear();
        blocks.resize(constrained, Mat3::ZERO);
        right.clear();
        right.resize(region.len(), Vec3::ZERO);
        for push in pushes {
            let i = places[push.vertex as usize] as usize;
            let weighted = push.weight * push.normal;
            blocks[i] += Mat3::from_cols(weighted * push.normal.x, weighted * push.normal.y, weighted * push.normal.z);
            right[i] += push.gap * weighted;
        }
        for pull in pulls {
            let i = places[pull.vertex as usize] as usize;
            blocks[i] += Mat3::from_diagonal(Vec3::splat(pull.weight));
            right[i] += pull.weight * pull.offset;
        }
        let level = |vertex: u32| stiffness.smooth * self.diagonal[vertex as usize] + stiffness.damping;
        let damping = Mat3::from_diagonal(Vec3::splat(stiffness.damping));
        columns.clear();
        columns.extend(blocks.iter().map(|block| lanes_of_columns(*block + damping)));
        inverse_columns.clear();
        inverse_columns.extend(blocks.iter().zip(&*vertices).map(|(block, &vertex)| {
            lanes_of_columns((*block + Mat3::from_diagonal(Vec3::splat(level(vertex)))).inverse())
        }));
        inverse.clear();
        inverse.extend(vertices[constrained..region.len()].iter().map(|&vertex| level(vertex).recip() as f32));
    }

    /// Solves to a share of the right-hand side, in as many runs in f32 as it takes. Returns the number of iterations.
    fn iterate(&mut self, stiffness: Stiffness, accuracy: f64) -> usize {
        let scratch = &mut self.scratch;
        let length = |right: &[Vec3]| right.iter().map(|left| left.length_squared()).sum::<f64>().sqrt();
        scratch.solution.clear();
        scratch.solution.resize(scratch.region.len(), Vec3::ZERO);
        scratch.rest.clone_from(&scratch.right);
        let mut left = length(&scratch.rest);
        let wanted = accuracy * left;
        let mut iterations = 0;
        while left > wanted && iterations < MAX_ITERATIONS {
            let share = (wanted / left).max(BEST_IN_F32);
            iterations += scratch.run_in_f32(stiffness, share, left);
            for (sum, step) in scratch.solution.iter_mut().zip(&scratch.step) {
                *sum += left * step.to_vec3();
            }
            // What a run says of itself is believed where it was not asked for its last digits.
            if share > BEST_IN_F32 {
                break;
            }
            scratch.find_rest(stiffness, &self.shares);
            left = length(&scratch.rest);
        }
        iterations
    }
}

impl Scratch {
    /// What the solution leaves of the right-hand side.
    fn find_rest(&mut self, stiffness: Stiffness, shares_of_all: &[f64]) {
        let Self { region, vertices, starts, neighbours, blocks, right, rest, solution, bent_exactly, .. } = self;
        let around = |i: usize| neighbours[starts[i] as usize..starts[i + 1] as usize].iter().map(|&j| j as usize);
        let share = |i: usize| shares_of_all[vertices[i] as usize];
        let of = |i: usize| solution.get(i).copied().unwrap_or_default();
        bent_exactly.clear();
        bent_exactly.extend((0..vertices.len()).map(|i| of(i) - share(i) * around(i).map(of).sum::<Vec3>()));
        for i in 0..region.len() {
            let back: Vec3 = around(i).map(|j| share(j) * bent_exactly[j]).sum();
            let block = blocks.get(i).map_or(Vec3::ZERO, |block| *block * solution[i]);
            rest[i] = right[i] - stiffness.smooth * (bent_exactly[i] - back) - stiffness.damping * solution[i] - block;
        }
    }

    /// Finds the step for what is left of the right-hand side over its length `left`, to a residual of `share`. Returns the
    /// number of iterations.
    fn run_in_f32(&mut self, stiffness: Stiffness, share: f64, left: f64) -> usize {
        let Self { rest, step, residual, preconditioned, image, direction, bent, shared, .. } = self;
        let (count, all) = (self.region.len(), self.vertices.len());
        let (smooth, damping) = (stiffness.smooth as f32, stiffness.damping as f32);
        step.clear();
        step.resize(count, Lanes::ZERO);
        residual.clear();
        residual.extend(rest.iter().map(|rest| Lanes::from_vec3(*rest / left)));
        [&mut *preconditioned, image].into_iter().for_each(|vector| vector.resize(count, Lanes::ZERO));
        [&mut *direction, bent, shared].into_iter().for_each(|vector| vector.resize(all, Lanes::ZERO));
        direction[count..].fill(Lanes::ZERO);
        let (columns, inverse_columns, inverse) = (&self.columns, &self.inverse_columns, &self.inverse);
        let around = |i: usize| &self.neighbours[self.starts[i] as usize..self.starts[i + 1] as usize];
        let precondition = |residual: &[Lanes], out: &mut [Lanes]| {
            let (blocks, rest) = out.split_at_mut(columns.len());
            for (i, (out, columns)) in blocks.iter_mut().zip(inverse_columns).enumerate() {
                *out = residual[i].through(columns);
            }
            for ((out, residual), &inverse) in rest.iter_mut().zip(&residual[columns.len()..]).zip(inverse) {
                *out = residual.times(inverse);
            }
        };
        let wanted = (share * share) as f32;
        precondition(residual, &mut direction[..count]);
        let mut product = dot(&direction[..count], residual);
        for iteration in 1..=MAX_ITERATIONS {
            for i in 0..all {
                let sum = around(i).iter().fold(Lanes::ZERO, |sum, &j| sum.plus(direction[j as usize]));
                bent[i] = direction[i].minus(sum.times(self.shares[i]));
                shared[i] = bent[i].times(self.shares[i]);
            }
            for i in 0..count {
                let sum = around(i).iter().fold(bent[i], |sum, &j| sum.minus(shared[j as usize]));
                let own = match columns.get(i) {
                    Some(columns) => direction[i].through(columns),
                    None => direction[i].times(damping),
                };
                image[i] = own.plus(sum.times(smooth));
            }
            let curvature = dot(image, &direction[..count]);
            if curvature <= 0.0 {
                return iteration;
            }
            let length = product / curvature;
            for i in 0..count {
                step[i] = step[i].plus(direction[i].times(length));
                residual[i] = residual[i].minus(image[i].times(length));
            }
            if dot(residual, residual) <= wanted {
                return iteration;
            }
            precondition(residual, preconditioned);
            let next = dot(residual, preconditioned);
            let keep = next / product;
            product = next;
            for i in 0..count {
                direction[i] = preconditioned[i].plus(direction[i].times(keep));
            }
        }
        MAX_ITERATIONS
    }
}

/// The least residual that a run in f32 is asked for.
const BEST_IN_F32: f64 = 1e-4;

/// Far more than the blocks of the diagonal ever need.
const MAX_ITERATIONS: usize = 300;

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
