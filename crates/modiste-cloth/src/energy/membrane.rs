//! Stretch and shear of one triangle.

use crate::error::ClothError;
use crate::material::{Stretch, Voigt};
use glam::{Mat3A, Vec3A};
use modiste_core::{Vec2, Vec3};

/// The membrane element of one triangle: linear shape functions over its rest shape in panel space.
///
/// `F = Σ x_i N_iᵀ` (3×2) maps panel space to the world, `E = (FᵀF - I)/2` is the strain and `A W(E)` the energy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Membrane {
    /// The corners.
    pub vertices: [u32; 3],
    /// Gradients `N_i` of the shape functions in panel space (1/m).
    pub gradients: [Vec2; 3],
    /// Rest area (m²).
    pub area: f64,
}

/// Material damping over one step: the stress grows by `ratio · tangent · (strain - start)`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Viscosity {
    /// Relaxation time over the length of the step.
    pub(crate) ratio: f64,
    /// Strain at the start of the step.
    pub(crate) start: Voigt,
}

/// Force and stiffness of one membrane element.
#[cfg_attr(not(test), expect(dead_code, reason = "read where the eight-wide kernel is tested against the plain one"))]
#[derive(Debug, Clone, Copy)]
pub(crate) struct MembraneForce {
    /// Force on each corner (N).
    pub(crate) forces: [Vec3; 3],
    /// Stiffness blocks `∂²(A W)/∂x_i ∂x_j` (N/m) for (0,0), (1,1), (2,2), (0,1), (1,2), (2,0), definite as a whole.
    pub(crate) blocks: [Mat3A; 6],
}

/// Corner pairs of [`MembraneForce::blocks`].
pub(crate) const BLOCK_CORNERS: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [0, 1], [1, 2], [2, 0]];

/// Rest areas below this (m²) are refused: a tenth of a millimetre squared.
const MIN_AREA: f64 = 1e-8;

impl Membrane {
    /// Prepares the element of `face` from the corners of its rest shape in panel space (m), counter-clockwise.
    ///
    /// # Errors
    /// [`ClothError::DegenerateFace`] if the rest area is not positive.
    pub fn new(face: usize, vertices: [u32; 3], rest: &[Vec2; 3]) -> Result<Self, ClothError> {
        let double_area = (rest[1] - rest[0]).perp_dot(rest[2] - rest[0]);
        let area = 0.5 * double_area;
        if area.is_nan() || area < MIN_AREA {
            return Err(ClothError::DegenerateFace { face, area });
        }
        // The gradient of a corner's shape function is its opposite edge turned inwards, over twice the area.
        let gradient = |a: Vec2, b: Vec2| (b - a).perp() / double_area;
        let gradients = [gradient(rest[1], rest[2]), gradient(rest[2], rest[0]), gradient(rest[0], rest[1])];
        Ok(Self { vertices, gradients, area })
    }

    /// The columns of the deformation gradient: images of the weft and the warp direction.
    #[inline]
    pub fn deformation(&self, x: &[Vec3]) -> [Vec3; 2] {
        let [a, b, c] = self.vertices.map(|v| x[v as usize]);
        let [m, n] = [b - a, c - a];
        let [g, h] = [self.gradients[1], self.gradients[2]];
        [m * g.x + n * h.x, m * g.y + n * h.y]
    }

    /// Green strain `(E11, E22, 2 E12)`.
    #[inline]
    pub fn strain(&self, x: &[Vec3]) -> Voigt {
        let [u, v] = self.deformation(x);
        [0.5 * (u.length_squared() - 1.0), 0.5 * (v.length_squared() - 1.0), u.dot(v)]
    }

    /// Energy (J).
    pub fn energy(&self, law: &Stretch, x: &[Vec3]) -> f64 {
        self.area * law.energy(&self.strain(x))
    }

    /// Forces and stiffness at `x`, with material damping.
    ///
    /// The stiffness keeps the whole material part and the part of the geometric stiffness due to tension; under compression
    /// the geometric part is indefinite (that is buckling) and left out.
    #[cfg_attr(not(test), expect(dead_code, reason = "the plain road that the eight-wide kernel is tested against"))]
    #[inline]
    pub(crate) fn force(&self, law: &Stretch, viscosity: &Viscosity, x: &[Vec3]) -> MembraneForce {
        let [u, v] = self.deformation(x);
        let strain = [0.5 * (u.length_squared() - 1.0), 0.5 * (v.length_squared() - 1.0), u.dot(v)];
        let (elastic, mut tangent) = law.stress_and_tangent(&strain);
        let rate: Voigt = std::array::from_fn(|a| viscosity.ratio * (strain[a] - viscosity.start[a]));
        let stress: Voigt = std::array::from_fn(|a| {
            elastic[a] + tangent[a][0] * rate[0] + tangent[a][1] * rate[1] + tangent[a][2] * rate[2]
        });
        let damped = self.area * (1.0 + viscosity.ratio);
        for row in &mut tangent {
            for value in row {
                *value *= damped;
            }
        }
        let forces = self
            .gradients
            .map(|n| (u * (stress[0] * n.x + stress[2] * n.y) + v * (stress[1] * n.y + stress[2] * n.x)) * -self.area);
        let [p, q, r] = tension(&stress);
        let [u32, v32] = [u, v].map(|w| w.as_vec3a());
        let blocks = BLOCK_CORNERS.map(|[i, j]| {
            let (a, b) = (self.gradients[i], self.gradients[j]);
            // B_iᵀ C B_j with the strain derivatives B_i = [[a.x, 0], [0, a.y], [a.y, a.x]] in terms of u and v.
            let c = &tangent;
            let [c0, c1] = [0, 1, 2].iter().fold([[0.0; 3]; 2], |mut rows, &k| {
                rows[0][k] = a.x * c[0][k] + a.y * c[2][k];
                rows[1][k] = a.y * c[1][k] + a.x * c[2][k];
                rows
            });
            let [uu, uv] = [c0[0] * b.x + c0[2] * b.y, c0[1] * b.y + c0[2] * b.x];
            let [vu, vv] = [c1[0] * b.x + c1[2] * b.y, c1[1] * b.y + c1[2] * b.x];
            let geometric = self.area * (a.x * (p * b.x + r * b.y) + a.y * (r * b.x + q * b.y));
            stiffness_block(u32, v32, [[uu, uv], [vu, vv]], geometric)
        });
        MembraneForce { forces, blocks }
    }
}

/// `u (d00 u + d01 v)ᵀ + v (d10 u + d11 v)ᵀ + s I`.
#[inline]
#[expect(clippy::cast_possible_truncation, reason = "the inner solve runs in f32")]
fn stiffness_block(u: Vec3A, v: Vec3A, d: [[f64; 2]; 2], s: f64) -> Mat3A {
    let left = u * d[0][0] as f32 + v * d[0][1] as f32;
    let right = u * d[1][0] as f32 + v * d[1][1] as f32;
    let s = s as f32;
    Mat3A::from_cols(
        u * left.x + v * right.x + Vec3A::new(s, 0.0, 0.0),
        u * left.y + v * right.y + Vec3A::new(0.0, s, 0.0),
        u * left.z + v * right.z + Vec3A::new(0.0, 0.0, s),
    )
}

/// The positive semidefinite part `(P11, P22, P12)` of a symmetric 2×2 stress `(S11, S22, S12)`.
#[inline]
fn tension(stress: &Voigt) -> Voigt {
    let [a, b, c] = *stress;
    let mean = 0.5 * (a + b);
    let radius = (0.25 * (a - b) * (a - b) + c * c).sqrt();
    if mean >= radius {
        return *stress;
    }
    let high = mean + radius;
    if high <= 0.0 {
        return [0.0; 3];
    }
    // high > 0 > low: keep high q qᵀ = high (S - low I)/(high - low).
    let scale = high / (2.0 * radius);
    let low = mean - radius;
    [scale * (a - low), scale * (b - low), scale * c]
}

#[cfg(test)]
mod tests {
    use super::{BLOCK_CORNERS, Membrane, Viscosity, tension};
    use crate::material::Fabric;
    use modiste_core::{Mat3, Quat, Vec2, Vec3};

    const REST: [Vec2; 3] = [Vec2::new(0.01, 0.0), Vec2::new(0.024, 0.003), Vec2::new(0.012, 0.011)];
    const ELASTIC: Viscosity = Viscosity { ratio: 0.0, start: [0.0; 3] };

    /// Both directions in tension, away from the kinks of the law, where the stiffness is the whole second derivative.
    fn stretched() -> Vec<Vec3> {
        let turn = Quat::from_scaled_axis(Vec3::new(0.4, -0.3, 0.9));
        let stretch = Mat3::from_cols(Vec3::new(1.03, 0.02, 0.1), Vec3::new(-0.01, 1.02, 0.05), Vec3::Z);
        REST.iter().map(|p| turn * (stretch * p.extend(0.0)) + Vec3::new(0.3, 1.2, -0.1)).collect()
    }

    #[test]
    fn forces_are_minus_the_gradient_and_blocks_the_second_derivative() {
        let element = Membrane::new(0, [0, 1, 2], &REST).unwrap();
        let step = 1e-7;
        for fabric in Fabric::all() {
            let x = stretched();
            let result = element.force(&fabric.stretch, &ELASTIC, &x);
            for (block, [i, j]) in BLOCK_CORNERS.into_iter().enumerate() {
                for axis in 0..3 {
                    let mut up = x.clone();
                    let mut down = x.clone();
                    up[j][axis] += step;
                    down[j][axis] -= step;
                    let slope =
                        (element.energy(&fabric.stretch, &up) - element.energy(&fabric.stretch, &down)) / (2.0 * step);
                    assert!((slope + result.forces[j][axis]).abs() < 2e-6 * (1.0 + slope.abs()), "{}", fabric.name);
                    let high = element.force(&fabric.stretch, &ELASTIC, &up).forces[i];
                    let low = element.force(&fabric.stretch, &ELASTIC, &down).forces[i];
                    let column = (low - high) / (2.0 * step);
                    let got = result.blocks[block].col(axis).as_dvec3();
                    assert!((column - got).length() < 2e-3 * (1.0 + column.length()), "{column} {got}");
                }
            }
        }
    }

    #[test]
    fn internal_forces_carry_no_momentum_and_turn_with_the_cloth() {
        let element = Membrane::new(0, [0, 1, 2], &REST).unwrap();
        let law = Fabric::jersey().stretch;
        let x = stretched();
        let viscosity = Viscosity { ratio: 0.7, start: [0.01, 0.0, -0.02] };
        let forces = element.force(&law, &viscosity, &x).forces;
        let scale: f64 = forces.iter().map(|f| f.length()).sum();
        let sum: Vec3 = forces.iter().sum();
        let torque: Vec3 = forces.iter().zip(&x).map(|(f, x)| x.cross(*f)).sum();
        assert!(sum.length() < 1e-12 * scale && torque.length() < 1e-12 * scale);
        let turn = Quat::from_scaled_axis(Vec3::new(-1.1, 0.2, 0.5));
        let moved: Vec<Vec3> = x.iter().map(|p| turn * *p + Vec3::new(5.0, -2.0, 1.0)).collect();
        for (turned, force) in element.force(&law, &viscosity, &moved).forces.iter().zip(forces) {
            assert!((*turned - turn * force).length() < 1e-11 * scale);
        }
    }

    #[test]
    fn tension_part_is_the_positive_part() {
        for stress in [[3.0, 1.0, 0.5], [-3.0, -1.0, 0.5], [2.0, -1.0, 0.7], [0.0, 0.0, 0.3], [0.0, 0.0, 0.0]] {
            let [a, b, c] = tension(&stress);
            assert!(a * b - c * c > -1e-12 && a + b > -1e-12);
            let [m, n, o] = [stress[0] - a, stress[1] - b, stress[2] - c];
            assert!(m * n - o * o > -1e-12 && m + n < 1e-12);
        }
    }

    #[test]
    fn clockwise_and_flat_faces_are_refused() {
        let [a, b, c] = REST;
        assert!(Membrane::new(7, [0, 1, 2], &[a, c, b]).unwrap_err().to_string().contains("face 7"));
        assert!(Membrane::new(7, [0, 1, 2], &[a, b, a.midpoint(b)]).is_err());
    }
}
