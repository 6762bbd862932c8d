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

/// Edges that a bending length must span: half a circle of that radius then takes five.
const EDGES_OF_BENDING_LENGTH: f64 = 1.5;

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

    /// The rigidity that a mesh of edge length `edge_length` (m) can show under `weight` per area (N/m²).
    ///
    /// Cloth under its own weight folds with radii about its bending length `c = (B / w)^(1/3)`. Folds narrower than the
    /// edges come out as noise of the mesh, so where c is below one and a half edges, all directions are made
    /// stiffer alike until it is not. A finer mesh leaves the fabric as it is.
    #[must_use]
    pub fn resolved_by(&self, edge_length: f64, weight: f64) -> Self {
        let mean = (self.weft + self.bias + self.warp) / 3.0;
        let needed = weight * (EDGES_OF_BENDING_LENGTH * edge_length).powi(3);
        if !(mean > 0.0 && mean < needed) {
            return *self;
        }
        let factor = needed / mean;
        Self { weft: factor * self.weft, bias: factor * self.bias, warp: factor * self.warp }
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
    fn a_coarse_mesh_stiffens_soft_cloth_until_its_bending_length_spans_the_edges() {
        let bend = Bend { weft: 8e-6, bias: 5e-6, warp: 4e-6 };
        let weight = 9.81 * 0.187;
        let length = |bend: &Bend| ((bend.weft + bend.bias + bend.warp) / 3.0 / weight).cbrt();
        let coarse = bend.resolved_by(0.016, weight);
        assert!((length(&coarse) - 0.024).abs() < 1e-9, "{}", length(&coarse));
        assert!((coarse.weft / coarse.warp - 2.0).abs() < 1e-12, "the directions keep their ratio");
        assert_eq!(bend.resolved_by(0.008, weight), bend, "a fine mesh leaves it alone");
        assert_eq!(Bend::isotropic(0.0).resolved_by(0.016, weight), Bend::isotropic(0.0), "no rigidity is no mistake");
    }

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
