//! Cloth on a body-like obstacle: a square dropped on a sphere.

use super::sheet::{FRAME, Sheet};
use crate::{BodyCollider, ClothError, Fabric, Solver, SolverOptions};
use modiste_core::{Vec2, Vec3, shapes};
use serde::Serialize;
use std::sync::Arc;
use std::time::Instant;

/// A square of jersey dropped on a sphere of 25 cm radius.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DropFigures {
    /// Number of cloth vertices.
    pub vertices: usize,
    /// Vertices inside the sphere's triangles after any frame, all frames together.
    pub inside: usize,
    /// Largest 99th percentile of the edge stretch in any frame.
    pub stretch: f64,
    /// Median time of a frame (s) on this machine, contact included.
    pub median_frame: f64,
    /// 95th percentile of the time of a frame (s).
    pub slow_frame: f64,
}

/// Drops a square of about `vertices` vertices and follows it for two seconds.
///
/// # Errors
/// What the solver refuses.
pub fn sphere_drop(vertices: usize) -> Result<DropFigures, ClothError> {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small positive count")]
    let cells = ((vertices as f64).sqrt().round() as usize).max(3) - 1;
    let mut sheet = Sheet::new(Vec2::ONE, [cells, cells], &Fabric::jersey())?;
    for x in &mut sheet.state.positions {
        *x = Vec3::new(x.x - 0.5, 0.26, 0.5 - x.y);
    }
    // As many triangles as a body: 20,480.
    let mut sphere = shapes::icosphere(5);
    sphere.vertices.iter_mut().for_each(|x| *x *= 0.25);
    let mut body = BodyCollider::new(Arc::clone(&sphere.topology), &sphere.vertices)?;
    let mut solver = Solver::new(&sheet.model, SolverOptions::default());
    let mut times = Vec::new();
    let (mut inside, mut stretch) = (0, 0.0f64);
    for _ in 0..60 {
        let clock = Instant::now();
        solver.step(&sheet.model, &mut sheet.state, &mut body, FRAME)?;
        times.push(clock.elapsed().as_secs_f64());
        let below = |x: &&Vec3| body.closest(**x, 0.05).is_some_and(|(_, distance)| distance < 0.0);
        inside += sheet.state.positions.iter().filter(below).count();
        stretch = stretch.max(sheet.state.edge_stretch(&sheet.model).percentile_99);
    }
    times.sort_by(f64::total_cmp);
    let at = |share: usize| times[(times.len() - 1) * share / 100];
    Ok(DropFigures { vertices: sheet.state.positions.len(), inside, stretch, median_frame: at(50), slow_frame: at(95) })
}

#[cfg(test)]
mod tests {
    use super::sphere_drop;

    #[test]
    fn no_vertex_of_a_dropped_square_is_inside_the_sphere() {
        let figures = sphere_drop(900).unwrap();
        assert_eq!(figures.inside, 0, "{figures:?}");
        assert!(figures.stretch < 0.08, "{figures:?}");
    }
}
