//! How well a population matches the people that it was solved for.

use modiste_core::Vec3;
use rayon::prelude::*;
use serde::Serialize;

use super::subject::{ANSUR_QUANTITIES, AnsurStatistics, SubjectError};
use super::{Population, mesh_quality};
use crate::{Gender, MakeHumanModel, Measurements, Quantity};

/// Mean and standard deviation of one quantity (m or kg): of the bodies, of their subjects, and of the whole survey.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct QuantityStatistics {
    /// The quantity.
    pub quantity: Quantity,
    /// Mean of the bodies.
    pub mean: f64,
    /// Standard deviation of the bodies.
    pub std_dev: f64,
    /// Mean of the subjects solved for.
    pub target_mean: f64,
    /// Standard deviation of the subjects solved for.
    pub target_std_dev: f64,
    /// Mean of the whole survey.
    pub survey_mean: f64,
    /// Standard deviation of the whole survey.
    pub survey_std_dev: f64,
    /// `|mean / survey_mean - 1|`.
    pub mean_error: f64,
    /// `|std_dev / survey_std_dev - 1|`.
    pub std_dev_error: f64,
    /// What is left between bodies and subjects.
    pub residual: TwinResidual,
    /// The same of the twins without soft directions.
    pub residual_without_soft: TwinResidual,
}

/// What is left between bodies and the measurements that they were solved for (m or kg).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TwinResidual {
    /// Mean of body minus subject.
    pub bias: f64,
    /// Root of the mean square.
    pub rms: f64,
    /// 95th percentile of the magnitude.
    pub percentile_95: f64,
    /// Largest magnitude.
    pub worst: f64,
}

/// The figures of one population.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PopulationStatistics {
    /// Whose bodies.
    pub gender: Gender,
    /// Number of bodies.
    pub count: usize,
    /// Number held out.
    pub held_out: usize,
    /// One per quantity solved for.
    pub quantities: Vec<QuantityStatistics>,
    /// The five quantities whose correlations count: stature, mass, chest, waist, hip.
    pub correlated: [Quantity; 5],
    /// Their correlations among the bodies, row by row.
    pub correlations: [[f64; 5]; 5],
    /// Their correlations in the survey.
    pub survey_correlations: [[f64; 5]; 5],
    /// Largest difference between the two.
    pub worst_correlation_error: f64,
    /// Bodies with a face that crosses another, outside head, hands and feet.
    pub self_intersecting: usize,
    /// Bodies with a face without area.
    pub degenerate: usize,
    /// Mean over the persons of the root mean square distance between a body and its twin without soft directions (m).
    pub twin_distance: f64,
    /// Standard deviation of each soft coefficient over the bodies (1 in the scans that they come from).
    pub soft_std_devs: Vec<f64>,
}

/// Quantities whose correlations are compared.
const CORRELATED: [Quantity; 5] =
    [Quantity::Stature, Quantity::BodyMass, Quantity::ChestGirth, Quantity::WaistGirth, Quantity::HipGirth];

/// Compares a population with its subjects and with the committed figures of the whole survey.
///
/// # Errors
/// When the committed figures are damaged.
pub fn statistics(model: &MakeHumanModel, population: &Population) -> Result<PopulationStatistics, SubjectError> {
    let survey = AnsurStatistics::committed(population.gender)?;
    let size = survey.means.len();
    let covariance = |i: usize, j: usize| survey.covariance[i * size + j];
    let quantities = ANSUR_QUANTITIES
        .iter()
        .enumerate()
        .map(|(index, q)| {
            let values = achieved(population, q.quantity, false);
            let targets: Vec<f64> = population.persons.iter().map(|person| person.targets[index]).collect();
            let survey_mean = survey.means[index] + q.offset;
            let survey_std_dev = covariance(index, index).sqrt();
            QuantityStatistics {
                quantity: q.quantity,
                mean: mean(&values),
                std_dev: std_dev(&values),
                target_mean: mean(&targets),
                target_std_dev: std_dev(&targets),
                survey_mean,
                survey_std_dev,
                mean_error: (mean(&values) / survey_mean - 1.0).abs(),
                std_dev_error: (std_dev(&values) / survey_std_dev - 1.0).abs(),
                residual: residual(&values, &targets),
                residual_without_soft: residual(&achieved(population, q.quantity, true), &targets),
            }
        })
        .collect();
    let place = CORRELATED.map(|quantity| ANSUR_QUANTITIES.iter().position(|q| q.quantity == quantity).unwrap_or(0));
    let columns = CORRELATED.map(|quantity| achieved(population, quantity, false));
    let table = |entry: &dyn Fn(usize, usize) -> f64| {
        let mut rows = [[0.0; 5]; 5];
        for (i, row) in rows.iter_mut().enumerate() {
            for (j, slot) in row.iter_mut().enumerate() {
                *slot = entry(i, j);
            }
        }
        rows
    };
    let correlations = table(&|i, j| correlation(&columns[i], &columns[j]));
    let survey_correlations = table(&|i, j| {
        covariance(place[i], place[j]) / (covariance(place[i], place[i]) * covariance(place[j], place[j])).sqrt()
    });
    let worst_correlation_error = correlations
        .iter()
        .flatten()
        .zip(survey_correlations.iter().flatten())
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max);
    let defects = defects(model, population);
    Ok(PopulationStatistics {
        gender: population.gender,
        count: population.persons.len(),
        held_out: population.persons.iter().filter(|person| person.held_out).count(),
        quantities,
        correlated: CORRELATED,
        correlations,
        survey_correlations,
        worst_correlation_error,
        self_intersecting: defects.iter().filter(|defects| defects.0).count(),
        degenerate: defects.iter().filter(|defects| defects.1).count(),
        twin_distance: mean(&population.persons.iter().map(|person| person.twin_distance).collect::<Vec<f64>>()),
        soft_std_devs: soft_std_devs(population),
    })
}

/// Of each person, whether a face crosses another and whether one is degenerate.
fn defects(model: &MakeHumanModel, population: &Population) -> Vec<(bool, bool)> {
    let of = |person: &super::Person| {
        let vertices: Vec<Vec3> = person.vertices.iter().map(|&p| Vec3::from(p.map(f64::from))).collect();
        let quality = mesh_quality(model.topology(), model.face_parts(), &vertices);
        (!quality.crossings.is_empty(), quality.degenerate_faces > 0)
    };
    population.persons.par_iter().map(of).collect()
}

fn soft_std_devs(population: &Population) -> Vec<f64> {
    let names = population.parameter_names.iter().enumerate();
    names
        .filter(|(_, name)| name.starts_with("soft/"))
        .map(|(index, _)| std_dev(&population.persons.iter().map(|p| p.parameters[index]).collect::<Vec<f64>>()))
        .collect()
}

fn achieved(population: &Population, quantity: Quantity, twin: bool) -> Vec<f64> {
    let of = |measurements: &Measurements| measurements.get(quantity);
    population.persons.iter().map(|p| of(if twin { &p.twin_achieved } else { &p.achieved })).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

fn std_dev(values: &[f64]) -> f64 {
    let centre = mean(values);
    (values.iter().map(|value| (value - centre).powi(2)).sum::<f64>() / values.len().saturating_sub(1).max(1) as f64)
        .sqrt()
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let (ca, cb) = (mean(a), mean(b));
    let product: f64 = a.iter().zip(b).map(|(a, b)| (a - ca) * (b - cb)).sum();
    let scale = std_dev(a) * std_dev(b) * a.len().saturating_sub(1) as f64;
    if scale > 0.0 { product / scale } else { 0.0 }
}

fn residual(values: &[f64], targets: &[f64]) -> TwinResidual {
    let differences: Vec<f64> = values.iter().zip(targets).map(|(value, target)| value - target).collect();
    let mut magnitudes: Vec<f64> = differences.iter().map(|difference| difference.abs()).collect();
    magnitudes.sort_by(f64::total_cmp);
    let at = |share: f64| magnitudes.get((share * magnitudes.len().saturating_sub(1) as f64).round() as usize).copied();
    TwinResidual {
        bias: mean(&differences),
        rms: mean(&differences.iter().map(|d| d * d).collect::<Vec<f64>>()).sqrt(),
        percentile_95: at(0.95).unwrap_or(0.0),
        worst: at(1.0).unwrap_or(0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::{correlation, mean, residual, std_dev};

    #[test]
    fn moments_of_small_samples() {
        let a = [1.0, 2.0, 3.0, 4.0];
        assert!((mean(&a) - 2.5).abs() < 1e-15);
        assert!((std_dev(&a) - (5.0_f64 / 3.0).sqrt()).abs() < 1e-15);
        assert!((correlation(&a, &[2.0, 4.0, 6.0, 8.0]) - 1.0).abs() < 1e-12);
        assert!((correlation(&a, &[-1.0, -2.0, -3.0, -4.0]) + 1.0).abs() < 1e-12);
        let left = residual(&a, &[1.0, 2.0, 3.0, 2.0]);
        assert!((left.bias - 0.5).abs() < 1e-15 && (left.rms - 1.0).abs() < 1e-15 && (left.worst - 2.0).abs() < 1e-15);
    }
}
