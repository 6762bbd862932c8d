//! The artist-made body (MakeHuman, CC0): one mesh that parameters morph, with joints and skin weights.
//!
//! `x = base + Σ_t (Π factors of t) · target_t`, linear in the targets and piecewise multilinear in the parameters.
//! The file's rest pose (forearms bent forward) is turned into the template pose of this project (arms straight,
//! 45° below horizontal; legs slightly apart) by linear blend skinning with rotations that are fixed per gender, so
//! the model stays linear in its targets; [`MakeHumanModel::normalise_pose`] takes out what is left per body.

mod load;
mod parameters;
mod template_pose;

use std::sync::Arc;

use modiste_core::{Topology, Vec3};

use crate::{Gender, Part};

pub use load::MakeHumanError;
pub use modiste_io::makehuman::BODY_VERTEX_COUNT;
use parameters::Factor;
pub use parameters::{Parameter, ParameterKind};
pub(crate) use template_pose::skin;

/// A displacement of some of the points (m).
#[derive(Debug, Clone, Default)]
pub struct Offsets {
    /// Which points: body vertices, then one joint per part.
    pub points: Vec<u32>,
    /// Displacement of each (m).
    pub values: Vec<[f32; 3]>,
}

impl Offsets {
    /// The displacements that are not zero among one per point (m).
    pub fn from_dense(dense: &[Vec3]) -> Self {
        let mut offsets = Self::default();
        for (index, value) in dense.iter().enumerate() {
            if value.length_squared() > 1e-14 {
                offsets.points.push(index as u32);
                offsets.values.push(value.as_vec3().to_array());
            }
        }
        offsets
    }

    /// Adds `weight` times these displacements to the points.
    pub fn add_to(&self, weight: f64, points: &mut [Vec3]) {
        for (&point, value) in self.points.iter().zip(&self.values) {
            points[point as usize] += weight * Vec3::new(f64::from(value[0]), f64::from(value[1]), f64::from(value[2]));
        }
    }
}

/// A target with the factors whose product is its weight.
#[derive(Debug, Clone)]
struct Term {
    factors: Vec<Factor>,
    offsets: Offsets,
}

/// Values of the parameters of a [`MakeHumanModel`], in the order of [`MakeHumanModel::parameters`].
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters(pub Vec<f64>);

/// The artist-made body of one gender: constant.
#[derive(Debug, Clone)]
pub struct MakeHumanModel {
    gender: Gender,
    topology: Arc<Topology>,
    parameters: Vec<Parameter>,
    base: Vec<Vec3>,
    terms: Vec<Term>,
    skin_weights: Vec<Vec<(Part, f64)>>,
    vertex_parts: Vec<Part>,
    face_parts: Vec<Part>,
    sides: Vec<f64>,
}

impl MakeHumanModel {
    /// Whose body.
    pub fn gender(&self) -> Gender {
        self.gender
    }

    /// The triangles of the body: 13,380 vertices, 26,756 faces, closed.
    pub fn topology(&self) -> &Arc<Topology> {
        &self.topology
    }

    /// The parameters, in the order of [`Parameters`].
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// Index of the parameter with this name, if there is one.
    pub fn parameter_index(&self, name: &str) -> Option<usize> {
        self.parameters.iter().position(|parameter| parameter.name == name)
    }

    /// The average young adult.
    pub fn default_parameters(&self) -> Parameters {
        Parameters(self.parameters.iter().map(|parameter| parameter.default).collect())
    }

    /// Parts that move each vertex, with weights that sum to one; heaviest first.
    pub fn skin_weights(&self) -> &[Vec<(Part, f64)>] {
        &self.skin_weights
    }

    /// The part that moves each vertex most.
    pub fn vertex_parts(&self) -> &[Part] {
        &self.vertex_parts
    }

    /// The part that moves the corners of each face most.
    pub fn face_parts(&self) -> &[Part] {
        &self.face_parts
    }

    /// Side of the body that a vertex belongs to: 1 left, -1 right, 0 on the middle plane.
    pub fn side(&self, vertex: usize) -> f64 {
        self.sides[vertex]
    }

    /// Body vertices (m) in the template pose: feet on `y = 0`, the pelvis joint at `x = z = 0`.
    pub fn vertices(&self, parameters: &Parameters) -> Vec<Vec3> {
        let mut points = self.posed_points(parameters);
        points.truncate(BODY_VERTEX_COUNT);
        points
    }

    /// Body vertices (m), as by [`Self::vertices`], and the proximal joint of each part.
    pub fn vertices_and_joints(&self, parameters: &Parameters) -> (Vec<Vec3>, [Vec3; Part::COUNT]) {
        let mut points = self.posed_points(parameters);
        let joints = joints_of(&points);
        points.truncate(BODY_VERTEX_COUNT);
        (points, joints)
    }

    fn posed_points(&self, parameters: &Parameters) -> Vec<Vec3> {
        let mut points = self.points(&parameters.0);
        self.normalise_pose(&mut points);
        points
    }

    /// Points, which are the body vertices and then one joint per part (m), before [`Self::normalise_pose`].
    pub fn points(&self, values: &[f64]) -> Vec<Vec3> {
        let mut points = self.base.clone();
        for term in &self.terms {
            let weight: f64 = term.factors.iter().map(|factor| factor.value(values)).product();
            if weight != 0.0 {
                term.offsets.add_to(weight, &mut points);
            }
        }
        points
    }

    /// Calls `visit` with each target that matters near `values` and its weight's derivatives `(parameter, ∂w)`.
    ///
    /// `∂x/∂p = Σ_t ∂w_t/∂p · target_t`; a caller that needs only some functionals of `x` applies them to the targets.
    pub fn visit_derivatives(&self, values: &[f64], mut visit: impl FnMut(&Offsets, &[(usize, f64)])) {
        let mut derivatives: Vec<(usize, f64)> = Vec::new();
        for term in &self.terms {
            derivatives.clear();
            for (index, factor) in term.factors.iter().enumerate() {
                for parameter in factor.parameters().into_iter().flatten() {
                    let own = factor.derivative(values, parameter);
                    if own == 0.0 {
                        continue;
                    }
                    let others: f64 = term
                        .factors
                        .iter()
                        .enumerate()
                        .filter(|&(other, _)| other != index)
                        .map(|(_, factor)| factor.value(values))
                        .product();
                    if others != 0.0 {
                        derivatives.push((parameter, own * others));
                    }
                }
            }
            if !derivatives.is_empty() {
                visit(&term.offsets, &derivatives);
            }
        }
    }
}

/// The joints among points: the last [`Part::COUNT`].
pub fn joints_of(points: &[Vec3]) -> [Vec3; Part::COUNT] {
    let mut joints = [Vec3::ZERO; Part::COUNT];
    joints.copy_from_slice(&points[points.len() - Part::COUNT..]);
    joints
}

#[cfg(test)]
pub(crate) mod tests {
    use std::path::Path;
    use std::sync::OnceLock;

    use modiste_core::volume;

    use super::MakeHumanModel;
    use crate::{Gender, Part};

    /// The model of one gender, or `None` (said on the test's output) where the data is absent.
    pub(crate) fn model(gender: Gender) -> Option<&'static MakeHumanModel> {
        static MODELS: OnceLock<Option<[MakeHumanModel; 2]>> = OnceLock::new();
        let models = MODELS.get_or_init(|| {
            let path = Path::new(concat!(
                env!("CARGO_MANIFEST_DIR"),
                "/../../../shared/data/bodies/makehuman_cc0_subset.tar.xz"
            ));
            if !path.exists() {
                eprintln!("skipped: {} is absent", path.display());
                return None;
            }
            let files = modiste_io::makehuman::open(path).expect("readable archive");
            Some(
                [Gender::Female, Gender::Male]
                    .map(|gender| MakeHumanModel::new(&files, gender).expect("complete archive")),
            )
        });
        models.as_ref().map(|models| &models[usize::from(gender == Gender::Male)])
    }

    #[test]
    fn the_average_woman_stands_in_the_template_pose() {
        let Some(model) = model(Gender::Female) else { return };
        assert_eq!(model.topology().vertex_count(), 13_380);
        assert_eq!(model.topology().face_count(), 26_756);
        let (vertices, joints) = model.vertices_and_joints(&model.default_parameters());
        let floor = vertices.iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
        assert!(floor.abs() < 1e-12);
        let stature = vertices.iter().map(|p| p.y).fold(0.0, f64::max);
        assert!((1.5..1.7).contains(&stature), "stature {stature}");
        let litres = 1000.0 * volume(model.topology(), &vertices);
        assert!((40.0..60.0).contains(&litres), "volume {litres}");
        let arm = joints[Part::LeftForearm.index()] - joints[Part::LeftUpperArm.index()];
        let below_horizontal = (-arm.y).atan2(arm.x).to_degrees();
        assert!((40.0..50.0).contains(&below_horizontal), "arm {below_horizontal}");
        let pelvis = joints[Part::Pelvis.index()];
        assert!(pelvis.x.abs() < 1e-12 && pelvis.z.abs() < 1e-12);
    }

    #[test]
    fn derivatives_of_points_agree_with_finite_differences() {
        let Some(model) = model(Gender::Male) else { return };
        // Values off the knots, where the weights are smooth.
        let mut values = model.default_parameters().0;
        for (index, value) in values.iter_mut().enumerate() {
            *value += 0.03 + 0.001 * index as f64;
        }
        for name in ["weight", "height", "torso/torso-vshape"] {
            let parameter = model.parameter_index(name).expect("known parameter");
            let step = 1e-5;
            let mut above = values.clone();
            above[parameter] += step;
            let mut below = values.clone();
            below[parameter] -= step;
            let (above, below) = (model.points(&above), model.points(&below));
            let mut analytic = vec![modiste_core::Vec3::ZERO; above.len()];
            model.visit_derivatives(&values, |offsets, derivatives| {
                for &(by, derivative) in derivatives {
                    if by == parameter {
                        offsets.add_to(derivative, &mut analytic);
                    }
                }
            });
            let worst = above
                .iter()
                .zip(&below)
                .zip(&analytic)
                .map(|((a, b), analytic)| ((*a - *b) / (2.0 * step) - *analytic).length())
                .fold(0.0, f64::max);
            assert!(worst < 1e-7, "{name}: {worst}");
        }
    }

    #[test]
    fn skin_weights_are_a_partition_of_unity_and_mirror() {
        let Some(model) = model(Gender::Female) else { return };
        for weights in model.skin_weights() {
            let total: f64 = weights.iter().map(|(_, weight)| weight).sum();
            assert!((total - 1.0).abs() < 1e-9);
            assert!(weights.is_sorted_by(|a, b| a.1 >= b.1));
        }
        let count = |part| model.vertex_parts().iter().filter(|&&own| own == part).count();
        assert_eq!(count(Part::LeftFoot), count(Part::RightFoot));
        assert_eq!(count(Part::LeftUpperArm), count(Part::RightUpperArm));
        assert!(Part::ALL.into_iter().all(|part| count(part) > 0));
    }
}
