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

/// Share of the modulus that resists compression. At the critical load `4π² B/h²` of a strip as long as an edge of the mesh,
/// 16 mm, the fabrics carry 3 to 25 N/m: what a hundredth to a tenth of their moduli would at full compression. With the
/// whole modulus creases of single edges stay where they first arose: of the wrinkles of shorts in motions held out, the
/// pose foretold 0.37 of the variance with 1, 0.53 with 0.1 and 0.58 with 0.02.
const COMPRESSION: f64 = 0.02;

/// A measured law as cloth of a garment on a mesh of centimetres has it.
fn worn(stretch: Stretch) -> Stretch {
    stretch.with_limit(YARN_LIMIT, YARN_LIMIT_STIFFNESS).with_compression(COMPRESSION)
}

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
            stretch: worn(Stretch::from_table(stretching)),
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
            stretch: worn(Stretch::from_table(&measured.stretching)),
            bend: Bend::from_table(&measured.bending),
            stretch_damping: STRETCH_DAMPING,
            bend_damping: BEND_DAMPING,
        }
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
    fn negative_density_is_refused() {
        let error = Fabric::from_tables("x", -1.0, &[[1.0; 4]; 6], &[[1e-6; 5]; 3]).unwrap_err();
        assert!(error.to_string().contains("density = -1"));
    }
}
