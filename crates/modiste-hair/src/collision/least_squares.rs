//! Method B: a few small least-squares problems (eq. 32 and 33).

use modiste_core::{Matrix, Vec3, solve_spd};
use rayon::prelude::*;

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
    let weight = options.penetration * options.every as f64;
    let prior = options.prior_weight(subspace);
    let mut y = y0.to_vec();
    let mut report = SolveReport { rounds: Vec::new(), inside: Vec::new() };
    // Normal equations of the points that are inside; from round to round, few come and go.
    let mut gram = Matrix::zeros(d, d);
    let mut right: Vec<f64> = (0..d).map(|k| prior * y0[k] + options.roots * root_right[k]).collect();
    let mut counted = vec![false; correspondences.len()];
    for _ in 0..options.rounds {
        let depths: Vec<f64> = correspondences
            .par_iter()
            .with_min_len(64)
            .map(|pair| pair.normal.dot(subspace.position(pair.point, &y) - pair.at) - options.margin)
            .collect();
        for comes in [true, false] {
            let changed: Vec<usize> =
                (0..depths.len()).filter(|&i| (depths[i] < 0.0) == comes && counted[i] != comes).collect();
            if changed.is_empty() {
                continue;
            }
            let mut rows = Matrix::zeros(changed.len(), d);
            rows.data.par_chunks_mut(d).zip(&changed).with_min_len(64).for_each(|(row, &index)| {
                let pair = &correspondences[index];
                subspace.along(pair.point, pair.normal, row);
            });
            let weight = if comes { weight } else { -weight };
            for (entry, more) in gram.data.iter_mut().zip(&rows.transpose_matmul(&rows).data) {
                *entry += weight * more;
            }
            for (row, &index) in rows.data.chunks_exact(d).zip(&changed) {
                // n · (Q y + μ − b) − margin = row · y + constant
                let constant = depths[index] - row.iter().zip(&y).map(|(a, y)| a * y).sum::<f64>();
                for (value, &a) in right.iter_mut().zip(row) {
                    *value -= weight * constant * a;
                }
                counted[index] = comes;
            }
        }
        let inside = depths.iter().filter(|depth| **depth < 0.0).count();
        report.inside.push(inside);
        if inside == 0 {
            report.rounds.push(y.clone());
            break;
        }
        let mut matrix = gram.clone();
        for i in 0..d {
            for j in 0..d {
                matrix[(i, j)] += options.roots * root_gram[(i.max(j), i.min(j))];
            }
            matrix[(i, i)] += prior;
        }
        let right = Matrix { rows: d, cols: 1, data: right.clone() };
        y = solve_spd(&matrix, &right).map_err(HairError::solving("coefficients of hair without collisions"))?.data;
        report.rounds.push(y.clone());
    }
    Ok(report)
}
