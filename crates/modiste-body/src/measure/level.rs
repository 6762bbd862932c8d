//! Numbers read off the vertices, such as the height of a landmark, with their derivatives.

use modiste_core::Vec3;

use super::SparseGradient;
use super::section::SectionGradient;

/// A height or other number with its derivative.
pub(super) struct Level {
    pub(super) value: f64,
    pub(super) gradient: SparseGradient,
}

pub(super) fn stature(x: &[Vec3], gradient: Option<&mut SparseGradient>) -> f64 {
    give(minus(highest(x), floor(x)), gradient)
}

pub(super) fn floor(x: &[Vec3]) -> Level {
    extreme(x, (0..x.len()).min_by(|&i, &j| x[i].y.total_cmp(&x[j].y)))
}

pub(super) fn highest(x: &[Vec3]) -> Level {
    extreme(x, (0..x.len()).max_by(|&i, &j| x[i].y.total_cmp(&x[j].y)))
}

pub(super) fn extreme(x: &[Vec3], vertex: Option<usize>) -> Level {
    vertex.map_or(Level { value: 0.0, gradient: SparseGradient::new() }, |vertex| Level {
        value: x[vertex].y,
        gradient: vec![(vertex as u32, Vec3::Y)],
    })
}

pub(super) fn mean_point(vertices: &[u32], x: &[Vec3]) -> Vec3 {
    vertices.iter().map(|&vertex| x[vertex as usize]).sum::<Vec3>() / vertices.len() as f64
}

pub(super) fn mean(vertices: &[u32], x: &[Vec3], direction: Vec3) -> Level {
    let share = direction / vertices.len() as f64;
    Level {
        value: mean_point(vertices, x).dot(direction),
        gradient: vertices.iter().map(|&vertex| (vertex, share)).collect(),
    }
}

pub(super) fn distance(from: &[u32], to: &[u32], x: &[Vec3]) -> Level {
    let between = mean_point(to, x) - mean_point(from, x);
    let direction = between.normalize_or_zero();
    let mut gradient = mean(to, x, direction).gradient;
    gradient.extend(mean(from, x, -direction).gradient);
    Level { value: between.length(), gradient }
}

pub(super) fn scaled(mut gradient: SparseGradient, by: f64) -> SparseGradient {
    for (_, g) in &mut gradient {
        *g *= by;
    }
    gradient
}

pub(super) fn plus(mut a: Level, b: Level) -> Level {
    a.gradient.extend(b.gradient);
    Level { value: a.value + b.value, gradient: a.gradient }
}

pub(super) fn minus(a: Level, b: Level) -> Level {
    plus(a, Level { value: -b.value, gradient: scaled(b.gradient, -1.0) })
}

pub(super) fn give(level: Level, gradient: Option<&mut SparseGradient>) -> f64 {
    if let Some(gradient) = gradient {
        gradient.extend(level.gradient);
    }
    level.value
}

/// Adds the derivative of a section's functional, its plane moving with `level`.
pub(super) fn chain(own: SectionGradient, level: Level, gradient: &mut SparseGradient) {
    gradient.extend(own.vertices);
    gradient.extend(scaled(level.gradient, own.offset));
}
