//! Moving cloth: what must be conserved, and what must not depend on the length of the step.

use super::sheet::Sheet;
use crate::{BodyCollider, ClothError, Fabric, Solver, SolverOptions};
use modiste_core::{Quat, Vec2, Vec3, normal, seeded_rng};
use serde::Serialize;

/// Momentum of free cloth, and what a turn of the whole scene changes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Conservation {
    /// Change of the linear momentum within a second over the sum of the momenta of the vertices.
    pub linear_drift: f64,
    /// Share of the angular momentum that a spinning sheet keeps for a second (implicit steps lose a little).
    pub angular_kept: f64,
    /// Distance (m) between a fall and the same fall turned and shifted, after half a second.
    pub turned_difference: f64,
}

/// A swinging sheet at growing numbers of substeps.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Convergence {
    /// Substeps per frame, each with the mean distance (m) from the finest run after half a second.
    pub distances: Vec<(usize, f64)>,
}

fn swatch(cells: usize) -> Result<Sheet, ClothError> {
    Sheet::new(Vec2::new(0.2, 0.2), [cells, cells], &Fabric::jersey())
}

fn free_options() -> SolverOptions {
    SolverOptions {
        gravity: [0.0; 3],
        air_drag: 0.0,
        tolerance: 0.001,
        max_iterations: 1000,
        ..SolverOptions::default()
    }
}

/// Lets sheets fly, spin and fall.
///
/// # Errors
/// What the solver refuses.
pub fn conservation() -> Result<Conservation, ClothError> {
    Ok(Conservation {
        linear_drift: linear_drift()?,
        angular_kept: angular_kept()?,
        turned_difference: turned_difference()?,
    })
}

fn linear_drift() -> Result<f64, ClothError> {
    let mut sheet = swatch(12)?;
    let mut rng = seeded_rng(1);
    for v in &mut sheet.state.velocities {
        *v = Vec3::from_array(std::array::from_fn(|_| 0.3 * normal(&mut rng))) + Vec3::new(0.5, 0.2, -0.1);
    }
    let before = sheet.state.momentum(&sheet.model).0;
    let speeds = sheet.state.velocities.iter().zip(sheet.model.masses());
    let total: f64 = speeds.map(|(v, mass)| v.length() * mass).sum();
    let mut solver = Solver::new(&sheet.model, free_options());
    sheet.rest(&mut solver, &mut BodyCollider::none(), (30, 0.0))?;
    Ok(sheet.state.momentum(&sheet.model).0.distance(before) / total)
}

fn angular_kept() -> Result<f64, ClothError> {
    let mut sheet = swatch(12)?;
    let spin = Vec3::new(0.0, 0.0, 3.0);
    let centre = Vec3::new(0.1, 0.1, 0.0);
    for (x, v) in sheet.state.positions.iter_mut().zip(&mut sheet.state.velocities) {
        *x -= centre;
        *v = spin.cross(*x);
    }
    let before = sheet.state.momentum(&sheet.model).1;
    let mut solver = Solver::new(&sheet.model, free_options());
    sheet.rest(&mut solver, &mut BodyCollider::none(), (30, 0.0))?;
    Ok(sheet.state.momentum(&sheet.model).1.dot(before) / before.length_squared())
}

/// A sheet pinned at two corners that swings for `frames` frames in a scene turned by `turn` and shifted by `shift`.
fn swing(frames: usize, options: SolverOptions, turn: Quat, shift: Vec3) -> Result<Sheet, ClothError> {
    let mut sheet = swatch(12)?;
    sheet.model.pins = vec![sheet.row(12)[0], sheet.row(12)[12]];
    let level = Quat::from_rotation_x(0.9);
    for x in &mut sheet.state.positions {
        *x = turn * (level * *x) + shift;
    }
    let gravity = (turn * Vec3::new(0.0, -9.81, 0.0)).to_array();
    let mut solver = Solver::new(&sheet.model, SolverOptions { gravity, air_drag: 0.1, ..options });
    sheet.rest(&mut solver, &mut BodyCollider::none(), (frames, 0.0))?;
    Ok(sheet)
}

fn mean_distance(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.distance(*b)).sum::<f64>() / a.len() as f64
}

fn turned_difference() -> Result<f64, ClothError> {
    let turn = Quat::from_scaled_axis(Vec3::new(0.7, -1.1, 0.4));
    let shift = Vec3::new(1.0, -2.0, 3.0);
    let plain = swing(15, free_options(), Quat::IDENTITY, Vec3::ZERO)?;
    let turned = swing(15, free_options(), turn, shift)?;
    let back: Vec<Vec3> = turned.state.positions.iter().map(|x| turn.conjugate() * (*x - shift)).collect();
    Ok(mean_distance(&plain.state.positions, &back))
}

/// Runs a swing with 5 to 40 substeps against 160.
///
/// # Errors
/// What the solver refuses.
pub fn convergence() -> Result<Convergence, ClothError> {
    let run = |substeps: usize| {
        let options = SolverOptions { substeps, ..free_options() };
        swing(15, options, Quat::IDENTITY, Vec3::ZERO).map(|sheet| sheet.state.positions)
    };
    let finest = run(160)?;
    let distances = [5, 10, 20, 40].map(|substeps| Ok((substeps, mean_distance(&run(substeps)?, &finest))));
    Ok(Convergence { distances: distances.into_iter().collect::<Result<_, ClothError>>()? })
}

#[cfg(test)]
mod tests {
    use super::{conservation, convergence};

    #[test]
    fn free_cloth_keeps_its_momentum_and_knows_no_direction() {
        let figures = conservation().unwrap();
        assert!(figures.linear_drift < 5e-3, "{figures:?}");
        assert!(figures.angular_kept > 0.9 && figures.angular_kept < 1.001, "{figures:?}");
        assert!(figures.turned_difference < 2e-3, "{figures:?}");
    }

    #[test]
    fn finer_steps_come_nearer_to_the_finest() {
        let distances = convergence().unwrap().distances;
        assert!(distances.windows(2).all(|pair| pair[1].1 < 0.8 * pair[0].1), "{distances:?}");
    }
}
