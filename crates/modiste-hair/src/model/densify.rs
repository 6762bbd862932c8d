//! More guides from fewer: strands between guides are linear in them, so a basis of guides gives a basis of strands.

use modiste_body::Body;
use modiste_core::{QuantisedBasis, Vec3};

use super::{Expansion, HairModel};
use crate::strands::FullHair;
use crate::{HairError, POINTS};

impl HairModel {
    /// The same hair with `count` guides, each between those that there are: dynamics and coefficients are the same, and so is
    /// the cost of synthesis; only the basis is larger. Guides learned by themselves show more than those between others.
    ///
    /// # Errors
    /// As [`FullHair::new`].
    pub fn densified(&self, body: &Body, count: usize) -> Result<Self, HairError> {
        let mean: Vec<Vec3> =
            self.mean.chunks_exact(3).map(|p| Vec3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2]))).collect();
        let between = FullHair::new(body, &self.roots, &mean, count, self.seed)?;
        let spread = |numbers: &[f32]| -> Vec<f32> {
            let mut out = Vec::with_capacity(count * 3 * POINTS);
            for followed in between.followed() {
                for place in 0..3 * POINTS {
                    let sum: f64 = followed
                        .iter()
                        .map(|&(guide, weight)| weight * f64::from(numbers[guide as usize * 3 * POINTS + place]))
                        .sum();
                    out.push(sum as f32);
                }
            }
            out
        };
        let n = self.mean.len();
        let rows = self.basis.to_f32();
        let rows: Vec<f32> = rows.chunks_exact(n).flat_map(spread).collect();
        let basis = QuantisedBasis::from_f32(&rows, self.basis.count(), count * 3 * POINTS)
            .map_err(HairError::solving("basis of the denser hair"))?;
        let mean = spread(&self.mean);
        Ok(Self {
            name: self.name.clone(),
            fps: self.fps,
            roots: between.roots().to_vec(),
            cells: self.cells.clone(),
            bust_vertices: self.bust_vertices.clone(),
            bust_rest: self.bust_rest.clone(),
            bust: self.bust.clone(),
            plain: self.plain,
            space: self.space.clone(),
            limits: std::sync::Arc::clone(&self.limits),
            expansion: Expansion::new(&mean, &basis),
            mean,
            basis,
            std_devs: self.std_devs.clone(),
            blocks: self.blocks.copied(),
            ridges: self.ridges.clone(),
            seed: self.seed,
        })
    }
}
