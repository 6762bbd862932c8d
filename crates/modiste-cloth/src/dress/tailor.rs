//! The whole of dressing: choice of size, sewing on one body, carrying to others, coming to rest.

use std::sync::Arc;

use modiste_body::Part;
use modiste_core::{Topology, Vec2, Vec3};

use super::band;
use super::carry::Carrier;
use super::inspect::{DrapeQuality, inspect};
use super::settle::{SettleOptions, Stage};
use super::sew::sew;
use super::{DressError, Mannequin};
use crate::cut::CutGarment;
use crate::pattern::GradedPattern;
use crate::{Attachment, BodyCollider, ClothModel, ClothState, ElasticEdge, Fabric, SolverOptions};

/// How bodies are dressed.
#[derive(Debug, Clone, PartialEq)]
pub struct TailorOptions {
    /// About how many vertices the garment has.
    pub vertex_count: usize,
    /// Settings of the physics.
    pub solver: SolverOptions,
    /// How cloth comes to rest after sewing.
    pub first_settle: SettleOptions,
    /// How cloth comes to rest after it was carried to another body.
    pub settle: SettleOptions,
}

impl Default for TailorOptions {
    fn default() -> Self {
        let stages = vec![
            Stage { frames: 30, drag: 1.5, friction: 0.05, damping: 3.0 },
            Stage { frames: 60, drag: 0.4, friction: 0.05, damping: 3.0 },
            Stage { frames: 30, drag: 1.5, friction: 1.0, damping: 3.0 },
        ];
        // Nearer, the points of the body show through between the vertices of the cloth.
        let solver = SolverOptions { thickness: 0.004, max_iterations: 250, ..SolverOptions::default() };
        Self {
            vertex_count: 4500,
            solver,
            first_settle: SettleOptions { stages, ..SettleOptions::default() },
            settle: SettleOptions::default(),
        }
    }
}

/// A garment cut and ready to be put on bodies of one gender.
#[derive(Debug, Clone)]
pub struct Tailor {
    cut: Arc<CutGarment>,
    fabric: Fabric,
    options: TailorOptions,
}

/// A garment on a body, at rest.
#[derive(Debug, Clone)]
pub struct Dressed {
    /// The size: an index into those of the pattern, or between two.
    pub size: f64,
    /// The cloth.
    pub state: ClothState,
    /// The physics of the garment in this size on this body: what [`crate::Solver`] steps on.
    pub model: ClothModel,
    /// What a look at it found.
    pub quality: DrapeQuality,
    /// Widest gap when the seams were welded (m); zero for a drape carried from another body.
    pub widest_seam: f64,
    /// Largest speed at the end (m/s).
    pub speed: f64,
}

/// A sewn garment as plain arrays.
#[derive(Debug, Clone)]
pub struct SewnGarment {
    /// Name, for example `tshirt`.
    pub name: String,
    /// Name of the size.
    pub size: String,
    /// The welded mesh.
    pub topology: Arc<Topology>,
    /// Rest shape of each face in panel space (m).
    pub rest_faces: Vec<[Vec2; 3]>,
    /// Body part of each face.
    pub face_parts: Vec<Part>,
    /// Vertices of the waist band; empty where there is none.
    pub waist_band: Vec<u32>,
    /// Vertices that carry anchors.
    pub anchors: Vec<u32>,
    /// Texture coordinates of the corners of each face.
    pub uv: Vec<[[f32; 2]; 3]>,
}

impl Tailor {
    /// Cuts a pattern.
    ///
    /// # Errors
    /// A pattern that cannot be cut, or a material that is not known.
    pub fn new(pattern: Arc<GradedPattern>, mut options: TailorOptions) -> Result<Self, DressError> {
        options.solver.self_contact |= pattern.self_contact;
        let Some(mut fabric) = Fabric::from_name(&pattern.material) else {
            return Err(DressError::Fabric(pattern.material.clone()));
        };
        let edge_length = CutGarment::edge_length_for(&pattern, options.vertex_count);
        let weight = fabric.density * Vec3::from_array(options.solver.gravity).length();
        fabric.bend = fabric.bend.resolved_by(edge_length, weight);
        let cut = Arc::new(CutGarment::new(pattern, edge_length)?);
        Ok(Self { cut, fabric, options })
    }

    /// The garment in all sizes.
    pub fn cut(&self) -> &Arc<CutGarment> {
        &self.cut
    }

    /// The options.
    pub fn options(&self) -> &TailorOptions {
        &self.options
    }

    /// Dresses a body from the flat panels: places, sews, settles.
    ///
    /// # Errors
    /// [`DressError`] with the plain reason.
    pub fn dress(&self, body: &Mannequin) -> Result<Dressed, DressError> {
        let size = self.cut.pattern().choose_size(&body.girths());
        let sewn = sew(&self.cut, size, body, &self.fabric, self.options.solver)?;
        let collider = BodyCollider::new(Arc::clone(&body.topology), &body.vertices)?;
        let holds = band::hold(&self.cut, size, &sewn.positions, body, &collider);
        let mut dressed = self.settle(size, sewn.positions, holds, body, &self.options.first_settle)?;
        dressed.widest_seam = sewn.widest_seam;
        Ok(dressed)
    }

    /// Dresses another body, alike: the drape `from` on `from_body` is carried along as one body turns into the other, takes
    /// the size that fits, and settles. Folds stay where they were, so that drapes can be compared from body to body.
    ///
    /// The two bodies must have the same topology.
    ///
    /// # Errors
    /// [`DressError`] with the plain reason.
    pub fn redress(
        &self,
        carrier: &Carrier,
        from: &Dressed,
        from_body: &Mannequin,
        body: &Mannequin,
    ) -> Result<Dressed, DressError> {
        let size = self.cut.pattern().choose_size(&body.girths());
        let start = carrier.carry(self.cut.topology(), &from.state.positions, &from_body.vertices, &body.vertices);
        self.settle(size, start, from.model.attachments.clone(), body, &self.options.settle)
    }

    /// The garment of a drape as plain arrays.
    pub fn garment(&self, dressed: &Dressed) -> SewnGarment {
        let pattern = self.cut.pattern();
        SewnGarment {
            name: pattern.garment.clone(),
            size: pattern.size_name(dressed.size).to_owned(),
            topology: Arc::clone(self.cut.topology()),
            rest_faces: self.cut.rest_faces(dressed.size),
            face_parts: self.cut.face_parts().to_vec(),
            waist_band: band::band_vertices(&self.cut),
            anchors: self.cut.anchors().to_vec(),
            uv: self.cut.uv(),
        }
    }

    fn settle(
        &self,
        size: f64,
        start: Vec<Vec3>,
        holds: Vec<Attachment>,
        body: &Mannequin,
        settle: &SettleOptions,
    ) -> Result<Dressed, DressError> {
        let rest = band::gathered_rest_faces(&self.cut, size, &holds, body);
        let mut model = ClothModel::new(Arc::clone(self.cut.topology()), rest, &self.fabric)?;
        model.attachments = holds;
        let points = self.cut.points(size);
        for rib in self.cut.ribs() {
            let [a, b] = rib.loose.map(|v| points[v as usize]);
            let rest_length = rib.scale * a.distance(b);
            let stiffness = rib.modulus / rest_length;
            model.elastic_edges.push(ElasticEdge { vertices: rib.vertices, rest_length, stiffness });
        }
        let mut state = ClothState::at_rest(start);
        let mut collider = BodyCollider::new(Arc::clone(&body.topology), &body.vertices)?;
        let speed = settle.run(&model, &mut state, &mut collider, self.options.solver)?;
        let quality = inspect(&self.cut, &model, &state, body);
        Ok(Dressed { size, state, model, quality, widest_seam: 0.0, speed })
    }
}

/// Dresses a body in the template pose in a garment, from the flat panels to rest.
///
/// # Errors
/// [`DressError`] with the plain reason, a drape that must not be used among them.
pub fn dress(
    pattern: Arc<GradedPattern>,
    body: &Mannequin,
    options: TailorOptions,
) -> Result<(SewnGarment, Dressed), DressError> {
    let tailor = Tailor::new(pattern, options)?;
    let dressed = tailor.dress(body)?;
    dressed.quality.check()?;
    Ok((tailor.garment(&dressed), dressed))
}
