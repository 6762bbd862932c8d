//! A look at a finished drape: inside the body, inside out, stretched?

use modiste_body::Part;
use modiste_core::{TriangleBvh, Vec3, face_normals};

use super::{DressError, Mannequin};
use crate::{ClothModel, ClothState};

/// Deeper than this (m) a vertex counts as inside the body.
const DEPTH_TOLERANCE: f64 = 1e-4;

/// Share of faces that may face the body in a part that is right side out: folds.
const MAX_INWARD_SHARE: f64 = 0.2;

/// Stretch (99th percentile) beyond which a garment does not fit.
const MAX_STRETCH: f64 = 0.12;

/// What a look at a drape found.
#[derive(Debug, Clone, PartialEq)]
pub struct DrapeQuality {
    /// Vertices inside the body.
    pub inside: usize,
    /// The deepest of them (m).
    pub deepest: f64,
    /// The largest share of faces turned towards the body among the garment's parts, and the part.
    pub inward: (f64, Part),
    /// 99th percentile of the edge stretch.
    pub stretch: f64,
}

/// Looks at a drape on a body; `face_parts` tell which part each face belongs to.
pub fn inspect(face_parts: &[Part], model: &ClothModel, state: &ClothState, body: &Mannequin) -> DrapeQuality {
    let tree = TriangleBvh::new(&body.topology, &body.vertices);
    let body_normals = face_normals(&body.topology, &body.vertices);
    let x = &state.positions;
    let (mut inside, mut deepest) = (0, 0.0f64);
    for &p in x {
        if let Some(near) = tree.closest_point(&body.vertices, p, 0.05)
            && near.distance > DEPTH_TOLERANCE
            && tree.contains(&body.vertices, p)
        {
            inside += 1;
            deepest = deepest.max(near.distance);
        }
    }
    let normals = face_normals(model.topology(), x);
    let mut counts = [(0usize, 0usize); Part::COUNT];
    for ((corners, part), normal) in model.topology().faces().iter().zip(face_parts).zip(&normals) {
        let centre: Vec3 = corners.iter().map(|&v| x[v as usize]).sum::<Vec3>() / 3.0;
        let Some(near) = tree.closest_point(&body.vertices, centre, 0.3) else { continue };
        let count = &mut counts[part.index()];
        count.1 += 1;
        // Beside an edge of the body the direction to the body tells inside from outside better than a face's normal.
        let outward = (centre - near.point).normalize_or(body_normals[near.face as usize]);
        count.0 += usize::from(normal.dot(outward) < 0.0 && normal.dot(body_normals[near.face as usize]) < 0.0);
    }
    let share = |part: Part| {
        let (inward, all) = counts[part.index()];
        if all == 0 { 0.0 } else { inward as f64 / all as f64 }
    };
    let worst =
        Part::ALL.into_iter().fold(Part::Pelvis, |worst, part| if share(part) > share(worst) { part } else { worst });
    DrapeQuality { inside, deepest, inward: (share(worst), worst), stretch: state.edge_stretch(model).percentile_99 }
}

impl DrapeQuality {
    /// Refuses a drape that must not be learned from.
    ///
    /// # Errors
    /// The reason.
    pub fn check(&self) -> Result<(), DressError> {
        if self.inside > 0 {
            return Err(DressError::Inside { count: self.inside, deepest: self.deepest });
        }
        let (share, part) = self.inward;
        if share > MAX_INWARD_SHARE {
            return Err(DressError::InsideOut { part: part.name(), share });
        }
        if self.stretch > MAX_STRETCH {
            return Err(DressError::Stretched { stretch: self.stretch });
        }
        Ok(())
    }
}
