//! Sewing patterns: panels with curved outlines in many sizes, their seams, and how to wear them.

mod builtin;
mod check;
mod curve;
mod drafts;
mod fitting;
mod json;
mod ungraded;

use modiste_body::Part;
use modiste_core::Vec2;
use serde::{Deserialize, Serialize};

pub use builtin::{GARMENTS, builtin, draft, known};
pub use check::PatternFault;
pub use curve::Curve;
pub use drafts::{draft_longsleeve, draft_pants, draft_shorts, draft_skirt, draft_tshirt};
pub use fitting::{Cut, Fitting};
pub use json::PatternError;
pub use ungraded::Wearer;

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
    /// The longer side of a seam may be at most so many times as long as the other: above 1 it is gathered, or eased in.
    pub gather: f64,
    /// Height of the waist band over stature.
    pub band: f64,
    /// Whether the cloth has to be kept from passing through itself: what hangs free folds onto itself.
    pub self_contact: bool,
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
    /// The outline in each size (m), in the regular cut.
    pub outlines: Vec<Outline>,
    /// The same in the slim cut and in the loose one; both empty where the pattern has one cut alone.
    pub slim: Vec<Outline>,
    /// See [`Self::slim`].
    pub loose: Vec<Outline>,
    /// How the panel is laid around the body before sewing.
    pub wrap: Wrap,
    /// The body part that the panel moves with.
    pub part: Part,
    /// Lower portions that move with other parts, from top to bottom.
    pub lower_parts: Vec<LowerPart>,
    /// Further parts that may lie under any of the panel: a skirt hangs around both thighs.
    pub covers: Vec<Part>,
}

/// A lower portion of a panel.
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
    HipFront,
    HipBack,
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

    /// The outlines of a cut, one per size; empty where there is no such cut.
    pub fn in_cut(&self, cut: Cut) -> &[Outline] {
        match cut {
            Cut::Slim => &self.slim,
            Cut::Regular => &self.outlines,
            Cut::Loose => &self.loose,
        }
    }

    /// The first edge with this label.
    pub fn edge_labelled(&self, label: &str) -> Option<usize> {
        self.edge_labels.iter().position(|l| l == label)
    }
}

impl GradedPattern {
    /// [`Self::band`] a little below the navel, whose height is 0.602 of the stature for women and 0.601 for men in ANSUR II.
    pub const LOW_WAIST: f64 = 0.5845;

    /// Index of the panel with this name.
    pub fn panel(&self, name: &str) -> Option<usize> {
        self.panels.iter().position(|panel| panel.name == name)
    }

    /// The size for a body with these girths: where the largest demand of its girths is met, between sizes as a rule (3.4 is
    /// two fifths of the way from size 3 to size 4). A garment in whole sizes has an ease that jumps from body to body.
    pub fn choose_size(&self, body: &Girths) -> f64 {
        let demand = |size: &Size| match self.fit {
            FitRule::Upper => (body.chest - size.chest_girth)
                .max(body.waist - size.waist_girth - 0.09)
                .max(body.hip - size.hip_girth - 0.04),
            FitRule::Lower => (body.hip - size.hip_girth).max(body.waist - size.waist_girth - 0.08),
        };
        let demands: Vec<f64> = self.sizes.iter().map(demand).collect();
        match demands.iter().position(|&demand| demand <= 0.0) {
            Some(0) => 0.0,
            Some(wide) => {
                let [narrow_by, wide_by] = [demands[wide - 1], demands[wide]];
                (wide - 1) as f64 + narrow_by / (narrow_by - wide_by)
            }
            None => demands.len().saturating_sub(1) as f64,
        }
    }

    /// The two neighbours of a size and the share of the second.
    pub(crate) fn between(&self, size: f64) -> ([usize; 2], f64) {
        let last = self.sizes.len().saturating_sub(1);
        let lower = (size.max(0.0).floor() as usize).min(last);
        ([lower, (lower + 1).min(last)], (size - lower as f64).clamp(0.0, 1.0))
    }

    /// Name of the size nearest to `size`.
    pub fn size_name(&self, size: f64) -> &str {
        let ([lower, upper], share) = self.between(size);
        &self.sizes[if share < 0.5 { lower } else { upper }].name
    }

    /// The grading points (m) of a panel in a size and ease.
    pub(crate) fn corners(&self, panel: usize, fitting: Fitting) -> Vec<Vec2> {
        let panel = &self.panels[panel];
        self.at(fitting, |cut, size| &panel.in_cut(cut)[size].vertices)
    }
}

/// Signed area (m²) of a polygon, positive counter-clockwise.
pub(crate) fn signed_area(polygon: &[Vec2]) -> f64 {
    (0..polygon.len()).map(|i| polygon[i].perp_dot(polygon[(i + 1) % polygon.len()])).sum::<f64>() * 0.5
}
