//! In-plane elasticity: an orthotropic base with yarn families that stiffen, and lock at a strain limit.

use crate::error::{ClothError, check_not_negative, check_positive};
use serde::{Deserialize, Serialize};

/// Green strain in Voigt order `(E11, E22, 2 E12)`, 1 = weft (x), 2 = warp (y).
pub type Voigt = [f64; 3];

/// How a fabric resists stretching in its plane. Moduli in N/m (force per width).
///
/// Energy density (J/m²) over Green strain `E = (FᵀF - I)/2`:
///
/// `W = ½(weft ⌊E11⌋² + 2 cross E11 E22 + warp ⌊E22⌋² + shear E12²) + Σ_d [ b_d/6 ⟨e_d⟩³ + ½ k ⟨e_d - e_limit⟩² ]`
///
/// with the yarn strain `e_d = dᵀE d` along weft, warp and the two bias directions, `⟨x⟩ = max(x, 0)`, and
/// `⌊x⌋² = x²` in tension and `compression · x²` in compression. The first part is the St. Venant-Kirchhoff law of Wang, Ramamoorthi and O'Brien 2011 at small strain; the cubic terms give
/// the stiffening that they measured as a potential (theirs looks the moduli up by strain, which has none); the last one is
/// the strain limit, where the yarns of a knit run straight.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Stretch {
    /// Modulus along the weft (x) at small strain (N/m).
    pub weft: f64,
    /// Modulus along the warp (y) at small strain (N/m).
    pub warp: f64,
    /// Cross modulus between weft and warp, the Poisson coupling (N/m).
    pub cross: f64,
    /// Modulus of `E12²` (N/m); four times the engineering shear modulus.
    pub shear: f64,
    /// Stiffening `b_d` along weft, warp and bias (N/m per unit of strain).
    pub stiffening: [f64; 3],
    /// Stretch (length over rest length) at which the yarns lock; infinite for none.
    pub limit: f64,
    /// Modulus `k` beyond the limit (N/m).
    pub limit_stiffness: f64,
    /// Share of `weft` and `warp` that resists compression: above 0, at most 1.
    ///
    /// Pressed cloth folds at next to no force, into folds finer than a mesh of centimetres can show. Triangles that resist
    /// like a plate instead lock in creases of one edge that stay wherever they first arose. This is the relaxed energy of
    /// tension field theory (Pipkin 1986), with a rest of stiffness that keeps triangles open.
    #[serde(default = "one")]
    pub compression: f64,
}

fn one() -> f64 {
    1.0
}

/// Coefficients of `e_d = n · (E11, E22, 2 E12)` for weft, warp and the two bias directions.
const YARNS: [[f64; 3]; 4] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.5, 0.5, 0.5], [0.5, 0.5, -0.5]];

/// Which stiffening belongs to each direction of [`YARNS`].
const YARN_KIND: [usize; 4] = [0, 1, 2, 2];

/// The largest share of `√(weft warp)` that the cross modulus may reach, so that the base stays definite.
const MAX_CROSS_SHARE: f64 = 0.9;

/// Share of a stretch by which slack cloth may draw in across it.
const MAX_CONTRACTION: f64 = 0.5;

/// Most rounds of Newton's method for a free strip.
const STRIP_ROUNDS: usize = 60;

/// Green strain of the outer rows of the measured table: a stretch of 7/6.
const TABLE_STRAIN: f64 = (49.0 / 36.0 - 1.0) / 2.0;

impl Stretch {
    /// A linear isotropic membrane with Young's modulus × thickness `young` (N/m) and Poisson ratio `poisson`, no limit.
    pub fn isotropic(young: f64, poisson: f64) -> Self {
        let plane = young / (1.0 - poisson * poisson);
        Self {
            weft: plane,
            warp: plane,
            cross: plane * poisson,
            shear: 2.0 * young / (1.0 + poisson),
            stiffening: [0.0; 3],
            limit: f64::INFINITY,
            limit_stiffness: 0.0,
            compression: 1.0,
        }
    }

    /// Fits the moduli to a stretching table of Wang, Ramamoorthi and O'Brien 2011.
    ///
    /// Columns are the moduli of `E11²`, `E11 E22`, `E22²`, `E12²`; the first row holds at zero strain, the others at a
    /// principal stretch of 7/6 in directions of 0, 22.5, 45, 67.5 and 90 degrees from the weft. As in the authors' ARCSim
    /// the values are doubled and negative ones count as zero. The stiffening is such that the stress along weft, bias and
    /// warp at that stretch is the measured one, where a non-negative stiffening can do so.
    pub fn from_table(table: &[[f64; 4]; 6]) -> Self {
        let row = |index: usize| table[index].map(|k| 2.0 * k.max(0.0));
        let [weft, cross, warp, shear] = row(0);
        let cross = cross.min(MAX_CROSS_SHARE * (weft * warp).sqrt());
        let e = TABLE_STRAIN;
        // Stress beyond the base law that the stiffening has to carry, over ½e², along weft, warp and bias.
        let weft_excess = (row(1)[0] - weft) * 2.0 / e;
        let warp_excess = (row(5)[2] - warp) * 2.0 / e;
        let bias_stiffness = |[k0, k1, k2, k3]: [f64; 4]| (k0 + 2.0 * k1 + k2 + k3) / 4.0;
        let bias_excess = (bias_stiffness(row(3)) - bias_stiffness([weft, cross, warp, shear])) * 2.0 / e;
        // A stretch e along weft strains both bias yarns by e/2: weft + bias/4 = weft_excess, warp likewise; one along
        // the bias strains weft and warp by e/2: bias + (weft + warp)/8 = bias_excess.
        let bias = ((bias_excess - (weft_excess + warp_excess) / 8.0) / (1.0 - 1.0 / 16.0)).max(0.0);
        let stiffening = [(weft_excess - bias / 4.0).max(0.0), (warp_excess - bias / 4.0).max(0.0), bias];
        Self { weft, warp, cross, shear, stiffening, limit: f64::INFINITY, limit_stiffness: 0.0, compression: 1.0 }
    }

    /// The same with yarns that lock at the stretch `limit` with modulus `stiffness` (N/m).
    pub fn with_limit(self, limit: f64, stiffness: f64) -> Self {
        Self { limit, limit_stiffness: stiffness, ..self }
    }

    /// The same with a share of the moduli left against compression, or more where the Poisson coupling asks for it: no
    /// stretch may draw the cloth in by more than [`MAX_CONTRACTION`] of itself. That keeps the law definite, too.
    pub fn with_compression(self, share: f64) -> Self {
        let least = self.cross.abs() / (MAX_CONTRACTION * self.weft.min(self.warp));
        Self { compression: share.max(least).min(1.0), ..self }
    }

    /// The moduli along weft and warp, as they are under these strains.
    fn moduli(&self, e1: f64, e2: f64) -> [f64; 2] {
        [(self.weft, e1), (self.warp, e2)].map(|(k, e)| if e < 0.0 { self.compression * k } else { k })
    }

    /// Energy density (J/m²).
    pub fn energy(&self, strain: &Voigt) -> f64 {
        let [e1, e2, g] = *strain;
        let [weft, warp] = self.moduli(e1, e2);
        let base = weft * e1 * e1 + 2.0 * self.cross * e1 * e2 + warp * e2 * e2 + 0.25 * self.shear * g * g;
        let limit = self.limit_strain();
        YARNS.iter().zip(YARN_KIND).fold(0.5 * base, |sum, (n, kind)| {
            let e = n[0] * e1 + n[1] * e2 + n[2] * g;
            let stretched = e.max(0.0);
            let beyond = (e - limit).max(0.0);
            sum + self.stiffening[kind] / 6.0 * stretched.powi(3) + 0.5 * self.limit_stiffness * beyond * beyond
        })
    }

    /// Stress `∂W/∂E` in Voigt order `(S11, S22, S12)` (N/m) and its derivative, symmetric and positive definite.
    pub fn stress_and_tangent(&self, strain: &Voigt) -> (Voigt, [[f64; 3]; 3]) {
        let [e1, e2, g] = *strain;
        let quarter_shear = 0.25 * self.shear;
        let [weft, warp] = self.moduli(e1, e2);
        let mut stress = [weft * e1 + self.cross * e2, self.cross * e1 + warp * e2, quarter_shear * g];
        let mut tangent = [[weft, self.cross, 0.0], [self.cross, warp, 0.0], [0.0, 0.0, quarter_shear]];
        let limit = self.limit_strain();
        for (n, kind) in YARNS.iter().zip(YARN_KIND) {
            let e = n[0] * e1 + n[1] * e2 + n[2] * g;
            if e <= 0.0 {
                continue;
            }
            let mut slope = self.stiffening[kind] * e;
            let mut tension = 0.5 * slope * e;
            if e > limit {
                tension += self.limit_stiffness * (e - limit);
                slope += self.limit_stiffness;
            }
            for a in 0..3 {
                stress[a] += tension * n[a];
                for b in 0..3 {
                    tangent[a][b] += slope * n[a] * n[b];
                }
            }
        }
        (stress, tangent)
    }

    /// Force per width (N/m) of a long strip cut at `angle` (rad) from the weft and pulled to `stretch` times its length, free to
    /// narrow and to shear: `λ ∂W/∂E_dd` where the energy is least over the other strains.
    pub fn strip_force(&self, angle: f64, stretch: f64) -> f64 {
        let (sin, cos) = angle.sin_cos();
        // Unit strains along the strip, across it, and of shear, in Voigt order.
        let along = [cos * cos, sin * sin, 2.0 * sin * cos];
        let free = [
            [sin * sin, cos * cos, -2.0 * sin * cos],
            [-2.0 * sin * cos, 2.0 * sin * cos, 2.0 * (2.0 * cos * cos - 1.0)],
        ];
        let pulled = 0.5 * (stretch * stretch - 1.0);
        let strain = |u: [f64; 2]| -> Voigt {
            std::array::from_fn(|i| pulled * along[i] + u[0] * free[0][i] + u[1] * free[1][i])
        };
        let dot = |a: &[f64; 3], b: &[f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let mut u = [0.0; 2];
        for _ in 0..STRIP_ROUNDS {
            let (stress, tangent) = self.stress_and_tangent(&strain(u));
            let slope = free.map(|v| dot(&stress, &v));
            let curved = free.map(|v| tangent.map(|row| dot(&row, &v)));
            let [a, b, d] = [dot(&curved[0], &free[0]), dot(&curved[0], &free[1]), dot(&curved[1], &free[1])];
            let determinant = a * d - b * b;
            let step = [(d * slope[0] - b * slope[1]) / determinant, (a * slope[1] - b * slope[0]) / determinant];
            // The energy is convex; half steps keep Newton's method from going back and forth over its kinks.
            let before = self.energy(&strain(u));
            let mut share = 1.0;
            let mut next = u;
            while share > 1e-9 {
                next = [u[0] - share * step[0], u[1] - share * step[1]];
                if self.energy(&strain(next)) <= before {
                    break;
                }
                share *= 0.5;
            }
            let moved = (next[0] - u[0]).abs() + (next[1] - u[1]).abs();
            u = next;
            if moved < 1e-13 {
                break;
            }
        }
        stretch * dot(&self.stress_and_tangent(&strain(u)).0, &along)
    }

    fn limit_strain(&self) -> f64 {
        0.5 * (self.limit * self.limit - 1.0)
    }

    pub(crate) fn check(&self) -> Result<(), ClothError> {
        check_positive("stretch.weft", self.weft)?;
        check_positive("stretch.warp", self.warp)?;
        check_positive("stretch.shear", self.shear)?;
        for stiffening in self.stiffening {
            check_not_negative("stretch.stiffening", stiffening)?;
        }
        check_not_negative("stretch.limit_stiffness", self.limit_stiffness)?;
        if !(self.compression > 0.0 && self.compression <= 1.0) {
            return Err(ClothError::Value {
                field: "stretch.compression",
                want: "above 0 and at most 1",
                found: self.compression,
            });
        }
        if self.cross.abs() >= (self.compression * self.weft * self.warp).sqrt() || self.cross.is_nan() {
            let want = "smaller than the geometric mean of weft and warp, times the root of the compression share";
            return Err(ClothError::Value { field: "stretch.cross", want, found: self.cross });
        }
        if self.limit <= 1.0 || self.limit.is_nan() {
            return Err(ClothError::Value { field: "stretch.limit", want: "above 1", found: self.limit });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::{MAX_CONTRACTION, Stretch, TABLE_STRAIN};
    use crate::material::Fabric;

    #[test]
    fn stress_and_tangent_are_derivatives_of_the_energy() {
        // Strains away from zero and from the limit, where the second derivative jumps.
        let step = 1e-6;
        for fabric in Fabric::all() {
            for strain in [[0.03, 0.02, 0.01], [-0.02, 0.015, -0.02], [0.09, -0.01, 0.07], [0.08, 0.09, 0.02]] {
                let (stress, tangent) = fabric.stretch.stress_and_tangent(&strain);
                for a in 0..3 {
                    let mut up = strain;
                    let mut down = strain;
                    up[a] += step;
                    down[a] -= step;
                    let slope = (fabric.stretch.energy(&up) - fabric.stretch.energy(&down)) / (2.0 * step);
                    assert!((slope - stress[a]).abs() < 1e-6 * (1.0 + stress[a].abs()), "{slope} {}", stress[a]);
                    let (high, _) = fabric.stretch.stress_and_tangent(&up);
                    let (low, _) = fabric.stretch.stress_and_tangent(&down);
                    for b in 0..3 {
                        let second = (high[b] - low[b]) / (2.0 * step);
                        assert!((second - tangent[b][a]).abs() < 1e-4 * (1.0 + second.abs()));
                    }
                }
            }
        }
    }

    #[test]
    fn the_fit_reproduces_the_measured_stress_along_the_warp() {
        let table = &crate::material::library::GRAY_INTERLOCK.stretching;
        let law = Stretch::from_table(table);
        let (stress, _) = law.stress_and_tangent(&[0.0, TABLE_STRAIN, 0.0]);
        let measured = 2.0 * table[5][2] * TABLE_STRAIN;
        assert!((stress[1] / measured - 1.0).abs() < 1e-9, "{} against {measured}", stress[1]);
        let half = 0.5 * TABLE_STRAIN;
        let (stress, _) = law.stress_and_tangent(&[half, half, TABLE_STRAIN]);
        let along = 0.5 * (stress[0] + stress[1]) + stress[2];
        let [k0, k1, k2, k3] = table[3];
        let measured = 2.0 * (k0 + 2.0 * k1 + k2 + k3) / 4.0 * TABLE_STRAIN;
        // The weft stiffening is clamped at zero for this knit, so the bias may come out slightly stiffer.
        assert!((along / measured - 1.0).abs() < 0.05, "{along} against {measured}");
    }

    #[test]
    fn compression_is_resisted_less_and_never_so_little_that_the_law_is_indefinite() {
        let law = Stretch::isotropic(120.0, 0.3);
        let slack = law.with_compression(0.7);
        let pressed = [-0.02, 0.0, 0.0];
        let ratio = slack.stress_and_tangent(&pressed).0[0] / law.stress_and_tangent(&pressed).0[0];
        assert!((ratio - 0.7).abs() < 1e-12, "{ratio}");
        assert_eq!(slack.stress_and_tangent(&[0.02, 0.01, 0.0]), law.stress_and_tangent(&[0.02, 0.01, 0.0]));
        let least = law.with_compression(1e-6);
        least.check().unwrap();
        let drawn_in = -least.cross / (least.compression * least.weft);
        assert!((drawn_in + MAX_CONTRACTION).abs() < 1e-12, "{drawn_in}");
        let (_, tangent) = least.stress_and_tangent(&[0.01, -0.01, 0.0]);
        assert!(tangent[0][0] * tangent[1][1] > tangent[0][1] * tangent[0][1]);
        assert!(Stretch { compression: 0.0, ..law }.check().is_err());
        assert!(Stretch { compression: 0.01, ..law }.check().is_err(), "indefinite");
    }

    #[test]
    fn a_free_strip_of_an_isotropic_law_has_youngs_modulus_in_every_direction() {
        let law = Stretch::isotropic(120.0, 0.3);
        for angle in [0.0, 0.3, std::f64::consts::FRAC_PI_4, 1.2] {
            let green = 0.5 * (1.1 * 1.1 - 1.0);
            let force = law.strip_force(angle, 1.1);
            assert!((force / (1.1 * 120.0 * green) - 1.0).abs() < 1e-9, "{angle}: {force}");
        }
        // Less compression left than tension: across the strip it gives way, along it nothing changes without coupling.
        let uncoupled = Stretch::isotropic(120.0, 0.0).with_compression(0.1);
        assert!((uncoupled.strip_force(0.0, 1.05) / (1.05 * 120.0 * 0.051_25) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn isotropic_modulus_is_the_slope_of_a_free_strip() {
        let law = Stretch::isotropic(120.0, 0.3);
        let (stress, _) = law.stress_and_tangent(&[1e-3, -0.3e-3, 0.0]);
        assert!((stress[0] - 0.12).abs() < 1e-12 && stress[1].abs() < 1e-12);
    }
}
