//! The drafting of the project's own patterns: flat blocks from body measurements, one draft per size.
//!
//! The measurements of a size follow from its leading girth by linear regressions on ANSUR II (Gordon et al. 2014,
//! 1,986 women and 4,082 men), so that girths, breadths and lengths grade at their own rates.

mod shorts;
mod tshirt;

use modiste_core::Vec2;

use super::{Curve, GradedPattern, Outline};

pub use shorts::draft_shorts;
pub use tshirt::draft_tshirt;

/// A regression `mean + slope · (x − centre)` of a body measurement (m) on a leading girth (m).
#[derive(Debug, Clone, Copy)]
struct Trend {
    mean: f64,
    slope: f64,
}

impl Trend {
    fn at(self, offset: f64) -> f64 {
        self.mean + self.slope * offset
    }
}

/// Builds an outline edge by edge.
#[derive(Debug, Default)]
struct Pen {
    vertices: Vec<Vec2>,
    curves: Vec<Curve>,
    labels: Vec<String>,
}

impl Pen {
    fn start(at: (f64, f64)) -> Self {
        Self { vertices: vec![Vec2::new(at.0, at.1)], ..Self::default() }
    }

    fn line(self, label: &'static str, to: (f64, f64)) -> Self {
        self.edge(label, None, to)
    }

    fn cubic(self, label: &'static str, control_1: (f64, f64), control_2: (f64, f64), to: (f64, f64)) -> Self {
        let controls = [Vec2::new(control_1.0, control_1.1), Vec2::new(control_2.0, control_2.1)];
        self.edge(label, Some(controls), to)
    }

    fn edge(mut self, label: &'static str, controls: Option<[Vec2; 2]>, to: (f64, f64)) -> Self {
        let to = Vec2::new(to.0, to.1);
        let from = self.vertices[self.vertices.len() - 1];
        self.curves.push(match controls {
            Some([c1, c2]) => Curve::cubic(from, c1, c2, to),
            None => Curve::Line,
        });
        self.labels.push(label.to_owned());
        self.vertices.push(to);
        self
    }

    /// Ends the loop; the last point must be the first.
    fn close(mut self) -> (Outline, Vec<String>) {
        debug_assert!(self.vertices[0].distance(self.vertices[self.vertices.len() - 1]) < 1e-12);
        self.vertices.pop();
        (Outline { vertices: self.vertices, curves: self.curves }, self.labels)
    }
}

/// The outline mirrored left to right, its loop reversed so that it keeps its sense seen from outside.
///
/// Edge order is reversed with it: edge `i` becomes edge `n − 1 − i`.
fn mirrored(outline: &Outline) -> Outline {
    let count = outline.vertices.len();
    let flip = |v: Vec2| Vec2::new(-v.x, v.y);
    // Vertex 0 of the mirrored loop is the mirrored vertex 0; then backwards.
    let vertices = (0..count).map(|i| flip(outline.vertices[(count - i) % count])).collect();
    let curves = (0..count).map(|i| reversed(outline.curves[count - 1 - i]).mirrored()).collect();
    Outline { vertices, curves }
}

fn mirrored_labels(labels: &[String]) -> Vec<String> {
    labels.iter().rev().cloned().collect()
}

/// The same curve walked from its end to its start.
fn reversed(curve: Curve) -> Curve {
    let turn = |v: Vec2| Vec2::new(1.0 - v.x, -v.y);
    match curve {
        Curve::Line => Curve::Line,
        Curve::Quadratic(c) => Curve::Quadratic(turn(c)),
        Curve::Cubic(c1, c2) => Curve::Cubic(turn(c2), turn(c1)),
        Curve::Arc { radius, large, counter_clockwise } => {
            Curve::Arc { radius, large, counter_clockwise: !counter_clockwise }
        }
    }
}

/// Root of an increasing function in a bracket, by bisection to 1e-13 of the bracket.
fn increasing_root(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..44 {
        let middle = 0.5 * (low + high);
        if f(middle) < 0.0 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Stitches between edges named `panel:label`, in the order given.
fn stitch(pattern: &mut GradedPattern, pairs: &[(&str, &str)]) {
    for &(a, b) in pairs {
        let sides = [edge_named(pattern, a), edge_named(pattern, b)];
        pattern.stitches.push(super::Stitch { sides });
    }
}

fn edge_named(pattern: &GradedPattern, name: &str) -> super::EdgeId {
    let found = name.split_once(':').and_then(|(panel, label)| {
        let panel = pattern.panel(panel)?;
        Some(super::EdgeId { panel, edge: pattern.panels[panel].edge_labelled(label)? })
    });
    match found {
        Some(edge) => edge,
        None => unreachable!("the draft names its own edges: {name}"),
    }
}
