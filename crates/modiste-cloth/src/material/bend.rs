//! Bending rigidity by direction.

use crate::error::{ClothError, check_not_negative};
use modiste_core::Vec2;
use serde::{Deserialize, Serialize};

/// Bending rigidity (N·m: moment per width over curvature) by the direction of the fold line.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Bend {
    /// Rigidity against folds whose crease runs along the weft (x).
    pub weft: f64,
    /// Rigidity against folds whose crease runs at 45 degrees.
    pub bias: f64,
    /// Rigidity against folds whose crease runs along the warp (y).
    pub warp: f64,
}

/// Plate rigidity over the bending coefficient of the table, whose hinge energy is `k l²/(8 A) θ²` (Bridson et al. 2003,
/// as Wang et al. 2011 use it), while a plate of rigidity `B` has `B l²/(2 A) θ²`; `A` is the area of the two triangles.
const RIGIDITY_OVER_TABLE: f64 = 0.25;

impl Bend {
    /// The same rigidity in every direction (N·m).
    pub fn isotropic(rigidity: f64) -> Self {
        Self { weft: rigidity, bias: rigidity, warp: rigidity }
    }

    /// Takes a bending table of Wang, Ramamoorthi and O'Brien 2011: rows are crease directions of 0, 45 and 90 degrees from
    /// the weft, columns curvatures of 0 to 20 per metre. A column varies by the noise of the measurement, so the mean
    /// over curvature is taken and the bending energy stays a potential.
    pub fn from_table(table: &[[f64; 5]; 3]) -> Self {
        let [weft, bias, warp] = table.map(|row| RIGIDITY_OVER_TABLE * row.iter().sum::<f64>() / 5.0);
        Self { weft, bias, warp }
    }

    /// Rigidity (N·m) of a crease along `edge` in panel space, linear in its angle between the three directions.
    pub fn along(&self, edge: Vec2) -> f64 {
        let angle = edge.y.abs().atan2(edge.x.abs()) / std::f64::consts::FRAC_PI_4;
        if angle <= 1.0 {
            self.weft + (self.bias - self.weft) * angle
        } else {
            self.bias + (self.warp - self.bias) * (angle - 1.0)
        }
    }

    pub(crate) fn check(&self) -> Result<(), ClothError> {
        check_not_negative("bend.weft", self.weft)?;
        check_not_negative("bend.bias", self.bias)?;
        check_not_negative("bend.warp", self.warp)
    }
}

#[cfg(test)]
mod tests {
    use super::Bend;
    use modiste_core::Vec2;

    #[test]
    fn rigidity_follows_the_crease() {
        let bend = Bend { weft: 1.0, bias: 2.0, warp: 4.0 };
        assert!((bend.along(Vec2::new(-3.0, 0.0)) - 1.0).abs() < 1e-12);
        assert!((bend.along(Vec2::new(2.0, -2.0)) - 2.0).abs() < 1e-12);
        assert!((bend.along(Vec2::new(0.0, -1.0)) - 4.0).abs() < 1e-12);
        let between = bend.along(Vec2::from_angle(67.5f64.to_radians()));
        assert!((between - 3.0).abs() < 1e-12);
    }
}
