//! Stitching: the seams of the placed panels pulled together, then welded.

use std::sync::Arc;

use modiste_core::Vec3;

use super::place::{place, thin_body};
use super::{DressError, Mannequin};
use crate::cut::CutGarment;
use crate::pattern::Fitting;
use crate::{BodyCollider, ClothModel, ClothState, Fabric, Seam, Solver, SolverOptions};

/// Widest gap of a seam before it is welded (m).
pub const SEAM_TOLERANCE: f64 = 1e-3;

/// Share of the body's thickness while seams close.
const THIN_SHARE: f64 = 0.62;

/// Frames over which the seams are drawn in.
const CLOSING_FRAMES: usize = 30;

/// Frames after which sewing is given up.
const MAX_FRAMES: usize = 150;

/// Seams that resist, gathered ones above all, are pulled twice as hard after so many further frames, up to a limit.
const HARDENING_FRAMES: usize = 12;
const HARDEST: f64 = 64.0;

/// Frames over which the thin body grows to its size inside the sewn garment.
const GROWING_FRAMES: usize = 30;

/// Drag while sewing (kg/(m² s)): nothing swings.
const DRAG: f64 = 3.0;

/// Factor on the damping times of the fabric while sewing.
const DAMPING: f64 = 3.0;

const FRAME_TIME: f64 = 1.0 / 30.0;

/// A garment that is sewn and hangs weightless around the full body.
#[derive(Debug, Clone)]
pub struct Sewn {
    /// Positions of the sewn vertices (m).
    pub positions: Vec<Vec3>,
    /// Widest gap of a seam when it was welded (m).
    pub widest_seam: f64,
    /// Frames that the seams took to close.
    pub frames: usize,
}

/// Places the panels of a size around the thinned body, pulls the seams together, welds them, and lets the body grow to
/// its size inside.
///
/// # Errors
/// Seams that do not close to [`SEAM_TOLERANCE`], or what the physics refuses.
pub fn sew(
    cut: &CutGarment,
    fitting: Fitting,
    body: &Mannequin,
    fabric: &Fabric,
    solver: SolverOptions,
) -> Result<Sewn, DressError> {
    let thin = thin_body(body, THIN_SHARE);
    let options = SolverOptions {
        gravity: [0.0; 3],
        air_drag: DRAG,
        friction: 0.05,
        static_friction: 0.05,
        damping: DAMPING,
        ..solver
    };
    let (loose, widest_seam, frames) = close_seams(cut, fitting, body, &thin, fabric, options)?;
    let mut sums = vec![(Vec3::ZERO, 0.0); cut.topology().vertex_count()];
    for (position, &welded) in loose.iter().zip(cut.welded_from_loose()) {
        sums[welded as usize].0 += *position;
        sums[welded as usize].1 += 1.0;
    }
    let mut state = ClothState::at_rest(sums.into_iter().map(|(sum, count)| sum / count).collect());
    let model = ClothModel::new(Arc::clone(cut.topology()), cut.rest_faces(fitting), fabric)?;
    let mut collider = BodyCollider::new(Arc::clone(&body.topology), &thin)?;
    let mut solver = Solver::new(&model, options);
    let mut grown = vec![Vec3::ZERO; thin.len()];
    for frame in 1..=GROWING_FRAMES {
        let share = frame as f64 / GROWING_FRAMES as f64;
        for ((grown, thin), full) in grown.iter_mut().zip(&thin).zip(&body.vertices) {
            *grown = thin.lerp(*full, share);
        }
        collider.advance_to(&grown);
        solver.step(&model, &mut state, &mut collider, FRAME_TIME)?;
    }
    Ok(Sewn { positions: state.positions, widest_seam, frames })
}

/// Loose positions with all seams closed, the widest gap left (m), and the frames it took.
fn close_seams(
    cut: &CutGarment,
    fitting: Fitting,
    body: &Mannequin,
    thin: &[Vec3],
    fabric: &Fabric,
    options: SolverOptions,
) -> Result<(Vec<Vec3>, f64, usize), DressError> {
    let mut state = ClothState::at_rest(place(cut, fitting, body));
    let mut model = ClothModel::new(Arc::clone(cut.loose_topology()), cut.rest_faces(fitting), fabric)?;
    let gap = |x: &[Vec3], [a, b]: [u32; 2]| x[a as usize].distance(x[b as usize]);
    let gaps: Vec<f64> = cut.seam_pairs().iter().map(|&pair| gap(&state.positions, pair)).collect();
    model.seams = cut.seam_pairs().iter().zip(&gaps).map(|(&pair, &gap)| Seam::new(pair, gap)).collect();
    let mut collider = BodyCollider::new(Arc::clone(&body.topology), thin)?;
    let mut solver = Solver::new(&model, options);
    let mut widest = f64::INFINITY;
    for frame in 1..=MAX_FRAMES {
        let share = (1.0 - frame as f64 / CLOSING_FRAMES as f64).max(0.0);
        let doublings = frame.saturating_sub(CLOSING_FRAMES) / HARDENING_FRAMES;
        let stiffness = Seam::STIFFNESS * 2f64.powi(doublings as i32).min(HARDEST);
        for (seam, gap) in model.seams.iter_mut().zip(&gaps) {
            seam.rest_length = share * gap;
            seam.stiffness = stiffness;
        }
        solver.step(&model, &mut state, &mut collider, FRAME_TIME)?;
        widest = cut.seam_pairs().iter().map(|&pair| gap(&state.positions, pair)).fold(0.0, f64::max);
        if share == 0.0 && widest < SEAM_TOLERANCE {
            return Ok((state.positions, widest, frame));
        }
    }
    Err(DressError::SeamsOpen { widest, frames: MAX_FRAMES })
}
