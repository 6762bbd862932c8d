//! Learning a SCAPE model from a population in the template pose.

use std::sync::Arc;

use modiste_core::{Mat3, Pca, Progress, QuantisedBasis, Topology, Vec3, face_areas, seeded_rng};

use super::blend::RotationBlend;
use super::joints::fit_joint_regressor;
use super::model::ModelData;
use super::pose_deformation::PoseDeformation;
use super::shape_gradient::shape_gradients;
use super::skin::{Skin, SkinWeights};
use super::training_poses::sample_poses;
use crate::{BodyError, Gender, Part, Pose, ScapeModel};

/// Bodies in the template pose, in correspondence.
#[derive(Debug, Clone)]
pub struct TrainingBodies {
    /// Whose bodies.
    pub gender: Gender,
    /// Their triangles.
    pub topology: Arc<Topology>,
    /// Vertices of each body (m).
    pub vertices: Vec<Vec<Vec3>>,
    /// Joint of each part of each body (m).
    pub joints: Vec<[Vec3; Part::COUNT]>,
    /// The parts that move each vertex.
    pub skin_weights: SkinWeights,
}

/// What can be chosen in training.
#[derive(Debug, Clone, PartialEq)]
pub struct TrainOptions {
    /// Number of shape coefficients β.
    pub shape_count: usize,
    /// Poses of one individual to learn Q from.
    pub pose_count: usize,
    /// Further poses to learn Q from, such as captured ones.
    pub extra_poses: Vec<Pose>,
    /// Whether the part rotations are blended near joints; plain SCAPE if not.
    pub blend_rotations: bool,
    /// Whether there is a pose deformation at all.
    pub learn_pose_deformation: bool,
    /// Weight of the squared coefficients of Q.
    pub ridge: f64,
    /// Q blocks that deform no edge by more than this share of its length are dropped.
    pub negligible: f64,
    /// Seed of the poses.
    pub seed: u64,
}

impl Default for TrainOptions {
    fn default() -> Self {
        Self {
            shape_count: 20,
            pose_count: 70,
            extra_poses: Vec::new(),
            blend_rotations: true,
            learn_pose_deformation: true,
            ridge: 1e-3,
            negligible: 5e-3,
            seed: 1,
        }
    }
}

/// A trained model with what its evaluation needs.
#[derive(Debug, Clone)]
pub struct Trained {
    /// The model.
    pub model: Arc<ScapeModel>,
    /// The principal components of D, as many as were asked for.
    pub shape_space: Pca,
    /// The skin of the mean body that Q was learned from.
    pub skin: Skin,
}

/// Learns the model: mean body, parts, D by PCA over the bodies, Q by ridge regression over poses of the mean body.
///
/// # Errors
/// Fewer than two bodies, lists of different lengths, or numbers that are not finite.
pub fn train(bodies: &TrainingBodies, options: &TrainOptions, progress: &dyn Progress) -> Result<Trained, BodyError> {
    check(bodies)?;
    let topology = &bodies.topology;
    let (template, joints) = mean_body(bodies);
    let face_weights = face_part_weights(topology, &bodies.skin_weights);
    let vertex_parts: Vec<Part> = bodies.skin_weights.iter().map(|weights| strongest(weights)).collect();
    let face_parts: Vec<Part> = face_weights.iter().map(largest_part).collect();
    let blend = if options.blend_rotations {
        RotationBlend::from_face_weights(&face_weights, 0.02)
    } else {
        RotationBlend::rigid(&face_parts)
    };

    progress.start("shape", bodies.vertices.len());
    let shape_space = fit_shape_space(bodies, &template, options.shape_count, progress)?;
    progress.finish("shape");

    progress.start("pose", options.pose_count + options.extra_poses.len());
    let skin = Skin::new(Arc::clone(topology), template.clone(), joints, bodies.skin_weights.clone());
    let mut poses = sample_poses(&joints, options.pose_count, &mut seeded_rng(options.seed));
    poses.extend(options.extra_poses.iter().cloned());
    let pose_deformation = if options.learn_pose_deformation {
        fit_pose_deformation(&skin, topology, &template, &blend, &face_parts, &poses, options, progress)?
    } else {
        PoseDeformation::none(topology.face_count())
    };
    progress.finish("pose");

    let regressor = fit_joint_regressor(&bodies.vertices, &bodies.joints, &template, &joints, &bodies.skin_weights)?;
    let data = ModelData {
        gender: bodies.gender,
        faces: topology.faces().to_vec(),
        pelvis_anchor: pelvis_anchor(&bodies.skin_weights),
        template,
        face_parts,
        vertex_parts,
        blend,
        shape_mean: shape_space.mean.clone(),
        shape_basis: scaled_basis(&shape_space)?,
        pose_deformation,
        joints: regressor,
    };
    Ok(Trained { model: ScapeModel::new(data)?, shape_space, skin })
}

fn check(bodies: &TrainingBodies) -> Result<(), BodyError> {
    let size = |what: &'static str, wanted: usize, found: usize| {
        if wanted == found { Ok(()) } else { Err(BodyError::Size { what, wanted: wanted.to_string(), found }) }
    };
    if bodies.vertices.len() < 2 {
        return Err(BodyError::Size {
            what: "bodies to learn from",
            wanted: "at least 2".to_owned(),
            found: bodies.vertices.len(),
        });
    }
    size("joints of the bodies", bodies.vertices.len(), bodies.joints.len())?;
    size("skin weights", bodies.topology.vertex_count(), bodies.skin_weights.len())?;
    for body in &bodies.vertices {
        size("vertices of a body", bodies.topology.vertex_count(), body.len())?;
    }
    Ok(())
}

/// Mean vertices and joints (m), the pelvis joint above the origin and the lowest vertex at y = 0.
fn mean_body(bodies: &TrainingBodies) -> (Vec<Vec3>, [Vec3; Part::COUNT]) {
    let count = bodies.vertices.len() as f64;
    let mut template = vec![Vec3::ZERO; bodies.topology.vertex_count()];
    for body in &bodies.vertices {
        for (mean, x) in template.iter_mut().zip(body) {
            *mean += *x / count;
        }
    }
    let mut joints: [Vec3; Part::COUNT] =
        std::array::from_fn(|part| bodies.joints.iter().map(|joints| joints[part]).sum::<Vec3>() / count);
    let floor = template.iter().map(|x| x.y).fold(f64::INFINITY, f64::min);
    let offset = Vec3::new(-joints[0].x, -floor, -joints[0].z);
    for x in template.iter_mut().chain(&mut joints) {
        *x += offset;
    }
    (template, joints)
}

fn strongest(weights: &[(Part, f64)]) -> Part {
    weights.iter().fold((Part::Pelvis, f64::NEG_INFINITY), |best, &next| if next.1 > best.1 { next } else { best }).0
}

/// Mean skin weights of each face's corners.
fn face_part_weights(topology: &Topology, skin_weights: &SkinWeights) -> Vec<[f64; Part::COUNT]> {
    let of_face = |face: &[u32; 3]| {
        let mut sum = [0.0; Part::COUNT];
        for &(part, weight) in face.iter().flat_map(|&vertex| &skin_weights[vertex as usize]) {
            sum[part.index()] += weight / 3.0;
        }
        sum
    };
    topology.faces().iter().map(of_face).collect()
}

fn largest_part(weights: &[f64; Part::COUNT]) -> Part {
    Part::ALL
        .into_iter()
        .fold(Part::Pelvis, |best, part| if weights[part.index()] > weights[best.index()] { part } else { best })
}

/// D of every body relative to the template, one row of nine numbers per face.
pub(crate) fn shape_numbers(topology: &Topology, template: &[Vec3], body: &[Vec3]) -> Vec<f32> {
    let gradients = shape_gradients(topology, template, body);
    gradients.iter().flat_map(Mat3::to_cols_array).map(|x| x as f32).collect()
}

/// PCA of D in which every triangle counts by its area, so that the finely meshed face and fingers do not dominate.
/// Each component's sign is chosen such that more of it means more volume.
fn fit_shape_space(
    bodies: &TrainingBodies,
    template: &[Vec3],
    count: usize,
    progress: &dyn Progress,
) -> Result<Pca, BodyError> {
    let topology = &bodies.topology;
    let mut samples = Vec::with_capacity(bodies.vertices.len());
    for (done, body) in bodies.vertices.iter().enumerate() {
        samples.push(shape_numbers(topology, template, body));
        progress.advance("shape", done + 1);
    }
    let areas = face_areas(topology, template);
    let total: f64 = areas.iter().sum();
    let weights: Vec<f32> = areas.iter().flat_map(|area| [(area / total) as f32; 9]).collect();
    let rows: Vec<&[f32]> = samples.iter().map(Vec::as_slice).collect();
    let mut space = Pca::fit_weighted(&rows, &weights, count)?;
    let width = space.dimensions();
    for k in 0..space.count() {
        if growth(&space.basis[k * width..(k + 1) * width], &weights) < 0.0 {
            space.basis[k * width..(k + 1) * width].iter_mut().for_each(|x| *x = -*x);
        }
    }
    Ok(space)
}

/// Mean trace of D's change: positive where the body grows.
fn growth(component: &[f32], weights: &[f32]) -> f64 {
    let trace = |(d, w): (&[f32], &[f32])| f64::from(w[0]) * f64::from(d[0] + d[4] + d[8]);
    component.chunks_exact(9).zip(weights.chunks_exact(9)).map(trace).sum()
}

/// The components, each times its standard deviation, quantised.
fn scaled_basis(space: &Pca) -> Result<QuantisedBasis, BodyError> {
    let width = space.dimensions();
    let mut scaled = space.basis.clone();
    for (row, std_dev) in scaled.chunks_exact_mut(width).zip(&space.std_devs) {
        row.iter_mut().for_each(|x| *x *= *std_dev as f32);
    }
    Ok(QuantisedBasis::from_f32(&scaled, space.count(), width)?)
}

/// Q from examples: what is left of each triangle's deformation once its rotation is taken out (D is the identity, for
/// the individual is the template).
#[expect(clippy::too_many_arguments, reason = "the pieces of a model under construction, used once")]
fn fit_pose_deformation(
    skin: &Skin,
    topology: &Topology,
    template: &[Vec3],
    blend: &RotationBlend,
    face_parts: &[Part],
    poses: &[Pose],
    options: &TrainOptions,
    progress: &dyn Progress,
) -> Result<PoseDeformation, BodyError> {
    let mut targets = Vec::with_capacity(poses.len());
    for (done, pose) in poses.iter().enumerate() {
        let mut gradients = shape_gradients(topology, template, &skin.pose(pose));
        let quaternions = pose.world_quaternions();
        let matrices = quaternions.map(Mat3::from_quat);
        for (face, gradient) in gradients.iter_mut().enumerate() {
            *gradient = blend.rotation(face, &quaternions, &matrices).transpose() * *gradient;
        }
        targets.push(gradients);
        progress.advance("pose", done + 1);
    }
    Ok(PoseDeformation::fit(face_parts, poses, &targets, options.ridge, options.negligible)?)
}

/// The vertices that move with the pelvis alone, in equal shares: their mean carries the pelvis joint in every pose.
fn pelvis_anchor(skin_weights: &SkinWeights) -> Vec<(u32, f32)> {
    let weight =
        |weights: &[(Part, f64)]| weights.iter().filter(|(part, _)| *part == Part::Pelvis).map(|(_, w)| w).sum::<f64>();
    let largest = skin_weights.iter().map(|weights| weight(weights)).fold(0.0, f64::max);
    let rigid: Vec<u32> = (0u32..)
        .zip(skin_weights)
        .filter(|(_, weights)| weight(weights) >= 0.95 * largest)
        .map(|(vertex, _)| vertex)
        .collect();
    let share = 1.0 / rigid.len() as f32;
    rigid.into_iter().map(|vertex| (vertex, share)).collect()
}
