//! Sewing patterns in GarmentCode's JSON, and files that add to it.
//!
//! What GarmentCode specifies is typed and checked; every other member, such as grading of our own beside it, is kept
//! in `other` and written back.

use std::collections::BTreeMap;
use std::path::Path;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::{IoError, json, read_bytes};

/// A pattern file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PatternSpec {
    /// Panels and seams.
    pub pattern: Garment,
    /// Units and conventions.
    pub properties: Properties,
    /// Members beyond those above.
    #[serde(flatten)]
    pub other: Map<String, Value>,
}

/// Panels and the seams between them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Garment {
    /// Panels by name.
    pub panels: BTreeMap<String, Panel>,
    /// Pairs of edges sewn together.
    #[serde(default)]
    pub stitches: Vec<Stitch>,
    /// Members beyond those above.
    #[serde(flatten)]
    pub other: Map<String, Value>,
}

/// A flat piece of cloth, in the file's unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Panel {
    /// Where the origin of the panel is placed around the body.
    pub translation: [f64; 3],
    /// How it is turned there: angles about X, Y and Z (degrees), applied in that order about fixed axes.
    pub rotation: [f64; 3],
    /// Corners in the plane of the panel.
    pub vertices: Vec<[f64; 2]>,
    /// The outline.
    pub edges: Vec<Edge>,
    /// Body part, such as "body" or "arm".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub label: Option<String>,
    /// Members beyond those above.
    #[serde(flatten)]
    pub other: Map<String, Value>,
}

/// A piece of the outline from one corner to another.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Edge {
    /// Indices of the two corners.
    pub endpoints: [usize; 2],
    /// How it bends; straight if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub curvature: Option<Curvature>,
    /// What the edge is, such as "lower_interface".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub label: Option<String>,
    /// Members beyond those above.
    #[serde(flatten)]
    pub other: Map<String, Value>,
}

/// How an edge bends.
///
/// Control points are relative to the edge if `properties.curvature_coords` says so: x along it from 0 to 1, y to its
/// left in units of its length.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Curvature {
    /// The older way to write a quadratic Bézier curve: its control point.
    Point([f64; 2]),
    /// A curve of a named kind.
    Curve(Curve),
}

/// A curve of a named kind.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", content = "params", rename_all = "lowercase")]
pub enum Curve {
    /// Bézier curve with one control point.
    Quadratic([[f64; 2]; 1]),
    /// Bézier curve with two control points.
    Cubic([[f64; 2]; 2]),
    /// Arc: radius (file's unit), 1 for the longer one, 1 for the one that runs to the right of the edge.
    Circle([f64; 3]),
}

/// Two edges sewn together.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(from = "RawStitch", into = "RawStitch")]
pub struct Stitch {
    /// The edges.
    pub sides: [EdgeName; 2],
    /// Which faces of the cloth meet, such as "right_wrong", where the file says it.
    pub faces: Option<String>,
}

/// An edge by its panel and its place in the outline.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct EdgeName {
    /// Name of the panel.
    pub panel: String,
    /// Index of the edge.
    pub edge: usize,
}

#[derive(Clone, Serialize, Deserialize)]
#[serde(untagged)]
enum RawStitch {
    Pair([EdgeName; 2]),
    Sided(EdgeName, EdgeName, String),
}

impl From<RawStitch> for Stitch {
    fn from(raw: RawStitch) -> Self {
        match raw {
            RawStitch::Pair(sides) => Self { sides, faces: None },
            RawStitch::Sided(a, b, faces) => Self { sides: [a, b], faces: Some(faces) },
        }
    }
}

impl From<Stitch> for RawStitch {
    fn from(Stitch { sides, faces }: Stitch) -> Self {
        match faces {
            None => Self::Pair(sides),
            Some(faces) => {
                let [a, b] = sides;
                Self::Sided(a, b, faces)
            }
        }
    }
}

/// Units and conventions of a pattern file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Properties {
    /// How many of the file's units make a metre (100 for centimetres).
    pub units_in_meter: f64,
    /// "relative" or "absolute": the frame of the control points.
    pub curvature_coords: String,
    /// Members beyond those above.
    #[serde(flatten)]
    pub other: Map<String, Value>,
}

/// Reads a pattern.
///
/// # Errors
/// [`IoError`] naming the file and the panel, edge or stitch.
pub fn read(path: impl AsRef<Path>) -> Result<PatternSpec, IoError> {
    let path = path.as_ref();
    parse(&read_bytes(path)?, &path.display().to_string())
}

/// Reads from bytes; `name` stands for the file in errors.
///
/// # Errors
/// [`IoError`] naming the panel, edge or stitch.
pub fn parse(bytes: &[u8], name: &str) -> Result<PatternSpec, IoError> {
    let spec: PatternSpec = json::parse(bytes, name)?;
    spec.check(name)?;
    Ok(spec)
}

/// Writes a pattern, after the same checks as in reading.
///
/// # Errors
/// [`IoError`] naming the file and the reason.
pub fn write(path: impl AsRef<Path>, spec: &PatternSpec) -> Result<(), IoError> {
    spec.check(&path.as_ref().display().to_string())?;
    json::write(path, spec)
}

impl PatternSpec {
    /// A member beyond GarmentCode's, such as our grading.
    ///
    /// # Errors
    /// [`IoError`] when it is missing or not of that type; `name` stands for the file.
    pub fn member<T: DeserializeOwned>(&self, member: &str, name: &str) -> Result<T, IoError> {
        let wrong = |found: &dyn std::fmt::Display| IoError::field(name, member, "a member of its kind", found);
        let value = self.other.get(member).ok_or_else(|| wrong(&"none"))?;
        T::deserialize(value).map_err(|error| wrong(&error))
    }

    fn check(&self, name: &str) -> Result<(), IoError> {
        let units = self.properties.units_in_meter;
        if !(units.is_finite() && units > 0.0) {
            return Err(IoError::field(name, "properties.units_in_meter", "a number above 0", units));
        }
        let frame = &self.properties.curvature_coords;
        if frame != "relative" && frame != "absolute" {
            return Err(IoError::field(name, "properties.curvature_coords", "relative or absolute", frame));
        }
        if self.pattern.panels.is_empty() {
            return Err(IoError::field(name, "pattern.panels", "at least one panel", "none"));
        }
        for (panel_name, panel) in &self.pattern.panels {
            let wrong = |wanted, found| IoError::field(name, format!("panel \"{panel_name}\""), wanted, found);
            panel.check(wrong)?;
        }
        for (index, stitch) in self.pattern.stitches.iter().enumerate() {
            for side in &stitch.sides {
                let wrong =
                    |wanted: &str, found: String| IoError::field(name, format!("stitch {index}"), wanted, found);
                let panel = self.pattern.panels.get(&side.panel);
                let panel = panel.ok_or_else(|| wrong("panels that exist", format!("\"{}\"", side.panel)))?;
                if side.edge >= panel.edges.len() {
                    let wanted = format!("one of the {} edges of panel \"{}\"", panel.edges.len(), side.panel);
                    return Err(wrong(&wanted, side.edge.to_string()));
                }
            }
            if stitch.sides[0] == stitch.sides[1] {
                let wanted = "two different edges".to_owned();
                return Err(IoError::field(name, format!("stitch {index}"), wanted, "the same twice"));
            }
        }
        Ok(())
    }
}

/// No coordinate of a garment is as large, in whatever unit; beyond, sums lose their digits.
const LARGEST: f64 = 1e6;

/// Panels are turned by at most so much (degrees); some programs count full turns.
const LARGEST_TURN: f64 = 3600.0;

impl Panel {
    fn check(&self, wrong: impl Fn(String, String) -> IoError) -> Result<(), IoError> {
        let within = |what: &str, limit: f64, numbers: &[f64]| match numbers.iter().find(|x| !(x.abs() <= limit)) {
            Some(number) => Err(wrong(format!("numbers from -{limit} to {limit} in {what}"), format!("{number:e}"))),
            None => Ok(()),
        };
        within("translation", LARGEST, &self.translation)?;
        within("rotation", LARGEST_TURN, &self.rotation)?;
        within("vertices", LARGEST, self.vertices.as_flattened())?;
        if self.edges.len() < 2 {
            return Err(wrong("an outline of two or more edges".to_owned(), self.edges.len().to_string()));
        }
        for (index, edge) in self.edges.iter().enumerate() {
            let [from, to] = edge.endpoints;
            if from == to || from.max(to) >= self.vertices.len() {
                let wanted = format!("edge {index} to join two of {} vertices", self.vertices.len());
                return Err(wrong(wanted, format!("[{from}, {to}]")));
            }
            let next = self.edges[(index + 1) % self.edges.len()].endpoints[0];
            if to != next {
                return Err(wrong(format!("the edge after edge {index} to start at vertex {to}"), next.to_string()));
            }
            let params: &[f64] = match &edge.curvature {
                None => &[],
                Some(Curvature::Point(point)) => point,
                Some(Curvature::Curve(Curve::Quadratic(points))) => points.as_flattened(),
                Some(Curvature::Curve(Curve::Cubic(points))) => points.as_flattened(),
                Some(Curvature::Curve(Curve::Circle(params))) => params,
            };
            within(&format!("the curvature of edge {index}"), LARGEST, params)?;
            if let Some(Curvature::Curve(Curve::Circle([radius, ..]))) = edge.curvature
                && radius <= 0.0
            {
                return Err(wrong(format!("a radius above 0 at edge {index}"), radius.to_string()));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::{Curvature, Curve, PatternSpec, parse, read, write};
    use crate::fuzz::survives_damage;

    const PATTERN: &str = r#"{"pattern": {"panels": {
        "front": {"translation": [0, 1, 2], "rotation": [0, 0, 90], "vertices": [[0, 0], [4, 0], [4, 5]], "label": "body", "wrap": "torso",
            "edges": [{"endpoints": [0, 1], "curvature": {"type": "circle", "params": [3, 0, 1]}}, {"endpoints": [1, 2], "label": "hem"},
                {"endpoints": [2, 0], "curvature": [0.5, 0.1]}]},
        "back": {"translation": [0, 1, -2], "rotation": [0, 0, 0], "vertices": [[0, 0], [4, 0], [4, 5]],
            "edges": [{"endpoints": [0, 1], "curvature": {"type": "cubic", "params": [[0.2, 0.1], [0.7, 0.1]]}}, {"endpoints": [1, 2]}, {"endpoints": [2, 0]}]}},
        "stitches": [[{"panel": "front", "edge": 0}, {"panel": "back", "edge": 0}], [{"panel": "front", "edge": 2}, {"panel": "back", "edge": 2}, "right_wrong"]]},
        "properties": {"units_in_meter": 100, "curvature_coords": "relative", "normalized_edge_loops": true}, "modiste": {"sizes": [1, 2]}}"#;

    fn pattern() -> PatternSpec {
        parse(PATTERN.as_bytes(), "p.json").unwrap()
    }

    #[test]
    fn known_members_are_typed_and_others_kept() {
        let spec = pattern();
        let front = &spec.pattern.panels["front"];
        assert_eq!(front.edges[0].curvature, Some(Curvature::Curve(Curve::Circle([3.0, 0.0, 1.0]))));
        assert_eq!(front.edges[2].curvature, Some(Curvature::Point([0.5, 0.1])));
        assert_eq!(front.other["wrap"], "torso");
        assert_eq!(spec.pattern.stitches[1].faces.as_deref(), Some("right_wrong"));
        let sizes: std::collections::BTreeMap<String, Vec<u32>> = spec.member("modiste", "p.json").unwrap();
        assert_eq!(sizes["sizes"], [1, 2]);
        assert!(spec.member::<u32>("grading", "p.json").unwrap_err().to_string().contains("grading"));
    }

    #[test]
    fn round_trip_loses_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p.json");
        write(&path, &pattern()).unwrap();
        assert_eq!(read(&path).unwrap(), pattern());
        let original: serde_json::Value = serde_json::from_str(PATTERN).unwrap();
        let written: serde_json::Value = crate::json::read(&path).unwrap();
        assert_eq!(written["modiste"], original["modiste"]);
        assert_eq!(written["pattern"]["stitches"], original["pattern"]["stitches"]);
        assert_eq!(written["properties"]["normalized_edge_loops"], true);
    }

    #[test]
    fn errors_name_the_part() {
        let message =
            |from: &str, to: &str| parse(PATTERN.replacen(from, to, 1).as_bytes(), "p").unwrap_err().to_string();
        let found = message("\"edge\": 2}, {\"panel\": \"back\"", "\"edge\": 3}, {\"panel\": \"back\"");
        assert_eq!(found, "p, stitch 1: wanted one of the 3 edges of panel \"front\", found 3");
        assert!(message("\"panel\": \"back\"", "\"panel\": \"side\"").contains("stitch 0: wanted panels that exist"));
        assert!(message("[1, 2]", "[1, 3]").contains("panel \"front\": wanted edge 1 to join two of 3 vertices"));
        assert!(message("[2, 0]", "[2, 1]").contains("to start at vertex 1, found 0"));
        assert!(message("[3, 0, 1]", "[0, 0, 1]").contains("radius above 0 at edge 0"));
        assert!(message("100", "0").contains("units_in_meter"));
        assert!(message("relative", "polar").contains("curvature_coords"));
        assert!(message("\"circle\"", "\"spiral\"").contains("p, line"));
        assert!(message("[4, 5]", "[4, 1e999]").contains("p, line"));
    }

    #[test]
    fn damage_never_panics() {
        survives_damage(PATTERN.as_bytes(), |bytes| drop(parse(bytes, "damaged.json")));
    }

    #[test]
    fn garmentcode_files_load_as_they_are() {
        let Some(folder) = crate::shared_data("patterns/garmentcode") else { return };
        let mut count = 0;
        for gender in ["mean_female", "mean_male"] {
            for path in crate::list_folder(folder.join(gender)).unwrap() {
                let spec = read(&path).unwrap();
                let original: serde_json::Value = crate::json::read(&path).unwrap();
                assert_eq!(serde_json::to_value(&spec).unwrap()["parameters"], original["parameters"]);
                count += 1;
            }
        }
        assert_eq!(count, 10);
    }
}
