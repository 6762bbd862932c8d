//! Method A: gradient descent on the robust error (eq. 28 and 29).

use modiste_core::Vec3;

use super::{CollisionOptions, Correspondence, Subspace};

/// How method A goes downhill.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DescentOptions {
    /// σ of the robust error (m): deeper points pull no more than this. The text leaves it open.
    pub sigma: f64,
    /// Most steps.
    pub steps: usize,
    /// Stops when a step changes the energy by less than this part of it.
    pub tolerance: f64,
}

impl Default for DescentOptions {
    fn default() -> Self {
        Self { sigma: 0.05, steps: 200, tolerance: 1e-5 }
    }
}

/// Minimises eq. 29 from the prediction `y0` by gradient descent with backtracking; `roots` are the true places of the roots.
///
/// The robust error `ρ(x) = x² / (σ² + x²)` has no unit; it is multiplied by σ² so that near the surface, where it is `x²`,
/// the weights mean what they mean in method B.
pub fn descend(
    subspace: &Subspace,
    y0: &[f64],
    correspondences: &[Correspondence],
    roots: &[Vec3],
    options: &CollisionOptions,
    descent: &DescentOptions,
) -> Vec<f64> {
    let energy =
        |y: &[f64], gradient: &mut [f64]| energy(subspace, y, y0, correspondences, roots, options, descent, gradient);
    let d = subspace.count();
    let mut y = y0.to_vec();
    let mut gradient = vec![0.0; d];
    let mut value = energy(&y, &mut gradient);
    let mut step = 1.0;
    let mut trial_gradient = vec![0.0; d];
    for _ in 0..descent.steps {
        let slope: f64 = gradient.iter().map(|g| g * g).sum();
        if slope < 1e-24 {
            break;
        }
        let mut found = None;
        for _ in 0..40 {
            let trial: Vec<f64> = y.iter().zip(&gradient).map(|(y, g)| y - step * g).collect();
            let trial_value = energy(&trial, &mut trial_gradient);
            if trial_value <= value - 1e-4 * step * slope {
                found = Some((trial, trial_value));
                break;
            }
            step *= 0.5;
        }
        let Some((trial, trial_value)) = found else { break };
        let change = value - trial_value;
        (y, value) = (trial, trial_value);
        std::mem::swap(&mut gradient, &mut trial_gradient);
        step *= 2.0;
        if change < descent.tolerance * value {
            break;
        }
    }
    y
}

/// E(y), and its gradient.
#[expect(clippy::too_many_arguments, reason = "the terms of one equation")]
fn energy(
    subspace: &Subspace,
    y: &[f64],
    y0: &[f64],
    correspondences: &[Correspondence],
    roots: &[Vec3],
    options: &CollisionOptions,
    descent: &DescentOptions,
    gradient: &mut [f64],
) -> f64 {
    gradient.fill(0.0);
    let prior = options.prior_weight(subspace);
    let mut sum = options.roots * subspace.root_error(y, roots, options.roots, gradient);
    for k in 0..y.len() {
        sum += prior * (y[k] - y0[k]).powi(2);
        gradient[k] += 2.0 * prior * (y[k] - y0[k]);
    }
    let square = descent.sigma * descent.sigma;
    let weight = options.penetration * options.every as f64;
    let mut along = vec![0.0; y.len()];
    for pair in correspondences {
        let depth = pair.normal.dot(subspace.position(pair.point, y) - pair.at) - options.margin;
        if depth >= 0.0 {
            continue;
        }
        let spread = square + depth * depth;
        sum += weight * square * depth * depth / spread;
        let slope = weight * square * 2.0 * depth * square / (spread * spread);
        subspace.along(pair.point, pair.normal, &mut along);
        for (value, a) in gradient.iter_mut().zip(&along) {
            *value += slope * a;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::super::{CollisionOptions, Correspondence, Subspace, solve};
    use super::{DescentOptions, descend, energy};
    use modiste_core::{QuantisedBasis, Vec3, normal, seeded_rng};

    /// 30 points about a ball's top, linear in 6 coefficients, some of them below the plane y = 0.
    fn scene() -> (Subspace, Vec<f64>, Vec<Correspondence>, Vec<Vec3>) {
        let mut rng = seeded_rng(2);
        let (points, d) = (30, 6);
        let basis: Vec<f32> = (0..d * 3 * points).map(|_| 0.1 * normal(&mut rng) as f32).collect();
        let basis = QuantisedBasis::from_f32(&basis, d, 3 * points).unwrap();
        let mean: Vec<f32> = (0..3 * points).map(|_| 0.02 * normal(&mut rng) as f32).collect();
        let subspace = Subspace::new(&mean, &basis, (0..points).collect(), vec![0, 7]).unwrap();
        let y: Vec<f64> = (0..d).map(|_| 0.1 * normal(&mut rng)).collect();
        let pairs = (0..points).map(|point| Correspondence { point, at: Vec3::ZERO, normal: Vec3::Y }).collect();
        (subspace, y, pairs, vec![Vec3::new(0.0, 0.02, 0.0); 2])
    }

    #[test]
    fn the_gradient_is_the_slope() {
        let (subspace, y0, pairs, roots) = scene();
        let (options, descent) = (CollisionOptions::default(), DescentOptions::default());
        // Away from the prediction, where no point lies exactly on the plane.
        let y: Vec<f64> = y0.iter().map(|y| 0.7 * y + 0.01).collect();
        let mut gradient = vec![0.0; y.len()];
        energy(&subspace, &y, &y0, &pairs, &roots, &options, &descent, &mut gradient);
        for k in 0..y.len() {
            let side = |step: f64| {
                let mut moved = y.clone();
                moved[k] += step;
                energy(&subspace, &moved, &y0, &pairs, &roots, &options, &descent, &mut vec![0.0; y.len()])
            };
            let slope = (side(1e-6) - side(-1e-6)) / 2e-6;
            assert!((slope - gradient[k]).abs() < 1e-5 * (1.0 + slope.abs()), "{k}: {slope} {}", gradient[k]);
        }
    }

    #[test]
    fn both_methods_let_points_out_and_agree() {
        let (subspace, y0, pairs, roots) = scene();
        // With a wide σ the robust error is the square that method B takes.
        let options = CollisionOptions { penetration: 10.0, prior: 130.0, rounds: 30, ..CollisionOptions::default() };
        let descent = DescentOptions { sigma: 10.0, steps: 4000, tolerance: 1e-13 };
        let depth = |y: &[f64]| -> f64 {
            (0..subspace.point_count()).map(|point| (-subspace.position(point, y).y).max(0.0).powi(2)).sum()
        };
        let by_squares = solve(&subspace, &y0, &pairs, &roots, &options).unwrap();
        let by_descent = descend(&subspace, &y0, &pairs, &roots, &options, &descent);
        let squares = by_squares.rounds.last().unwrap();
        assert!(depth(squares) < 0.3 * depth(&y0), "{} of {}", depth(squares), depth(&y0));
        assert!(by_squares.inside[0] > 3);
        let apart: f64 = squares.iter().zip(&by_descent).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        let moved: f64 = squares.iter().zip(&y0).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        assert!(apart < 0.05 * moved, "{apart} of {moved}");
    }
}
