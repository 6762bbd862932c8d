//! Patterns as JSON: GarmentCode's specification with the sizes, part labels and anchors of ours beside it.
//!
//! The `pattern` and `properties` members are GarmentCode's, holding the template size, so its tools read our files;
//! the `modiste` member adds the grading: for each panel the vertices and curves in every size, and where there are
//! several cuts in every size of the slim and the loose one.

use modiste_body::Part;
use modiste_core::Vec2;
use modiste_io::IoError;
use modiste_io::pattern as garmentcode;
use modiste_io::pattern::{Curvature, EdgeName, PatternSpec};
use serde::{Deserialize, Serialize};
use serde_json::Map;

use super::{
    Anchors, Curve, EdgeId, FitRule, GradedPattern, LowerPart, Outline, Panel, PatternFault, Rib, Size, Stitch, Wrap,
};

/// Version of the `modiste` member.
const SCHEMA: &str = "modiste-pattern-1";

/// Decimals kept of every number, in the file's own unit.
const DECIMALS: f64 = 1e6;

/// Why a pattern file was refused.
#[derive(Debug, thiserror::Error)]
pub enum PatternError {
    /// There is no pattern of that name.
    #[error("there is no pattern named {name}; there are {known}")]
    Unknown {
        /// The name asked for.
        name: String,
        /// The names that there are.
        known: String,
    },
    /// Not a pattern file.
    #[error(transparent)]
    File(#[from] IoError),
    /// A member holds what it must not.
    #[error("{name}: {field} should be {wanted}, found {found}")]
    Field {
        /// Name of the pattern or file.
        name: String,
        /// The member.
        field: String,
        /// What was wanted.
        wanted: String,
        /// What was found.
        found: String,
    },
    /// The outlines, seams or anchors do not fit together.
    #[error("{name}: {source}")]
    Fault {
        /// Name of the pattern or file.
        name: String,
        /// What does not fit.
        source: PatternFault,
    },
}

fn plain_seams() -> f64 {
    GradedPattern::PLAIN_SEAMS
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks for a reference")]
fn is_plain(gather: &f64) -> bool {
    (gather - GradedPattern::PLAIN_SEAMS).abs() < 1e-9
}

fn low_waist() -> f64 {
    GradedPattern::LOW_WAIST
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks for a reference")]
fn is_low_waist(band: &f64) -> bool {
    (band - GradedPattern::LOW_WAIST).abs() < 1e-9
}

/// Our member.
#[derive(Debug, Serialize, Deserialize)]
struct Extension {
    schema: String,
    garment: String,
    gender: String,
    material: String,
    licence: String,
    fit: FitRule,
    #[serde(default = "plain_seams", skip_serializing_if = "is_plain")]
    gather: f64,
    #[serde(default = "low_waist", skip_serializing_if = "is_low_waist")]
    band: f64,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    self_contact: bool,
    template_size: usize,
    sizes: Vec<Size>,
    panels: Vec<GradedPanel>,
    waist_band: Vec<EdgeName>,
    ribs: Vec<RibName>,
    anchors: Vec<AnchorName>,
}

#[derive(Debug, Serialize, Deserialize)]
struct GradedPanel {
    name: String,
    wrap: Wrap,
    part: Part,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    lower_parts: Vec<LowerPart>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    covers: Vec<Part>,
    grading: Vec<Grade>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    slim: Vec<Grade>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    loose: Vec<Grade>,
}

/// One size of one panel, in the file's unit: corners, and the curve parameters of the edges that have any.
#[derive(Debug, Serialize, Deserialize)]
struct Grade {
    vertices: Vec<[f64; 2]>,
    curvature: Vec<Option<Curvature>>,
}

#[derive(Debug, Serialize, Deserialize)]
struct RibName {
    panel: String,
    edge: usize,
    scale: f64,
    modulus: f64,
}

#[derive(Debug, Serialize, Deserialize)]
struct AnchorName {
    panel: String,
    edge: usize,
    count: usize,
}

/// What the numbers of a pattern may be: seams gathered up to fivefold, a waist band between knee and neck (over stature), a rib
/// from a quarter of its edge to twice it, its modulus (N), and the anchors along one edge.
const GATHER: (f64, f64) = (1.0, 5.0);
const BAND: (f64, f64) = (0.3, 0.85);
const RIB_SCALE: (f64, f64) = (0.25, 2.0);
const RIB_MODULUS: (f64, f64) = (0.01, 1e4);
const ANCHORS: (f64, f64) = (1.0, 1000.0);

impl GradedPattern {
    /// Reads and checks a pattern; `name` stands in the messages.
    ///
    /// A plain GarmentCode file has no grading and is refused here: what Modiste sews knows its sizes and parts.
    ///
    /// # Errors
    /// [`PatternError`] with the member at fault.
    pub fn from_json(name: &str, text: &str) -> Result<Self, PatternError> {
        let file = garmentcode::parse(text.as_bytes(), name)?;
        let extension: Extension = file.member("modiste", name)?;
        let field = |field: &str, wanted: &str, found: &str| PatternError::Field {
            name: name.to_owned(),
            field: field.to_owned(),
            wanted: wanted.to_owned(),
            found: found.to_owned(),
        };
        if extension.schema != SCHEMA {
            return Err(field("modiste.schema", SCHEMA, &extension.schema));
        }
        if file.properties.curvature_coords != "relative" {
            return Err(field("properties.curvature_coords", "relative", &file.properties.curvature_coords));
        }
        let units = file.properties.units_in_meter;
        if extension.template_size >= extension.sizes.len() {
            let wanted = format!("below {}", extension.sizes.len());
            return Err(field("modiste.template_size", &wanted, &extension.template_size.to_string()));
        }
        let names: Vec<String> = extension.panels.iter().map(|p| p.name.clone()).collect();
        let edge_id = |panel: &str, edge: usize| match names.iter().position(|n| n == panel) {
            Some(panel) => Ok(EdgeId { panel, edge }),
            None => Err(field("panel of a stitch, waist band or anchor", "one of the panels", panel)),
        };
        let mut panels = Vec::with_capacity(extension.panels.len());
        for graded in extension.panels {
            let Some(flat) = file.pattern.panels.get(&graded.name) else {
                return Err(field("modiste.panels", "a panel of the pattern", &graded.name));
            };
            panels.push(panel_from(flat, graded, units));
        }
        let mut stitches = Vec::with_capacity(file.pattern.stitches.len());
        for garmentcode::Stitch { sides: [a, b], .. } in &file.pattern.stitches {
            stitches.push(Stitch { sides: [edge_id(&a.panel, a.edge)?, edge_id(&b.panel, b.edge)?] });
        }
        let waist_band = extension.waist_band.iter().map(|e| edge_id(&e.panel, e.edge)).collect::<Result<_, _>>()?;
        let ribs: Vec<Rib> = extension
            .ribs
            .iter()
            .map(|r| Ok(Rib { edge: edge_id(&r.panel, r.edge)?, scale: r.scale, modulus: r.modulus }))
            .collect::<Result<_, PatternError>>()?;
        let anchors: Vec<Anchors> = extension
            .anchors
            .iter()
            .map(|a| Ok(Anchors { edge: edge_id(&a.panel, a.edge)?, count: a.count }))
            .collect::<Result<_, PatternError>>()?;
        let within = |of: &str, value: f64, (low, high): (f64, f64)| {
            let wrong = || field(&format!("modiste.{of}"), &format!("{low} to {high}"), &value.to_string());
            if (low..=high).contains(&value) { Ok(()) } else { Err(wrong()) }
        };
        within("gather", extension.gather, GATHER)?;
        within("band", extension.band, BAND)?;
        for rib in &ribs {
            within("ribs.scale", rib.scale, RIB_SCALE)?;
            within("ribs.modulus", rib.modulus, RIB_MODULUS)?;
        }
        for row in &anchors {
            within("anchors.count", row.count as f64, ANCHORS)?;
        }
        let pattern = Self {
            garment: extension.garment,
            gender: extension.gender,
            material: extension.material,
            sizes: extension.sizes,
            template_size: extension.template_size,
            fit: extension.fit,
            gather: extension.gather,
            band: extension.band,
            self_contact: extension.self_contact,
            panels,
            stitches,
            waist_band,
            ribs,
            anchors,
        };
        match pattern.check() {
            Ok(()) => Ok(pattern),
            Err(source) => Err(PatternError::Fault { name: name.to_owned(), source }),
        }
    }

    /// Writes the pattern in centimetres.
    ///
    /// # Panics
    /// Never: every member is plain data.
    pub fn to_json(&self) -> String {
        let units = 100.0;
        let edge_name = |id: EdgeId| EdgeName { panel: self.panels[id.panel].name.clone(), edge: id.edge };
        let grade = |outline: &Outline| Grade {
            vertices: outline.vertices.iter().map(|v| [rounded(v.x * units), rounded(v.y * units)]).collect(),
            curvature: outline.curves.iter().map(|c| curvature_of(*c, units)).collect(),
        };
        let extension = Extension {
            schema: SCHEMA.to_owned(),
            garment: self.garment.clone(),
            gender: self.gender.clone(),
            material: self.material.clone(),
            licence: "Apache-2.0 OR MIT".to_owned(),
            fit: self.fit,
            gather: self.gather,
            band: self.band,
            self_contact: self.self_contact,
            template_size: self.template_size,
            sizes: self.sizes.iter().map(rounded_size).collect(),
            panels: self
                .panels
                .iter()
                .map(|p| GradedPanel {
                    name: p.name.clone(),
                    wrap: p.wrap,
                    part: p.part,
                    lower_parts: p.lower_parts.clone(),
                    covers: p.covers.clone(),
                    grading: p.outlines.iter().map(grade).collect(),
                    slim: p.slim.iter().map(grade).collect(),
                    loose: p.loose.iter().map(grade).collect(),
                })
                .collect(),
            waist_band: self.waist_band.iter().map(|&id| edge_name(id)).collect(),
            ribs: self
                .ribs
                .iter()
                .map(|r| {
                    let EdgeName { panel, edge } = edge_name(r.edge);
                    RibName { panel, edge, scale: r.scale, modulus: r.modulus }
                })
                .collect(),
            anchors: self
                .anchors
                .iter()
                .map(|a| {
                    let EdgeName { panel, edge } = edge_name(a.edge);
                    AnchorName { panel, edge, count: a.count }
                })
                .collect(),
        };
        let spec = |extension| PatternSpec {
            pattern: garmentcode::Garment {
                panels: self.panels.iter().map(|p| (p.name.clone(), self.flat_panel(p, units))).collect(),
                stitches: self
                    .stitches
                    .iter()
                    .map(|s| garmentcode::Stitch { sides: s.sides.map(edge_name), faces: None })
                    .collect(),
                other: Map::new(),
            },
            properties: garmentcode::Properties {
                units_in_meter: units,
                curvature_coords: "relative".to_owned(),
                other: Map::new(),
            },
            other: Map::from_iter([("modiste".to_owned(), extension)]),
        };
        let text =
            serde_json::to_value(&extension).and_then(|extension| serde_json::to_string_pretty(&spec(extension)));
        match text {
            Ok(text) => number_rows_on_one_line(&text),
            Err(error) => unreachable!("plain data serialises: {error}"),
        }
    }

    fn flat_panel(&self, panel: &Panel, units: f64) -> garmentcode::Panel {
        let outline = &panel.outlines[self.template_size];
        let count = outline.vertices.len();
        garmentcode::Panel {
            translation: flat_translation(panel.wrap).map(|t| t * units),
            rotation: [0.0; 3],
            vertices: outline.vertices.iter().map(|v| [rounded(v.x * units), rounded(v.y * units)]).collect(),
            edges: (0..count)
                .map(|edge| garmentcode::Edge {
                    endpoints: [edge, (edge + 1) % count],
                    curvature: curvature_of(outline.curves[edge], units),
                    label: Some(panel.edge_labels[edge].clone()),
                    other: Map::new(),
                })
                .collect(),
            label: Some(panel.part.name().to_owned()),
            other: Map::new(),
        }
    }
}

/// Where a panel lies flat in front of, behind or beside an average body (m), for programs without our wrapping.
fn flat_translation(wrap: Wrap) -> [f64; 3] {
    match wrap {
        Wrap::TorsoFront => [0.0, 1.40, 0.30],
        Wrap::TorsoBack => [0.0, 1.40, -0.25],
        Wrap::HipFront => [0.0, 0.78, 0.30],
        Wrap::HipBack => [0.0, 0.78, -0.25],
        Wrap::LeftArm => [0.45, 1.35, 0.0],
        Wrap::RightArm => [-0.45, 1.35, 0.0],
        Wrap::LeftLegFront => [0.02, 0.78, 0.25],
        Wrap::LeftLegBack => [0.02, 0.78, -0.25],
        Wrap::RightLegFront => [-0.02, 0.78, 0.25],
        Wrap::RightLegBack => [-0.02, 0.78, -0.25],
    }
}

fn panel_from(flat: &garmentcode::Panel, graded: GradedPanel, units: f64) -> Panel {
    let outline = |grade: &Grade| Outline {
        vertices: grade.vertices.iter().map(|&[x, y]| Vec2::new(x, y) / units).collect(),
        curves: grade.curvature.iter().map(|c| curve_from(c.as_ref(), units)).collect(),
    };
    let outlines = |grades: &[Grade]| grades.iter().map(outline).collect();
    Panel {
        name: graded.name,
        edge_labels: flat.edges.iter().map(|e| e.label.clone().unwrap_or_default()).collect(),
        outlines: outlines(&graded.grading),
        slim: outlines(&graded.slim),
        loose: outlines(&graded.loose),
        wrap: graded.wrap,
        part: graded.part,
        lower_parts: graded.lower_parts,
        covers: graded.covers,
    }
}

pub(super) fn curve_from(curvature: Option<&Curvature>, units: f64) -> Curve {
    let point = |[x, y]: [f64; 2]| Vec2::new(x, y);
    match curvature {
        None => Curve::Line,
        Some(Curvature::Point(c) | Curvature::Curve(garmentcode::Curve::Quadratic([c]))) => Curve::Quadratic(point(*c)),
        Some(Curvature::Curve(garmentcode::Curve::Cubic([c1, c2]))) => Curve::Cubic(point(*c1), point(*c2)),
        Some(Curvature::Curve(garmentcode::Curve::Circle([radius, large, counter_clockwise]))) => {
            Curve::Arc { radius: radius / units, large: *large > 0.5, counter_clockwise: *counter_clockwise > 0.5 }
        }
    }
}

fn curvature_of(curve: Curve, units: f64) -> Option<Curvature> {
    let pair = |v: Vec2| [rounded(v.x), rounded(v.y)];
    let flag = |set: bool| f64::from(u8::from(set));
    Some(Curvature::Curve(match curve {
        Curve::Line => return None,
        Curve::Quadratic(c) => garmentcode::Curve::Quadratic([pair(c)]),
        Curve::Cubic(c1, c2) => garmentcode::Curve::Cubic([pair(c1), pair(c2)]),
        Curve::Arc { radius, large, counter_clockwise } => {
            garmentcode::Curve::Circle([rounded(radius * units), flag(large), flag(counter_clockwise)])
        }
    }))
}

fn rounded_size(size: &Size) -> Size {
    Size {
        name: size.name.clone(),
        chest_girth: rounded(size.chest_girth),
        waist_girth: rounded(size.waist_girth),
        hip_girth: rounded(size.hip_girth),
    }
}

fn rounded(x: f64) -> f64 {
    // Adding zero turns -0 into 0.
    (x * DECIMALS).round() / DECIMALS + 0.0
}

/// Puts each innermost array of an indented JSON text on one line.
fn number_rows_on_one_line(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(open) = rest.find('[') {
        let (before, from) = rest.split_at(open);
        out.push_str(before);
        let end = from.find(']').map_or(from.len(), |i| i + 1);
        if from[1..end].contains(['[', '{', '"']) {
            out.push('[');
            rest = &from[1..];
        } else {
            out.extend(from[..end].split_whitespace());
            rest = &from[end..];
        }
    }
    out.push_str(rest);
    out
}

#[cfg(test)]
mod tests {
    use crate::pattern::{Cut, GradedPattern, PatternError, draft_shorts};
    use modiste_body::Gender;

    #[test]
    fn patterns_round_trip() {
        let pattern = draft_shorts(Gender::Female);
        let again = GradedPattern::from_json("shorts", &pattern.to_json()).unwrap();
        assert_eq!(again.stitches, pattern.stitches);
        assert_eq!(again.waist_band, pattern.waist_band);
        for (a, b) in again.panels.iter().zip(&pattern.panels) {
            assert_eq!(
                (&a.name, &a.edge_labels, a.wrap, &a.lower_parts),
                (&b.name, &b.edge_labels, b.wrap, &b.lower_parts)
            );
            for (p, q) in Cut::ALL.into_iter().flat_map(|cut| a.in_cut(cut).iter().zip(b.in_cut(cut))) {
                assert!(p.vertices.iter().zip(&q.vertices).all(|(v, w)| v.distance(*w) < 1e-7));
                assert!((p.edge_length(1) - q.edge_length(1)).abs() < 1e-7);
            }
        }
    }

    #[test]
    fn damaged_files_are_named() {
        let text = draft_shorts(Gender::Female).to_json();
        let broken = GradedPattern::from_json("x", &text[..text.len() / 2]).unwrap_err();
        assert!(matches!(broken, PatternError::File(_)));
        let other = text.replace("modiste-pattern-1", "modiste-pattern-9");
        let message = GradedPattern::from_json("x", &other).unwrap_err().to_string();
        assert!(message.contains("modiste.schema") && message.contains("modiste-pattern-9"), "{message}");
        let unsewable = text.replacen("\"panel\": \"left_back\"", "\"panel\": \"left_wing\"", 1);
        let message = GradedPattern::from_json("x", &unsewable).unwrap_err().to_string();
        assert!(message.contains("left_wing"), "{message}");
    }

    #[test]
    fn numbers_that_no_garment_has_are_refused() {
        let shirt = crate::pattern::draft_tshirt(Gender::Female);
        type Change = fn(&mut GradedPattern);
        let changes: [(&str, Change); 5] = [
            ("modiste.gather", |pattern| pattern.gather = 0.5),
            ("modiste.band", |pattern| pattern.band = 1.2),
            ("modiste.ribs.scale", |pattern| pattern.ribs[0].scale = -1.0),
            ("modiste.ribs.modulus", |pattern| pattern.ribs[0].modulus = 0.0),
            ("modiste.anchors.count", |pattern| pattern.anchors[0].count = 0),
        ];
        for (field, change) in changes {
            let mut pattern = shirt.clone();
            change(&mut pattern);
            let message = GradedPattern::from_json("x", &pattern.to_json()).unwrap_err().to_string();
            assert!(message.contains(field), "{field}: {message}");
        }
    }
}
