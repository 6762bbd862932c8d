//! Learning a SCAPE model from a population in the template pose.

use std::sync::Arc;

use modiste_core::{
    Mat3, Pca, Progress, QuantisedBasis, Topology, Vec3, centroid, face_areas, seeded_rng, vertex_areas,
};

use super::blend::RotationBlend;
use super::joints::fit_joint_regressor;
use super::model::ModelData;
use super::pose_deformation::PoseDeformation;
use super::shape_gradient::shape_gradients;
use super::skin::{Skin, SkinWeights};
use super::training_poses::sample_poses;
use crate::population::Population;
use crate::{BodyError, Gender, MakeHumanModel, Part, Pose, ScapeModel};

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

impl TrainingBodies {
    /// The persons of a population that may be trained on, or those that are held out.
    pub fn from_population(population: &Population, model: &MakeHumanModel, held_out: bool) -> Self {
        let point = |x: &[f32; 3]| Vec3::from_array(x.map(f64::from));
        let chosen = || population.persons.iter().filter(|person| person.held_out == held_out);
        Self {
            gender: population.gender,
            topology: Arc::clone(model.topology()),
            vertices: chosen().map(|person| person.vertices.iter().map(point).collect()).collect(),
            joints: chosen().map(|person| person.joints.each_ref().map(point)).collect(),
            skin_weights: model.skin_weights()[..model.topology().vertex_count()].to_vec(),
        }
    }
}

impl TrainingBodies {
    /// The first `count` bodies alone.
    pub fn first(&self, count: usize) -> Self {
        let count = count.min(self.vertices.len());
        Self { vertices: self.vertices[..count].to_vec(), joints: self.joints[..count].to_vec(), ..self.clone() }
    }
}

/// What can be chosen in training.
#[derive(Debug, Clone, PartialEq)]
pub struct TrainOptions {
    /// Number of shape coefficients β.
    pub shape_count: usize,
    /// Length (m) at which a change of D weighs as much as moving the vertices by that length, in the inner product of
    /// the PCA.
    pub detail_length: f64,
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
            detail_length: 0.03,
            pose_count: 70,
            extra_poses: Vec::new(),
            blend_rotations: true,
            learn_pose_deformation: true,
            ridge: 1e-5,
            negligible: 2e-3,
            seed: 1,
        }
    }
}

/// Licence of a model that was learned from the population.
pub const LICENCE: &str = "CC0-1.0 (MakeHuman shapes and skin); Apache-2.0 (soft directions of the Momentum Human Rig); \
    measurements: ANSUR II, US Army public release";

/// A trained model with what its evaluation needs.
#[derive(Debug, Clone)]
pub struct Trained {
    /// The model.
    pub model: Arc<ScapeModel>,
    /// The principal components of the bodies, as many as were asked for, over [`shape_sample`]s.
    pub shape_space: Pca,
    /// The skin of the mean body that Q was learned from.
    pub skin: Skin,
}

impl Trained {
    /// The model with only the first `count` shape coefficients.
    ///
    /// # Errors
    /// Does not fail for fewer coefficients than there are.
    pub fn with_shape_count(&self, count: usize) -> Result<Arc<ScapeModel>, BodyError> {
        let mut data = self.model.data.clone();
        let (count, width) = (count.min(data.shape_basis.count()), data.shape_basis.dimensions());
        let (scales, values) =
            (data.shape_basis.scales()[..count].to_vec(), data.shape_basis.values()[..count * width].to_vec());
        data.shape_basis = QuantisedBasis::from_parts(scales, values, width)?;
        ScapeModel::new(data)
    }
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
        RotationBlend::from_part_weights(&face_weights, 0.02)
    } else {
        RotationBlend::rigid(&face_parts)
    };

    progress.start("shape", bodies.vertices.len());
    let shape_space = fit_shape_space(bodies, &template, options, progress)?;
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
        cores: part_cores(&bodies.skin_weights),
        vertex_blend: RotationBlend::from_part_weights(&vertex_part_weights(&bodies.skin_weights), 0.01),
        template,
        face_parts,
        vertex_parts,
        blend,
        shape_mean: shape_space.mean[..9 * topology.face_count()].to_vec(),
        shape_basis: scaled_basis(&shape_space, topology.face_count())?,
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

fn vertex_part_weights(skin_weights: &SkinWeights) -> Vec<[f64; Part::COUNT]> {
    let of_vertex = |weights: &Vec<(Part, f64)>| {
        let mut sum = [0.0; Part::COUNT];
        for &(part, weight) in weights {
            sum[part.index()] += weight;
        }
        sum
    };
    skin_weights.iter().map(of_vertex).collect()
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

/// What the PCA sees of a body: D, nine numbers per face, then its vertices (m) about their centroid.
pub fn shape_sample(topology: &Topology, template: &[Vec3], body: &[Vec3]) -> Vec<f32> {
    let centre = centroid(body);
    let mut sample = shape_numbers(topology, template, body);
    sample.extend(body.iter().flat_map(|x| (*x - centre).to_array()).map(|x| x as f32));
    sample
}

/// PCA of D under the inner product `mean_area <Δx, Δx'> + l² mean_area <ΔD, ΔD'>`.
///
/// Means are over the surface, so that the finely meshed face and fingers do not dominate. PCA of D alone (`l → ∞`)
/// spends its components on local detail that hardly moves a vertex while limb lengths, a faint but far-reaching change
/// of D, come late; the first term sees them. The mesh is linear in D, so both terms are quadratic forms of D and every
/// component still is a direction of D. Signs are chosen such that more of a component means more volume.
fn fit_shape_space(
    bodies: &TrainingBodies,
    template: &[Vec3],
    options: &TrainOptions,
    progress: &dyn Progress,
) -> Result<Pca, BodyError> {
    let topology = &bodies.topology;
    let mut samples = Vec::with_capacity(bodies.vertices.len());
    for (done, body) in bodies.vertices.iter().enumerate() {
        samples.push(shape_sample(topology, template, body));
        progress.advance("shape", done + 1);
    }
    let areas = face_areas(topology, template);
    let total: f64 = areas.iter().sum();
    let detail = options.detail_length.powi(2) / total;
    let mut weights: Vec<f32> = areas.iter().flat_map(|area| [(area * detail) as f32; 9]).collect();
    weights.extend(vertex_areas(topology, template).iter().flat_map(|area| [(area / total) as f32; 3]));
    let rows: Vec<&[f32]> = samples.iter().map(Vec::as_slice).collect();
    let mut space = Pca::fit_weighted(&rows, &weights, options.shape_count)?;
    let (width, gradient_width) = (space.dimensions(), 9 * topology.face_count());
    for component in space.basis.chunks_exact_mut(width) {
        if growth(&component[..gradient_width], &weights) < 0.0 {
            component.iter_mut().for_each(|x| *x = -*x);
        }
    }
    Ok(space)
}

/// Mean trace of D's change: positive where the body grows.
fn growth(component: &[f32], weights: &[f32]) -> f64 {
    let trace = |(d, w): (&[f32], &[f32])| f64::from(w[0]) * f64::from(d[0] + d[4] + d[8]);
    component.chunks_exact(9).zip(weights.chunks_exact(9)).map(trace).sum()
}

/// The D of each component times its standard deviation, quantised.
fn scaled_basis(space: &Pca, face_count: usize) -> Result<QuantisedBasis, BodyError> {
    let mut scaled = Vec::with_capacity(9 * face_count * space.count());
    for (row, std_dev) in space.basis.chunks_exact(space.dimensions()).zip(&space.std_devs) {
        scaled.extend(row[..9 * face_count].iter().map(|x| x * *std_dev as f32));
    }
    Ok(QuantisedBasis::from_f32(&scaled, space.count(), 9 * face_count)?)
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

/// For each part the vertices that move with it alone, in equal shares: their mean shows where the part has gone.
fn part_cores(skin_weights: &SkinWeights) -> Vec<Vec<(u32, f32)>> {
    let weight_of = |part: Part, weights: &[(Part, f64)]| -> f64 {
        weights.iter().filter(|(other, _)| *other == part).map(|(_, weight)| weight).sum()
    };
    let core = |part: Part| {
        let largest = skin_weights.iter().map(|weights| weight_of(part, weights)).fold(0.0, f64::max);
        let rigid: Vec<u32> = (0u32..)
            .zip(skin_weights)
            .filter(|(_, weights)| largest > 0.0 && weight_of(part, weights) >= 0.95 * largest)
            .map(|(vertex, _)| vertex)
            .collect();
        let share = 1.0 / rigid.len() as f32;
        rigid.into_iter().map(|vertex| (vertex, share)).collect()
    };
    Part::ALL.into_iter().map(core).collect()
}
