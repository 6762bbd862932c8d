//! A learned garment at another resolution: what it costs to wear, without learning it anew.

mod mesh;

use std::sync::Arc;

use modiste_core::{QuantisedBasis, SolveError, Topology};

use self::mesh::{Origin, Resampled};
use super::basis::GradientBasis;
use super::blend::blend_parts;
use super::coarse::{CoarseModel, Learned};
use super::gradient::TangentFrames;
use super::model::DrapeModel;
use super::shape::ShapeModel;
use super::training_set::Garment;
use super::wrinkle::WrinkleModel;
use crate::GarmentError;

impl DrapeModel {
    /// The garment with `vertex_count` vertices: edges are halved, or vertices left out. All that was learned is carried over,
    /// so it moves as it did: with more vertices it is the same surface, whose wrinkles are no finer. It has no evaluation.
    ///
    /// # Errors
    /// Fewer vertices than the garment can do without (those of its boundary, waist band and anchors stay), or a solve that
    /// fails.
    pub fn resampled(&self, vertex_count: usize) -> Result<Self, GarmentError> {
        let old = &self.garment;
        let same = Resampled::same(old.template.len(), old.topology.faces(), &old.uv);
        let mesh = if vertex_count < old.template.len() {
            let mut kept = vec![false; old.template.len()];
            let named = old.waist_band.iter().chain(old.anchors.iter().map(|[on_garment, _]| on_garment));
            named.for_each(|&vertex| kept[vertex as usize] = true);
            same.coarsen(&old.template, vertex_count, &kept)
        } else {
            same.subdivide(&old.template, vertex_count)
        };
        if mesh.origins.len() != vertex_count {
            let wanted = format!("at least {} for {}", mesh.origins.len(), old.name);
            return Err(GarmentError::data("number of vertices", wanted, vertex_count));
        }
        let garment = resampled_garment(old, &mesh)?;
        let carried = Carried::new(old, &garment, &mesh);
        let blend = blend_parts(&garment, self.wrinkle.blend_width)?;
        let shape = ShapeModel {
            frames: carried.frames.clone(),
            mean: carried.gradients(&self.shape.mean),
            basis: carried.basis(&garment, &self.shape.basis).map_err(GarmentError::solve("basis of shapes"))?,
            ..self.shape.clone()
        };
        let wrinkle = WrinkleModel {
            frames: carried.frames.clone(),
            blend: blend.faces,
            mean: carried.gradients(&self.wrinkle.mean),
            basis: carried.basis(&garment, &self.wrinkle.basis).map_err(GarmentError::solve("basis of wrinkles"))?,
            ..self.wrinkle.clone()
        };
        let coarse = match &self.coarse {
            Some(coarse) => {
                let learned = &coarse.learned;
                let basis = carried.moves(&learned.basis);
                let basis = basis.map_err(GarmentError::solve("basis of coarse deformations"))?;
                let learned = Learned { mean: mesh.carry(&learned.mean), basis, ..learned.clone() };
                Some(CoarseModel::assemble(&garment, blend.vertices, learned)?)
            }
            None => None,
        };
        let (dynamics, provenance) = (self.dynamics.clone(), self.provenance.clone());
        let model = Self::assemble(garment, shape, (wrinkle, coarse), dynamics, self.fps, provenance)?;
        Ok(Self { ease: self.ease, ..model })
    }
}

/// The mesh and how it is tied to the body.
fn resampled_garment(old: &Garment, mesh: &Resampled) -> Result<Garment, GarmentError> {
    let topology = Topology::new(mesh.origins.len(), mesh.faces.clone())
        .map_err(|source| GarmentError::Topology { garment: old.name.clone(), source })?;
    let mut new_from_old = vec![u32::MAX; old.template.len()];
    let mut in_band = vec![false; mesh.origins.len()];
    for (new, origin) in mesh.origins.iter().enumerate() {
        in_band[new] = match *origin {
            Origin::Vertex(vertex) => {
                new_from_old[vertex as usize] = new as u32;
                old.waist_band.contains(&vertex)
            }
            Origin::Between(ends) => ends.iter().all(|&end| in_band[end as usize]),
        };
    }
    let band = (0u32..).zip(&in_band).filter(|(_, in_band)| **in_band).map(|(vertex, _)| vertex);
    Ok(Garment {
        topology: Arc::new(topology),
        face_parts: mesh.face_origins.iter().map(|&face| old.face_parts[face as usize]).collect(),
        template: mesh.carry_points(&old.template),
        waist_band: band.collect(),
        anchors: old
            .anchors
            .iter()
            .map(|&[on_garment, on_body]| [new_from_old[on_garment as usize], on_body])
            .collect(),
        uv: mesh.uv.clone(),
        ..old.clone()
    })
}

/// How what was learned goes from one mesh to the other.
struct Carried<'a> {
    mesh: &'a Resampled,
    old_frames: TangentFrames,
    frames: TangentFrames,
}

impl<'a> Carried<'a> {
    fn new(old: &Garment, garment: &Garment, mesh: &'a Resampled) -> Self {
        Self {
            mesh,
            old_frames: TangentFrames::new(&old.topology, &old.template),
            frames: TangentFrames::new(&garment.topology, &garment.template),
        }
    }

    /// A flat row of gradients.
    fn gradients(&self, row: &[f32]) -> Vec<f32> {
        self.frames.carry(&self.old_frames, &self.mesh.face_origins, row)
    }

    fn moves(&self, basis: &QuantisedBasis<i8>) -> Result<QuantisedBasis<i8>, SolveError> {
        basis.map(|row| self.mesh.carry(row))
    }

    fn basis(&self, garment: &Garment, basis: &GradientBasis) -> Result<GradientBasis, SolveError> {
        let rest = basis.rest().map(|row| self.gradients(row))?;
        let mesh = (garment.topology.as_ref(), garment.template.as_slice());
        Ok(GradientBasis::from_parts(mesh, self.moves(basis.moves())?, basis.mixing().clone(), rest))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use modiste_core::Silent;

    use crate::drape::synthetic::{anchor_body, motion, training_set};
    use crate::drape::{DynamicsOptions, TrainOptions, WrinkleOptions};
    use crate::{DrapeModel, Synthesis};

    #[test]
    fn a_finer_garment_moves_as_the_one_it_was_made_from() {
        let options = TrainOptions {
            wrinkle: WrinkleOptions { min_count: 4, max_count: 8, ..WrinkleOptions::default() },
            dynamics: DynamicsOptions { ridges: vec![1e-3, 1e-1], ..DynamicsOptions::default() },
            ..TrainOptions::default()
        };
        let model = DrapeModel::train(&training_set(), &options, &Silent).unwrap().0;
        let count = model.garment().template.len();
        let fine = model.resampled(3 * count).unwrap();
        assert_eq!(fine.garment().template.len(), 3 * count);
        let coarse = model.resampled(count - 40).unwrap();
        assert!(model.resampled(10).is_err());
        let run = |model: DrapeModel| {
            let mut synthesis = Synthesis::new(Arc::new(model), &[0.5, -0.5], 4).unwrap();
            let mut last = Vec::new();
            for pose in &motion(5, 12).frames {
                last = synthesis.step(pose, &anchor_body(pose)).to_vec();
            }
            last
        };
        let (plain, fine, coarse) = (run(model), run(fine), run(coarse));
        // The old vertices come first. Between them the finer mesh is straight, while the weights of the parts are not.
        let furthest = plain.iter().zip(&fine).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        assert!(furthest < 0.01, "{furthest}");
        assert!(coarse.iter().all(|v| plain.iter().any(|old| old.distance(*v) < 0.02)));
    }
}
