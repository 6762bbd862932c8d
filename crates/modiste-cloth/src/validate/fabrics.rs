//! Strips of measured fabrics, pulled and bent, beside what their tables say.

use super::sheet::{Sheet, static_options};
use super::strips::{Comparison, expected_sag, sag_of_strip};
use crate::{BodyCollider, ClothError, Fabric, Solver, SolverOptions, Stretch};
use modiste_core::{Vec2, Vec3};
use serde::Serialize;

/// How a strip is cut: the direction of its length.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[expect(missing_docs, reason = "the names say it")]
pub enum Cut {
    Weft,
    Bias,
    Warp,
}

impl Cut {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Weft, Self::Bias, Self::Warp];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Weft => "weft",
            Self::Bias => "bias",
            Self::Warp => "warp",
        }
    }

    /// Angle from the weft (rad).
    fn angle(self) -> f64 {
        match self {
            Self::Weft => 0.0,
            Self::Bias => std::f64::consts::FRAC_PI_4,
            Self::Warp => std::f64::consts::FRAC_PI_2,
        }
    }

    /// Row of the stretching table that was measured along it at a stretch of 7/6.
    fn row(self) -> usize {
        match self {
            Self::Weft => 1,
            Self::Bias => 3,
            Self::Warp => 5,
        }
    }
}

/// A strip that was pulled.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StripTest {
    /// How it was cut.
    pub cut: Cut,
    /// Length over rest length of the middle third.
    pub stretch: f64,
    /// Force per width (N/m): simulated, and of the table's moduli at that stretch.
    pub force: Comparison,
    /// Force per width (N/m) at that stretch of the same fabric in a garment: with yarns that lock and slack against compression.
    pub worn: f64,
}

/// Edge (m) of the meshes of garments, for the force as worn.
const WORN_EDGE: f64 = 0.016;

/// Pulls a strip of 5 cm × 20 cm by its clamped ends to `stretch` times its length.
///
/// `table` is that of Wang, Ramamoorthi and O'Brien 2011, see [`table_force`]. The force is the derivative of the strip's
/// energy by the way of its clamp, compared with the table where the clamps do not hinder the strip from narrowing: at the
/// stretch of its middle third. The limit at which the yarns of a worn garment lock is left out.
///
/// # Errors
/// What the solver refuses.
pub fn strip_test(fabric: &Fabric, table: &[[f64; 4]; 6], cut: Cut, stretch: f64) -> Result<StripTest, ClothError> {
    let (width, length, cells) = (0.05, 0.2, [10, 40]);
    let worn = fabric.resolved_by(WORN_EDGE, 9.81).stretch;
    let law = Stretch { limit: f64::INFINITY, limit_stiffness: 0.0, ..fabric.stretch };
    let fabric = Fabric { stretch: law, ..fabric.clone() };
    let mut sheet = Sheet::cut_at(cut.angle(), Vec2::new(width, length), cells, &fabric)?;
    let top = sheet.row(sheet.rows);
    sheet.model.pins = [sheet.row(0), top.clone()].concat();
    sheet.state.positions.iter_mut().for_each(|x| x.y *= stretch);
    let options = SolverOptions { gravity: [0.0; 3], ..static_options() };
    let mut solver = Solver::new(&sheet.model, options);
    sheet.rest(&mut solver, &mut BodyCollider::none(), (300, 1e-5))?;
    // At rest the energy changes with the clamp alone, whatever the vertices between do.
    let step = 1e-6;
    let pulled = |way: f64| {
        let mut x = sheet.state.positions.clone();
        top.iter().for_each(|&vertex| x[vertex as usize].y += way);
        sheet.model.energy(&x, Vec3::ZERO)
    };
    let measured = (pulled(step) - pulled(-step)) / (2.0 * step) / width;
    let (low, high) = (sheet.rows / 3, sheet.rows - sheet.rows / 3);
    let rest = length * (high - low) as f64 / sheet.rows as f64;
    let stretch = (sheet.row_centre(high).y - sheet.row_centre(low).y) / rest;
    let force = Comparison::new(measured, table_force(table, cut, stretch));
    Ok(StripTest { cut, stretch, force, worn: worn.strip_force(cut.angle(), stretch) })
}

/// Force per width (N/m) of a free strip by the table: `λ σ` with `dᵀE d = σ dᵀC⁻¹(d ⊗ d) d`.
///
/// The moduli go in proportion to the stretch from the first row, at none, to the row of the direction, at 7/6, and stay
/// there, as the authors' ARCSim looks them up (`dde.cpp`); it doubles them and takes negative ones for zero. Its forces
/// (`physics.cpp`) are those of the stress `S11 = k0 E11 + k1 E22`, `S22 = k1 E11 + k2 E22`, `S12 = k3 E12`: so an isotropic
/// sheet has `k3 = k0 - k1`, as its files for paper and aluminium have it.
fn table_force(table: &[[f64; 4]; 6], cut: Cut, stretch: f64) -> f64 {
    let share = (6.0 * (stretch - 1.0)).clamp(0.0, 1.0);
    let row: [f64; 4] = std::array::from_fn(|k| table[0][k] + share * (table[cut.row()][k] - table[0][k]));
    let [weft, cross, warp, shear] = row.map(|k| 2.0 * k.max(0.0));
    let cross = cross.min(0.9 * (weft * warp).sqrt());
    let (sin, cos) = cut.angle().sin_cos();
    let [a, b, c] = [cos * cos, sin * sin, sin * cos];
    let determinant = weft * warp - cross * cross;
    let compliance = (a * a * warp - 2.0 * a * b * cross + b * b * weft) / determinant
        + if c.abs() > 1e-12 { 2.0 * c * c / shear } else { 0.0 };
    stretch * green(stretch) / compliance
}

/// Green strain of a stretch.
fn green(stretch: f64) -> f64 {
    0.5 * (stretch * stretch - 1.0)
}

/// A strip that was bent under its own weight.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BendTest {
    /// How it was cut.
    pub cut: Cut,
    /// Bending length `(B / w)^(1/3)` of the table (m).
    pub bending_length: f64,
    /// Sag of its end (m): simulated, and of the elastica with the table's rigidity, its mean over curvature.
    pub sag: Comparison,
    /// Sag (m) of the elastica with the greatest and with the least rigidity of the table's row.
    pub sag_of_table: [f64; 2],
}

/// Lets a strip of twice its bending length hang level from a clamp. `table` is that of the fabric's bending.
///
/// # Errors
/// What the solver refuses.
pub fn bend_test(fabric: &Fabric, table: &[[f64; 5]; 3], cut: Cut) -> Result<BendTest, ClothError> {
    // The crease runs across the strip.
    let (rigidity, row) = match cut {
        Cut::Weft => (fabric.bend.warp, table[2]),
        Cut::Bias => (fabric.bend.bias, table[1]),
        Cut::Warp => (fabric.bend.weft, table[0]),
    };
    let bending_length = (rigidity / (9.81 * fabric.density)).cbrt();
    let sag = sag_of_strip(fabric, cut.angle(), 2.0 * bending_length, rigidity)?;
    let mean = row.iter().sum::<f64>() / row.len() as f64;
    let extremes = [row.iter().copied().fold(0.0, f64::max), row.iter().copied().fold(f64::INFINITY, f64::min)];
    let sag_of_table = extremes.map(|extreme| expected_sag(fabric, 2.0 * bending_length, rigidity * extreme / mean));
    Ok(BendTest { cut, bending_length, sag, sag_of_table })
}

#[cfg(test)]
mod tests {
    use super::{Cut, bend_test, strip_test, table_force};
    use crate::material::library::{BLACK_DENIM, GRAY_INTERLOCK};
    use crate::{Fabric, Stretch};

    #[test]
    fn a_strip_of_the_table_is_as_stiff_as_its_moduli() {
        // Without Poisson coupling a strip along the weft has the modulus of the weft.
        let force = table_force(&[[100.0, 0.0, 300.0, 50.0]; 6], Cut::Weft, 1.01);
        assert!((force - 1.01 * 200.0 * 0.010_05).abs() < 1e-9, "{force}");
        // On the bias an isotropic membrane is as stiff as along the weft.
        let isotropic = [[100.0, 30.0, 100.0, 100.0 - 30.0]; 6];
        let ratio = table_force(&isotropic, Cut::Weft, 1.1) / table_force(&isotropic, Cut::Bias, 1.1);
        assert!((ratio - 1.0).abs() < 1e-9, "{ratio}");
    }

    #[test]
    fn strips_of_jersey_and_denim_pull_as_their_tables_say() {
        for (fabric, measured, stretch) in [
            (Fabric::jersey(), &GRAY_INTERLOCK, 1.01),
            (Fabric::denim(), &BLACK_DENIM, 1.01),
            (Fabric::denim(), &BLACK_DENIM, 7.0 / 6.0),
        ] {
            let strip = strip_test(&fabric, &measured.stretching, Cut::Warp, stretch).unwrap();
            assert!(strip.force.relative_error < 0.1, "{} {strip:?}", fabric.name);
        }
    }

    #[test]
    fn a_long_strip_pulls_as_a_free_one_whatever_its_cut() {
        let fabric = Fabric::jersey();
        let law = Stretch { limit: f64::INFINITY, limit_stiffness: 0.0, ..fabric.stretch };
        for cut in Cut::ALL {
            let strip = strip_test(&fabric, &GRAY_INTERLOCK.stretching, cut, 1.1).unwrap();
            let free = law.strip_force(cut.angle(), strip.stretch);
            assert!((strip.force.measured / free - 1.0).abs() < 0.03, "{strip:?} {free}");
        }
    }

    #[test]
    fn a_strip_of_denim_sags_as_the_elastica_does() {
        let bend = bend_test(&Fabric::denim(), &BLACK_DENIM.bending, Cut::Warp).unwrap();
        assert!(bend.sag.relative_error < 0.12, "{bend:?}");
    }
}
