//! The smooth warp: where to move the vertices of a garment so that some of them get where they must.

use modiste_core::{Mat3, Topology, Vec3};

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
/// vertices only; u is zero elsewhere.
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
/// What is solved for lies close together: the vertices are numbered anew, those of the region first, then the ring around
/// it, where a warp of the region bends the cloth.
#[derive(Debug, Clone, Default)]
struct Scratch {
    region: Vec<u32>,
    ring: Vec<u32>,
    /// Where each vertex is.
    sides: Vec<Side>,
    /// The new number of each vertex of region and ring.
    places: Vec<u32>,
    /// Where the neighbours of each begin, and the end of the last.
    starts: Vec<u32>,
    /// Neighbours in region and ring, by their new numbers.
    neighbours: Vec<u32>,
    /// One over the number of all neighbours, of region and ring.
    shares: Vec<f64>,
    inverse: Vec<Mat3>,
    block: Vec<Mat3>,
    residual: Vec<Vec3>,
    preconditioned: Vec<Vec3>,
    image: Vec<Vec3>,
    /// Zero in the ring.
    direction: Vec<Vec3>,
    /// L of the direction.
    bent: Vec<Vec3>,
    /// The same, times the share.
    shared: Vec<Vec3>,
}

/// Where a vertex is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
enum Side {
    #[default]
    Outside,
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

    /// Solves for `warp` (m, one per vertex), which holds a first guess or zeros and is zero outside the region
    /// afterwards. Returns the number of iterations.
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
        self.iterate(stiffness.smooth, options.accuracy, warp)
    }

    /// The constrained vertices and some rings around them.
    fn grow_region(&mut self, pushes: &[Push], pulls: &[Pull], rings: usize) {
        let Scratch { region, ring, sides, .. } = &mut self.scratch;
        region.clear();
        ring.clear();
        sides.fill(Side::Outside);
        let mut add = |vertex: u32, side: Side, list: &mut Vec<u32>| {
            if sides[vertex as usize] == Side::Outside {
                sides[vertex as usize] = side;
                list.push(vertex);
            }
        };
        pushes.iter().for_each(|push| add(push.vertex, Side::Region, region));
        pulls.iter().for_each(|pull| add(pull.vertex, Side::Region, region));
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
        let ascending = |list: &mut Vec<u32>, side: Side| {
            list.clear();
            list.extend((0u32..).zip(&*sides).filter(|(_, other)| **other == side).map(|(vertex, _)| vertex));
        };
        ascending(region, Side::Region);
        ascending(ring, Side::Ring);
    }

    /// Numbers region and ring anew and notes who is next to whom.
    fn number(&mut self) {
        let Scratch { region, ring, sides, places, starts, neighbours, shares, .. } = &mut self.scratch;
        let all = || region.iter().chain(&*ring).map(|&vertex| vertex as usize);
        all().zip(0u32..).for_each(|(vertex, place)| places[vertex] = place);
        shares.clear();
        shares.extend(all().map(|vertex| self.shares[vertex]));
        neighbours.clear();
        starts.clear();
        starts.push(0);
        for vertex in all() {
            let around = self.topology.neighbours(vertex).iter().map(|&other| other as usize);
            neighbours.extend(around.filter(|&other| sides[other] != Side::Outside).map(|other| places[other]));
            starts.push(neighbours.len() as u32);
        }
    }

    /// Blocks of the diagonal, their inverses, and the right-hand side as first residual.
    fn prepare(&mut self, stiffness: Stiffness, pushes: &[Push], pulls: &[Pull]) {
        let Scratch { region, places, inverse, block, residual, .. } = &mut self.scratch;
        block.clear();
        block.resize(region.len(), Mat3::from_diagonal(Vec3::splat(stiffness.damping)));
        residual.clear();
        residual.resize(region.len(), Vec3::ZERO);
        for push in pushes {
            let i = places[push.vertex as usize] as usize;
            let weighted = push.weight * push.normal;
            block[i] += Mat3::from_cols(weighted * push.normal.x, weighted * push.normal.y, weighted * push.normal.z);
            residual[i] += push.gap * weighted;
        }
        for pull in pulls {
            let i = places[pull.vertex as usize] as usize;
            block[i] += Mat3::from_diagonal(Vec3::splat(pull.weight));
            residual[i] += pull.weight * pull.offset;
        }
        inverse.clear();
        inverse.extend(region.iter().zip(&*block).map(|(&vertex, block)| {
            let smooth = stiffness.smooth * self.diagonal[vertex as usize];
            (*block + Mat3::from_diagonal(Vec3::splat(smooth))).inverse()
        }));
    }

    fn iterate(&mut self, smooth: f64, accuracy: f64, warp: &mut [Vec3]) -> usize {
        let Scratch {
            region,
            ring,
            starts,
            neighbours,
            shares,
            inverse,
            block,
            residual,
            preconditioned,
            image,
            direction,
            bent,
            shared,
            ..
        } = &mut self.scratch;
        let (count, all) = (region.len(), region.len() + ring.len());
        [&mut *preconditioned, image].into_iter().for_each(|vector| vector.resize(count, Vec3::ZERO));
        [&mut *direction, bent, shared].into_iter().for_each(|vector| vector.resize(all, Vec3::ZERO));
        direction[count..].fill(Vec3::ZERO);
        let around = |i: usize| &neighbours[starts[i] as usize..starts[i + 1] as usize];
        let wanted = accuracy * accuracy * residual.iter().map(|left| left.length_squared()).sum::<f64>();
        let mut product = 0.0;
        for i in 0..count {
            direction[i] = inverse[i] * residual[i];
            product += direction[i].dot(residual[i]);
        }
        for iteration in 1..=MAX_ITERATIONS {
            let mut curvature = 0.0;
            for i in 0..all {
                let sum: Vec3 = around(i).iter().map(|&j| direction[j as usize]).sum();
                bent[i] = direction[i] - shares[i] * sum;
                shared[i] = shares[i] * bent[i];
            }
            for i in 0..count {
                let mut sum = bent[i];
                for &j in around(i) {
                    sum -= shared[j as usize];
                }
                image[i] = smooth * sum + block[i] * direction[i];
                curvature += image[i].dot(direction[i]);
            }
            if curvature <= 0.0 {
                return iteration;
            }
            let step = product / curvature;
            let (mut left, mut next) = (0.0, 0.0);
            for i in 0..count {
                warp[region[i] as usize] += step * direction[i];
                residual[i] -= step * image[i];
                preconditioned[i] = inverse[i] * residual[i];
                left += residual[i].length_squared();
                next += residual[i].dot(preconditioned[i]);
            }
            if left <= wanted {
                return iteration;
            }
            let keep = next / product;
            product = next;
            for i in 0..count {
                direction[i] = preconditioned[i] + keep * direction[i];
            }
        }
        MAX_ITERATIONS
    }
}

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
