//! Sewing patterns: panels with curved outlines in many sizes, their seams, and how to wear them.

mod builtin;
mod check;
mod curve;
mod draft;
mod json;

use modiste_body::Part;
use modiste_core::Vec2;
use serde::{Deserialize, Serialize};

pub use builtin::{GARMENTS, builtin};
pub use check::{MAX_SEAM_MISMATCH, PatternFault};
pub use curve::Curve;
pub use draft::{draft_shorts, draft_tshirt};
pub use json::PatternError;

/// A garment as flat panels in every size, with its seams.
#[derive(Debug, Clone, PartialEq)]
pub struct GradedPattern {
    /// Garment name, for example `tshirt`.
    pub garment: String,
    /// `female` or `male`.
    pub gender: String,
    /// Name of the fabric.
    pub material: String,
    /// Which body each size is made for, from small to large.
    pub sizes: Vec<Size>,
    /// Index of the size whose triangulation all others take.
    pub template_size: usize,
    /// How a size is chosen for a body.
    pub fit: FitRule,
    /// The panels.
    pub panels: Vec<Panel>,
    /// Pairs of edges to be sewn.
    pub stitches: Vec<Stitch>,
    /// Edges that make the elastic waist band; empty where there is none.
    pub waist_band: Vec<EdgeId>,
    /// Edges with an elastic rib along them.
    pub ribs: Vec<Rib>,
    /// Edges that carry anchor points, and how many each.
    pub anchors: Vec<Anchors>,
}

/// One size and the body it is cut for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Size {
    /// Name of the size: its leading girth in centimetres.
    pub name: String,
    /// Chest girth (m).
    pub chest_girth: f64,
    /// Waist girth (m).
    pub waist_girth: f64,
    /// Hip girth (m).
    pub hip_girth: f64,
}

/// Which girths of the body decide the size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FitRule {
    /// Chest first; a waist or hip too wide for that size asks for a larger one.
    Upper,
    /// Hip first; a waist too wide for that size asks for a larger one.
    Lower,
}

/// The girths by which a size is chosen (m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Girths {
    /// Chest girth (m).
    pub chest: f64,
    /// Waist girth (m).
    pub waist: f64,
    /// Hip girth (m).
    pub hip: f64,
}

/// One flat piece of cloth.
///
/// Edge `i` runs from vertex `i` to vertex `i + 1`. All loops run counter-clockwise seen from outside the garment, so
/// that a panel drawn clockwise (a back, in world-like coordinates) faces backward, as in GarmentCode.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// Name, for example `front`.
    pub name: String,
    /// Label of each edge; empty where it needs none.
    pub edge_labels: Vec<String>,
    /// The outline in each size (m).
    pub outlines: Vec<Outline>,
    /// How the panel is laid around the body before sewing.
    pub wrap: Wrap,
    /// The body part that the panel moves with.
    pub part: Part,
    /// The part that the lower portion moves with, and the panel height (m) below which it does, in each size.
    pub lower_part: Option<LowerPart>,
}

/// The lower portion of a panel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LowerPart {
    /// The body part that the portion moves with.
    pub part: Part,
    /// Panel y (m) under which a face belongs to it, one per size.
    pub below: Vec<f64>,
}

/// The outline of a panel in one size: its vertices are the grading points.
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    /// Corners in panel space (m), in order.
    pub vertices: Vec<Vec2>,
    /// The curve from each vertex to the next.
    pub curves: Vec<Curve>,
}

/// How a panel is laid around the body before sewing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[expect(missing_docs, reason = "the names say it")]
pub enum Wrap {
    TorsoFront,
    TorsoBack,
    LeftArm,
    RightArm,
    LeftLegFront,
    LeftLegBack,
    RightLegFront,
    RightLegBack,
}

/// One edge of one panel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EdgeId {
    /// Index of the panel.
    pub panel: usize,
    /// Index of the edge in its loop.
    pub edge: usize,
}

/// Two edges to be sewn; the first runs against the second.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stitch {
    /// The two sides of the seam.
    pub sides: [EdgeId; 2],
}

/// A knitted rib along an edge, such as a neckband: shorter than the edge, so it lies flat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rib {
    /// The edge.
    pub edge: EdgeId,
    /// Rest length over the length of the edge.
    pub scale: f64,
    /// Force at a stretch of one (N).
    pub modulus: f64,
}

/// Anchor points spread evenly over an edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Anchors {
    /// The edge.
    pub edge: EdgeId,
    /// How many.
    pub count: usize,
}

impl Outline {
    /// The two ends and the curve of edge `edge`.
    pub fn edge(&self, edge: usize) -> (Vec2, Vec2, Curve) {
        (self.vertices[edge], self.vertices[(edge + 1) % self.vertices.len()], self.curves[edge])
    }

    /// Length of edge `edge` (m).
    pub fn edge_length(&self, edge: usize) -> f64 {
        let (start, end, curve) = self.edge(edge);
        curve.length(start, end)
    }

    /// The outline as a closed polygon with `per_edge` segments on each curved edge.
    pub fn polygon(&self, per_edge: usize) -> Vec<Vec2> {
        let mut polygon = Vec::new();
        for edge in 0..self.vertices.len() {
            let (start, end, curve) = self.edge(edge);
            let segments = if curve == Curve::Line { 1 } else { per_edge };
            for segment in 0..segments {
                polygon.push(curve.point(start, end, segment as f64 / segments as f64));
            }
        }
        polygon
    }

    /// Signed area (m²), positive for a counter-clockwise loop.
    pub fn signed_area(&self) -> f64 {
        signed_area(&self.polygon(64))
    }
}

impl Panel {
    /// +1 where the loop is counter-clockwise in panel space, −1 where it is clockwise.
    pub fn orientation(&self) -> f64 {
        self.outlines[0].signed_area().signum()
    }

    /// The first edge with this label.
    pub fn edge_labelled(&self, label: &str) -> Option<usize> {
        self.edge_labels.iter().position(|l| l == label)
    }
}

impl GradedPattern {
    /// Index of the panel with this name.
    pub fn panel(&self, name: &str) -> Option<usize> {
        self.panels.iter().position(|panel| panel.name == name)
    }

    /// Index of the size for a body with these girths: the one nearest to the largest demand of its girths.
    pub fn choose_size(&self, body: &Girths) -> usize {
        let demand = |size: &Size| match self.fit {
            FitRule::Upper => (body.chest - size.chest_girth)
                .max(body.waist - size.waist_girth - 0.09)
                .max(body.hip - size.hip_girth - 0.04),
            FitRule::Lower => (body.hip - size.hip_girth).max(body.waist - size.waist_girth - 0.08),
        };
        let mut best = (0, f64::INFINITY);
        for (index, size) in self.sizes.iter().enumerate() {
            let miss = demand(size).abs();
            if miss < best.1 {
                best = (index, miss);
            }
        }
        best.0
    }
}

/// Signed area (m²) of a polygon, positive counter-clockwise.
pub(crate) fn signed_area(polygon: &[Vec2]) -> f64 {
    (0..polygon.len()).map(|i| polygon[i].perp_dot(polygon[(i + 1) % polygon.len()])).sum::<f64>() * 0.5
}
