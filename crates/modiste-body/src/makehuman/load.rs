//! Assembles the model of one gender from MakeHuman's files.

use std::collections::HashMap;
use std::sync::Arc;

use modiste_core::{Topology, TopologyError, Vec3};
use modiste_io::IoError;
use modiste_io::makehuman::{BODY_VERTEX_COUNT, MakeHumanFiles, SkinWeights};
use modiste_io::obj::Polygons;

use super::parameters::ParameterTable;
use super::{MakeHumanModel, Offsets, Term};
use crate::{Gender, Part};

/// Metres per unit of the files.
const METRES_PER_DECIMETRE: f64 = 0.1;

/// Why MakeHuman's files do not make a model.
#[derive(Debug, thiserror::Error)]
pub enum MakeHumanError {
    /// A file could not be read.
    #[error(transparent)]
    Io(#[from] IoError),
    /// The base mesh is not MakeHuman's.
    #[error("base.obj: wanted {wanted}, found {found}")]
    Base {
        /// What was wanted.
        wanted: String,
        /// What was found.
        found: String,
    },
    /// The faces of the body are not a mesh.
    #[error("base.obj: {0}")]
    Topology(#[from] TopologyError),
    /// A target moves a vertex that does not exist.
    #[error("{target}.target: vertex {vertex} is not one of the {vertex_count} of base.obj")]
    TargetVertex {
        /// Name of the target.
        target: String,
        /// Index found.
        vertex: usize,
        /// Vertices of the base mesh.
        vertex_count: usize,
    },
    /// A vertex has no skin weight.
    #[error("weights.cmu_mb.json: body vertex {vertex} has no weight")]
    Unweighted {
        /// The vertex at fault.
        vertex: usize,
    },
    /// The weights name a bone that is none of the rig's.
    #[error("weights.cmu_mb.json: unknown bone {bone:?}")]
    UnknownBone {
        /// The bone's name.
        bone: String,
    },
}

/// The joint cube whose middle is the proximal joint of each part, in part order.
const JOINT_CUBES: [&str; Part::COUNT] = [
    "joint-pelvis",
    "joint-spine-4",
    "joint-spine-2",
    "joint-neck",
    "joint-head",
    "joint-l-clavicle",
    "joint-l-shoulder",
    "joint-l-elbow",
    "joint-l-hand",
    "joint-r-clavicle",
    "joint-r-shoulder",
    "joint-r-elbow",
    "joint-r-hand",
    "joint-l-upper-leg",
    "joint-l-knee",
    "joint-l-ankle",
    "joint-r-upper-leg",
    "joint-r-knee",
    "joint-r-ankle",
];

/// The part that a bone of the `cmu_mb` rig belongs to.
fn part_of_bone(bone: &str) -> Option<Part> {
    Some(match bone {
        "Hips" | "LHipJoint" | "RHipJoint" => Part::Pelvis,
        "LowerBack" => Part::Abdomen,
        "Spine" | "Spine1" => Part::Chest,
        "Neck" | "Neck1" => Part::Neck,
        "Head" => Part::Head,
        "LeftShoulder" => Part::LeftShoulder,
        "LeftArm" => Part::LeftUpperArm,
        "LeftForeArm" => Part::LeftForearm,
        "LeftHand" | "LeftFingerBase" | "LeftHandFinger1" | "LThumb" => Part::LeftHand,
        "RightShoulder" => Part::RightShoulder,
        "RightArm" => Part::RightUpperArm,
        "RightForeArm" => Part::RightForearm,
        "RightHand" | "RightFingerBase" | "RightHandFinger1" | "RThumb" => Part::RightHand,
        "LeftUpLeg" => Part::LeftThigh,
        "LeftLeg" => Part::LeftShin,
        "LeftFoot" | "LeftToeBase" => Part::LeftFoot,
        "RightUpLeg" => Part::RightThigh,
        "RightLeg" => Part::RightShin,
        "RightFoot" | "RightToeBase" => Part::RightFoot,
        _ => return None,
    })
}

/// The vertices of the base mesh that become points: body vertices as they are, joints as means of cubes.
struct PointMap {
    vertex_count: usize,
    cubes: [Vec<usize>; Part::COUNT],
}

impl PointMap {
    fn gather(&self, value: impl Fn(usize) -> Vec3) -> Vec<Vec3> {
        let mut points: Vec<Vec3> = (0..BODY_VERTEX_COUNT).map(&value).collect();
        points.extend(self.cubes.iter().map(|cube| cube.iter().map(|&v| value(v)).sum::<Vec3>() / cube.len() as f64));
        points
    }
}

impl MakeHumanModel {
    /// The body of one gender from MakeHuman's files.
    ///
    /// # Errors
    /// When a file is missing, damaged, or not what MakeHuman's is.
    pub fn new(files: &MakeHumanFiles, gender: Gender) -> Result<Self, MakeHumanError> {
        let base = files.base()?;
        let map = point_map(&base)?;
        let topology = Arc::new(body_topology(&base)?);
        let base_points = map.gather(|vertex| METRES_PER_DECIMETRE * base.vertices[vertex]);
        let skin_weights = skin_weights(&files.weights("cmu_mb")?, &base_points[..BODY_VERTEX_COUNT])?;
        let table = ParameterTable::new(gender);
        let mut terms = Vec::with_capacity(table.terms.len());
        for (names, factors) in table.terms {
            let mut dense = vec![Vec3::ZERO; map.vertex_count];
            let mut found = false;
            for name in &names {
                found |= add_target(files, name, &mut dense)?;
            }
            // An absent macro target means no displacement.
            if found {
                let offsets = Offsets::from_dense(&map.gather(|vertex| dense[vertex]));
                terms.push(Term { factors, offsets });
            }
        }
        let vertex_parts: Vec<Part> = skin_weights.iter().map(|weights| weights[0].0).collect();
        let face_parts = topology.faces().iter().map(|face| heaviest_part(*face, &skin_weights)).collect();
        let side = |p: &Vec3| if p.x.abs() < 1e-6 { 0.0 } else { p.x.signum() };
        let sides = base_points[..BODY_VERTEX_COUNT].iter().map(side).collect();
        let mut model = Self {
            gender,
            topology,
            parameters: table.parameters,
            base: base_points,
            terms,
            skin_weights,
            vertex_parts,
            face_parts,
            sides,
        };
        model.move_to_template_pose();
        Ok(model)
    }
}

fn add_target(files: &MakeHumanFiles, name: &str, dense: &mut [Vec3]) -> Result<bool, MakeHumanError> {
    if !files.contains(&format!("{name}.target")) {
        return Ok(false);
    }
    let vertex_count = dense.len();
    for (vertex, offset) in files.target(name)? {
        let vertex = vertex as usize;
        let slot = dense.get_mut(vertex).ok_or_else(|| MakeHumanError::TargetVertex {
            target: name.to_owned(),
            vertex,
            vertex_count,
        })?;
        *slot += METRES_PER_DECIMETRE * offset;
    }
    Ok(true)
}

fn point_map(base: &Polygons) -> Result<PointMap, MakeHumanError> {
    let vertex_count = base.vertices.len();
    if vertex_count < BODY_VERTEX_COUNT {
        return Err(base_error(format!("at least {BODY_VERTEX_COUNT} vertices"), vertex_count.to_string()));
    }
    let mut cubes: [Vec<usize>; Part::COUNT] = Default::default();
    for (cube, name) in cubes.iter_mut().zip(JOINT_CUBES) {
        cube.extend(base.of_group(name).flatten().map(|&vertex| vertex as usize));
        cube.sort_unstable();
        cube.dedup();
        if cube.is_empty() {
            return Err(base_error(format!("a group {name:?}"), "none".to_owned()));
        }
    }
    Ok(PointMap { vertex_count, cubes })
}

fn base_error(wanted: String, found: String) -> MakeHumanError {
    MakeHumanError::Base { wanted, found }
}

fn body_topology(base: &Polygons) -> Result<Topology, MakeHumanError> {
    let mut faces = Vec::new();
    for polygon in base.of_group("body") {
        let [a, b, c, d] = *polygon else {
            return Err(base_error("a body of quads".to_owned(), format!("a polygon of {} corners", polygon.len())));
        };
        faces.extend([[a, b, c], [a, c, d]]);
    }
    Ok(Topology::new(BODY_VERTEX_COUNT, faces)?)
}

/// Weights per body vertex: bones merged to parts, made symmetric, normalised, heaviest first.
fn skin_weights(bones: &SkinWeights, vertices: &[Vec3]) -> Result<Vec<Vec<(Part, f64)>>, MakeHumanError> {
    let mut dense = vec![[0.0; Part::COUNT]; vertices.len()];
    for (bone, entries) in bones {
        let part = part_of_bone(bone).ok_or_else(|| MakeHumanError::UnknownBone { bone: bone.clone() })?;
        for &(vertex, weight) in entries {
            if let Some(row) = dense.get_mut(vertex as usize) {
                row[part.index()] += weight;
            }
        }
    }
    let mirror = mirror_vertices(vertices)?;
    let weights_of = |vertex: usize| -> Result<Vec<(Part, f64)>, MakeHumanError> {
        let own = |part: Part| 0.5 * (dense[vertex][part.index()] + dense[mirror[vertex]][part.mirrored().index()]);
        let total: f64 = Part::ALL.into_iter().map(own).sum();
        if total <= 0.0 {
            return Err(MakeHumanError::Unweighted { vertex });
        }
        let mut weights: Vec<(Part, f64)> =
            Part::ALL.into_iter().map(|part| (part, own(part) / total)).filter(|entry| entry.1 > 0.0).collect();
        weights.sort_by(|a, b| b.1.total_cmp(&a.1));
        Ok(weights)
    };
    (0..vertices.len()).map(weights_of).collect()
}

/// For each vertex the one at its mirror image; the base mesh is symmetric to its six decimals.
fn mirror_vertices(vertices: &[Vec3]) -> Result<Vec<usize>, MakeHumanError> {
    let key = |p: Vec3| [p.x, p.y, p.z].map(|x| (x * 1e5).round() as i64);
    let by_place: HashMap<[i64; 3], usize> = vertices.iter().enumerate().map(|(index, &p)| (key(p), index)).collect();
    let image = |p: Vec3| {
        // Rounding may fall to either side of a cell: look at the neighbours too.
        let [x, y, z] = key(Vec3::new(-p.x, p.y, p.z));
        let cells = (0..27).map(|cell| [x + cell % 3 - 1, y + cell / 3 % 3 - 1, z + cell / 9 - 1]);
        cells.into_iter().find_map(|cell: [i64; 3]| by_place.get(&cell).copied())
    };
    vertices
        .iter()
        .map(|&p| image(p).ok_or_else(|| base_error("a symmetric body".to_owned(), format!("no mirror image of {p}"))))
        .collect()
}

fn heaviest_part(face: [u32; 3], skin_weights: &[Vec<(Part, f64)>]) -> Part {
    let mut totals = [0.0; Part::COUNT];
    for &(part, weight) in face.iter().flat_map(|&vertex| &skin_weights[vertex as usize]) {
        totals[part.index()] += weight;
    }
    let heaviest = |best: Part, part: Part| if totals[part.index()] > totals[best.index()] { part } else { best };
    Part::ALL.into_iter().fold(Part::Pelvis, heaviest)
}
