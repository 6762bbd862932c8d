//! The whole of dressing: choice of size, sewing on one body, carrying to others, coming to rest.

use std::sync::Arc;

use modiste_body::Part;
use modiste_core::{Topology, Vec2, Vec3};

use super::band;
use super::carry::Carrier;
use super::inspect::{DrapeQuality, inspect};
use super::settle::{SettleOptions, Stage};
use super::sew::sew;
use super::{Design, DressError, Mannequin, ReadyMade};
use crate::cut::CutGarment;
use crate::{Attachment, BodyCollider, ClothModel, ClothState, ElasticEdge, Fabric, SolverOptions};

/// The size of what has none.
const MADE_TO_MEASURE: &str = "made to measure";

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
    design: Design,
    form: Form,
    fabric: Fabric,
    options: TailorOptions,
}

/// A design ready to be dressed.
#[derive(Debug, Clone)]
enum Form {
    Cut(Arc<CutGarment>),
    ReadyMade(Arc<ReadyMade>),
}

/// A garment on a body, at rest.
#[derive(Debug, Clone)]
pub struct Dressed {
    /// The size: an index into those of the pattern, or between two; 0 for what is made to measure.
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

/// A garment laid flat, in the size that is chosen for a body.
#[derive(Debug, Clone)]
pub struct FlatGarment {
    /// Name of the size.
    pub size: String,
    /// The welded mesh.
    pub topology: Arc<Topology>,
    /// Rest shape of each face in panel space (m), a band as it is drawn, not gathered.
    pub rest_faces: Vec<[Vec2; 3]>,
}

impl Tailor {
    /// Cuts a pattern, or takes a sewn mesh as it is.
    ///
    /// # Errors
    /// A pattern that cannot be cut, or a material that is not known.
    pub fn new(design: impl Into<Design>, mut options: TailorOptions) -> Result<Self, DressError> {
        let design = design.into();
        options.solver.self_contact |= design.self_contact();
        let Some(fabric) = Fabric::from_name(design.material()) else {
            return Err(DressError::Fabric(design.material().to_owned()));
        };
        let edge_length = match &design {
            Design::Pattern(pattern) => CutGarment::edge_length_for(pattern, options.vertex_count),
            Design::ReadyMade(mesh) => mesh.edge_length(),
        };
        let fabric = fabric.resolved_by(edge_length, Vec3::from_array(options.solver.gravity).length());
        let form = match &design {
            Design::Pattern(pattern) => Form::Cut(Arc::new(CutGarment::new(Arc::clone(pattern), edge_length)?)),
            Design::ReadyMade(mesh) => Form::ReadyMade(Arc::clone(mesh)),
        };
        Ok(Self { design, form, fabric, options })
    }

    /// What the garment is made from.
    pub fn design(&self) -> &Design {
        &self.design
    }

    /// The sewn mesh.
    pub fn topology(&self) -> &Arc<Topology> {
        match &self.form {
            Form::Cut(cut) => cut.topology(),
            Form::ReadyMade(mesh) => mesh.topology(),
        }
    }

    /// Body part of each face.
    pub fn face_parts(&self) -> &[Part] {
        match &self.form {
            Form::Cut(cut) => cut.face_parts(),
            Form::ReadyMade(mesh) => mesh.face_parts(),
        }
    }

    /// Vertices that carry anchors.
    pub fn anchors(&self) -> &[u32] {
        match &self.form {
            Form::Cut(cut) => cut.anchors(),
            Form::ReadyMade(mesh) => mesh.anchors(),
        }
    }

    /// Parts of the body that vertices meet beside those of their faces.
    pub fn covers(&self) -> Vec<(u32, Part)> {
        match &self.form {
            Form::Cut(cut) => {
                let panels = cut.pattern().panels.iter().zip(cut.face_ranges());
                panels
                    .flat_map(|(panel, faces)| {
                        let vertices = cut.topology().faces()[faces].as_flattened().iter();
                        vertices.flat_map(|&vertex| panel.covers.iter().map(move |&part| (vertex, part)))
                    })
                    .collect()
            }
            Form::ReadyMade(mesh) => mesh.covers().to_vec(),
        }
    }

    /// The options.
    pub fn options(&self) -> &TailorOptions {
        &self.options
    }

    /// Dresses a body from the flat panels: places, sews, settles. A sewn mesh is laid on it and settles.
    ///
    /// # Errors
    /// [`DressError`] with the plain reason.
    pub fn dress(&self, body: &Mannequin) -> Result<Dressed, DressError> {
        let collider = BodyCollider::new(Arc::clone(&body.topology), &body.vertices)?;
        match &self.form {
            Form::Cut(cut) => {
                let size = cut.pattern().choose_size(&body.girths());
                let sewn = sew(cut, size, body, &self.fabric, self.options.solver)?;
                let holds = band::hold(cut, size, &sewn.positions, body, &collider);
                let mut dressed = self.settle(sewn.positions, holds, body, &self.options.first_settle)?;
                dressed.widest_seam = sewn.widest_seam;
                Ok(dressed)
            }
            Form::ReadyMade(mesh) => {
                let start = mesh.made_for(body);
                let holds = band::hold_in_place(mesh.band(), &start, &collider);
                self.settle(start, holds, body, &self.options.settle)
            }
        }
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
        let start = carrier.carry(self.topology(), &from.state.positions, &from_body.vertices, &body.vertices);
        self.settle(start, from.model.attachments.clone(), body, &self.options.settle)
    }

    /// The garment as it is cut for a body, before it is sewn.
    pub fn flat(&self, body: &Mannequin) -> FlatGarment {
        let (size, rest_faces) = match &self.form {
            Form::Cut(cut) => {
                let size = cut.pattern().choose_size(&body.girths());
                (cut.pattern().size_name(size).to_owned(), cut.rest_faces(size))
            }
            Form::ReadyMade(mesh) => (MADE_TO_MEASURE.to_owned(), mesh.rest_faces(body)),
        };
        FlatGarment { size, topology: Arc::clone(self.topology()), rest_faces }
    }

    /// The garment of a drape on a body as plain arrays.
    pub fn garment(&self, dressed: &Dressed, body: &Mannequin) -> SewnGarment {
        let (size, rest_faces, waist_band, uv) = match &self.form {
            Form::Cut(cut) => (
                cut.pattern().size_name(dressed.size).to_owned(),
                cut.rest_faces(dressed.size),
                band::band_vertices(cut),
                cut.uv(),
            ),
            Form::ReadyMade(mesh) => {
                let mut band = mesh.band().to_vec();
                band.sort_unstable();
                (MADE_TO_MEASURE.to_owned(), mesh.rest_faces(body), band, mesh.uv())
            }
        };
        SewnGarment {
            name: self.design.garment().to_owned(),
            size,
            topology: Arc::clone(self.topology()),
            rest_faces,
            face_parts: self.face_parts().to_vec(),
            waist_band,
            anchors: self.anchors().to_vec(),
            uv,
        }
    }

    fn settle(
        &self,
        start: Vec<Vec3>,
        holds: Vec<Attachment>,
        body: &Mannequin,
        settle: &SettleOptions,
    ) -> Result<Dressed, DressError> {
        let (size, mut model) = match &self.form {
            Form::Cut(cut) => self.cut_model(cut, &holds, body)?,
            Form::ReadyMade(mesh) => (0.0, mesh.model(body, &self.fabric)?),
        };
        model.attachments = holds;
        let mut state = ClothState::at_rest(start);
        let mut collider = BodyCollider::new(Arc::clone(&body.topology), &body.vertices)?;
        let speed = settle.run(&model, &mut state, &mut collider, self.options.solver)?;
        let quality = inspect(self.face_parts(), &model, &state, body);
        Ok(Dressed { size, state, model, quality, widest_seam: 0.0, speed })
    }

    /// The size that fits, and the physics of the garment in it, its band gathered to the holds.
    fn cut_model(
        &self,
        cut: &CutGarment,
        holds: &[Attachment],
        body: &Mannequin,
    ) -> Result<(f64, ClothModel), DressError> {
        let size = cut.pattern().choose_size(&body.girths());
        let rest = band::gathered_rest_faces(cut, size, holds, body);
        let mut model = ClothModel::new(Arc::clone(cut.topology()), rest, &self.fabric)?;
        let points = cut.points(size);
        for rib in cut.ribs() {
            let [a, b] = rib.loose.map(|v| points[v as usize]);
            let rest_length = rib.scale * a.distance(b);
            let stiffness = rib.modulus / rest_length;
            model.elastic_edges.push(ElasticEdge { vertices: rib.vertices, rest_length, stiffness });
        }
        Ok((size, model))
    }
}

/// Dresses a body in the template pose in a garment, from the flat panels to rest.
///
/// # Errors
/// [`DressError`] with the plain reason, a drape that must not be used among them.
pub fn dress(
    design: impl Into<Design>,
    body: &Mannequin,
    options: TailorOptions,
) -> Result<(SewnGarment, Dressed), DressError> {
    let tailor = Tailor::new(design, options)?;
    let dressed = tailor.dress(body)?;
    dressed.quality.check()?;
    Ok((tailor.garment(&dressed, body), dressed))
}
