//! Learning: principal components of bust and hair, and the blocks of the hair tensor.

use modiste_body::Body;
use modiste_core::{Affine3, Matrix, Pca, Progress, QuantisedBasis, Vec3};
use rayon::prelude::*;

use super::blocks::Blocks;
use super::bust::BustState;
use super::expansion::Expansion;
use super::inputs::Inputs;
use super::matrix::{Layout, MOVES, Ridge, StyleMatrix};
use super::{Dynamics, HairModel};
use crate::canonical::{BustTrack, Frame};
use crate::scalp::Root;
use crate::space::HairSpace;
use crate::training::{Factors, Recorded, TrainingFolder};
use crate::{HairError, POINTS};

/// Frames that principal components are found from, of hair and of bust.
const HAIR_FRAMES: usize = 1400;
const BUST_FRAMES: usize = 1000;
/// Frames that are added to the Gram matrix at a time.
const CHUNK: usize = 512;
/// Every so many training sequences, one is kept back to choose the ridge by.
const CHOOSE_EVERY: usize = 6;
/// Ridges that are tried.
const INDEPENDENT: [f64; 3] = [1e-4, 1e-3, 1e-2];
const SHARED: [f64; 4] = [1e-2, 3e-2, 1e-1, 3e-1];
const INPUTS: [f64; 4] = [1e-2, 5e-2, 2e-1, 6e-1];
/// How far beyond what was seen in training inputs may go.
const BEYOND: f64 = 1.2;
/// A style whose largest eigenvalue is above this is not taken.
const STABLE: f64 = 0.995;

/// What can be chosen in learning.
#[derive(Debug, Clone, PartialEq)]
pub struct LearnOptions {
    /// Most hair coefficients, d_h.
    pub hair_dimensions: usize,
    /// Bust coefficients, d_b.
    pub bust_dimensions: usize,
    /// Whether the model is that of the thesis alone ([`HairSpace`], [`Inputs`]).
    pub plain: bool,
}

impl Default for LearnOptions {
    fn default() -> Self {
        Self { hair_dimensions: 100, bust_dimensions: 16, plain: false }
    }
}

impl LearnOptions {
    /// The model of the thesis, which has ten coefficients of the bust.
    pub fn plain() -> Self {
        Self { bust_dimensions: 10, plain: true, ..Self::default() }
    }
}

/// A learned model with what learning found out.
#[derive(Debug)]
pub struct Learned {
    /// The model.
    pub model: HairModel,
    /// Part of the variance of the hair that its coefficients hold.
    pub energy: f64,
    /// Frames of a cell that it was learned from.
    pub frames: usize,
    /// Sequences that it was learned from.
    pub sequences: usize,
}

/// A sequence in coefficients: the bust and the inputs per frame, and the hair per cell and frame.
struct Reduced {
    busts: Vec<BustState>,
    inputs: Vec<Vec<f64>>,
    /// Whether the bust cannot have moved to where it is in a frame, or in the one before.
    cut: Vec<bool>,
    hair: Vec<Vec<Vec<f64>>>,
}

/// Learns a model from the sequences of a training set that are not held out.
///
/// # Errors
/// A set without sequences, or one whose files are damaged.
pub fn learn(
    folder: &TrainingFolder,
    names: &[String],
    body: &Body,
    roots: &[Root],
    options: &LearnOptions,
    progress: &dyn Progress,
) -> Result<Learned, HairError> {
    const STAGE: &str = "learn";
    let cells = &folder.recipe().cells;
    let mut recorded = Vec::new();
    for name in names {
        let sequence = folder.body(name)?;
        if !sequence.held_out && sequence.frames.len() >= 4 {
            recorded.push(sequence);
        }
    }
    let frames: usize = recorded.iter().map(|sequence| sequence.frames.len()).sum();
    if frames < 100 {
        return Err(HairError::data("training set", "100 frames or more", frames));
    }
    progress.start(STAGE, recorded.len() + 3);
    let track = BustTrack::reference(body)?;
    let bust_rest: Vec<Vec3> = track.vertices().iter().map(|&v| body.rest_vertices()[v as usize]).collect();
    let space = if options.plain { HairSpace::of_bust() } else { HairSpace::of_head(track.head(), &bust_rest) };
    let bust = bust_components(&recorded, frames, &space, options.bust_dimensions)?;
    let hair = hair_components(folder, &recorded, frames, &space, options.hair_dimensions)?;
    progress.advance(STAGE, 1);
    let energy = hair.std_devs.iter().map(|s| s * s).sum::<f64>() / hair.total_variance;
    let mut reduced = Vec::with_capacity(recorded.len());
    for (index, recorded) in recorded.into_iter().enumerate() {
        reduced.push(reduce(folder, recorded, &bust, (&space, &hair), options.plain)?);
        progress.advance(STAGE, index + 2);
    }
    let layout = Layout { inputs: Inputs::count(options.plain, bust.count()), hair: hair.count() };
    let chosen = |index: usize| index % CHOOSE_EVERY == CHOOSE_EVERY - 1;
    let gram_of = |wanted: &dyn Fn(usize) -> bool| gram(&reduced, layout, cells.len(), wanted);
    let (kept, rest) = (gram_of(&|index| !chosen(index)), gram_of(&chosen));
    let n = 3 * POINTS * roots.len();
    let basis =
        QuantisedBasis::from_f32(&hair.basis, hair.count(), n).map_err(HairError::solving("basis of the hair"))?;
    let mut model = HairModel {
        name: folder.recipe().source.clone().unwrap_or_else(|| folder.recipe().style.name().to_owned()),
        fps: 30.0,
        roots: roots.to_vec(),
        cells: cells.clone(),
        bust_vertices: track.vertices().to_vec(),
        bust_rest,
        plain: options.plain,
        space,
        limits: limits(&reduced),
        expansion: Expansion::new(&hair.mean, &basis),
        basis,
        mean: hair.mean,
        std_devs: hair.std_devs,
        bust,
        blocks: Blocks::from_gram(&kept, &layout.shared(), cells.len())?,
        ridges: vec![Ridge::NONE; cells.len()],
        seed: folder.recipe().seed,
    };
    let trial: Vec<&Reduced> = reduced.iter().enumerate().filter(|(index, _)| chosen(*index)).map(|(_, r)| r).collect();
    let ridges = choose_ridges(&model, &trial)?;
    let mut sum = kept;
    for (value, more) in sum.data.iter_mut().zip(&rest.data) {
        *value += more;
    }
    model.blocks = Blocks::from_gram(&sum, &layout.shared(), cells.len())?;
    take_first_stable(&mut model, &ridges)?;
    progress.finish(STAGE);
    Ok(Learned { energy, frames, sequences: reduced.len(), model })
}

fn bust_components(recorded: &[Recorded], frames: usize, space: &HairSpace, count: usize) -> Result<Pca, HairError> {
    let every = frames.div_ceil(BUST_FRAMES).max(1);
    let numbers = |(frame, canonical): (Frame, Vec<Vec3>)| -> Vec<f32> {
        space.level(frame, canonical).1.iter().flat_map(|p| p.to_array()).map(|x| x as f32).collect()
    };
    let samples: Vec<Vec<f32>> = recorded.iter().flat_map(Recorded::busts).step_by(every).map(numbers).collect();
    let samples: Vec<&[f32]> = samples.iter().map(Vec::as_slice).collect();
    Pca::fit(&samples, count).map_err(HairError::solving("components of the bust"))
}

fn hair_components(
    folder: &TrainingFolder,
    recorded: &[Recorded],
    frames: usize,
    space: &HairSpace,
    count: usize,
) -> Result<Pca, HairError> {
    let cells = folder.recipe().cells.len();
    let every = (frames * cells).div_ceil(HAIR_FRAMES).max(1);
    let mut samples: Vec<Vec<f32>> = Vec::new();
    // Cells take turns, so that none is seen at the same moments only.
    let mut at = 0;
    for sequence in recorded {
        for cell in 0..cells {
            let count = sequence.frames.len();
            let hair = folder.hair(&sequence.name, cell, count)?;
            for (frame, (_, canonical)) in hair.chunks_exact(hair.len() / count).zip(sequence.busts()) {
                if at % every == 0 {
                    samples.push(space.carry(&space.pose(&canonical).inverse(), frame));
                }
                at += 1;
            }
        }
    }
    let samples: Vec<&[f32]> = samples.iter().map(Vec::as_slice).collect();
    Pca::fit(&samples, count).map_err(HairError::solving("components of the hair"))
}

fn reduce(
    folder: &TrainingFolder,
    recorded: Recorded,
    bust: &Pca,
    (space, hair): (&HairSpace, &Pca),
    plain: bool,
) -> Result<Reduced, HairError> {
    let count = recorded.frames.len();
    let poses: Vec<Affine3> = recorded.busts().map(|(_, canonical)| space.pose(&canonical).inverse()).collect();
    let busts: Vec<BustState> =
        recorded.busts().map(|(frame, canonical)| BustState::new(space, bust, frame, canonical)).collect();
    let mut cells = Vec::new();
    for cell in 0..folder.recipe().cells.len() {
        let numbers = folder.hair(&recorded.name, cell, count)?;
        let frames: Vec<&[f32]> = numbers.chunks_exact(numbers.len() / count).collect();
        let carried = frames.par_iter().zip(&poses).map(|(frame, pose)| hair.project(&space.carry(pose, frame)));
        cells.push(carried.collect());
    }
    let mut inputs = Inputs::new(plain);
    let driven = busts.iter().map(|bust| inputs.next(bust)).collect();
    let is_cut = |t: usize| {
        let before = || [&busts[t - 2].frame, &busts[t - 1].frame];
        t >= 2 && busts[t].frame.is_cut(before(), busts[t].shift(&busts[t - 1]))
    };
    let cut = (0..count).map(|t| t >= 1 && (is_cut(t) || t >= 2 && is_cut(t - 1))).collect();
    Ok(Reduced { busts, inputs: driven, cut, hair: cells })
}

/// How far inputs and moves may go.
fn limits(reduced: &[Reduced]) -> std::sync::Arc<[f64]> {
    let mut limits: Vec<f64> = Vec::new();
    for sequence in reduced {
        for t in (2..sequence.busts.len()).filter(|&t| !sequence.cut[t]) {
            let numbers = sequence.inputs[t].iter().copied().chain(moves(sequence, t));
            for (index, number) in numbers.enumerate() {
                match limits.get_mut(index) {
                    Some(limit) => *limit = limit.max(BEYOND * number.abs()),
                    None => limits.push(BEYOND * number.abs()),
                }
            }
        }
    }
    limits.into()
}

/// `z_{t,t−2}` and `z_{t−1,t−2}`.
fn moves(sequence: &Reduced, t: usize) -> [f64; MOVES] {
    let frame = |t: usize| sequence.busts[t].frame;
    let (a, b) = (frame(t).since(&frame(t - 2)), frame(t - 1).since(&frame(t - 2)));
    std::array::from_fn(|i| if i < 5 { a[i] } else { b[i - 5] })
}

/// `D Dᵀ` of the stacked blocks over the frames from the third on of the wanted sequences.
fn gram(reduced: &[Reduced], layout: Layout, cells: usize, wanted: &dyn Fn(usize) -> bool) -> Matrix {
    let size = Blocks::stacked(&layout.shared(), cells);
    let mut sum = Matrix::zeros(size, size);
    let mut rows: Vec<Vec<f64>> = Vec::with_capacity(CHUNK);
    let mut add = |rows: &mut Vec<Vec<f64>>| {
        let chunk = Matrix::from_rows(rows);
        for (value, more) in sum.data.iter_mut().zip(chunk.transpose_matmul(&chunk).data) {
            *value += more;
        }
        rows.clear();
    };
    for sequence in reduced.iter().enumerate().filter(|(index, _)| wanted(*index)).map(|(_, sequence)| sequence) {
        for t in (2..sequence.busts.len()).filter(|&t| !sequence.cut[t]) {
            rows.push(stacked(sequence, t));
            if rows.len() == CHUNK {
                add(&mut rows);
            }
        }
    }
    if !rows.is_empty() {
        add(&mut rows);
    }
    sum
}

/// `w_t = [x_t; y_{t−2}; y_{t−1}; z_{t,t−2}; z_{t−1,t−2}; y_t]` of all cells: x and z first, which all have in common.
fn stacked(sequence: &Reduced, t: usize) -> Vec<f64> {
    let mut row = sequence.inputs[t].clone();
    row.extend(moves(sequence, t));
    for hair in &sequence.hair {
        row.extend(hair[t - 2..=t].iter().flatten());
    }
    row
}

/// For each cell, ridges in the order of how near the model comes to simulated hair with them, running freely through the
/// trial sequences.
fn choose_ridges(model: &HairModel, trial: &[&Reduced]) -> Result<Vec<Vec<Ridge>>, HairError> {
    let mut tried = vec![Vec::new(); model.cells.len()];
    for independent in INDEPENDENT {
        for shared in SHARED {
            for inputs in INPUTS {
                let ridge = Ridge { independent, shared, inputs };
                for (cell, tried) in tried.iter_mut().enumerate() {
                    tried.push((free_error(model, trial, cell, ridge)?, ridge));
                }
            }
        }
    }
    let in_order = |mut tried: Vec<(f64, Ridge)>| {
        tried.sort_by(|a, b| a.0.total_cmp(&b.0));
        tried.into_iter().map(|(_, ridge)| ridge).collect()
    };
    Ok(tried.into_iter().map(in_order).collect())
}

/// Sum of squared distances between predicted and simulated coefficients of a cell.
fn free_error(model: &HairModel, trial: &[&Reduced], cell: usize, ridge: Ridge) -> Result<f64, HairError> {
    let factors = Factors::of_cell(&model.cells[cell]);
    let matrix = StyleMatrix::new(&model.blocks, &factors.weights(&model.cells)?, model.layout(), ridge)?;
    let mut sum = 0.0;
    for sequence in trial {
        let mut dynamics = Dynamics::with_matrix(model, factors, matrix.clone());
        for (bust, wanted) in sequence.busts.iter().zip(&sequence.hair[cell]) {
            let found = dynamics.step(bust);
            sum += found.iter().zip(wanted).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        }
    }
    Ok(if sum.is_finite() { sum } else { f64::INFINITY })
}

/// Takes the best ridges of the cells, or the next best, with which every style is stable; where none of those tried are,
/// stronger ones.
fn take_first_stable(model: &mut HairModel, ridges: &[Vec<Ridge>]) -> Result<(), HairError> {
    let strongest = Ridge { independent: 0.1, shared: 1.0, inputs: 0.1 };
    for rank in 0..=ridges[0].len() {
        model.ridges = ridges.iter().map(|ridges| ridges.get(rank).copied().unwrap_or(strongest)).collect();
        if largest_eigenvalue(model)? < STABLE {
            return Ok(());
        }
    }
    Err(HairError::data("hair dynamics", format!("eigenvalues below {STABLE}"), "none of the ridges gives them"))
}

/// λ_max over a coarse grid of the factors and all cells; the report looks at a fine one.
fn largest_eigenvalue(model: &HairModel) -> Result<f64, HairError> {
    let mut largest = 0.0f64;
    let still = model.cells.iter().filter(|cell| cell.wind.is_none()).count();
    let mut styles: Vec<Factors> = model.cells.iter().map(Factors::of_cell).collect();
    if still >= 4 {
        styles.extend(
            [(0.5, 0.5), (0.5, 1.0), (0.5, 0.0), (0.0, 0.5), (1.0, 0.5), (1.35, 1.0)].map(|(a, b)| Factors::new(a, b)),
        );
    }
    for factors in styles {
        largest = largest.max(model.style(&factors)?.largest_eigenvalue()?);
    }
    Ok(largest)
}
