//! Method B: a few small least-squares problems (eq. 32 and 33).

use modiste_core::{Matrix, Vec3, solve_spd};

use super::subspace::add_outer;
use super::{CollisionOptions, Correspondence, Subspace};
use crate::HairError;

/// What the solution did.
#[derive(Debug, Clone, PartialEq)]
pub struct SolveReport {
    /// Coefficients after each round, the last being the result.
    pub rounds: Vec<Vec<f64>>,
    /// Points that were inside at the start of each round.
    pub inside: Vec<usize>,
}

/// Minimises eq. 29 by method B, starting from the prediction `y0`; `roots` are the true places of the roots (m).
///
/// Correspondences are found once; which points are inside is found anew in each round. A point counts `every` times, for
/// those that are left out. Without any point inside, the prediction stays as it is.
///
/// # Errors
/// Numbers that are not finite.
pub fn solve(
    subspace: &Subspace,
    y0: &[f64],
    correspondences: &[Correspondence],
    roots: &[Vec3],
    options: &CollisionOptions,
) -> Result<SolveReport, HairError> {
    let d = subspace.count();
    let (root_gram, root_right) = subspace.root_terms(roots);
    let mut y = y0.to_vec();
    let mut report = SolveReport { rounds: Vec::new(), inside: Vec::new() };
    for _ in 0..options.rounds {
        let mut matrix = Matrix::zeros(d, d);
        let mut right: Vec<f64> = (0..d).map(|k| options.prior * y0[k] + options.roots * root_right[k]).collect();
        let weight = options.penetration * options.every as f64;
        let mut inside = 0;
        for pair in correspondences {
            let position = subspace.position(pair.point, &y);
            let depth = pair.normal.dot(position - pair.at) - options.margin;
            if depth >= 0.0 {
                continue;
            }
            inside += 1;
            let along = subspace.along(pair.point, pair.normal);
            // n · (Q y + μ − b) − margin = along · y + constant
            let constant = depth - along.iter().zip(&y).map(|(a, y)| f64::from(*a) * y).sum::<f64>();
            add_outer(&mut matrix, &along, weight);
            for (value, &a) in right.iter_mut().zip(&along) {
                *value -= weight * constant * f64::from(a);
            }
        }
        report.inside.push(inside);
        if inside == 0 {
            report.rounds.push(y.clone());
            break;
        }
        for i in 0..d {
            for j in 0..=i {
                let entry = matrix[(i, j)] + options.roots * root_gram[(i, j)];
                matrix[(i, j)] = entry;
                matrix[(j, i)] = entry;
            }
            matrix[(i, i)] += options.prior;
        }
        let right = Matrix { rows: d, cols: 1, data: right };
        y = solve_spd(&matrix, &right).map_err(HairError::solving("coefficients of hair without collisions"))?.data;
        report.rounds.push(y.clone());
    }
    Ok(report)
}
