//! Second-order dynamics of the wrinkles (DRAPE eq. 5).

use modiste_body::Pose;
use modiste_core::{Matrix, largest_eigenvalue_magnitude};

use super::amplitudes::Amplitudes;
use super::features::PoseInputs;
use crate::GarmentError;

/// Wrinkle coefficients from the pose and from the last two frames:
/// `ψ^f = m + M1 θ_c^f + M2 ψ^{f-1} + M3 ψ^{f-2} + M4 z^{f,f-2} + M5 z^{f-1,f-2}` (DRAPE eq. 5).
///
/// Where the inputs have a memory, `M6` times the mean of the past θ_c less θ_c^f is added; it is not in the paper, nor is
/// the constant `m`. Without that ψ would be forced to 0, the mean wrinkles of the training motions,
/// at θ_c = 0, the template pose, which is not the mean pose of a motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Dynamics {
    pub(crate) inputs: PoseInputs,
    /// Rows 1, θ_c, ψ^{f-1}, ψ^{f-2}, z^{f,f-2}, z^{f-1,f-2}, memory; one column per ψ.
    pub(crate) coefficients: Matrix,
    /// Rows 1, θ_c; one column per ψ: the model of order zero, "without dynamics".
    pub(crate) static_coefficients: Matrix,
    /// A factor on each ψ; see [`Dynamics::amplitudes`].
    amplitudes: Vec<f64>,
    /// Largest magnitude that each ψ may take.
    limits: Vec<f64>,
}

/// What the dynamics remember of the last two frames.
#[derive(Debug, Clone)]
pub struct DynamicsState {
    wrinkles: [Vec<f64>; 2],
    poses: Option<[Pose; 2]>,
    /// Mean of the past θ_c.
    memory: Vec<f64>,
    /// The wrinkles of the last frame at their amplitudes.
    shown: Vec<f64>,
    row: Vec<f64>,
    scratch: Vec<f64>,
}

/// Where the blocks of a row of regressors begin.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RowLayout {
    pub(crate) pose: usize,
    pub(crate) history: usize,
    pub(crate) change: usize,
    pub(crate) memory: usize,
    pub(crate) end: usize,
    wrinkle_count: usize,
    change_count: usize,
}

impl RowLayout {
    pub(crate) fn new(inputs: &PoseInputs, wrinkle_count: usize) -> Self {
        let history = 1 + inputs.pose_count();
        let change = history + 2 * wrinkle_count;
        let memory = change + 2 * inputs.change_count();
        let end = memory + inputs.memory_count();
        Self { pose: 1, history, change, memory, end, wrinkle_count, change_count: inputs.change_count() }
    }
}

/// What a frame comes after: poses and wrinkles of the frame before and of the one before that, and the mean of the past θ_c.
pub(crate) struct Past<'a> {
    pub(crate) poses: [&'a Pose; 2],
    pub(crate) wrinkles: [&'a [f64]; 2],
    pub(crate) memory: &'a mut [f64],
}

/// Writes one row of regressors, and takes the pose into the memory of the past.
pub(crate) fn fill_row(
    inputs: &PoseInputs,
    layout: RowLayout,
    pose: &Pose,
    past: Past<'_>,
    scratch: &mut [f64],
    row: &mut [f64],
) {
    row[0] = 1.0;
    let (head, memory) = row.split_at_mut(layout.memory);
    inputs.pose(pose, &mut head[layout.pose..layout.history]);
    let (first, second) = head[layout.history..layout.change].split_at_mut(layout.wrinkle_count);
    first.copy_from_slice(past.wrinkles[0]);
    second.copy_from_slice(past.wrinkles[1]);
    let (first, second) = head[layout.change..].split_at_mut(layout.change_count);
    inputs.change(pose, past.poses[1], scratch, first);
    inputs.change(past.poses[0], past.poses[1], scratch, second);
    let theta = &head[layout.pose..layout.history];
    inputs.remember(theta, false, past.memory);
    for ((out, mean), value) in memory.iter_mut().zip(past.memory.iter()).zip(theta) {
        *out = mean - value;
    }
}

/// `out = rowᵀ coefficients`.
pub(crate) fn apply_row(coefficients: &Matrix, row: &[f64], out: &mut [f64]) {
    out.fill(0.0);
    for (index, &value) in row.iter().enumerate() {
        for (out, coefficient) in out.iter_mut().zip(coefficients.row(index)) {
            *out += value * coefficient;
        }
    }
}

/// Standard deviations that a wrinkle coefficient may be away from the mean; training frames rarely are further.
const LARGEST_DEVIATION: f64 = 5.0;

impl Dynamics {
    pub(crate) fn new(inputs: PoseInputs, coefficients: Matrix, static_coefficients: Matrix) -> Self {
        let limits = vec![f64::INFINITY; coefficients.cols];
        let amplitudes = vec![1.0; coefficients.cols];
        Self { inputs, coefficients, static_coefficients, amplitudes, limits }
    }

    pub(crate) fn with_amplitudes(self, amplitudes: Vec<f64>) -> Self {
        Self { amplitudes, ..self }
    }

    /// Shows the wrinkles at these amplitudes. Runs without dynamics share those with dynamics; where theirs are smaller, the
    /// model of order zero is weakened.
    pub(crate) fn shown_at(mut self, Amplitudes { dynamic, fixed }: &Amplitudes) -> Self {
        for row in 0..self.static_coefficients.rows {
            for (column, (fixed, dynamic)) in fixed.iter().zip(dynamic).enumerate() {
                self.static_coefficients[(row, column)] *= fixed / dynamic;
            }
        }
        self.static_coefficients.round_to_single();
        self.with_amplitudes(dynamic.clone())
    }

    /// A factor on each ψ as it is shown, with dynamics or without; they do not enter the recursion.
    ///
    /// Not in the paper. They give each ψ some of the spread that it has in motions that were held out in training.
    pub fn amplitudes(&self) -> &[f64] {
        &self.amplitudes
    }

    /// Bounds the wrinkles by their standard deviations over the training frames. Like any linear model this one would
    /// extrapolate poses far from all training poses without end.
    pub(crate) fn limit_to(&mut self, std_devs: &[f64]) {
        self.limits = std_devs.iter().map(|sd| LARGEST_DEVIATION * sd).collect();
    }

    /// Number of wrinkle coefficients ψ.
    pub fn wrinkle_count(&self) -> usize {
        self.coefficients.cols
    }

    /// The inputs from the pose.
    pub fn inputs(&self) -> &PoseInputs {
        &self.inputs
    }

    pub(crate) fn layout(&self) -> RowLayout {
        RowLayout::new(&self.inputs, self.wrinkle_count())
    }

    /// The matrices m, M1 … M5 of eq. 5 and that of the memory, in this order, each transposed: one column per ψ.
    pub fn matrices(&self) -> [Matrix; 7] {
        let layout = self.layout();
        let n = self.wrinkle_count();
        let history = layout.history;
        let change = layout.change;
        let bounds =
            [0, layout.pose, history, history + n, change, change + layout.change_count, layout.memory, layout.end];
        std::array::from_fn(|block| {
            let rows = bounds[block + 1] - bounds[block];
            Matrix::from_fn(rows, n, |row, column| self.coefficients[(bounds[block] + row, column)])
        })
    }

    /// The largest magnitude among the eigenvalues of `[[M2, M3], [1, 0]]`: below 1 the wrinkles settle when the body does.
    ///
    /// # Errors
    /// An iteration that does not converge.
    pub fn spectral_radius(&self) -> Result<f64, GarmentError> {
        spectral_radius(&self.coefficients, self.layout())
    }

    /// A state without memory: the first step gives the wrinkles of the model of order zero.
    pub fn start(&self) -> DynamicsState {
        DynamicsState {
            wrinkles: [vec![0.0; self.wrinkle_count()], vec![0.0; self.wrinkle_count()]],
            poses: None,
            memory: vec![0.0; self.inputs.memory_count()],
            shown: vec![0.0; self.wrinkle_count()],
            row: vec![0.0; self.layout().end],
            scratch: vec![0.0; self.inputs.pose_count()],
        }
    }

    /// The wrinkles of the next frame (eq. 5) at their [amplitudes](Self::amplitudes); nothing is allocated.
    pub fn step<'s>(&self, state: &'s mut DynamicsState, pose: &Pose) -> &'s [f64] {
        let DynamicsState { wrinkles: [newer, older], poses, memory, shown, row, scratch } = state;
        match poses {
            Some([before, before_that]) => {
                let past = Past { poses: [before, before_that], wrinkles: [newer, older], memory };
                fill_row(&self.inputs, self.layout(), pose, past, scratch, row);
                std::mem::swap(newer, older);
                apply_row(&self.coefficients, row, newer);
                self.limit(newer);
                std::mem::swap(before, before_that);
                before.clone_from(pose);
            }
            None => {
                self.static_into(pose, row, newer);
                older.copy_from_slice(newer);
                self.inputs.remember(&row[1..], true, memory);
                *poses = Some([pose.clone(), pose.clone()]);
            }
        }
        self.show(newer, shown);
        shown
    }

    /// The wrinkles of the model of order zero, which knows the pose alone, at their amplitudes; nothing is allocated.
    pub fn step_static<'s>(&self, state: &'s mut DynamicsState, pose: &Pose) -> &'s [f64] {
        let DynamicsState { wrinkles: [wrinkles, _], shown, row, .. } = state;
        self.static_into(pose, row, wrinkles);
        self.show(wrinkles, shown);
        shown
    }

    fn show(&self, wrinkles: &[f64], shown: &mut [f64]) {
        for ((shown, value), amplitude) in shown.iter_mut().zip(wrinkles).zip(&self.amplitudes) {
            *shown = value * amplitude;
        }
        self.limit(shown);
    }

    fn static_into(&self, pose: &Pose, row: &mut [f64], out: &mut [f64]) {
        let row = &mut row[..self.static_coefficients.rows];
        row[0] = 1.0;
        self.inputs.pose(pose, &mut row[1..]);
        apply_row(&self.static_coefficients, row, out);
        self.limit(out);
    }

    fn limit(&self, wrinkles: &mut [f64]) {
        for (value, &limit) in wrinkles.iter_mut().zip(&self.limits) {
            *value = value.clamp(-limit, limit);
        }
    }
}

/// Spectral radius of the companion matrix of the history blocks.
pub(crate) fn spectral_radius(coefficients: &Matrix, layout: RowLayout) -> Result<f64, GarmentError> {
    let n = layout.wrinkle_count;
    let companion = Matrix::from_fn(2 * n, 2 * n, |row, column| {
        if row < n { coefficients[(layout.history + column, row)] } else { f64::from(u8::from(row - n == column)) }
    });
    largest_eigenvalue_magnitude(&companion).map_err(GarmentError::solve("stability of the dynamics"))
}
