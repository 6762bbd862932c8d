//! Carries body shape directions learned from scans to our topology, once, by registering our template to theirs.
//!
//! Coarse to fine: parameters and part rotations of the artist-made body are fitted to their template (poses and
//! proportions differ a little), then every vertex moves smoothly onto it (non-rigid iterative closest points, point
//! to plane). Directions are read off by barycentric interpolation and turned back into our pose.

mod articulated;
mod carry;
mod nonrigid;

use std::path::Path;
use std::sync::Arc;

use modiste_core::{Mat3, SolveError, Topology, TopologyError, TriangleBvh, Vec3, face_normals, vertex_normals};
use modiste_io::{IoError, npz};

use crate::{MakeHumanModel, Part};

pub use carry::{CarriedCheck, carry, check};

/// Why a registration failed.
#[derive(Debug, thiserror::Error)]
pub enum RegistrationError {
    /// The file is missing, damaged, or of another shape.
    #[error(transparent)]
    Io(#[from] IoError),
    /// The faces in the file are not a mesh.
    #[error("{path}: {source}")]
    Topology {
        /// The file.
        path: String,
        /// What is wrong with the faces.
        source: TopologyError,
    },
    /// A least-squares problem could not be solved.
    #[error("registration: {0}")]
    Solve(#[from] SolveError),
}

/// Body shape statistics learned from scans: a template and displacement directions on its own mesh.
#[derive(Debug, Clone)]
pub struct ScanShapes {
    /// The triangles of their mesh.
    pub topology: Arc<Topology>,
    /// Their mean body (m), Y up, arms down.
    pub template: Vec<Vec3>,
    /// Displacement (m) per vertex for a coefficient of one standard deviation, per direction.
    pub directions: Vec<Vec<Vec3>>,
}

impl ScanShapes {
    /// Reads `template` (V, 3), `faces` (T, 3) and `shape_dirs` (K, V, 3).
    ///
    /// # Errors
    /// When the file is missing, damaged, or of another shape.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, RegistrationError> {
        let path = path.as_ref();
        let reader = npz::Reader::open(path)?;
        let template = reader.points("template")?;
        let count = template.len();
        let topology = Topology::new(count, reader.triangles("faces")?)
            .map_err(|source| RegistrationError::Topology { path: path.display().to_string(), source })?;
        let array = reader.f32("shape_dirs")?;
        reader.check_shape("shape_dirs", &array.shape, &[None, Some(count), Some(3)])?;
        let point = |p: &[f32]| Vec3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2]));
        let directions = array.data.chunks_exact(count * 3).map(|d| d.chunks_exact(3).map(point).collect()).collect();
        Ok(Self { topology: Arc::new(topology), template, directions })
    }
}

/// Our template laid onto theirs.
#[derive(Debug, Clone)]
pub struct Registration {
    /// Our vertices (m) on their surface, in their pose.
    pub vertices: Vec<Vec3>,
    /// Rotation of each vertex from our template pose to theirs.
    pub theirs_from_ours: Vec<Mat3>,
    /// Whether the vertex lies on a corresponding place of theirs: false where the topology differs (hands, face,
    /// toes) and the directions are continued smoothly.
    pub matched: Vec<bool>,
}

/// Registers the template of an artist-made body to the template of the scan statistics.
///
/// # Errors
/// When a least-squares problem cannot be solved.
pub fn register(model: &MakeHumanModel, scans: &ScanShapes) -> Result<Registration, RegistrationError> {
    let target = Target::new(&scans.topology, &scans.template);
    let articulated = articulated::fit(model, &target)?;
    let vertices = nonrigid::fit(model, &articulated.vertices, &target)?;
    let normals = vertex_normals(model.topology(), &vertices);
    let matched = (0..vertices.len())
        .map(|vertex| {
            is_comparable(model.vertex_parts()[vertex])
                && target.closest(vertices[vertex], normals[vertex], MATCHED_DISTANCE, 0.5).is_some()
        })
        .collect();
    Ok(Registration { vertices, theirs_from_ours: articulated.rotations, matched })
}

/// Distance (m) below which a registered vertex lies on their surface.
const MATCHED_DISTANCE: f64 = 0.006;

/// Parts whose surface means the same in both topologies: not the fingers, and not the face with its open mouth.
fn is_comparable(part: Part) -> bool {
    !matches!(part, Part::LeftHand | Part::RightHand | Part::Head)
}

/// Their surface, ready for closest-point queries.
struct Target<'a> {
    topology: &'a Topology,
    vertices: &'a [Vec3],
    normals: Vec<Vec3>,
    tree: TriangleBvh,
}

/// A corresponding point of their surface with its normal.
struct Match {
    point: Vec3,
    normal: Vec3,
}

impl<'a> Target<'a> {
    fn new(topology: &'a Topology, vertices: &'a [Vec3]) -> Self {
        let tree = TriangleBvh::new(topology, vertices);
        Self { topology, vertices, normals: face_normals(topology, vertices), tree }
    }

    /// The closest point within `reach` (m) whose normal agrees with `normal` to a cosine of at least `agreement`.
    fn closest(&self, p: Vec3, normal: Vec3, reach: f64, agreement: f64) -> Option<Match> {
        let found = self.tree.closest_point(self.vertices, p, reach)?;
        let own = self.normals[found.face as usize];
        (own.dot(normal) >= agreement).then_some(Match { point: found.point, normal: own })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use modiste_core::Vec3;

    use super::{ScanShapes, carry, check, register};
    use crate::Gender;
    use crate::makehuman::tests::model;

    /// A body of the same model with other parameters stands for the scans, so the truth is known at every vertex.
    #[test]
    fn directions_come_back_from_a_body_whose_correspondence_is_known() {
        let Some(model) = model(Gender::Male) else { return };
        let mut parameters = model.default_parameters();
        parameters.0[model.parameter_index("weight").expect("known")] = 0.7;
        parameters.0[model.parameter_index("height").expect("known")] = 0.6;
        let template: Vec<Vec3> = model.vertices(&parameters).iter().map(|p| *p + Vec3::new(0.02, 0.0, 0.03)).collect();
        // A swelling of the waist, wide against the error of the correspondence, none at the hands, where nothing is
        // read off.
        let swelling = |p: &Vec3| {
            let near = (-((p.y - 1.1) / 0.2).powi(2) - (p.x / 0.2).powi(2)).exp();
            Vec3::new(p.x, 0.0, p.z - 0.03) * (0.1 * near)
        };
        let direction: Vec<Vec3> = template.iter().map(swelling).collect();
        let scans = ScanShapes { topology: Arc::clone(model.topology()), template, directions: vec![direction] };
        let registration = register(model, &scans).expect("registers");
        let soft = carry(model, &scans, &registration).expect("carries");
        let checked = check(model, &scans, &registration, &soft);
        assert!(checked.worst_rms < 0.001, "{checked:?}");
        let mut carried = vec![Vec3::ZERO; model.topology().vertex_count() + crate::Part::COUNT];
        soft.directions[0].add_to(1.0, &mut carried);
        let squared: f64 = scans.directions[0].iter().zip(&carried).map(|(a, b)| a.distance_squared(*b)).sum();
        let rms = (squared / scans.template.len() as f64).sqrt();
        let size = scans.directions[0].iter().map(|d| d.length_squared()).sum::<f64>() / scans.template.len() as f64;
        assert!(rms < 0.1 * size.sqrt(), "{rms} of {}", size.sqrt());
    }
}
