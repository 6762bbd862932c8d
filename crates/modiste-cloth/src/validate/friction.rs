//! Coulomb friction on an inclined plane.

use super::sheet::{FRAME, Sheet, plain_fabric, table};
use crate::{ClothError, Solver, SolverOptions};
use modiste_core::{Vec2, Vec3};
use serde::Serialize;

/// A sheet on an inclined plane.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Incline {
    /// Tangent of the angle over the coefficient of friction: above one the sheet must slide.
    pub steepness: f64,
    /// How far the sheet slid in one second (m), after half a second to break away.
    pub slid: f64,
    /// How far Coulomb's law lets it slide (m) from the speed that it had.
    pub expected: f64,
}

/// Lays a sheet on a plane whose slope is `steepness` times the coefficient of friction, and lets go.
///
/// # Errors
/// What the solver refuses.
pub fn incline(steepness: f64) -> Result<Incline, ClothError> {
    let friction = 0.4;
    let mut options = SolverOptions {
        friction,
        static_friction: friction,
        air_drag: 0.0,
        tolerance: 0.01,
        ..SolverOptions::default()
    };
    let mut body = table(3.0)?;
    let mut sheet = Sheet::new(Vec2::new(0.1, 0.1), [10, 10], &plain_fabric(0.2, 100.0, 1e-5))?;
    for x in &mut sheet.state.positions {
        *x = Vec3::new(x.x, options.thickness - 2e-6, -x.y);
    }
    options.gravity = [0.0, -9.81, 0.0];
    let mut solver = Solver::new(&sheet.model, options);
    sheet.rest(&mut solver, &mut body, (15, 0.0))?;
    let angle = (steepness * friction).atan();
    options.gravity = [9.81 * angle.sin(), -9.81 * angle.cos(), 0.0];
    solver.set_options(options);
    sheet.rest(&mut solver, &mut body, (15, 0.0))?;
    let along = |vectors: &[Vec3]| vectors.iter().map(|v| v.x).sum::<f64>() / vectors.len() as f64;
    let (start, speed) = (along(&sheet.state.positions), along(&sheet.state.velocities));
    let frames = 30;
    sheet.rest(&mut solver, &mut body, (frames, 0.0))?;
    let time = frames as f64 * FRAME;
    let pull = 9.81 * (angle.sin() - friction * angle.cos());
    let expected = if pull > 0.0 { speed * time + 0.5 * pull * time * time } else { 0.0 };
    Ok(Incline { steepness, slid: along(&sheet.state.positions) - start, expected })
}

#[cfg(test)]
mod tests {
    use super::incline;

    #[test]
    fn cloth_sticks_below_the_critical_angle_and_slides_above() {
        for steepness in [0.5, 0.95] {
            let sheet = incline(steepness).unwrap();
            assert!(sheet.slid.abs() < 1e-3, "{sheet:?}");
        }
        for steepness in [1.1, 1.5] {
            let sheet = incline(steepness).unwrap();
            assert!((sheet.slid - sheet.expected).abs() < 0.02 * sheet.expected, "{sheet:?}");
        }
    }
}
