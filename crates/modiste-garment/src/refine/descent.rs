//! Conjugate gradients for the warp, in f32.

use rayon::prelude::*;

use super::lanes::{Lanes, dot};

/// Vertices that one thread takes at a time. Sums are taken chunk by chunk, so that they do not depend on the threads.
const CHUNK: usize = 1024;

/// Far more than the blocks of the diagonal ever need.
pub(crate) const MAX_ITERATIONS: usize = 300;

/// What is solved, in the numbers of a [`Region`](super::region::Region): `λ_s LᵀL + λ_d`, and a block for each of the first
/// vertices.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Normal<'a> {
    /// λ_s.
    pub(crate) smooth: f32,
    /// λ_d.
    pub(crate) damping: f32,
    /// Where the neighbours of each vertex begin, and the end of the last.
    pub(crate) starts: &'a [u32],
    pub(crate) neighbours: &'a [u32],
    /// One over the number of all neighbours.
    pub(crate) shares: &'a [f32],
    /// The blocks, with the damping, and the inverses of the whole blocks of the diagonal.
    pub(crate) columns: &'a [[Lanes; 3]],
    pub(crate) inverse_columns: &'a [[Lanes; 3]],
    /// One over the diagonal, of the vertices that have no block.
    pub(crate) inverse: &'a [f32],
}

impl Normal<'_> {
    #[inline(always)]
    fn around(&self, i: usize) -> impl Iterator<Item = usize> {
        self.neighbours[self.starts[i] as usize..self.starts[i + 1] as usize].iter().map(|&j| j as usize)
    }

    /// Of every vertex L of the direction, times the share of the vertex: what its neighbours have of it.
    fn bend(&self, direction: &[Lanes], bent: &mut [Lanes]) {
        bent.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, bent)| {
            for (i, bent) in (chunk * CHUNK..).zip(bent) {
                let sum = self.around(i).fold(Lanes::ZERO, |sum, j| sum.plus(direction[j]));
                *bent = direction[i].minus(sum.times(self.shares[i])).times(self.shares[i]);
            }
        });
    }

    /// The image of the direction, and their product.
    fn apply(&self, direction: &[Lanes], bent: &[Lanes], image: &mut [Lanes], sums: &mut [[f64; 2]]) -> f32 {
        image.par_chunks_mut(CHUNK).zip(&mut *sums).enumerate().for_each(|(chunk, (image, sums))| {
            let first = chunk * CHUNK;
            for (i, image) in (first..).zip(&mut *image) {
                let own = bent[i].times(1.0 / self.shares[i]);
                let sum = self.around(i).fold(own, |sum, j| sum.minus(bent[j]));
                let held = match self.columns.get(i) {
                    Some(columns) => direction[i].through(columns),
                    None => direction[i].times(self.damping),
                };
                *image = held.plus(sum.times(self.smooth));
            }
            sums[0] = dot(image, &direction[first..]);
        });
        sums.iter().map(|sums| sums[0]).sum::<f64>() as f32
    }

    fn precondition(&self, i: usize, residual: Lanes) -> Lanes {
        match self.inverse_columns.get(i) {
            Some(columns) => residual.through(columns),
            None => residual.times(self.inverse[i - self.inverse_columns.len()]),
        }
    }
}

/// Memory of the iterations.
#[derive(Debug, Clone, Default)]
pub(crate) struct Descent {
    step: Vec<Lanes>,
    residual: Vec<Lanes>,
    preconditioned: Vec<Lanes>,
    image: Vec<Lanes>,
    /// Zero in the ring around the region.
    direction: Vec<Lanes>,
    bent: Vec<Lanes>,
    /// Sums over each chunk.
    sums: Vec<[f64; 2]>,
}

impl Descent {
    /// What the last run has found.
    pub(crate) fn step(&self) -> &[Lanes] {
        &self.step
    }

    /// Finds the step for a right-hand side of unit length, to a residual of `share`. Returns the number of iterations.
    pub(crate) fn run(&mut self, system: &Normal<'_>, right: impl Iterator<Item = Lanes>, share: f64) -> usize {
        self.residual.clear();
        self.residual.extend(right);
        let (count, all) = (self.residual.len(), system.shares.len());
        self.step.clear();
        self.step.resize(count, Lanes::ZERO);
        [&mut self.preconditioned, &mut self.image].into_iter().for_each(|vector| vector.resize(count, Lanes::ZERO));
        [&mut self.direction, &mut self.bent].into_iter().for_each(|vector| vector.resize(all, Lanes::ZERO));
        self.direction[count..].fill(Lanes::ZERO);
        self.sums.resize(count.div_ceil(CHUNK), [0.0; 2]);
        let wanted = (share * share) as f32;
        let [_, mut product] = self.descend(system, 0.0);
        self.direction[..count].copy_from_slice(&self.preconditioned);
        for iteration in 1..=MAX_ITERATIONS {
            system.bend(&self.direction, &mut self.bent);
            let curvature = system.apply(&self.direction, &self.bent, &mut self.image, &mut self.sums);
            if curvature <= 0.0 {
                return iteration;
            }
            let [left, next] = self.descend(system, product / curvature);
            if left <= wanted {
                return iteration;
            }
            let keep = next / product;
            product = next;
            for (direction, preconditioned) in self.direction.iter_mut().zip(&self.preconditioned) {
                *direction = preconditioned.plus(direction.times(keep));
            }
        }
        MAX_ITERATIONS
    }

    /// Goes some length along the direction. Returns the square of the residual, and its product with the preconditioned one.
    fn descend(&mut self, system: &Normal<'_>, length: f32) -> [f32; 2] {
        let Self { step, residual, preconditioned, image, direction, sums, .. } = self;
        let (direction, image) = (&*direction, &*image);
        let chunks = step.par_chunks_mut(CHUNK).zip(residual.par_chunks_mut(CHUNK));
        let chunks = chunks.zip(preconditioned.par_chunks_mut(CHUNK)).zip(&mut *sums).enumerate();
        chunks.for_each(|(chunk, (((step, residual), preconditioned), sums))| {
            let first = chunk * CHUNK;
            for (at, (step, residual)) in step.iter_mut().zip(&mut *residual).enumerate() {
                let i = first + at;
                *step = step.plus(direction[i].times(length));
                *residual = residual.minus(image[i].times(length));
                preconditioned[at] = system.precondition(i, *residual);
            }
            *sums = [dot(residual, residual), dot(residual, preconditioned)];
        });
        [0, 1].map(|which| sums.iter().map(|sums| sums[which]).sum::<f64>() as f32)
    }
}
