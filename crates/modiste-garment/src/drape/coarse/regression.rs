//! Kernel ridge regression on a few centres.

use modiste_core::{Matrix, solve_spd};
use rayon::prelude::*;

use crate::GarmentError;
use crate::drape::clips::{Clips, Standing};
use crate::drape::pose_kernel::{median_squared_distance, near, squared_distance};

/// Reaches to choose from, as shares of the median squared distance between inputs.
const REACHES: [f64; 3] = [1.0, 2.0, 4.0];

/// Weights of the norm to choose from, for a kernel of 1 at its centre.
const RIDGES: [f64; 4] = [0.01, 0.03, 0.1, 0.3];

/// Groups of clips that are held out in turn to choose by.
const FOLDS: usize = 4;

/// Added to the kernel among the centres, which is singular where two are alike.
const JITTER: f64 = 1e-6;

/// `κ = mean + Wᵀ k(x, C)` with `k(a, b) = exp(-|a - b|²/reach)`: kernel ridge regression whose solution is sought among the
/// kernels at m centres ("subset of regressors", Nyström's approximation).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct KernelRegression {
    /// One input per row, m of them.
    pub(crate) centres: Matrix,
    pub(crate) reach: f64,
    /// One row per centre, one column per output.
    pub(crate) weights: Matrix,
    pub(crate) mean: Vec<f64>,
}

/// The frames of one sequence.
#[derive(Debug, Clone)]
pub(crate) struct Frames {
    pub(crate) clips: Clips,
    /// One row of inputs per frame.
    pub(crate) inputs: Matrix,
    /// One row of outputs per frame.
    pub(crate) outputs: Matrix,
}

impl Frames {
    fn standing(&self, fold: usize) -> Standing {
        self.clips.standing(|clip| clip % FOLDS == fold)
    }
}

/// Sums of some sequences under one kernel: KᵀK and Kᵀy. The sequences have something of the same folds.
struct Sums {
    standings: [Standing; FOLDS],
    gram: Matrix,
    cross: Matrix,
}

impl KernelRegression {
    /// Learns from sequences with at most `count` centres, reach and ridge being those with the least error on clips held
    /// out; returns that error as a share of the variance.
    ///
    /// # Errors
    /// No frames, or a solve that fails.
    pub(crate) fn fit(sequences: &[Frames], count: usize) -> Result<(Self, f64), GarmentError> {
        let rows: Vec<&[f64]> =
            sequences.iter().flat_map(|s| (0..s.inputs.rows).map(|row| s.inputs.row(row))).collect();
        if rows.is_empty() || count == 0 {
            return Err(GarmentError::data("pose training set", "at least one frame", "none"));
        }
        // Spread evenly over the frames: as near to all of them as the frames that lie farthest apart are far from most.
        let centres: Vec<&[f64]> =
            (0..count.min(rows.len())).map(|i| rows[i * rows.len() / count.min(rows.len())]).collect();
        let centres = Matrix::from_rows(&centres);
        let median = median_squared_distance(&rows);
        let mean = mean_of(sequences.iter().map(|s| &s.outputs));
        let is_tested = |sequence: &&Frames| (0..FOLDS).any(|fold| sequence.standing(fold) == Standing::HeldOut);
        let variance: f64 = sequences
            .iter()
            .filter(is_tested)
            .flat_map(|s| (0..s.outputs.rows).map(|row| squared_distance(s.outputs.row(row), &mean)))
            .sum();
        let mut best: Option<(f64, Self)> = None;
        for reach in REACHES.map(|share| if median > 0.0 { share * median } else { 1.0 }) {
            let frame = Frame { centres: &centres, reach, mean: &mean };
            let kernels: Vec<Matrix> = sequences.par_iter().map(|s| frame.kernels(&s.inputs)).collect();
            let among = frame.kernels(&centres);
            let sums = frame.sums(sequences, &kernels);
            let found = RIDGES
                .par_iter()
                .map(|&ridge| {
                    let mut error = 0.0;
                    for out in 0..FOLDS {
                        let kept = sums.iter().filter(|sums| sums.standings[out] == Standing::Kept);
                        let weights = solve(kept, &among, ridge)?;
                        error += frame.held_out_error(sequences, &kernels, out, &weights);
                    }
                    Ok((error, ridge))
                })
                .collect::<Result<Vec<_>, GarmentError>>()?;
            let (error, ridge) = found
                .into_iter()
                .fold((f64::INFINITY, RIDGES[0]), |best, next| if next.0 < best.0 { next } else { best });
            if best.as_ref().is_none_or(|(least, _)| error < *least) {
                let weights = solve(sums.iter(), &among, ridge)?;
                best = Some((error, Self { centres: centres.clone(), reach, weights, mean: mean.clone() }));
            }
        }
        let (error, mut regression) =
            best.ok_or_else(|| GarmentError::data("pose training set", "finite coefficients", "others"))?;
        // As the file keeps them.
        regression.centres.round_to_single();
        regression.weights.round_to_single();
        Ok((regression, if variance > 0.0 { error / variance } else { 0.0 }))
    }

    /// Writes the outputs for one row of inputs; nothing is allocated.
    pub(crate) fn predict(&self, inputs: &[f64], out: &mut [f64]) {
        out.copy_from_slice(&self.mean);
        for centre in 0..self.centres.rows {
            let nearness = near(inputs, self.centres.row(centre), self.reach);
            for (out, weight) in out.iter_mut().zip(self.weights.row(centre)) {
                *out += nearness * weight;
            }
        }
    }
}

/// One choice of kernel.
struct Frame<'a> {
    centres: &'a Matrix,
    reach: f64,
    mean: &'a [f64],
}

impl Frame<'_> {
    /// The kernel between rows of inputs and the centres.
    fn kernels(&self, inputs: &Matrix) -> Matrix {
        Matrix::from_fn(inputs.rows, self.centres.rows, |row, centre| {
            near(inputs.row(row), self.centres.row(centre), self.reach)
        })
    }

    /// The sums of all sequences, together where they have something of the same folds.
    fn sums(&self, sequences: &[Frames], kernels: &[Matrix]) -> Vec<Sums> {
        let mut groups: Vec<([Standing; FOLDS], Vec<usize>)> = Vec::new();
        for (index, sequence) in sequences.iter().enumerate() {
            let standings = std::array::from_fn(|fold| sequence.standing(fold));
            match groups.iter_mut().find(|(known, _)| *known == standings) {
                Some((_, members)) => members.push(index),
                None => groups.push((standings, vec![index])),
            }
        }
        let (m, outputs) = (self.centres.rows, self.mean.len());
        let sum = |(standings, members): ([Standing; FOLDS], Vec<usize>)| {
            let mut sums = Sums { standings, gram: Matrix::zeros(m, m), cross: Matrix::zeros(m, outputs) };
            for index in members {
                let (kernels, outputs) = (&kernels[index], &sequences[index].outputs);
                let centred = Matrix::from_fn(outputs.rows, outputs.cols, |row, k| outputs[(row, k)] - self.mean[k]);
                add(&mut sums.gram, &kernels.transpose_matmul(kernels));
                add(&mut sums.cross, &kernels.transpose_matmul(&centred));
            }
            sums
        };
        groups.into_par_iter().map(sum).collect()
    }

    fn held_out_error(&self, sequences: &[Frames], kernels: &[Matrix], fold: usize, weights: &Matrix) -> f64 {
        let held_out =
            sequences.iter().zip(kernels).filter(|(sequence, _)| sequence.standing(fold) == Standing::HeldOut);
        held_out
            .map(|(sequence, kernels)| {
                let made = kernels.matmul(weights);
                let error = |row: usize| {
                    let truth = sequence.outputs.row(row).iter().zip(self.mean);
                    truth.zip(made.row(row)).map(|((truth, mean), made)| (truth - mean - made).powi(2)).sum::<f64>()
                };
                (0..made.rows).map(error).sum::<f64>()
            })
            .sum()
    }
}

fn solve<'a>(sums: impl Iterator<Item = &'a Sums>, among: &Matrix, ridge: f64) -> Result<Matrix, GarmentError> {
    let mut gram = Matrix::from_fn(among.rows, among.cols, |i, j| {
        ridge * among[(i, j)] + if i == j { JITTER * ridge.max(1.0) } else { 0.0 }
    });
    let mut cross: Option<Matrix> = None;
    for sums in sums {
        add(&mut gram, &sums.gram);
        match &mut cross {
            Some(cross) => add(cross, &sums.cross),
            None => cross = Some(sums.cross.clone()),
        }
    }
    let cross = cross.unwrap_or_else(|| Matrix::zeros(among.rows, 0));
    solve_spd(&gram, &cross).map_err(GarmentError::solve("regression of the coarse deformation"))
}

fn add(to: &mut Matrix, from: &Matrix) {
    for (to, from) in to.data.iter_mut().zip(&from.data) {
        *to += from;
    }
}

fn mean_of<'a>(matrices: impl Iterator<Item = &'a Matrix> + Clone) -> Vec<f64> {
    let columns = matrices.clone().next().map_or(0, |first| first.cols);
    let mut mean = vec![0.0; columns];
    let mut count = 0;
    for matrix in matrices {
        for row in 0..matrix.rows {
            mean.iter_mut().zip(matrix.row(row)).for_each(|(mean, value)| *mean += value);
        }
        count += matrix.rows;
    }
    mean.iter_mut().for_each(|mean| *mean /= f64::from(u32::try_from(count.max(1)).unwrap_or(u32::MAX)));
    mean
}

#[cfg(test)]
mod tests {
    use super::{Frames, KernelRegression};
    use crate::drape::clips::Clips;
    use modiste_core::{Matrix, normal, seeded_rng};

    /// Outputs that no linear function of the inputs gives.
    fn truth(x: &[f64]) -> [f64; 2] {
        [x[0].sin() * x[1], x[1].abs() - 0.5 * x[0]]
    }

    fn sequences(count: usize, noise: f64) -> Vec<Frames> {
        let mut rng = seeded_rng(4);
        let mut sequence = |clip: usize| {
            let inputs = Matrix::from_fn(60, 2, |_, _| normal(&mut rng));
            let outputs = Matrix::from_fn(60, 2, |row, k| truth(inputs.row(row))[k] + noise * normal(&mut rng));
            Frames { clips: Clips::from(clip), inputs, outputs }
        };
        (0..count).map(&mut sequence).collect()
    }

    #[test]
    fn a_bent_surface_is_learned_and_the_error_held_out_is_told() {
        let (regression, error) = KernelRegression::fit(&sequences(8, 0.0), 150).unwrap();
        assert!(error < 0.03, "{error}");
        let mut out = [0.0; 2];
        let mut worst = 0.0f64;
        for x in [[0.2, 0.7], [-0.5, 1.0], [1.0, -0.3], [0.0, 0.0]] {
            regression.predict(&x, &mut out);
            worst = out.iter().zip(truth(&x)).fold(worst, |worst, (a, b)| worst.max((a - b).abs()));
        }
        assert!(worst < 0.15, "{worst}");
        let noisy = KernelRegression::fit(&sequences(8, 1.0), 150).unwrap().1;
        assert!((0.4..1.0).contains(&noisy), "what is noise cannot be foretold: {noisy}");
    }

    #[test]
    fn far_from_all_centres_the_mean_is_foretold() {
        let (regression, _) = KernelRegression::fit(&sequences(4, 0.0), 40).unwrap();
        let mut out = [0.0; 2];
        regression.predict(&[1e3, -1e3], &mut out);
        assert_eq!(out.to_vec(), regression.mean);
        assert!(KernelRegression::fit(&[], 10).is_err());
    }

    #[test]
    fn frames_that_are_all_alike_give_their_mean() {
        let same =
            Frames { clips: Clips::from(0), inputs: Matrix::zeros(9, 3), outputs: Matrix::from_fn(9, 1, |_, _| 2.0) };
        let (regression, error) = KernelRegression::fit(&[same], 5).unwrap();
        let mut out = [0.0];
        regression.predict(&[0.0; 3], &mut out);
        assert!((out[0] - 2.0).abs() < 1e-12 && error < 1e-12);
    }
}
