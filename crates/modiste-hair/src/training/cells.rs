//! The combinations of factors that are simulated, and how a style between them is blended.

use modiste_core::Vec3;
use serde::{Deserialize, Serialize};

use crate::HairError;
use crate::error::check_range;

/// Where the wind blows to, seen from the person: +Z is ahead, +X to their left.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum WindDirection {
    /// Ahead: from behind.
    #[serde(rename = "+z")]
    Ahead,
    /// To their left.
    #[serde(rename = "+x")]
    Left,
    /// To their right.
    #[serde(rename = "-x")]
    Right,
    /// Back: into their face.
    #[serde(rename = "-z")]
    Back,
}

/// One combination of factors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Cell {
    /// Length factor.
    pub length: f64,
    /// Softness factor.
    pub softness: f64,
    /// Full wind from there, or none.
    pub wind: Option<WindDirection>,
}

/// What a user asks for.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Factors {
    /// Length factor, α: 0 is the shortest and 1 the longest of the training sets.
    pub length: f64,
    /// Softness factor, β: 0 stiff, 1 soft.
    pub softness: f64,
    /// Strength of the wind, 1 as in training, and where it blows to (rad, about Y from ahead towards the left).
    pub wind: [f64; 2],
}

/// How far the sliders go beyond what was learned; the thesis shows a length of 1.35.
const BEYOND: [f64; 2] = [-0.2, 1.4];
/// Strongest wind.
const STRONGEST: f64 = 1.3;

impl WindDirection {
    /// All directions.
    pub const ALL: [Self; 4] = [Self::Ahead, Self::Left, Self::Right, Self::Back];

    /// Unit vector that the wind blows along, in canonical space.
    pub fn vector(self) -> Vec3 {
        match self {
            Self::Ahead => Vec3::Z,
            Self::Left => Vec3::X,
            Self::Right => Vec3::NEG_X,
            Self::Back => Vec3::NEG_Z,
        }
    }

    /// Its name, as on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ahead => "+z",
            Self::Left => "+x",
            Self::Right => "-x",
            Self::Back => "-z",
        }
    }

    /// The direction of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|direction| direction.name() == name)
    }

    /// Angle about Y from ahead towards the left (rad).
    pub fn angle(self) -> f64 {
        let vector = self.vector();
        vector.x.atan2(vector.z)
    }
}

impl Cell {
    /// Long and short, soft and stiff.
    pub const STYLES: [Self; 4] = [
        Self { length: 1.0, softness: 1.0, wind: None },
        Self { length: 1.0, softness: 0.0, wind: None },
        Self { length: 0.0, softness: 1.0, wind: None },
        Self { length: 0.0, softness: 0.0, wind: None },
    ];

    /// Long soft hair in the winds of the thesis, and in the one from the front.
    pub const WINDS: [Self; 4] = [
        Self { length: 1.0, softness: 1.0, wind: Some(WindDirection::Ahead) },
        Self { length: 1.0, softness: 1.0, wind: Some(WindDirection::Left) },
        Self { length: 1.0, softness: 1.0, wind: Some(WindDirection::Right) },
        Self { length: 1.0, softness: 1.0, wind: Some(WindDirection::Back) },
    ];

    /// Name in files, such as `l1.0-s0.0` or `l1.0-s1.0+x`.
    pub fn name(&self) -> String {
        let wind = self.wind.map_or("", WindDirection::name);
        format!("l{:.1}-s{:.1}{wind}", self.length, self.softness)
    }

    fn is(&self, length: f64, softness: f64, wind: Option<WindDirection>) -> bool {
        (self.length - length).abs() < 1e-9 && (self.softness - softness).abs() < 1e-9 && self.wind == wind
    }
}

impl Default for Factors {
    fn default() -> Self {
        Self { length: 1.0, softness: 1.0, wind: [0.0, 0.0] }
    }
}

impl Factors {
    /// Still air.
    pub fn new(length: f64, softness: f64) -> Self {
        Self { length, softness, wind: [0.0, 0.0] }
    }

    /// The factors of a cell.
    pub fn of_cell(cell: &Cell) -> Self {
        let wind = cell.wind.map_or([0.0, 0.0], |wind| [1.0, wind.angle()]);
        Self { length: cell.length, softness: cell.softness, wind }
    }

    /// Refuses factors beyond what the model can be stretched to.
    ///
    /// # Errors
    /// Names the factor and its range.
    pub fn check(&self) -> Result<(), HairError> {
        check_range("hair length factor", self.length, BEYOND[0], BEYOND[1])?;
        check_range("hair softness factor", self.softness, BEYOND[0], BEYOND[1])?;
        check_range("wind strength", self.wind[0], 0.0, STRONGEST)?;
        check_range("wind direction", self.wind[1], -10.0, 10.0)
    }

    /// How much of each cell a style takes: rows of the mode matrices in barycentric coordinates (§3), summing to one.
    ///
    /// Cells in wind were simulated for one length and softness. Elsewhere the wind's effect is taken to be the same, in
    /// proportion to the length factor's part and the softness: what was not simulated is filled in so.
    ///
    /// # Errors
    /// Factors out of range, or that the model has no cells for.
    pub fn weights(&self, cells: &[Cell]) -> Result<Vec<f64>, HairError> {
        self.check()?;
        let mut weights = vec![0.0; cells.len()];
        let find = |length, softness, wind| cells.iter().position(|cell| cell.is(length, softness, wind));
        let corners = [(1.0, 1.0), (1.0, 0.0), (0.0, 1.0), (0.0, 0.0)];
        let still = corners.map(|(length, softness)| find(length, softness, None));
        if still.iter().all(Option::is_some) {
            for ((length, softness), cell) in corners.into_iter().zip(still) {
                let part = |factor: f64, at: f64| if at > 0.5 { factor } else { 1.0 - factor };
                weights[cell.unwrap_or(0)] = part(self.length, length) * part(self.softness, softness);
            }
        } else if let Some(long_soft) = still[0] {
            if (self.length - 1.0).abs() > 1e-9 || (self.softness - 1.0).abs() > 1e-9 {
                return Err(HairError::data(
                    "hair style",
                    "length 1 and softness 1, the only one that this model was learned from",
                    format!("length {} and softness {}", self.length, self.softness),
                ));
            }
            weights[long_soft] = 1.0;
        } else {
            return Err(HairError::data("hair model", "a cell of long soft hair in still air", "none"));
        }
        let [strength, angle] = self.wind;
        if strength > 0.0 {
            self.add_wind(strength, angle, cells, &mut weights)?;
        }
        Ok(weights)
    }

    fn add_wind(&self, strength: f64, angle: f64, cells: &[Cell], weights: &mut [f64]) -> Result<(), HairError> {
        let mut winds: Vec<(f64, usize)> = cells
            .iter()
            .enumerate()
            .filter_map(|(index, cell)| Some((cell.wind?.angle().rem_euclid(std::f64::consts::TAU), index)))
            .collect();
        winds.sort_by(|a, b| a.0.total_cmp(&b.0));
        let still = cells.iter().position(|cell| cell.is(1.0, 1.0, None));
        let (Some(still), false) = (still, winds.is_empty()) else {
            return Err(HairError::data("wind", "a model learned in wind", "one learned in still air"));
        };
        let angle = angle.rem_euclid(std::f64::consts::TAU);
        // Between the two neighbouring directions, by angle; directions a half turn apart or more have no between.
        let after = winds.partition_point(|wind| wind.0 <= angle + 1e-9) % winds.len();
        let before = (after + winds.len() - 1) % winds.len();
        let gap = (winds[after].0 - winds[before].0).rem_euclid(std::f64::consts::TAU);
        let along = (angle - winds[before].0).rem_euclid(std::f64::consts::TAU);
        let part = if along < 1e-6 { 0.0 } else { along / gap };
        if part > 0.0 && (gap > std::f64::consts::FRAC_PI_2 + 1e-6 || winds.len() < 2) {
            let known: Vec<&str> = cells.iter().filter_map(|cell| Some(cell.wind?.name())).collect();
            return Err(HairError::data("wind direction", format!("between two of {}", known.join(", ")), angle));
        }
        let effect = strength * (0.3 + 0.7 * self.length).clamp(0.0, 1.2) * (0.4 + 0.6 * self.softness).clamp(0.0, 1.2);
        weights[winds[before].1] += (1.0 - part) * effect;
        weights[winds[after].1] += part * effect;
        weights[still] -= effect;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::{Cell, Factors, WindDirection};

    fn cells() -> Vec<Cell> {
        Cell::STYLES.into_iter().chain(Cell::WINDS).collect()
    }

    #[test]
    fn a_cell_is_itself_and_between_cells_weights_sum_to_one() {
        let cells = cells();
        for (index, cell) in cells.iter().enumerate() {
            let weights = Factors::of_cell(cell).weights(&cells).unwrap();
            for (other, weight) in weights.iter().enumerate() {
                assert!((weight - f64::from(u8::from(other == index))).abs() < 1e-9, "{cell:?}: {weights:?}");
            }
        }
        let factors = Factors { length: 0.3, softness: 1.2, wind: [0.7, 0.4] };
        assert!((factors.weights(&cells).unwrap().iter().sum::<f64>() - 1.0).abs() < 1e-9);
        let long = Factors::new(1.35, 1.0).weights(&cells).unwrap();
        assert!((long[0] - 1.35).abs() < 1e-9 && (long[2] + 0.35).abs() < 1e-9);
    }

    #[test]
    fn what_was_not_learned_is_refused() {
        let cells = cells();
        let message = |factors: Factors, cells: &[Cell]| factors.weights(cells).unwrap_err().to_string();
        assert!(message(Factors::new(3.0, 0.5), &cells).contains("hair length factor: wanted -0.2 to 1.4, found 3"));
        assert!(message(Factors::new(f64::NAN, 0.5), &cells).contains("found NaN"));
        let back = Factors { wind: [0.5, WindDirection::Back.angle()], ..Factors::default() };
        assert!(back.weights(&cells).is_ok());
        assert!(message(back, &cells[..cells.len() - 1]).contains("between two of +z, +x, -x"));
        let breeze = Factors { wind: [0.5, 0.0], ..Factors::default() };
        assert!(message(breeze, &Cell::STYLES).contains("still air"));
        assert!(message(Factors::new(0.5, 1.0), &Cell::STYLES[..1]).contains("only one"));
    }
}
