//! Strips of cloth against one-dimensional theory.

use super::sheet::{Sheet, plain_fabric, static_options};
use crate::{Attachment, BodyCollider, BodyPoint, ClothError, Fabric, Solver, SolverOptions};
use modiste_core::{Topology, Vec2, Vec3};
use serde::Serialize;
use std::sync::Arc;

/// A simulated figure beside the closed form.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Comparison {
    /// What the simulation gave.
    pub measured: f64,
    /// What theory gives.
    pub expected: f64,
    /// Their difference over what theory gives.
    pub relative_error: f64,
}

impl Comparison {
    pub(super) fn new(measured: f64, expected: f64) -> Self {
        Self { measured, expected, relative_error: (measured - expected).abs() / expected.abs() }
    }
}

const GRAVITY: f64 = 9.81;

/// Cells along a strip that is bent.
const CELLS: usize = 40;

/// Elongation (m) of a strip that hangs by one end: `ρ g L² / (2 E)`.
///
/// # Errors
/// What the solver refuses.
pub fn hanging_strip() -> Result<Comparison, ClothError> {
    let (length, density, young) = (0.5, 0.2, 500.0);
    let mut sheet = Sheet::new(Vec2::new(0.1, length), [10, 50], &plain_fabric(density, young, 1e-5))?;
    sheet.model.pins = sheet.row(sheet.rows);
    let options = SolverOptions { gravity: [0.0, -GRAVITY, 0.0], ..static_options() };
    let mut solver = Solver::new(&sheet.model, options);
    sheet.rest(&mut solver, &mut BodyCollider::none(), (400, 1e-5))?;
    Ok(Comparison::new(-sheet.row_centre(0).y, density * GRAVITY * length * length / (2.0 * young)))
}

/// Elongation (m) of a weightless strip under a load `F` at its end: `F L / (E w)` to first order; the expected value
/// solves the St. Venant-Kirchhoff law `E w λ (λ² - 1)/2 = F` exactly.
///
/// # Errors
/// What the solver refuses.
pub fn loaded_strip() -> Result<Comparison, ClothError> {
    let (length, width, young, load) = (0.4, 0.1, 300.0, 1.5);
    let mut sheet = Sheet::new(Vec2::new(width, length), [10, 40], &plain_fabric(0.2, young, 1e-5))?;
    sheet.model.pins = sheet.row(sheet.rows);
    // Weak long springs to a plate far below: nearly constant forces, half as much at the corners.
    let drop = 1.0;
    let corners = [[0.0, 0.0], [width, 0.0], [width, 0.1], [0.0, 0.1]].map(|[x, z]| Vec3::new(x, -drop, z));
    let topology = Topology::new(4, vec![[0, 1, 2], [0, 2, 3]]);
    let topology = topology.unwrap_or_else(|_| unreachable!("two triangles over four corners"));
    let mut plate = BodyCollider::new(Arc::new(topology), &corners)?;
    let bottom = sheet.row(0);
    let spring = load / drop / sheet.columns as f64;
    for (column, &vertex) in bottom.iter().enumerate() {
        let share = column as f64 / sheet.columns as f64;
        let end = column == 0 || column == sheet.columns;
        let point = BodyPoint { face: 0, barycentric: [1.0 - share, share, 0.0] };
        let stiffness = if end { 0.5 * spring } else { spring };
        sheet.model.attachments.push(Attachment { vertex, point, offset: 0.0, stiffness, most: f64::INFINITY });
    }
    let mut solver = Solver::new(&sheet.model, SolverOptions { gravity: [0.0; 3], ..static_options() });
    sheet.rest(&mut solver, &mut plate, (400, 1e-5))?;
    let elongation = -sheet.row_centre(0).y;
    let force = load * (drop - elongation) / drop;
    let pull = |stretch: f64| young * width * stretch * (stretch * stretch - 1.0) / 2.0;
    let stretch = bisect(|stretch| pull(stretch) - force, 1.0, 2.0);
    Ok(Comparison::new(elongation, (stretch - 1.0) * length))
}

/// Energy (J) of a strip stretched by 2% between clamps: `½ E w L e²` with the Green strain `e = (1.02² - 1)/2`.
///
/// # Errors
/// What the solver refuses.
pub fn clamped_strip() -> Result<Comparison, ClothError> {
    let (length, width, young, stretch) = (0.3, 0.1, 300.0, 1.02);
    let mut sheet = Sheet::new(Vec2::new(width, length), [10, 30], &plain_fabric(0.2, young, 1e-5))?;
    sheet.model.pins = [sheet.row(0), sheet.row(sheet.rows)].concat();
    let top = sheet.row(sheet.rows);
    for vertex in top {
        sheet.state.positions[vertex as usize].y = stretch * length;
    }
    let mut solver = Solver::new(&sheet.model, SolverOptions { gravity: [0.0; 3], ..static_options() });
    sheet.rest(&mut solver, &mut BodyCollider::none(), (300, 1e-5))?;
    let strain = 0.5 * (stretch * stretch - 1.0);
    let expected = 0.5 * young * width * length * strain * strain;
    Ok(Comparison::new(sheet.model.energy(&sheet.state.positions, Vec3::ZERO), expected))
}

/// Sag (m) of a strip of 10 cm held level at one end, of bending rigidity `rigidity` (N·m).
///
/// The expected value is the heavy elastica `B θ'' = -ρ g (L - s) cos θ` solved by shooting; for small sag it is
/// `ρ g L⁴ / (8 B)`.
///
/// # Errors
/// What the solver refuses.
pub fn cantilever(rigidity: f64) -> Result<Comparison, ClothError> {
    let fabric = plain_fabric(0.2, 2000.0, rigidity);
    sag_of_strip(&fabric, std::f64::consts::FRAC_PI_2, 0.1, rigidity)
}

/// Sag (m) of a strip of `length` (m) cut at `angle` (rad) from the weft and held level at one end, beside that of the elastica
/// of bending rigidity `rigidity` (N·m).
pub(super) fn sag_of_strip(fabric: &Fabric, angle: f64, length: f64, rigidity: f64) -> Result<Comparison, ClothError> {
    let mut sheet = Sheet::cut_at(angle, Vec2::new(0.3 * length, length), [10, CELLS], fabric)?;
    sheet.model.pins = [sheet.row(0), sheet.row(1)].concat();
    let options = SolverOptions { gravity: [0.0, 0.0, -GRAVITY], ..static_options() };
    let mut solver = Solver::new(&sheet.model, options);
    sheet.rest(&mut solver, &mut BodyCollider::none(), (200, 1e-5))?;
    Ok(Comparison::new(-sheet.row_centre(sheet.rows).z, expected_sag(fabric, length, rigidity)))
}

/// Sag (m) of the elastica of bending rigidity `rigidity` (N·m) that stands for the strip of [`sag_of_strip`].
pub(super) fn expected_sag(fabric: &Fabric, length: f64, rigidity: f64) -> f64 {
    // The bend at the second row stands for half a cell before and behind it, so the clamp is between the pinned rows.
    let free = length - 0.5 * length / CELLS as f64;
    elastica_sag(free, fabric.density * GRAVITY / rigidity)
}

/// Sag of the tip of the heavy elastica of length `length` (m) with weight over rigidity `load` (1/m³).
fn elastica_sag(length: f64, load: f64) -> f64 {
    let steps = 2000;
    let h = length / steps as f64;
    // Slope down θ, curvature κ: θ' = κ, κ' = -load (L - s) cos θ; the right curvature at the clamp ends with κ = 0.
    let shoot = |start: f64| {
        let (mut angle, mut curvature, mut sag) = (0.0, start, 0.0);
        for step in 0..steps {
            let s = (step as f64 + 0.5) * h;
            let middle: f64 = angle + 0.5 * h * curvature;
            let next = curvature - h * load * (length - s) * middle.cos();
            let after = angle + 0.5 * h * (curvature + next);
            sag += 0.5 * h * (f64::sin(angle) + after.sin());
            (angle, curvature) = (after, next);
        }
        (curvature, sag)
    };
    let most = 0.5 * load * length * length;
    shoot(bisect(|start| shoot(start).0, 0.0, most)).1
}

/// The zero of an increasing function.
fn bisect(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if f(middle) < 0.0 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::{cantilever, clamped_strip, elastica_sag, hanging_strip, loaded_strip};

    #[test]
    fn strips_follow_the_closed_forms() {
        for (name, comparison, bound) in [
            ("hanging", hanging_strip().unwrap(), 0.01),
            ("loaded", loaded_strip().unwrap(), 0.01),
            ("clamped", clamped_strip().unwrap(), 0.01),
        ] {
            assert!(comparison.relative_error < bound, "{name}: {comparison:?}");
        }
    }

    #[test]
    fn bent_strips_follow_the_elastica() {
        for (rigidity, bound) in [(1e-3, 0.07), (5e-5, 0.02)] {
            let comparison = cantilever(rigidity).unwrap();
            assert!(comparison.relative_error < bound, "{rigidity}: {comparison:?}");
        }
    }

    #[test]
    fn the_elastica_sags_by_the_beam_formula_where_it_is_stiff() {
        let (length, load) = (0.1f64, 20.0);
        let beam = load * length.powi(4) / 8.0;
        assert!((elastica_sag(length, load) / beam - 1.0).abs() < 1e-3);
        // And never below its own length where it is soft.
        assert!(elastica_sag(length, 1e6) < length);
    }
}
