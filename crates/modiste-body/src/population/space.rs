//! The space that bodies are solved in: parameters of the artist-made body and soft directions learned from scans.

use modiste_core::{Rng, Vec3};

use super::subject::bounded_normal;
use crate::Gender;
use crate::makehuman::{BODY_VERTEX_COUNT, MakeHumanModel, Offsets, ParameterKind};

/// Directions of body shape learned from scans, on the points (vertices, then joints) of our topology; coefficients
/// are standard deviations.
#[derive(Debug, Clone, Default)]
pub struct SoftDirections {
    /// Displacement for a coefficient of one (m).
    pub directions: Vec<Offsets>,
}

/// An unknown of the solve, with its normal prior.
#[derive(Debug, Clone, PartialEq)]
pub struct Unknown {
    /// Name: of the MakeHuman parameter, or `soft/00`.
    pub name: String,
    /// Mean of the prior.
    pub mean: f64,
    /// Standard deviation from which the person's own random starting point is drawn.
    pub spread: f64,
    /// Standard deviation that a solve may move it from that starting point.
    pub reach: f64,
    /// Smallest value.
    pub lowest: f64,
    /// Largest value.
    pub highest: f64,
}

/// Direction of [`SoftDirections`] that is mostly the difference between the sexes.
const SEX_DIRECTION: usize = 1;

/// Spread of the sex direction within one gender: its unit variance is over both, and MakeHuman's body already
/// stands at the mean of its gender.
const SEX_SPREAD: f64 = 0.4;

/// Smallest breast firmness: below it the artist's breasts fold into the chest.
const LOWEST_FIRMNESS: f64 = 0.25;

/// All unknowns, and the bodies that they make.
#[derive(Debug)]
pub struct BodySpace<'a> {
    model: &'a MakeHumanModel,
    soft: &'a SoftDirections,
    unknowns: Vec<Unknown>,
}

impl<'a> BodySpace<'a> {
    /// The space of a model with soft directions (none for the twins without them).
    pub fn new(model: &'a MakeHumanModel, soft: &'a SoftDirections) -> Self {
        let mut unknowns: Vec<Unknown> = model
            .parameters()
            .iter()
            .map(|parameter| {
                let (spread, reach) = prior_of(&parameter.name, parameter.kind);
                let margin = match parameter.kind {
                    ParameterKind::Macro if parameter.name != "age" => 0.02,
                    _ => 0.0,
                };
                Unknown {
                    name: parameter.name.clone(),
                    mean: parameter.default,
                    spread,
                    reach,
                    lowest: if parameter.name == "firmness" { LOWEST_FIRMNESS } else { parameter.lowest + margin },
                    highest: parameter.highest - margin,
                }
            })
            .collect();
        unknowns.extend((0..soft.directions.len()).map(|index| {
            let spread = if index == SEX_DIRECTION { SEX_SPREAD } else { 1.0 };
            let name = format!("soft/{index:02}");
            Unknown { name, mean: 0.0, spread, reach: spread, lowest: -3.0, highest: 3.0 }
        }));
        Self { model, soft, unknowns }
    }

    /// The artist-made body below.
    pub fn model(&self) -> &MakeHumanModel {
        self.model
    }

    /// The unknowns: MakeHuman's parameters, then the soft coefficients.
    pub fn unknowns(&self) -> &[Unknown] {
        &self.unknowns
    }

    /// Whose bodies.
    pub fn gender(&self) -> Gender {
        self.model.gender()
    }

    /// The random person that a solve starts from and stays near: a draw of the prior, with the given age (years).
    ///
    /// The soft draws come last, so twins with and without them share all others.
    pub fn draw_person(&self, age: f64, rng: &mut Rng) -> Vec<f64> {
        let mut values: Vec<f64> = self
            .unknowns
            .iter()
            .map(|unknown| {
                let value = unknown.mean + unknown.spread * bounded_normal(rng);
                value.clamp(unknown.lowest, unknown.highest)
            })
            .collect();
        if let Some(index) = self.model.parameter_index("age") {
            // MakeHuman's young is 25 years, its old 90.
            values[index] = (0.5 + 0.5 * (age - 25.0) / 65.0).clamp(0.5, 1.0);
        }
        values
    }

    fn split<'v>(&self, values: &'v [f64]) -> (&'v [f64], &'v [f64]) {
        values.split_at(self.model.parameters().len())
    }

    /// Points (body vertices, then joints; m) in the template pose.
    pub fn points(&self, values: &[f64]) -> Vec<Vec3> {
        let (parameters, coefficients) = self.split(values);
        let mut points = self.model.points(parameters);
        for (direction, &coefficient) in self.soft.directions.iter().zip(coefficients) {
            direction.add_to(coefficient, &mut points);
        }
        self.model.normalise_pose(&mut points);
        points
    }

    /// `∂f/∂unknown` for functionals `f` given by their gradients over the body vertices, row by row of unknowns.
    ///
    /// The small turn of the limbs into the template pose is taken as fixed.
    pub(super) fn pull_back(&self, values: &[f64], gradients: &FunctionalGradients) -> Vec<Vec<f64>> {
        let (parameters, _) = self.split(values);
        let mut rows = vec![vec![0.0; gradients.count]; self.unknowns.len()];
        let mut products = vec![0.0; gradients.count];
        self.model.visit_derivatives(parameters, |offsets, derivatives| {
            // Ages and ancestries are not solved for.
            if derivatives.iter().all(|&(parameter, _)| self.unknowns[parameter].reach == 0.0) {
                return;
            }
            gradients.apply(offsets, &mut products);
            for &(parameter, derivative) in derivatives {
                for (slot, product) in rows[parameter].iter_mut().zip(&products) {
                    *slot += derivative * product;
                }
            }
        });
        for (direction, row) in self.soft.directions.iter().zip(&mut rows[parameters.len()..]) {
            gradients.apply(direction, row);
        }
        rows
    }
}

/// Spread and reach of the prior of a MakeHuman parameter. Ages and ancestries are given, not solved for.
///
/// Details reach little, because far from zero they are caricature; those that only stretch a limb reach further.
fn prior_of(name: &str, kind: ParameterKind) -> (f64, f64) {
    match (name, kind) {
        ("age", _) => (0.0, 0.0),
        (_, ParameterKind::Ancestry) => (0.15, 0.0),
        ("height", _) => (0.05, 0.25),
        ("weight", _) => (0.08, 0.25),
        (_, ParameterKind::Macro) => (0.12, 0.15),
        (name, _) if name.contains("-vert") || name.contains("length") || name.contains("height") => (0.05, 0.35),
        (name, _) if name.starts_with("head/") => (0.08, 0.08),
        (name, _) if name.contains("pregnant") => (0.02, 0.1),
        _ => (0.06, 0.22),
    }
}

/// Gradients of several functionals by the body vertices, arranged by vertex so that applying all of them to a
/// displacement is one pass over it.
#[derive(Debug)]
pub(super) struct FunctionalGradients {
    count: usize,
    starts: Vec<u32>,
    entries: Vec<(u16, Vec3)>,
    /// One functional with a value at every vertex: its index and gradient.
    dense: Option<(usize, Vec<Vec3>)>,
}

impl FunctionalGradients {
    /// From one sparse gradient per functional.
    pub(super) fn new(gradients: Vec<Vec<(u32, Vec3)>>) -> Self {
        let count = gradients.len();
        let mut dense = None;
        let mut triples: Vec<(u32, u16, Vec3)> = Vec::new();
        for (index, gradient) in gradients.into_iter().enumerate() {
            if gradient.len() == BODY_VERTEX_COUNT && dense.is_none() {
                dense = Some((index, gradient.into_iter().map(|(_, g)| g).collect()));
            } else {
                triples.extend(gradient.into_iter().map(|(vertex, g)| (vertex, index as u16, g)));
            }
        }
        triples.sort_by_key(|&(vertex, index, _)| (vertex, index));
        let mut starts = vec![0u32; BODY_VERTEX_COUNT + 1];
        for &(vertex, ..) in &triples {
            starts[vertex as usize + 1] += 1;
        }
        for vertex in 0..BODY_VERTEX_COUNT {
            starts[vertex + 1] += starts[vertex];
        }
        Self { count, starts, entries: triples.into_iter().map(|(_, index, g)| (index, g)).collect(), dense }
    }

    /// The derivative of each functional along a displacement.
    fn apply(&self, offsets: &Offsets, out: &mut [f64]) {
        out.fill(0.0);
        let mut dense_sum = 0.0;
        for (&point, value) in offsets.points.iter().zip(&offsets.values) {
            let vertex = point as usize;
            if vertex >= BODY_VERTEX_COUNT {
                break;
            }
            let value = Vec3::new(f64::from(value[0]), f64::from(value[1]), f64::from(value[2]));
            if let Some((_, gradient)) = &self.dense {
                dense_sum += gradient[vertex].dot(value);
            }
            for &(index, g) in &self.entries[self.starts[vertex] as usize..self.starts[vertex + 1] as usize] {
                out[usize::from(index)] += g.dot(value);
            }
        }
        if let Some((index, _)) = self.dense {
            out[index] += dense_sum;
        }
    }
}
