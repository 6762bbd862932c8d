//! Learning the dynamics of the wrinkles (DRAPE eq. 6), and seeing to it that they are stable.

use modiste_body::{Motion, Part, Pose};
use modiste_core::{Matrix, solve_spd};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::amplitudes::{HeldOutFrame, HeldOutRuns};
use super::clips::{Clips, Standing};
use super::dynamics::{Dynamics, Past, RowLayout, apply_row, fill_row, spectral_radius};
use super::features::{InputOptions, PoseInputs};
use crate::GarmentError;

/// Weight of the history from which on it is doubled where the history is not stable.
const SMALLEST_STABLE_RIDGE: f64 = 1e-5;

/// How the dynamics are learned.
#[derive(Debug, Clone, PartialEq)]
pub struct DynamicsOptions {
    /// Inputs from the pose.
    pub inputs: InputOptions,
    /// Weights of |M|² to choose from, relative to the number of frames and for regressors of unit variance. Pose and
    /// history have a weight each; for every ψ the pair with the least error on held-out sequences, run freely, wins: where
    /// cloth follows the body it is learned closely, where folds fall as they like only their mean is.
    pub ridges: Vec<f64>,
    /// Number of groups of sequences that are held out in turn to choose the weights.
    pub folds: usize,
    /// Times that the model is run freely over its training motions and learned again with its own past added to the
    /// true one, so that it learns to return from its own errors. 0 is the paper.
    pub rehearsals: usize,
    /// Largest spectral radius of the history that is accepted; above it the history is weighed more (see [`learn`]).
    pub max_spectral_radius: f64,
    /// Largest factor that gives a wrinkle its spread back (see [`Dynamics::amplitudes`]); 1 is the paper. Where less makes
    /// held-out motions wrinkled enough, less is used.
    pub max_amplitude: f64,
}

impl Default for DynamicsOptions {
    fn default() -> Self {
        Self {
            inputs: InputOptions::default(),
            ridges: vec![1e-4, 1e-3, 1e-2, 1e-1, 1.0, 10.0],
            folds: 4,
            rehearsals: 0,
            max_spectral_radius: 0.98,
            max_amplitude: 30.0,
        }
    }
}

/// What was found out while learning the dynamics.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DynamicsTraining {
    /// Chosen weight for the pose and its change, for each ψ.
    pub pose_ridges: Vec<f64>,
    /// Chosen weight for the history, for each ψ.
    pub history_ridges: Vec<f64>,
    /// Chosen weight of the model of order zero, for each ψ.
    pub static_ridges: Vec<f64>,
    /// Part of the variance of ψ on held-out frames that a free run misses, with the chosen weights.
    pub held_out_error: f64,
    /// The same for the model of order zero.
    pub static_held_out_error: f64,
    /// Spectral radius of the history with the chosen weights.
    pub learned_spectral_radius: f64,
    /// Spectral radius of the history as it is used.
    pub spectral_radius: f64,
}

/// A run of poses with the wrinkles of its frames.
struct Example<'a> {
    clips: Clips,
    /// Place among the motions, and first frame there.
    sequence: usize,
    start: usize,
    poses: &'a [Pose],
    wrinkles: &'a [Vec<f64>],
}

/// Sums over regressors and targets: xᵀx and xᵀy.
#[derive(Clone)]
struct Normal {
    gram: Matrix,
    cross: Matrix,
    rows: usize,
}

impl Normal {
    fn zeros(regressors: usize, targets: usize) -> Self {
        Self { gram: Matrix::zeros(regressors, regressors), cross: Matrix::zeros(regressors, targets), rows: 0 }
    }

    fn of(x: &[Vec<f64>], y: &[&[f64]], regressors: usize, targets: usize) -> Self {
        if x.is_empty() {
            return Self::zeros(regressors, targets);
        }
        let (x, y) = (Matrix::from_rows(x), Matrix::from_rows(y));
        Self { gram: x.transpose_matmul(&x), cross: x.transpose_matmul(&y), rows: x.rows }
    }

    fn add(&mut self, other: &Self, sign: f64) {
        for (to, from) in [(&mut self.gram, &other.gram), (&mut self.cross, &other.cross)] {
            for (to, from) in to.data.iter_mut().zip(&from.data) {
                *to += sign * from;
            }
        }
        self.rows = self.rows.saturating_add_signed(sign as isize * other.rows.cast_signed());
    }

    /// Ridge regression with a weight for each regressor, relative to the rows, from its index and variance; the constant,
    /// row 0, is free.
    fn solve(&self, ridge: impl Fn(usize, f64) -> f64) -> Result<Matrix, GarmentError> {
        let n = self.rows.max(1) as f64;
        let mut gram = self.gram.clone();
        for i in 0..gram.rows {
            let mean = self.gram[(0, i)] / n;
            let variance = (self.gram[(i, i)] / n - mean * mean).max(0.0);
            // The floor keeps a regressor that never changes (a locked joint) at a coefficient of zero.
            gram[(i, i)] += if i == 0 { 0.0 } else { n * (ridge(i, variance) + 1e-9) };
        }
        solve_spd(&gram, &self.cross).map_err(GarmentError::solve("regression of the wrinkle dynamics"))
    }
}

/// Learns eq. 5 from motions, each with the clips that it comes from, and the wrinkles of their frames, in the same order.
///
/// Regressors reach back within their own sequence only. If the spectral radius ρ of the history is above the wanted
/// limit ρ*, the weight of |M2|² and |M3|² is doubled until it is not: with a heavy enough weight the history vanishes.
///
/// # Errors
/// No sequence with at least three frames, or a solve that fails.
pub(crate) fn learn(
    face_parts: &[Part],
    motions: &[(Clips, &Motion)],
    wrinkles: &[Vec<Vec<f64>>],
    options: &DynamicsOptions,
) -> Result<(Dynamics, DynamicsTraining, HeldOutRuns), GarmentError> {
    let examples = cut(motions, wrinkles, options.folds);
    let Some(count) = examples.first().map(|example| example.wrinkles[0].len()) else {
        return Err(GarmentError::data("pose training set", "a sequence of at least 3 frames", "none"));
    };
    let poses = examples.iter().flat_map(|example| example.poses);
    let inputs = PoseInputs::new(face_parts, options.inputs).with_typical_poses(poses)?;
    Learner { layout: RowLayout::new(&inputs, count), inputs, count, examples, options }.learn()
}

/// The sequences of three frames and more. Where there are fewer than `folds`, each is cut into that many pieces.
fn cut<'a>(motions: &[(Clips, &'a Motion)], wrinkles: &'a [Vec<Vec<f64>>], folds: usize) -> Vec<Example<'a>> {
    let pieces = if motions.len() < folds { folds } else { 1 };
    let whole = motions.iter().zip(wrinkles).enumerate();
    whole
        .flat_map(|(sequence, ((clips, motion), wrinkles))| {
            let length = wrinkles.len().div_ceil(pieces).max(1);
            let chunks = motion.frames.chunks(length).zip(wrinkles.chunks(length)).enumerate();
            // The pieces of one motion are all there is to hold out.
            chunks.map(move |(piece, (poses, wrinkles))| Example {
                clips: clips.piece(piece),
                sequence,
                start: piece * length,
                poses,
                wrinkles,
            })
        })
        .filter(|example| example.wrinkles.len() >= 3)
        .collect()
}

struct Learner<'a> {
    inputs: PoseInputs,
    layout: RowLayout,
    count: usize,
    examples: Vec<Example<'a>>,
    options: &'a DynamicsOptions,
}

impl Learner<'_> {
    fn learn(&self) -> Result<(Dynamics, DynamicsTraining, HeldOutRuns), GarmentError> {
        let static_normals: Vec<Normal> = self.examples.par_iter().map(|example| self.static_normal(example)).collect();
        let (static_ridges, static_held_out_error) = self.choose_static(&static_normals)?;
        let static_coefficients = self.solve_static(&sum(&static_normals), &static_ridges)?;

        let normals: Vec<Normal> =
            self.examples.par_iter().map(|example| self.normal(example, example.wrinkles)).collect();
        let (weights, held_out_error) = self.choose(&normals, &static_coefficients)?;
        let mut normal = sum(&normals);
        let (mut coefficients, mut radii) = self.solve_stable(&normal, &weights)?;
        for _ in 0..self.options.rehearsals {
            let dynamics = self.assemble(coefficients, &static_coefficients);
            let rehearsed: Vec<Normal> = self
                .examples
                .par_iter()
                .map(|example| self.normal(example, &free_run(&dynamics, example.poses)))
                .collect();
            normal.add(&sum(&rehearsed), 1.0);
            (coefficients, radii) = self.solve_stable(&normal, &weights)?;
        }
        let dynamic = self.held_out_runs(
            &normals,
            |kept| Ok(self.solve_stable(kept, &weights)?.0),
            |coefficients, example| free_run(&self.assemble(coefficients.clone(), &static_coefficients), example.poses),
        )?;
        let fixed = self.held_out_runs(
            &static_normals,
            |kept| self.solve_static(kept, &static_ridges),
            |coefficients, example| self.static_runs(coefficients, example),
        )?;
        let squares = |runs: &[(usize, Vec<Vec<f64>>)]| squares(runs.iter().flat_map(|(_, run)| run), self.count);
        let runs = HeldOutRuns {
            truth: self::squares(self.tested().flat_map(|example| example.wrinkles), self.count),
            dynamic: squares(&dynamic),
            fixed: squares(&fixed),
            frames: dynamic.into_iter().flat_map(|(place, run)| self.frames(place, run)).collect(),
        };
        let [learned_spectral_radius, spectral_radius] = radii;
        let training = DynamicsTraining {
            pose_ridges: weights.iter().map(|&(pose, _)| pose).collect(),
            history_ridges: weights.iter().map(|&(_, history)| history).collect(),
            static_ridges,
            held_out_error,
            static_held_out_error,
            learned_spectral_radius,
            spectral_radius,
        };
        // As the file keeps them.
        let mut static_coefficients = static_coefficients;
        coefficients.round_to_single();
        static_coefficients.round_to_single();
        Ok((self.assemble(coefficients, &static_coefficients), training, runs))
    }

    /// The frames of a run of the example at `place`.
    fn frames(&self, place: usize, run: Vec<Vec<f64>>) -> impl Iterator<Item = HeldOutFrame> {
        let Example { sequence, start, .. } = self.examples[place];
        run.into_iter().enumerate().map(move |(frame, wrinkles)| HeldOutFrame {
            sequence,
            frame: start + frame,
            wrinkles,
        })
    }

    fn is_history(&self, row: usize) -> bool {
        (self.layout.history..self.layout.change).contains(&row)
    }

    fn assemble(&self, coefficients: Matrix, static_coefficients: &Matrix) -> Dynamics {
        Dynamics::new(self.inputs.clone(), coefficients, static_coefficients.clone())
    }

    /// Sums of one example for eq. 6, with a given past.
    fn normal(&self, example: &Example<'_>, past: &[Vec<f64>]) -> Normal {
        let mut scratch = vec![0.0; self.inputs.pose_count()];
        let mut memory = vec![0.0; self.inputs.memory_count()];
        let mut rows: Vec<Vec<f64>> = Vec::with_capacity(example.poses.len());
        for (frame, pose) in example.poses.iter().enumerate() {
            if frame < 2 {
                self.inputs.pose(pose, &mut scratch);
                self.inputs.remember(&scratch, frame == 0, &mut memory);
                continue;
            }
            let past = Past {
                poses: [&example.poses[frame - 1], &example.poses[frame - 2]],
                wrinkles: [&past[frame - 1], &past[frame - 2]],
                memory: &mut memory,
            };
            let mut row = vec![0.0; self.layout.end];
            fill_row(&self.inputs, self.layout, pose, past, &mut scratch, &mut row);
            rows.push(row);
        }
        let targets: Vec<&[f64]> = example.wrinkles[2..].iter().map(Vec::as_slice).collect();
        Normal::of(&rows, &targets, self.layout.end, self.count)
    }

    /// Sums of one example for the model of order zero.
    fn static_normal(&self, example: &Example<'_>) -> Normal {
        let rows: Vec<Vec<f64>> = example.poses.iter().map(|pose| self.static_row(pose)).collect();
        let targets: Vec<&[f64]> = example.wrinkles.iter().map(Vec::as_slice).collect();
        Normal::of(&rows, &targets, self.layout.history, self.count)
    }

    fn static_row(&self, pose: &Pose) -> Vec<f64> {
        let mut row = vec![1.0; self.layout.history];
        self.inputs.pose(pose, &mut row[1..]);
        row
    }

    fn groups(&self) -> usize {
        let mut clips: Vec<usize> = self.examples.iter().flat_map(|example| example.clips.numbers()).copied().collect();
        clips.sort_unstable();
        clips.dedup();
        self.options.folds.min(clips.len()).max(1)
    }

    /// The examples that stand so to a group of clips that is held out, with their places.
    fn standing(&self, group: usize, standing: Standing) -> impl Iterator<Item = (usize, &Example<'_>)> {
        let groups = self.groups();
        let is_meant = move |example: &Example<'_>| example.clips.standing(|clip| clip % groups == group) == standing;
        self.examples.iter().enumerate().filter(move |(_, example)| is_meant(example))
    }

    /// The examples that one group of clips is tested on.
    fn group(&self, group: usize) -> impl Iterator<Item = (usize, &Example<'_>)> {
        self.standing(group, Standing::HeldOut)
    }

    /// The examples that any group is tested on: those put together of clips of several are not.
    fn tested(&self) -> impl Iterator<Item = &Example<'_>> {
        (0..self.groups()).flat_map(|group| self.group(group).map(|(_, example)| example))
    }

    /// The sums without those of examples that have something of one group of clips, if there are several.
    fn without(&self, total: &Normal, normals: &[Normal], group: usize) -> Normal {
        let mut kept = total.clone();
        if self.groups() > 1 {
            for standing in [Standing::HeldOut, Standing::Mixed] {
                self.standing(group, standing).for_each(|(place, _)| kept.add(&normals[place], -1.0));
            }
        }
        kept
    }

    /// For every ψ the choice of weights with the least error on held-out groups of examples, and that error over all ψ,
    /// relative to their variance. `run` makes the wrinkles of an example.
    fn validate<C: Copy + Sync>(
        &self,
        normals: &[Normal],
        choices: &[C],
        train: impl Fn(&Normal, C) -> Result<Matrix, GarmentError> + Sync,
        run: impl Fn(&Matrix, &Example<'_>) -> Vec<Vec<f64>> + Sync,
    ) -> Result<(Vec<C>, f64), GarmentError> {
        let groups = self.groups();
        let total = sum(normals);
        let errors: Vec<Vec<f64>> = choices
            .par_iter()
            .map(|&choice| {
                let mut errors = vec![0.0; self.count];
                for group in 0..groups {
                    let coefficients = train(&self.without(&total, normals, group), choice)?;
                    for (_, example) in self.group(group) {
                        let made = run(&coefficients, example);
                        for (made, truth) in made.iter().zip(example.wrinkles) {
                            let pairs = errors.iter_mut().zip(made.iter().zip(truth));
                            pairs.for_each(|(error, (made, truth))| *error += (made - truth) * (made - truth));
                        }
                    }
                }
                Ok(errors)
            })
            .collect::<Result<_, GarmentError>>()?;
        if choices.is_empty() {
            return Err(GarmentError::data("ridge weights", "at least one to choose from", "none"));
        }
        let error = |choice: usize, k: usize| {
            if errors[choice][k].is_finite() { errors[choice][k] } else { f64::INFINITY }
        };
        let best = |k: usize| (1..choices.len()).fold(0, |best, i| if error(i, k) < error(best, k) { i } else { best });
        let best: Vec<usize> = (0..self.count).map(best).collect();
        let sum: f64 = best.iter().enumerate().map(|(k, &choice)| error(choice, k)).sum();
        Ok((best.into_iter().map(|choice| choices[choice]).collect(), sum / self.variance()))
    }

    /// The runs on examples, each with its place, by models that were learned without any of their group of clips.
    fn held_out_runs(
        &self,
        normals: &[Normal],
        train: impl Fn(&Normal) -> Result<Matrix, GarmentError> + Sync,
        run: impl Fn(&Matrix, &Example<'_>) -> Vec<Vec<f64>> + Sync,
    ) -> Result<Vec<(usize, Vec<Vec<f64>>)>, GarmentError> {
        let total = sum(normals);
        let runs = (0..self.groups()).into_par_iter().map(|group| {
            let coefficients = train(&self.without(&total, normals, group))?;
            Ok(self.group(group).map(|(place, example)| (place, run(&coefficients, example))).collect())
        });
        let runs: Vec<Vec<_>> = runs.collect::<Result<_, GarmentError>>()?;
        Ok(runs.into_iter().flatten().collect())
    }

    fn static_runs(&self, coefficients: &Matrix, example: &Example<'_>) -> Vec<Vec<f64>> {
        let run = |pose: &Pose| {
            let mut out = vec![0.0; self.count];
            apply_row(coefficients, &self.static_row(pose), &mut out);
            out
        };
        example.poses.iter().map(run).collect()
    }

    fn choose_static(&self, normals: &[Normal]) -> Result<(Vec<f64>, f64), GarmentError> {
        let train = |normal: &Normal, ridge: f64| self.solve_static(normal, &vec![ridge; self.count]);
        self.validate(normals, &self.options.ridges, train, |coefficients, example| {
            self.static_runs(coefficients, example)
        })
    }

    fn choose(&self, normals: &[Normal], start: &Matrix) -> Result<(Vec<(f64, f64)>, f64), GarmentError> {
        let ridges = &self.options.ridges;
        let pairs: Vec<(f64, f64)> = ridges.iter().flat_map(|&a| ridges.iter().map(move |&b| (a, b))).collect();
        let train = |normal: &Normal, weights| Ok(self.solve_stable(normal, &vec![weights; self.count])?.0);
        self.validate(normals, &pairs, train, |coefficients, example| {
            free_run(&self.assemble(coefficients.clone(), start), example.poses)
        })
    }

    /// Sum of squared distances of the wrinkles that are tested from their mean.
    fn variance(&self) -> f64 {
        let all = || self.tested().flat_map(|example| example.wrinkles);
        let count = all().count() as f64;
        let mut mean = vec![0.0; self.count];
        for wrinkles in all() {
            for (mean, value) in mean.iter_mut().zip(wrinkles) {
                *mean += value / count;
            }
        }
        all().map(|wrinkles| squared_distance(wrinkles, &mean)).sum::<f64>().max(f64::MIN_POSITIVE)
    }

    /// Solves eq. 6 with weights of pose and history for each ψ, those of the history raised until it is stable enough; see
    /// [`learn`]. Returns the spectral radius before and after as well.
    fn solve_stable(&self, normal: &Normal, weights: &[(f64, f64)]) -> Result<(Matrix, [f64; 2]), GarmentError> {
        let mut weights = weights.to_vec();
        let mut first = None;
        loop {
            let coefficients = solve_each(normal, &weights, |row, variance, (pose, history)| {
                if self.is_history(row) { history * variance } else { self.pose_weight(row, variance, pose) }
            })?;
            let radius = spectral_radius(&coefficients, self.layout)?;
            let learned = *first.get_or_insert(radius);
            if radius <= self.options.max_spectral_radius || weights.iter().all(|(_, history)| !history.is_finite()) {
                return Ok((coefficients, [learned, radius]));
            }
            for (_, history) in &mut weights {
                *history = history.max(SMALLEST_STABLE_RIDGE) * 2.0;
            }
        }
    }

    fn solve_static(&self, normal: &Normal, ridges: &[f64]) -> Result<Matrix, GarmentError> {
        solve_each(normal, ridges, |row, variance, ridge| self.pose_weight(row, variance, ridge))
    }

    /// What a regressor from the pose weighs. Those of the kernel have its scale, on which the linear ones together weigh
    /// as much as it does.
    fn pose_weight(&self, row: usize, variance: f64, ridge: f64) -> f64 {
        let plain = self.inputs.plain_count();
        if (self.layout.pose + plain..self.layout.history).contains(&row) {
            ridge / plain as f64
        } else {
            ridge * variance
        }
    }
}

/// Ridge regression with other weights for each target; `ridge` says what a regressor weighs, from its
/// index and variance, under the weights of a target.
fn solve_each<C: Copy + PartialEq>(
    normal: &Normal,
    weights: &[C],
    ridge: impl Fn(usize, f64, C) -> f64,
) -> Result<Matrix, GarmentError> {
    let mut coefficients = Matrix::zeros(normal.cross.rows, normal.cross.cols);
    let mut distinct: Vec<C> = Vec::new();
    for &choice in weights {
        if distinct.contains(&choice) {
            continue;
        }
        distinct.push(choice);
        let solved = normal.solve(|row, variance| ridge(row, variance, choice))?;
        for (target, _) in weights.iter().enumerate().filter(|(_, other)| **other == choice) {
            (0..solved.rows).for_each(|row| coefficients[(row, target)] = solved[(row, target)]);
        }
    }
    Ok(coefficients)
}

fn sum(normals: &[Normal]) -> Normal {
    let mut total = normals[0].clone();
    for normal in &normals[1..] {
        total.add(normal, 1.0);
    }
    total
}

/// Sum of squares of every column.
fn squares<'a>(rows: impl Iterator<Item = &'a Vec<f64>>, count: usize) -> Vec<f64> {
    let mut sums = vec![0.0; count];
    for row in rows {
        for (sum, value) in sums.iter_mut().zip(row) {
            *sum += value * value;
        }
    }
    sums
}

fn squared_distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

/// The wrinkles of every frame of a motion from the poses alone.
pub(crate) fn free_run(dynamics: &Dynamics, poses: &[Pose]) -> Vec<Vec<f64>> {
    let mut state = dynamics.start();
    poses.iter().map(|pose| dynamics.step(&mut state, pose).to_vec()).collect()
}

#[cfg(test)]
mod tests {
    use super::{Clips, DynamicsOptions, HeldOutFrame, free_run, learn};
    use crate::drape::dynamics::Dynamics;
    use crate::drape::features::{InputOptions, PoseInputs};
    use modiste_body::{Motion, Part, Pose};
    use modiste_core::{Matrix, Vec3, normal, seeded_rng};

    const COUNT: usize = 3;

    /// A motion whose angles and place are sums of sines.
    fn motion(seed: u64, frames: usize) -> Motion {
        let mut rng = seeded_rng(seed);
        let draws: Vec<f64> = (0..200).map(|_| normal(&mut rng)).collect();
        let wave = |channel: usize, time: f64| {
            let [a, b, c, d] = [0, 1, 2, 3].map(|i| draws[(4 * channel + i) % 200]);
            0.3 * (a * (0.2 * (2.0 + b) * time).sin() + c * (0.07 * (2.0 + d) * time).cos())
        };
        let pose = |frame: usize| {
            let mut pose = Pose::template(Vec3::new(wave(40, frame as f64), 1.0, wave(41, frame as f64)));
            for (part, rotation) in pose.rotations.iter_mut().enumerate() {
                *rotation = Vec3::new(wave(3 * part, frame as f64), wave(3 * part + 1, frame as f64), 0.1);
            }
            pose
        };
        Motion { fps: 30.0, frames: (0..frames).map(pose).collect() }
    }

    /// Dynamics with given history blocks and random other blocks.
    fn dynamics(history: f64, second: f64) -> Dynamics {
        let inputs = PoseInputs::new(&[Part::Chest, Part::LeftThigh], InputOptions::PAPER);
        let mut rng = seeded_rng(5);
        let end = 1 + inputs.pose_count() + 2 * COUNT + 2 * inputs.change_count();
        let start = 1 + inputs.pose_count();
        let mut coefficients = Matrix::from_fn(end, COUNT, |_, _| normal(&mut rng));
        for row in 0..2 * COUNT {
            let value = if row < COUNT { history } else { second };
            for column in 0..COUNT {
                coefficients[(start + row, column)] = if row % COUNT == column { value } else { 0.0 };
            }
        }
        let static_coefficients = Matrix::from_fn(start, COUNT, |_, _| normal(&mut rng));
        Dynamics::new(inputs, coefficients, static_coefficients)
    }

    fn options(ridge: f64) -> DynamicsOptions {
        DynamicsOptions {
            inputs: InputOptions::PAPER,
            ridges: vec![ridge],
            rehearsals: 0,
            max_spectral_radius: 0.999,
            ..DynamicsOptions::default()
        }
    }

    fn each_a_clip(motions: &[Motion]) -> Vec<(Clips, &Motion)> {
        motions.iter().enumerate().map(|(clip, motion)| (Clips::from(clip), motion)).collect()
    }

    #[test]
    fn a_linear_system_is_recovered_from_its_own_motion() {
        let truth = dynamics(1.2, -0.5);
        let motions: Vec<Motion> = (0..5).map(|seed| motion(seed, 120)).collect();
        let wrinkles: Vec<Vec<Vec<f64>>> = motions.iter().map(|motion| free_run(&truth, &motion.frames)).collect();
        let motions = each_a_clip(&motions);
        let parts = [Part::Chest, Part::LeftThigh];
        let (learned, training, _) = learn(&parts, &motions, &wrinkles, &options(1e-12)).unwrap();
        let unseen = motion(77, 200);
        let mut state = truth.start();
        let mut copy = learned.start();
        for (frame, pose) in unseen.frames.iter().enumerate() {
            let wanted = truth.step(&mut state, pose).to_vec();
            let found = learned.step(&mut copy, pose).to_vec();
            if frame == 0 {
                copy = state.clone();
                continue;
            }
            for (wanted, found) in wanted.iter().zip(&found) {
                assert!((wanted - found).abs() < 1e-3, "frame {frame}: {wanted} {found}");
            }
        }
        // λ² = 1.2 λ - 0.5 has |λ|² = 0.5.
        assert!((training.spectral_radius - 0.5f64.sqrt()).abs() < 1e-3, "{training:?}");
        assert!((truth.spectral_radius().unwrap() - 0.5f64.sqrt()).abs() < 1e-9);
    }

    #[test]
    fn wrinkles_that_cannot_be_foreseen_keep_their_spread() {
        let truth = dynamics(0.0, 0.0);
        let motions: Vec<Motion> = (0..8).map(|seed| motion(seed, 150)).collect();
        let mut rng = seeded_rng(3);
        // The first ψ is what the pose makes of it, the second has noise of twice its size on top.
        let noisy = |motion: &Motion, rng: &mut _| -> Vec<Vec<f64>> {
            let mut run = free_run(&truth, &motion.frames);
            let spread = (run.iter().map(|row| row[1] * row[1]).sum::<f64>() / run.len() as f64).sqrt();
            run.iter_mut().for_each(|row| row[1] += 2.0 * spread * normal(rng));
            run
        };
        let wrinkles: Vec<_> = motions.iter().map(|motion| noisy(motion, &mut rng)).collect();
        let references = each_a_clip(&motions);
        let parts = [Part::Chest, Part::LeftThigh];
        let runs = learn(&parts, &references, &wrinkles, &options(1e-9)).unwrap().2;
        let free = runs.amplitudes(100.0, |_| false).dynamic;
        assert!((free[0] - 1.0).abs() < 0.02, "{free:?}");
        assert!((free[1] - 5.0f64.sqrt()).abs() < 0.4, "{free:?}");
        let HeldOutFrame { sequence, frame, wrinkles: run } = &runs.frames[200];
        assert!((run[0] - wrinkles[*sequence][*frame][0]).abs() < 1e-3, "the frame that it was foretold for");
        // They are shown, and do not feed back.
        let plain = dynamics(0.5, 0.1);
        let shown = plain.clone().with_amplitudes(vec![2.0; COUNT]);
        let poses = &motion(4, 30).frames;
        for (plain, shown) in free_run(&plain, poses).iter().zip(free_run(&shown, poses)) {
            assert!(plain.iter().zip(&shown).all(|(plain, shown)| (2.0 * plain - shown).abs() < 1e-12));
        }
    }

    #[test]
    fn each_wrinkle_has_the_weights_that_suit_it() {
        let truth = dynamics(0.0, 0.0);
        let motions: Vec<Motion> = (0..8).map(|seed| motion(seed, 60)).collect();
        let mut rng = seeded_rng(8);
        // The first ψ follows the pose, the second is noise alone.
        let mixed = |motion: &Motion, rng: &mut _| -> Vec<Vec<f64>> {
            let mut run = free_run(&truth, &motion.frames);
            run.iter_mut().for_each(|row| row[1] = normal(rng));
            run
        };
        let wrinkles: Vec<_> = motions.iter().map(|motion| mixed(motion, &mut rng)).collect();
        let references = each_a_clip(&motions);
        let chosen = DynamicsOptions { ridges: vec![1e-8, 10.0], ..options(1.0) };
        let training = learn(&[Part::Chest, Part::LeftThigh], &references, &wrinkles, &chosen).unwrap().1;
        assert!(training.static_ridges[0] < 1e-7 && training.pose_ridges[0] < 1e-7, "{training:?}");
        assert!(training.static_ridges[1] > 1.0 && training.pose_ridges[1] > 1.0, "{training:?}");
    }

    #[test]
    fn typical_poses_teach_what_no_linear_model_can() {
        // ψ is the absolute value of an angle.
        let motions: Vec<Motion> = (0..8).map(|seed| motion(seed, 120)).collect();
        let folds = |motion: &Motion| -> Vec<Vec<f64>> {
            motion.frames.iter().map(|pose| vec![pose.rotations[Part::LeftThigh.index()].x.abs()]).collect()
        };
        let wrinkles: Vec<_> = motions.iter().map(folds).collect();
        let references = each_a_clip(&motions);
        let error = |centres: usize| {
            let inputs = InputOptions { matrices: true, centres, ..InputOptions::PAPER };
            let chosen = DynamicsOptions { inputs, ridges: vec![1e-6, 1e-4, 1e-2, 1.0], ..options(1.0) };
            learn(&[Part::LeftThigh], &references, &wrinkles, &chosen).unwrap().1.static_held_out_error
        };
        let (linear, typical) = (error(0), error(30));
        assert!(typical < 0.5 * linear, "{typical} {linear}");
    }

    #[test]
    fn memory_teaches_what_comes_later_than_the_pose() {
        // ψ follows an angle of the thigh with a delay.
        let motions: Vec<Motion> = (0..8).map(|seed| motion(seed, 120)).collect();
        let late = |motion: &Motion| -> Vec<Vec<f64>> {
            let angles = motion.frames.iter().map(|pose| pose.rotations[Part::LeftThigh.index()].x);
            let mut mean = None;
            angles
                .map(|angle| {
                    let before = *mean.get_or_insert(angle);
                    vec![*mean.insert(before + 0.06 * (angle - before))]
                })
                .collect()
        };
        let wrinkles: Vec<_> = motions.iter().map(late).collect();
        let references = each_a_clip(&motions);
        let error = |memory: bool| {
            let inputs = InputOptions { memory, ..InputOptions::PAPER };
            // A heavy weight on everything but the pose and what it was.
            let chosen = DynamicsOptions { inputs, ridges: vec![1e-3], max_spectral_radius: 0.01, ..options(1.0) };
            learn(&[Part::LeftThigh], &references, &wrinkles, &chosen).unwrap().1.held_out_error
        };
        let (without, with) = (error(false), error(true));
        assert!(with < 0.3 * without, "{with} {without}");
    }

    #[test]
    fn an_unstable_history_is_mended_and_stays_bounded() {
        let truth = dynamics(1.01, 0.0);
        let motions: Vec<Motion> = (0..4).map(|seed| motion(seed, 90)).collect();
        let wrinkles: Vec<Vec<Vec<f64>>> = motions.iter().map(|motion| free_run(&truth, &motion.frames)).collect();
        let references = each_a_clip(&motions);
        let chosen = DynamicsOptions { max_spectral_radius: 0.97, ..options(1e-10) };
        let (learned, training, _) = learn(&[Part::Chest, Part::LeftThigh], &references, &wrinkles, &chosen).unwrap();
        assert!(training.learned_spectral_radius > 1.0, "{training:?}");
        assert!(training.spectral_radius < 0.9701, "{training:?}");
        let largest = wrinkles.iter().flatten().flatten().fold(0.0f64, |largest, value| largest.max(value.abs()));
        let long = free_run(&learned, &motion(9, 3000).frames);
        assert!(long.iter().flatten().all(|value| value.abs() < 20.0 * largest));
    }

    #[test]
    fn poses_far_from_all_training_poses_give_bounded_wrinkles() {
        let mut dynamics = dynamics(1.2, -0.5);
        dynamics.limit_to(&[0.1, 0.2, 0.3]);
        let run = free_run(&dynamics, &motion(12, 50).frames);
        for wrinkles in &run {
            for (value, sd) in wrinkles.iter().zip([0.1, 0.2, 0.3]) {
                assert!(value.abs() <= 5.0 * sd);
            }
        }
        assert!(run.iter().any(|wrinkles| wrinkles[0].abs() > 0.49), "the limit was met");
    }

    #[test]
    fn a_body_that_stands_still_comes_to_rest() {
        let dynamics = dynamics(1.2, -0.5);
        let mut state = dynamics.start();
        for pose in &motion(3, 20).frames {
            dynamics.step(&mut state, pose);
        }
        let still = motion(3, 20).frames[19].clone();
        for _ in 0..200 {
            dynamics.step(&mut state, &still);
        }
        let before = dynamics.step(&mut state, &still).to_vec();
        let after = dynamics.step(&mut state, &still).to_vec();
        assert!(before.iter().zip(&after).all(|(a, b)| (a - b).abs() < 1e-12));
    }

    #[test]
    fn the_blocks_of_the_matrices_add_up() {
        let dynamics = dynamics(0.5, 0.1);
        let rows: usize = dynamics.matrices().iter().map(|block| block.rows).sum();
        assert_eq!(rows, dynamics.coefficients.rows);
        assert!((dynamics.matrices()[2][(1, 1)] - 0.5).abs() < 1e-15);
        assert!((dynamics.matrices()[3][(1, 1)] - 0.1).abs() < 1e-15);
    }
}
