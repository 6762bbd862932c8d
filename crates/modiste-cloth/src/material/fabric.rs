//! A fabric: mass, stretch and bend.

use super::library::{self, Measured};
use super::{Bend, Stretch};
use crate::error::{ClothError, check_not_negative, check_positive};
use serde::{Deserialize, Serialize};

/// What a cloth is made of.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Fabric {
    /// Name for reports, for example `jersey`.
    pub name: String,
    /// Mass per area (kg/m²).
    pub density: f64,
    /// In-plane elasticity.
    pub stretch: Stretch,
    /// Bending rigidity.
    pub bend: Bend,
    /// Relaxation time of the viscous stress in the plane (s): `stress += time · tangent · strain rate`.
    pub stretch_damping: f64,
    /// Relaxation time of the viscous bending moment (s).
    pub bend_damping: f64,
}

/// Stretch at which the yarns of a worn garment are taken to lock: the training poses shall stay below 8%.
const YARN_LIMIT: f64 = 1.045;

/// Modulus beyond the limit (N/m): a yarn under 20 N/m goes 1% further.
const YARN_LIMIT_STIFFNESS: f64 = 2000.0;

/// Relaxation times of the built-in fabrics (s), in place of the hysteresis that a fabric's yarns have by rubbing; chosen,
/// not measured. At the pace of a walk, 1 Hz, 50 ms are a loss factor of `2π · 0.05 = 0.3` in bending. With a tenth of it
/// folds snap from one place to another: the same step of a walk, repeated, left them half as far again apart.
const STRETCH_DAMPING: f64 = 20.0e-3;
const BEND_DAMPING: f64 = 50.0e-3;

/// Least share of the modulus that resists compression: it keeps triangles open.
const LEAST_COMPRESSION: f64 = 0.02;

impl Fabric {
    /// Takes the tables of Wang, Ramamoorthi and O'Brien 2011 (see [`Stretch::from_table`] and [`Bend::from_table`]).
    ///
    /// # Errors
    /// A density that is not positive, or moduli that leave the law without resistance.
    pub fn from_tables(
        name: &str,
        density: f64,
        stretching: &[[f64; 4]; 6],
        bending: &[[f64; 5]; 3],
    ) -> Result<Self, ClothError> {
        let fabric = Self {
            name: name.to_owned(),
            density,
            stretch: Stretch::from_table(stretching).with_limit(YARN_LIMIT, YARN_LIMIT_STIFFNESS),
            bend: Bend::from_table(bending),
            stretch_damping: STRETCH_DAMPING,
            bend_damping: BEND_DAMPING,
        };
        fabric.check()?;
        Ok(fabric)
    }

    /// T-shirt jersey: `gray-interlock`, 60% cotton 40% polyester, 187 g/m².
    pub fn jersey() -> Self {
        Self::measured("jersey", &library::GRAY_INTERLOCK)
    }

    /// Firm double knit for shorts and jackets: `camel-ponte-roma`, 60% polyester 40% rayon, 284 g/m².
    pub fn ponte() -> Self {
        Self::measured("ponte", &library::CAMEL_PONTE_ROMA)
    }

    /// Jeans: `11oz-black-denim`, 99% cotton 1% spandex, 324 g/m².
    pub fn denim() -> Self {
        Self::measured("denim", &library::BLACK_DENIM)
    }

    /// Woven trousers: `royal-target`, 65% cotton 35% polyester, 220 g/m².
    pub fn twill() -> Self {
        Self::measured("twill", &library::ROYAL_TARGET)
    }

    /// The built-in fabrics.
    pub fn all() -> [Self; 4] {
        [Self::jersey(), Self::ponte(), Self::denim(), Self::twill()]
    }

    /// The built-in fabric of this name, if there is one.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::all().into_iter().find(|fabric| fabric.name == name)
    }

    fn measured(name: &str, measured: &Measured) -> Self {
        Self {
            name: name.to_owned(),
            density: measured.density,
            stretch: Stretch::from_table(&measured.stretching).with_limit(YARN_LIMIT, YARN_LIMIT_STIFFNESS),
            bend: Bend::from_table(&measured.bending),
            stretch_damping: STRETCH_DAMPING,
            bend_damping: BEND_DAMPING,
        }
    }

    /// The fabric as a mesh of edge length `edge_length` (m) can show it under `gravity` (m/s²).
    ///
    /// Bending is raised where the mesh is too coarse for the folds ([`Bend::resolved_by`]). Compression is resisted less:
    /// cloth pressed by more than the critical load `4π² B/h²` of a strip of one edge buckles within the triangle, so
    /// weft and warp keep the share of their moduli that carries this load at full compression. With the whole moduli of a
    /// stiff weave, creases of single edges stay where they first arose: of the wrinkles of shorts in motions held out, the
    /// pose foretold 0.37 of the variance with all of it, 0.53 with a tenth and 0.58 with a fiftieth. A finer mesh comes
    /// nearer to the fabric.
    #[must_use]
    pub fn resolved_by(&self, edge_length: f64, gravity: f64) -> Self {
        let bend = self.bend.resolved_by(edge_length, self.density * gravity);
        let rigidity = (bend.weft + bend.bias + bend.warp) / 3.0;
        let critical = 4.0 * std::f64::consts::PI.powi(2) * rigidity / (edge_length * edge_length);
        // Green strain is one half at full compression.
        let share = 2.0 * critical / (self.stretch.weft * self.stretch.warp).sqrt();
        let stretch = self.stretch.with_compression(share.max(LEAST_COMPRESSION));
        Self { bend, stretch, ..self.clone() }
    }

    pub(crate) fn check(&self) -> Result<(), ClothError> {
        check_positive("density", self.density)?;
        self.stretch.check()?;
        self.bend.check()?;
        check_not_negative("stretch_damping", self.stretch_damping)?;
        check_not_negative("bend_damping", self.bend_damping)
    }
}

#[cfg(test)]
mod tests {
    use super::Fabric;

    #[test]
    fn built_in_fabrics_are_sound_and_told_apart() {
        for fabric in Fabric::all() {
            fabric.check().unwrap();
            assert_eq!(Fabric::from_name(&fabric.name).unwrap(), fabric);
        }
        assert!(Fabric::denim().bend.warp > 4.0 * Fabric::jersey().bend.warp);
        assert!(Fabric::denim().stretch.warp > 10.0 * Fabric::jersey().stretch.warp);
    }

    #[test]
    fn a_coarse_mesh_lets_stiff_weaves_slacken_and_a_fine_one_leaves_them() {
        let share = |fabric: Fabric, edge: f64| fabric.resolved_by(edge, 9.81).stretch.compression;
        assert!((share(Fabric::twill(), 0.016) - super::LEAST_COMPRESSION).abs() < 1e-12);
        let jersey = share(Fabric::jersey(), 0.016);
        assert!((0.05..0.3).contains(&jersey), "a knit gives way by itself: {jersey}");
        assert!(share(Fabric::jersey(), 0.002) > 2.0 * jersey);
        assert!((share(Fabric::twill(), 1e-4) - 1.0).abs() < 1e-12);
        assert!((Fabric::twill().stretch.compression - 1.0).abs() < 1e-12, "as measured");
        for fabric in Fabric::all() {
            fabric.resolved_by(0.016, 9.81).check().unwrap();
        }
    }

    #[test]
    fn negative_density_is_refused() {
        let error = Fabric::from_tables("x", -1.0, &[[1.0; 4]; 6], &[[1e-6; 5]; 3]).unwrap_err();
        assert!(error.to_string().contains("density = -1"));
    }
}
