//! The curve of one panel edge: lines, Bézier curves and arcs, sampled by arc length.

use modiste_core::Vec2;

/// Segments of the polyline by which curve lengths are measured; the error falls with its square.
const LENGTH_SEGMENTS: usize = 256;

/// How a panel edge runs between its two end points.
///
/// Control points are relative to the edge as in GarmentCode: `start + x · (end − start) + y · perp(end − start)` with
/// `perp` a quarter turn counter-clockwise, so that grading moves them with the end points.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Curve {
    /// Straight.
    #[default]
    Line,
    /// Quadratic Bézier with its control point.
    Quadratic(Vec2),
    /// Cubic Bézier with its two control points.
    Cubic(Vec2, Vec2),
    /// Circular arc of a radius (m).
    Arc {
        /// Radius (m).
        radius: f64,
        /// Take the arc longer than a half turn.
        large: bool,
        /// Turn counter-clockwise from start to end.
        counter_clockwise: bool,
    },
}

/// The panel-space point with these coordinates relative to the edge from `start` to `end`.
pub(super) fn absolute_from_relative(start: Vec2, end: Vec2, relative: Vec2) -> Vec2 {
    let along = end - start;
    start + relative.x * along + relative.y * along.perp()
}

/// The inverse of [`absolute_from_relative`].
pub(super) fn relative_from_absolute(start: Vec2, end: Vec2, point: Vec2) -> Vec2 {
    let along = end - start;
    let offset = point - start;
    Vec2::new(offset.dot(along), offset.dot(along.perp())) / along.length_squared()
}

impl Curve {
    /// The cubic through these absolute control points.
    pub fn cubic(start: Vec2, control_1: Vec2, control_2: Vec2, end: Vec2) -> Self {
        Self::Cubic(relative_from_absolute(start, end, control_1), relative_from_absolute(start, end, control_2))
    }

    /// The point at the curve's own parameter `t` in [0, 1].
    pub fn point(&self, start: Vec2, end: Vec2, t: f64) -> Vec2 {
        let s = 1.0 - t;
        match *self {
            Self::Line => start.lerp(end, t),
            Self::Quadratic(control) => {
                let c = absolute_from_relative(start, end, control);
                s * s * start + 2.0 * s * t * c + t * t * end
            }
            Self::Cubic(control_1, control_2) => {
                let c1 = absolute_from_relative(start, end, control_1);
                let c2 = absolute_from_relative(start, end, control_2);
                s * s * s * start + 3.0 * s * s * t * c1 + 3.0 * s * t * t * c2 + t * t * t * end
            }
            Self::Arc { radius, large, counter_clockwise } => {
                arc_point(start, end, (radius, large, counter_clockwise), t)
            }
        }
    }

    /// Length of the curve (m).
    pub fn length(&self, start: Vec2, end: Vec2) -> f64 {
        *self.cumulative_lengths(start, end).last().unwrap_or(&0.0)
    }

    /// Points at the given fractions of the arc length, each in [0, 1].
    pub fn points_at(&self, start: Vec2, end: Vec2, fractions: &[f64]) -> Vec<Vec2> {
        let lengths = self.cumulative_lengths(start, end);
        let total = lengths[LENGTH_SEGMENTS];
        fractions
            .iter()
            .map(|&fraction| {
                let wanted = fraction.clamp(0.0, 1.0) * total;
                let segment = lengths.partition_point(|&l| l < wanted).clamp(1, LENGTH_SEGMENTS) - 1;
                let span = lengths[segment + 1] - lengths[segment];
                let within = if span > 0.0 { (wanted - lengths[segment]) / span } else { 0.0 };
                self.point(start, end, (segment as f64 + within) / LENGTH_SEGMENTS as f64)
            })
            .collect()
    }

    /// The same curve walked from its end to its start.
    pub fn reversed(&self) -> Self {
        let turn = |v: Vec2| Vec2::new(1.0 - v.x, -v.y);
        match *self {
            Self::Line => Self::Line,
            Self::Quadratic(c) => Self::Quadratic(turn(c)),
            Self::Cubic(c1, c2) => Self::Cubic(turn(c2), turn(c1)),
            Self::Arc { radius, large, counter_clockwise } => {
                Self::Arc { radius, large, counter_clockwise: !counter_clockwise }
            }
        }
    }

    /// Mirrored across a line: perpendicular offsets change sign.
    pub fn mirrored(&self) -> Self {
        let flip = |v: Vec2| Vec2::new(v.x, -v.y);
        match *self {
            Self::Line => Self::Line,
            Self::Quadratic(c) => Self::Quadratic(flip(c)),
            Self::Cubic(c1, c2) => Self::Cubic(flip(c1), flip(c2)),
            Self::Arc { radius, large, counter_clockwise } => {
                Self::Arc { radius, large, counter_clockwise: !counter_clockwise }
            }
        }
    }

    fn cumulative_lengths(&self, start: Vec2, end: Vec2) -> Vec<f64> {
        let mut lengths = Vec::with_capacity(LENGTH_SEGMENTS + 1);
        lengths.push(0.0);
        let mut previous = start;
        let mut total = 0.0;
        for segment in 1..=LENGTH_SEGMENTS {
            let point = self.point(start, end, segment as f64 / LENGTH_SEGMENTS as f64);
            total += point.distance(previous);
            lengths.push(total);
            previous = point;
        }
        lengths
    }
}

/// The point at parameter `t` of an arc; a radius below half the chord is raised to it, as SVG does.
fn arc_point(start: Vec2, end: Vec2, (radius, large, counter_clockwise): (f64, bool, bool), t: f64) -> Vec2 {
    let chord = end - start;
    let half = 0.5 * chord.length();
    if half == 0.0 {
        return start;
    }
    let radius = radius.max(half);
    let height = (radius * radius - half * half).sqrt();
    // The centre lies left of the chord for a short counter-clockwise arc.
    let side = if large == counter_clockwise { -1.0 } else { 1.0 };
    let centre = start + 0.5 * chord + side * height * chord.perp() / (2.0 * half);
    let from = start - centre;
    let short_turn = 2.0 * (half / radius).min(1.0).asin();
    let turn = if large { std::f64::consts::TAU - short_turn } else { short_turn };
    let angle = if counter_clockwise { turn * t } else { -turn * t };
    centre + Vec2::from_angle(angle).rotate(from)
}

#[cfg(test)]
mod tests {
    use super::{Curve, absolute_from_relative, relative_from_absolute};
    use modiste_core::Vec2;
    use std::f64::consts::PI;

    #[test]
    fn relative_coordinates_round_trip() {
        let (a, b, p) = (Vec2::new(0.3, -0.2), Vec2::new(-0.1, 0.9), Vec2::new(0.7, 0.4));
        assert!(absolute_from_relative(a, b, relative_from_absolute(a, b, p)).distance(p) < 1e-14);
    }

    #[test]
    fn arcs_have_the_length_of_their_angle() {
        let (a, b) = (Vec2::new(1.0, 0.0), Vec2::new(0.0, 1.0));
        for (large, counter_clockwise, turn) in
            [(false, true, 0.5 * PI), (true, true, 1.5 * PI), (false, false, 0.5 * PI), (true, false, 1.5 * PI)]
        {
            let arc = Curve::Arc { radius: 1.0, large, counter_clockwise };
            assert!((arc.length(a, b) - turn).abs() < 1e-4, "{large} {counter_clockwise}");
            assert!(arc.point(a, b, 1.0).distance(b) < 1e-12);
        }
        // The short counter-clockwise arc from (1,0) to (0,1) has its centre at the origin.
        let arc = Curve::Arc { radius: 1.0, large: false, counter_clockwise: true };
        assert!((arc.point(a, b, 0.3).length() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn points_are_even_in_arc_length() {
        let (a, b) = (Vec2::ZERO, Vec2::new(1.0, 0.5));
        let curve = Curve::Cubic(Vec2::new(0.1, 0.9), Vec2::new(0.2, -0.3));
        let fractions: Vec<f64> = (0..=200).map(|i| f64::from(i) / 200.0).collect();
        let points = curve.points_at(a, b, &fractions);
        let steps: Vec<f64> = points.windows(2).map(|w| w[0].distance(w[1])).collect();
        let mean = curve.length(a, b) / 200.0;
        assert!(steps.iter().all(|s| (s / mean - 1.0).abs() < 0.02));
        assert!(points[0].distance(a) < 1e-14 && points[200].distance(b) < 1e-14);
    }

    #[test]
    fn mirroring_keeps_the_length() {
        let (a, b) = (Vec2::ZERO, Vec2::new(0.2, 0.5));
        let mirror = |v: Vec2| Vec2::new(-v.x, v.y);
        let curve = Curve::Cubic(Vec2::new(0.1, 0.9), Vec2::new(0.2, -0.3));
        let mirrored = curve.mirrored();
        for i in 0..=10 {
            let t = f64::from(i) / 10.0;
            assert!(mirrored.point(mirror(a), mirror(b), t).distance(mirror(curve.point(a, b, t))) < 1e-14);
        }
    }
}
