//! What varies in a simulation of cloth.

use crate::model::ClothModel;
use modiste_core::Vec3;
use serde::Serialize;

/// Positions and velocities, one per cloth vertex.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ClothState {
    /// Positions in world (m).
    pub positions: Vec<Vec3>,
    /// Velocities in world (m/s).
    pub velocities: Vec<Vec3>,
}

/// How far edges are from their rest length in the panels.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct StretchStatistics {
    /// Median of length over rest length minus one.
    pub median: f64,
    /// 99th percentile of the same.
    pub percentile_99: f64,
    /// Largest of the same.
    pub largest: f64,
}

impl ClothState {
    /// Cloth at rest at these positions (m).
    pub fn at_rest(positions: Vec<Vec3>) -> Self {
        let velocities = vec![Vec3::ZERO; positions.len()];
        Self { positions, velocities }
    }

    /// Stretch of all edges, each against its rest length (the mean of its two faces where they differ).
    pub fn edge_stretch(&self, model: &ClothModel) -> StretchStatistics {
        let mut stretch: Vec<f64> = model
            .topology()
            .edges()
            .iter()
            .zip(model.edge_rest_lengths())
            .map(|(edge, rest)| {
                let [a, b] = edge.vertices.map(|v| self.positions[v as usize]);
                a.distance(b) / rest - 1.0
            })
            .collect();
        stretch.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let index = (share * (stretch.len().saturating_sub(1)) as f64).round();
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the length")]
            stretch.get(index as usize).copied().unwrap_or(0.0)
        };
        StretchStatistics { median: at(0.5), percentile_99: at(0.99), largest: at(1.0) }
    }

    /// Linear momentum (kg·m/s) and angular momentum about the origin (kg·m²/s).
    pub fn momentum(&self, model: &ClothModel) -> (Vec3, Vec3) {
        let mut linear = Vec3::ZERO;
        let mut angular = Vec3::ZERO;
        for ((x, v), &mass) in self.positions.iter().zip(&self.velocities).zip(model.masses()) {
            linear += *v * mass;
            angular += x.cross(*v) * mass;
        }
        (linear, angular)
    }
}
