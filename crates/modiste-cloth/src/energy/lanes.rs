//! The membrane for eight triangles at once, in f32: what the solver runs. [`Membrane`] is the same in plain form.

use super::Membrane;
use crate::material::Stretch;
use glam::Mat3A;
use modiste_core::Vec3;
use std::ops::{Add, Mul, Neg, Sub};

/// Triangles handled together.
pub(crate) const WIDTH: usize = 8;

/// One number for each of the triangles. Loops over the array become vector instructions.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Lanes([f32; WIDTH]);

/// Three numbers for each of the triangles.
type Lanes3 = [Lanes; 3];

impl Lanes {
    const ZERO: Self = Self([0.0; WIDTH]);

    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self([value; WIDTH])
    }

    #[inline(always)]
    fn map(self, f: impl Fn(f32) -> f32) -> Self {
        Self(self.0.map(f))
    }

    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        let mut out = self;
        for lane in 0..WIDTH {
            out.0[lane] = f(self.0[lane], other.0[lane]);
        }
        out
    }

    /// The positive part.
    #[inline(always)]
    fn ramp(self) -> Self {
        self.map(|x| if x > 0.0 { x } else { 0.0 })
    }

    /// One where positive, else zero.
    #[inline(always)]
    fn step(self) -> Self {
        self.map(|x| if x > 0.0 { 1.0 } else { 0.0 })
    }
}

impl Add for Lanes {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl Sub for Lanes {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}

impl Mul for Lanes {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
}

impl Mul<f32> for Lanes {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f32) -> Self {
        self.map(|a| a * factor)
    }
}

impl Neg for Lanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|a| -a)
    }
}

#[inline(always)]
fn dot(a: &Lanes3, b: &Lanes3) -> Lanes {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Symmetric 3×3 numbers as `(xx, xy, xz, yy, yz, zz)`.
type Symmetric = [Lanes; 6];

/// Moduli of the law in f32.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LaneLaw {
    base: [f32; 4],
    stiffening: [f32; 4],
    limit: f32,
    limit_stiffness: f32,
    /// What weft and warp resist less of a compression than of a stretch, as a share.
    slack: f32,
    viscosity: f32,
}

impl LaneLaw {
    /// The law with material damping: relaxation time over the length of the step.
    #[expect(clippy::cast_possible_truncation, reason = "the inner solve runs in f32")]
    pub(crate) fn new(law: &Stretch, viscosity: f64) -> Self {
        let [weft, warp, bias] = law.stiffening.map(|b| b as f32);
        let limit = if law.limit.is_finite() { 0.5 * (law.limit * law.limit - 1.0) } else { 1e3 };
        Self {
            base: [law.weft as f32, law.cross as f32, law.warp as f32, 0.25 * law.shear as f32],
            stiffening: [weft, warp, bias, bias],
            limit: limit as f32,
            limit_stiffness: law.limit_stiffness as f32,
            slack: (1.0 - law.compression) as f32,
            viscosity: viscosity as f32,
        }
    }

    /// Stress and tangent `(11, 12, 13, 22, 23, 33)` as [`Stretch::stress_and_tangent`].
    #[inline(always)]
    fn stress_and_tangent(&self, e: &Lanes3) -> (Lanes3, Symmetric) {
        let [weft, cross, warp, shear] = self.base;
        let [e1, e2, g] = *e;
        let mean = (e1 + e2) * 0.5;
        let yarns = [e1, e2, mean + g * 0.5, mean - g * 0.5];
        let mut tension = [Lanes::ZERO; 4];
        let mut slope = [Lanes::ZERO; 4];
        for yarn in 0..4 {
            let stretched = yarns[yarn].ramp();
            let beyond = yarns[yarn] - Lanes::splat(self.limit);
            slope[yarn] = stretched * self.stiffening[yarn] + beyond.step() * self.limit_stiffness;
            tension[yarn] =
                stretched * stretched * (0.5 * self.stiffening[yarn]) + beyond.ramp() * self.limit_stiffness;
        }
        let bias = (tension[2] + tension[3]) * 0.5;
        let borne = [e1, e2].map(|e| e + (-e).ramp() * self.slack);
        let share = [e1, e2].map(|e| Lanes::splat(1.0) - (-e).step() * self.slack);
        let stress = [
            borne[0] * weft + e2 * cross + tension[0] + bias,
            e1 * cross + borne[1] * warp + tension[1] + bias,
            g * shear + (tension[2] - tension[3]) * 0.5,
        ];
        let both = (slope[2] + slope[3]) * 0.25;
        let skew = (slope[2] - slope[3]) * 0.25;
        let tangent = [
            slope[0] + both + share[0] * weft,
            both + Lanes::splat(cross),
            skew,
            slope[1] + both + share[1] * warp,
            skew,
            both + Lanes::splat(shear),
        ];
        (stress, tangent)
    }
}

/// The membrane elements of up to eight triangles.
#[derive(Debug, Clone)]
pub(crate) struct MembraneLanes {
    vertices: [[u32; 3]; WIDTH],
    /// Gradients of the shape functions of the second and the third corner.
    gradients: [[Lanes; 2]; 2],
    area: Lanes,
    count: usize,
}

/// Forces and stiffness of eight triangles.
#[derive(Debug)]
pub(crate) struct LaneForces {
    /// Forces on the second and the third corner; the first takes the opposite of their sum.
    forces: [Lanes3; 2],
    /// Stiffness of the second corner, of the third, and between them (row major).
    second: Symmetric,
    third: Symmetric,
    between: [Lanes; 9],
}

impl MembraneLanes {
    /// Packs elements by eight, in order.
    pub(crate) fn pack(membranes: &[Membrane]) -> Vec<Self> {
        membranes.chunks(WIDTH).map(Self::new).collect()
    }

    #[expect(clippy::cast_possible_truncation, reason = "the inner solve runs in f32")]
    fn new(membranes: &[Membrane]) -> Self {
        let mut lanes = Self {
            vertices: [membranes[0].vertices; WIDTH],
            gradients: [[Lanes::ZERO; 2]; 2],
            area: Lanes::ZERO,
            count: membranes.len(),
        };
        for (lane, membrane) in membranes.iter().enumerate() {
            lanes.vertices[lane] = membrane.vertices;
            lanes.area.0[lane] = membrane.area as f32;
            for corner in 0..2 {
                let gradient = membrane.gradients[corner + 1];
                lanes.gradients[corner][0].0[lane] = gradient.x as f32;
                lanes.gradients[corner][1].0[lane] = gradient.y as f32;
            }
        }
        lanes
    }

    /// Corners of the triangles in use.
    pub(crate) fn vertices(&self) -> &[[u32; 3]] {
        &self.vertices[..self.count]
    }

    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "the inner solve runs in f32")]
    fn deformation(&self, x: &[Vec3]) -> [Lanes3; 2] {
        let mut edges = [[Lanes::ZERO; 3]; 2];
        for (lane, corners) in self.vertices.iter().enumerate() {
            let [a, b, c] = corners.map(|v| x[v as usize]);
            for (edge, offset) in edges.iter_mut().zip([b - a, c - a]) {
                edge[0].0[lane] = offset.x as f32;
                edge[1].0[lane] = offset.y as f32;
                edge[2].0[lane] = offset.z as f32;
            }
        }
        let [m, n] = edges;
        let [g, h] = self.gradients;
        let column = |k: usize| [0, 1, 2].map(|axis: usize| m[axis] * g[k] + n[axis] * h[k]);
        [column(0), column(1)]
    }

    /// Forces and stiffness where the vertices go from `start` to `x`, as [`Membrane::force`].
    #[inline]
    pub(crate) fn force(&self, law: &LaneLaw, start: &[Vec3], x: &[Vec3]) -> LaneForces {
        let strain = |[u, v]: &[Lanes3; 2]| {
            let half = |w: &Lanes3| (dot(w, w) - Lanes::splat(1.0)) * 0.5;
            [half(u), half(v), dot(u, v)]
        };
        let before = strain(&self.deformation(start));
        let [u, v] = self.deformation(x);
        let now = strain(&[u, v]);
        let (mut stress, t) = law.stress_and_tangent(&now);
        let rate = [0, 1, 2].map(|a: usize| (now[a] - before[a]) * law.viscosity);
        stress[0] = stress[0] + t[0] * rate[0] + t[1] * rate[1] + t[2] * rate[2];
        stress[1] = stress[1] + t[1] * rate[0] + t[3] * rate[1] + t[4] * rate[2];
        stress[2] = stress[2] + t[2] * rate[0] + t[4] * rate[1] + t[5] * rate[2];
        let forces = self.gradients.map(|[nx, ny]| {
            let along = -(stress[0] * nx + stress[2] * ny) * self.area;
            let across = -(stress[1] * ny + stress[2] * nx) * self.area;
            [0, 1, 2].map(|axis: usize| u[axis] * along + v[axis] * across)
        });
        let damped = self.area * (1.0 + law.viscosity);
        let c = t.map(|value| value * damped);
        let p = tension(&stress).map(|value| value * self.area);
        let [second, third] = [0, 1].map(|k: usize| {
            let block = couple(&u, &v, &self.gradients[k], &self.gradients[k], &c, &p);
            [block[0], block[1], block[2], block[4], block[5], block[8]]
        });
        let between = couple(&u, &v, &self.gradients[0], &self.gradients[1], &c, &p);
        LaneForces { forces, second, third, between }
    }
}

impl LaneForces {
    /// Forces (N) on the three corners of one triangle.
    #[inline]
    pub(crate) fn corner_forces(&self, lane: usize) -> [Vec3; 3] {
        let [b, c] = self.forces.map(|f| Vec3::from_array(f.map(|axis| f64::from(axis.0[lane]))));
        [-b - c, b, c]
    }

    /// Stiffness blocks of one triangle in the order of `BLOCK_CORNERS`.
    #[inline]
    pub(crate) fn blocks(&self, lane: usize) -> [Mat3A; 6] {
        let symmetric = |s: &Symmetric| {
            let [a, b, c, d, e, f] = s.map(|value| value.0[lane]);
            Mat3A::from_cols(glam::Vec3A::new(a, b, c), glam::Vec3A::new(b, d, e), glam::Vec3A::new(c, e, f))
        };
        let (second, third) = (symmetric(&self.second), symmetric(&self.third));
        let m = self.between.map(|value| value.0[lane]);
        let between = Mat3A::from_cols(
            glam::Vec3A::new(m[0], m[3], m[6]),
            glam::Vec3A::new(m[1], m[4], m[7]),
            glam::Vec3A::new(m[2], m[5], m[8]),
        );
        // Rows sum to zero: a shift of the whole triangle costs nothing.
        let first_second = -(second + between.transpose());
        let third_first = -(between.transpose() + third);
        let first = -(first_second + third_first.transpose());
        [first, second, third, first_second, between, third_first]
    }
}

/// `A (B_aᵀ C B_b)` in terms of `u` and `v`, plus the geometric part; row major.
#[inline(always)]
fn couple(u: &Lanes3, v: &Lanes3, a: &[Lanes; 2], b: &[Lanes; 2], c: &Symmetric, p: &Lanes3) -> [Lanes; 9] {
    let [c11, c12, c13, c22, c23, c33] = *c;
    let rows = [
        [a[0] * c11 + a[1] * c13, a[0] * c12 + a[1] * c23, a[0] * c13 + a[1] * c33],
        [a[1] * c12 + a[0] * c13, a[1] * c22 + a[0] * c23, a[1] * c23 + a[0] * c33],
    ];
    let d = rows.map(|[r1, r2, r3]| [r1 * b[0] + r3 * b[1], r2 * b[1] + r3 * b[0]]);
    let geometric = a[0] * (p[0] * b[0] + p[2] * b[1]) + a[1] * (p[2] * b[0] + p[1] * b[1]);
    let left = [0, 1, 2].map(|k: usize| u[k] * d[0][0] + v[k] * d[0][1]);
    let right = [0, 1, 2].map(|k: usize| u[k] * d[1][0] + v[k] * d[1][1]);
    let mut block = [Lanes::ZERO; 9];
    for row in 0..3 {
        for column in 0..3 {
            block[3 * row + column] = u[row] * left[column] + v[row] * right[column];
        }
        block[4 * row] = block[4 * row] + geometric;
    }
    block
}

/// The positive semidefinite part of a symmetric 2×2 stress `(11, 22, 12)`.
#[inline(always)]
fn tension(stress: &Lanes3) -> Lanes3 {
    let [a, b, c] = *stress;
    let mean = (a + b) * 0.5;
    let half = (a - b) * 0.5;
    let radius = (half * half + c * c).map(f32::sqrt);
    let low = mean - radius;
    let high = (mean + radius).ramp();
    // Keep the larger principal stress alone where the smaller one is compressive.
    let scale = high.zip(radius, |high, radius| high / (2.0 * radius).max(1e-20));
    let mixed = low.step();
    let pick = |whole: Lanes, part: Lanes| mixed.zip(whole.zip(part, |w, p| w - p), |m, d| m * d) + part;
    [pick(a, scale * (a - low)), pick(b, scale * (b - low)), pick(c, scale * c)]
}

#[cfg(test)]
mod tests {
    use super::{LaneLaw, MembraneLanes};
    use crate::energy::{Membrane, Viscosity};
    use crate::material::Fabric;
    use modiste_core::{Rng, Vec2, Vec3, seeded_rng, uniform};

    fn random(rng: &mut Rng, size: f64) -> f64 {
        size * (2.0 * uniform(rng) - 1.0)
    }

    #[test]
    fn lanes_agree_with_the_plain_element() {
        let mut rng = seeded_rng(5);
        for fabric in Fabric::all() {
            let mut membranes = Vec::new();
            let (mut start, mut x) = (Vec::new(), Vec::new());
            for face in 0..11u32 {
                let mut at = |p: Vec2| p + Vec2::new(random(&mut rng, 0.002), random(&mut rng, 0.002));
                let rest = [at(Vec2::ZERO), at(Vec2::new(0.012, 0.0)), at(Vec2::new(0.005, 0.011))];
                let corners = [0, 1, 2].map(|k| 3 * face + k);
                membranes.push(Membrane::new(face as usize, corners, &rest).unwrap());
                let size = 0.0004 * f64::from(face);
                for p in rest {
                    let mut shaken = || {
                        p.extend(0.7)
                            + Vec3::new(random(&mut rng, size), random(&mut rng, size), random(&mut rng, size))
                    };
                    start.push(shaken());
                    x.push(shaken());
                }
            }
            let law = LaneLaw::new(&fabric.stretch, 0.8);
            for (chunk, lanes) in membranes.chunks(8).zip(MembraneLanes::pack(&membranes)) {
                assert_eq!(lanes.vertices().len(), chunk.len());
                let got = lanes.force(&law, &start, &x);
                for (lane, membrane) in chunk.iter().enumerate() {
                    let viscosity = Viscosity { ratio: 0.8, start: membrane.strain(&start) };
                    let want = membrane.force(&fabric.stretch, &viscosity, &x);
                    // The rounding of a strain of one, carried by the stiffest modulus.
                    let scale: f64 = want.forces.iter().map(|f| f.length()).sum::<f64>() + 1e-3;
                    for (got, want) in got.corner_forces(lane).iter().zip(want.forces) {
                        assert!((*got - want).length() < 2e-4 * scale, "{got} {want}");
                    }
                    let scale: f32 = want.blocks.iter().map(|b| b.x_axis.length() + b.y_axis.length()).sum();
                    for (got, want) in got.blocks(lane).into_iter().zip(want.blocks) {
                        let off = got - want;
                        assert!(off.x_axis.length() + off.y_axis.length() + off.z_axis.length() < 1e-3 * scale);
                    }
                }
            }
        }
    }
}
