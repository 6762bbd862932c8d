//! The drafting of the project's own patterns: flat blocks from body measurements, one draft per size.
//!
//! The measurements of a size follow from its leading girth by linear regressions on ANSUR II (Gordon et al. 2014,
//! 1,986 women and 4,082 men), so that girths, breadths and lengths grade at their own rates.

mod skirt;
mod top;
mod trousers;

use modiste_body::Gender;
use modiste_core::Vec2;

use super::{Curve, Cut, FitRule, GradedPattern, Outline, Size};

pub use skirt::draft_skirt;
pub use top::{draft_longsleeve, draft_tshirt};
pub use trousers::{draft_pants, draft_shorts};

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

/// Step between sizes on the leading girth (m).
const STEP: f64 = 0.04;

/// From the regular cut to the loose one, everything that is worn below the waist gets wider by this at hip and band (m).
const HIP_STEP: f64 = 0.050;
const BAND_STEP: f64 = 0.030;

/// One draft per size, in every cut: `draft` takes the leading girth of a size and the ease.
#[derive(Debug)]
struct InCuts<T> {
    slim: Vec<T>,
    regular: Vec<T>,
    loose: Vec<T>,
}

impl<T> InCuts<T> {
    fn new(leading: &[f64], draft: impl Fn(f64, f64) -> T) -> Self {
        let of = |cut: Cut| leading.iter().map(|&girth| draft(girth, cut.ease())).collect();
        Self { slim: of(Cut::Slim), regular: of(Cut::Regular), loose: of(Cut::Loose) }
    }

    /// The outlines of one panel: slim, regular and loose.
    fn outlines(&self, panel: impl Fn(&T) -> Outline) -> [Vec<Outline>; 3] {
        [&self.slim, &self.regular, &self.loose].map(|drafts| drafts.iter().map(&panel).collect())
    }
}

/// The leading girths of the sizes from the first to the last.
fn leading_girths(first: f64, last: f64) -> Vec<f64> {
    let count = ((last - first) / STEP).round() as usize + 1;
    (0..count).map(|i| first + STEP * i as f64).collect()
}

/// What everything worn below the waist is sized by: the hip (buttock girth, m), and what ANSUR II says of a body with it.
#[derive(Debug, Clone, Copy)]
struct Hips {
    /// Mean hip girth, the centre of every trend.
    centre: f64,
    chest: Trend,
    waist: Trend,
}

impl Hips {
    const FIRST: f64 = 0.78;
    const LAST: f64 = 1.42;

    /// The band sits this far from the waist (at the navel) towards the hip, as a fraction of the way.
    const BAND_BELOW_WAIST: f64 = 0.25;

    fn of(gender: Gender) -> Self {
        match gender {
            Gender::Female => Self {
                centre: 1.021,
                chest: Trend { mean: 0.947, slope: 0.81 },
                waist: Trend { mean: 0.861, slope: 1.057 },
            },
            Gender::Male => Self {
                centre: 1.020,
                chest: Trend { mean: 1.059, slope: 0.95 },
                waist: Trend { mean: 0.941, slope: 1.276 },
            },
        }
    }

    /// The hips of all sizes.
    fn sizes() -> Vec<f64> {
        leading_girths(Self::FIRST, Self::LAST)
    }

    /// Chest, waist and hip girth of a size.
    fn girths(&self, hip: f64) -> [f64; 3] {
        [self.chest.at(hip - self.centre), self.waist.at(hip - self.centre), hip]
    }

    /// Girth of the band of a size. The elastic gathers what a loose cut has more of it.
    fn band(&self, hip: f64, ease: f64) -> f64 {
        let waist = self.waist.at(hip - self.centre);
        waist + Self::BAND_BELOW_WAIST * (hip - waist) + 0.015 + BAND_STEP * ease
    }
}

/// A pattern in these sizes that has no panels yet. `girths` gives chest, waist and hip of the size with a leading girth;
/// `centre` is the leading girth of the average body.
fn without_panels(
    (garment, gender, material): (&str, Gender, &str),
    fit: FitRule,
    (leading, centre): (&[f64], f64),
    girths: impl Fn(f64) -> [f64; 3],
) -> GradedPattern {
    let size = |&leading: &f64| {
        let [chest_girth, waist_girth, hip_girth] = girths(leading);
        Size { name: format!("{:.0}", leading * 100.0), chest_girth, waist_girth, hip_girth }
    };
    GradedPattern {
        garment: garment.to_owned(),
        gender: gender.name().to_owned(),
        material: material.to_owned(),
        sizes: leading.iter().map(size).collect(),
        template_size: leading.iter().position(|&girth| girth > centre - 0.5 * STEP).unwrap_or(0),
        fit,
        gather: GradedPattern::PLAIN_SEAMS,
        band: GradedPattern::LOW_WAIST,
        self_contact: false,
        panels: Vec::new(),
        stitches: Vec::new(),
        waist_band: Vec::new(),
        ribs: Vec::new(),
        anchors: Vec::new(),
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
    let curves = (0..count).map(|i| outline.curves[count - 1 - i].reversed().mirrored()).collect();
    Outline { vertices, curves }
}

fn mirrored_labels(labels: &[String]) -> Vec<String> {
    labels.iter().rev().cloned().collect()
}

/// Root of an increasing function in a bracket, by bisection to 1e-13 of the bracket.
fn increasing_root(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..44 {
        let middle = 0.5 * (low + high);
        if f(middle) < 0.0 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Makes every edge labelled `waist` part of the elastic band, with `count` anchors each.
fn band_at_waist(pattern: &mut GradedPattern, count: usize) {
    for panel in 0..pattern.panels.len() {
        if let Some(edge) = pattern.panels[panel].edge_labelled("waist") {
            let edge = super::EdgeId { panel, edge };
            pattern.waist_band.push(edge);
            pattern.anchors.push(super::Anchors { edge, count });
        }
    }
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
