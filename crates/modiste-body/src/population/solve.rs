//! One body for one subject: regularised least squares by Gauss-Newton with bounds.

use modiste_core::{Matrix, SolveError, Vec3, solve_spd};

use super::space::{BodySpace, FunctionalGradients};
use super::subject::{ANSUR_QUANTITIES, Subject};
use super::untangle::untangle;
use crate::makehuman::BODY_VERTEX_COUNT;
use crate::{MeasureTemplate, Measurements, measure};

const MAX_ITERATIONS: usize = 14;

/// Relative fall of the cost below which a solve has converged.
const COST_TOLERANCE: f64 = 1e-3;

/// A solved body.
#[derive(Debug, Clone)]
pub struct SolvedBody {
    /// Values of the unknowns.
    pub values: Vec<f64>,
    /// Points (body vertices, then joints; m) in the template pose.
    pub points: Vec<Vec3>,
    /// What they measure.
    pub measurements: Measurements,
    /// Whether no face crosses another.
    pub untangled: bool,
}

/// Finds the body nearest to the random person `start` that measures as the subject does.
///
/// Minimises `Σ ((m - target) / tolerance)² + Σ ((x - start) / reach)²` within bounds. The starting point is a draw of
/// the prior, so what the measurements do not determine keeps the variation of the population.
///
/// # Errors
/// When the normal equations cannot be solved.
pub fn solve_subject(
    space: &BodySpace<'_>,
    template: &MeasureTemplate,
    subject: &Subject,
    start: &[f64],
) -> Result<SolvedBody, SolveError> {
    let problem = Problem { space, template, subject, start };
    let mut state = problem.evaluate(start.to_vec());
    for _ in 0..MAX_ITERATIONS {
        let step = problem.step(&state)?;
        let mut better = None;
        for halving in 0..5 {
            let scale = 0.5_f64.powi(halving);
            let candidate = problem.evaluate(problem.clamped(&state.values, &step, scale));
            if candidate.cost < state.cost {
                better = Some(candidate);
                break;
            }
        }
        let Some(next) = better else { break };
        let converged = state.cost - next.cost < COST_TOLERANCE * state.cost;
        state = next;
        if converged {
            break;
        }
    }
    let State { values, mut points, .. } = state;
    let untangled = untangle(space.model(), &mut points);
    let measurements = measure(template, &points[..BODY_VERTEX_COUNT]);
    Ok(SolvedBody { values, points, measurements, untangled })
}

struct Problem<'a> {
    space: &'a BodySpace<'a>,
    template: &'a MeasureTemplate,
    subject: &'a Subject,
    start: &'a [f64],
}

struct State {
    values: Vec<f64>,
    points: Vec<Vec3>,
    cost: f64,
}

impl Problem<'_> {
    fn evaluate(&self, values: Vec<f64>) -> State {
        let points = self.space.points(&values);
        let measured = measure(self.template, &points[..BODY_VERTEX_COUNT]);
        let data: f64 = ANSUR_QUANTITIES
            .iter()
            .zip(self.subject.measurements)
            .map(|(q, target)| ((measured.get(q.quantity) - target) / q.tolerance).powi(2))
            .sum();
        let prior: f64 = self
            .space
            .unknowns()
            .iter()
            .zip(values.iter().zip(self.start))
            .filter(|(unknown, _)| unknown.reach > 0.0)
            .map(|(unknown, (value, start))| ((value - start) / unknown.reach).powi(2))
            .sum();
        State { values, points, cost: data + prior }
    }

    fn clamped(&self, values: &[f64], step: &[f64], scale: f64) -> Vec<f64> {
        let bounded = |((value, step), unknown): ((&f64, &f64), &super::space::Unknown)| {
            (value + scale * step).clamp(unknown.lowest, unknown.highest)
        };
        values.iter().zip(step).zip(self.space.unknowns()).map(bounded).collect()
    }

    /// The Gauss-Newton step; unknowns at a bound that it would push out are held there.
    fn step(&self, state: &State) -> Result<Vec<f64>, SolveError> {
        let vertices = &state.points[..BODY_VERTEX_COUNT];
        let mut residuals = Vec::new();
        let mut gradients = Vec::new();
        for (q, target) in ANSUR_QUANTITIES.iter().zip(self.subject.measurements) {
            let (value, gradient) = self.template.quantity_with_gradient(q.quantity, vertices);
            residuals.push((value - target) / q.tolerance);
            gradients.push(gradient);
        }
        let mut jacobian = self.space.pull_back(&state.values, &FunctionalGradients::new(gradients));
        for row in &mut jacobian {
            for (entry, q) in row.iter_mut().zip(ANSUR_QUANTITIES) {
                *entry /= q.tolerance;
            }
        }
        let mut free: Vec<usize> =
            (0..jacobian.len()).filter(|&index| self.space.unknowns()[index].reach > 0.0).collect();
        loop {
            let step = self.step_of(&jacobian, &residuals, state, &free)?;
            let pushes_out = |&index: &usize| {
                let unknown = &self.space.unknowns()[index];
                let value = state.values[index];
                (value <= unknown.lowest && step[index] < 0.0) || (value >= unknown.highest && step[index] > 0.0)
            };
            let before = free.len();
            free.retain(|index| !pushes_out(index));
            if free.len() == before {
                return Ok(step);
            }
        }
    }

    /// `(JᵀJ + Λ) δ = -Jᵀr - Λ (x - start)` over the free unknowns, with `Λ = reach⁻²`.
    fn step_of(
        &self,
        jacobian: &[Vec<f64>],
        residuals: &[f64],
        state: &State,
        free: &[usize],
    ) -> Result<Vec<f64>, SolveError> {
        let mut normal = Matrix::zeros(free.len(), free.len());
        let mut rhs = Matrix::zeros(free.len(), 1);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        for (i, &p) in free.iter().enumerate() {
            for (j, &q) in free.iter().enumerate().take(i + 1) {
                let entry = dot(&jacobian[p], &jacobian[q]);
                normal[(i, j)] = entry;
                normal[(j, i)] = entry;
            }
            let stiffness = self.space.unknowns()[p].reach.powi(-2);
            normal[(i, i)] += stiffness;
            rhs[(i, 0)] = -dot(&jacobian[p], residuals) - stiffness * (state.values[p] - self.start[p]);
        }
        let solution = solve_spd(&normal, &rhs)?;
        let mut step = vec![0.0; jacobian.len()];
        for (i, &p) in free.iter().enumerate() {
            step[p] = solution[(i, 0)];
        }
        Ok(step)
    }
}

#[cfg(test)]
mod tests {
    use modiste_core::{Vec3, seeded_rng};

    use super::solve_subject;
    use crate::makehuman::tests::model;
    use crate::population::space::{BodySpace, FunctionalGradients, SoftDirections};
    use crate::population::{ANSUR_QUANTITIES, AnsurStatistics};
    use crate::{Gender, MeasureTemplate, Quantity};

    #[test]
    fn a_drawn_man_gets_a_body_of_his_measurements() {
        let Some(model) = model(Gender::Male) else { return };
        let none = SoftDirections::default();
        let space = BodySpace::new(model, &none);
        let template = MeasureTemplate::new(model.topology(), model.face_parts()).expect("our topology");
        let subject = &AnsurStatistics::committed(Gender::Male).expect("figures").draw(1, 5).expect("covariance")[0];
        let start = space.draw_person(subject.age, &mut seeded_rng(1));
        let body = solve_subject(&space, &template, subject, &start).expect("solvable");
        assert!(body.untangled);
        for (q, target) in ANSUR_QUANTITIES.iter().zip(subject.measurements).take(5) {
            let error = body.measurements.get(q.quantity) - target;
            assert!(error.abs() < 6.0 * q.tolerance, "{:?}: {error}", q.quantity);
        }
        for (unknown, value) in space.unknowns().iter().zip(&body.values) {
            assert!((unknown.lowest..=unknown.highest).contains(value), "{}", unknown.name);
        }
    }

    #[test]
    fn derivatives_of_measurements_agree_with_finite_differences() {
        let Some(model) = model(Gender::Female) else { return };
        let none = SoftDirections::default();
        let space = BodySpace::new(model, &none);
        let template = MeasureTemplate::new(model.topology(), model.face_parts()).expect("our topology");
        // Off the knots of the parameters, where their weights are smooth.
        let mut values = model.default_parameters().0;
        for (index, value) in values.iter_mut().enumerate() {
            *value += 0.02 + 0.001 * index as f64;
        }
        let quantities = [Quantity::Stature, Quantity::BodyMass, Quantity::WaistGirth];
        let gradients = {
            let points = space.points(&values);
            quantities.map(|q| template.quantity_with_gradient(q, &points[..13_380]).1).to_vec()
        };
        let rows = space.pull_back(&values, &FunctionalGradients::new(gradients));
        for name in ["weight", "height", "torso/torso-scale-depth"] {
            let parameter = model.parameter_index(name).expect("known");
            let at = |step: f64| {
                let mut values = values.clone();
                values[parameter] += step;
                let points: Vec<Vec3> = space.points(&values)[..13_380].to_vec();
                quantities.map(|q| template.quantity_with_gradient(q, &points).0)
            };
            let (above, below) = (at(1e-4), at(-1e-4));
            for (index, quantity) in quantities.into_iter().enumerate() {
                let numeric = (above[index] - below[index]) / 2e-4;
                // The small turn of the limbs into the template pose is left out of the derivative.
                let slack = 0.05 * numeric.abs() + 0.005;
                assert!((rows[parameter][index] - numeric).abs() < slack, "{name} {quantity:?}: {numeric}");
            }
        }
    }
}
