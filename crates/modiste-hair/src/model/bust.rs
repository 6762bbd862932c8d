//! A bust as a hair model sees it.

use modiste_core::{Affine3, Pca, Vec3};

use crate::canonical::Frame;
use crate::space::HairSpace;

/// What a hair model knows of a bust in one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct BustState {
    /// Where it is and which way it faces.
    pub frame: Frame,
    /// Its coefficients, x_t (m).
    pub coefficients: Vec<f64>,
    /// The space of the hair in canonical space, of that heading.
    pub hair: Affine3,
}

impl BustState {
    /// From tracked vertices in canonical space (m).
    pub(crate) fn new(space: &HairSpace, components: &Pca, frame: Frame, canonical: Vec<Vec3>) -> Self {
        let (frame, canonical) = space.level(frame, canonical);
        let numbers: Vec<f32> = canonical.iter().flat_map(|p| p.to_array()).map(|x| x as f32).collect();
        Self { frame, coefficients: components.project(&numbers), hair: space.pose(&canonical) }
    }

    /// The world from the space of the hair.
    pub fn world_from_hair(&self) -> Affine3 {
        Affine3::from_mat3_translation(self.frame.rotation(), self.frame.position) * self.hair
    }

    /// Unit vector that points down, in the space of the hair.
    pub fn down(&self) -> Vec3 {
        self.hair.matrix3.transpose() * Vec3::NEG_Y
    }

    /// By how much the coefficients differ from those of another frame (m).
    pub(crate) fn shift(&self, other: &Self) -> f64 {
        let squares = self.coefficients.iter().zip(&other.coefficients).map(|(a, b)| (a - b).powi(2));
        squares.sum::<f64>().sqrt()
    }
}
