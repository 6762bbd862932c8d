//! Sewing patterns that cannot be worn.

use super::{Case, words};

/// A skirt of two rectangles in centimetres, as GarmentCode draws one.
const SKIRT: &str = r#"{"pattern": {"panels": {
    "front": {"translation": [-27, 56, 25], "rotation": [0, 0, 0], "label": "leg", "vertices": [[0, 0], [54, 0], [54, 40], [0, 40]],
        "edges": [{"endpoints": [0, 1]}, {"endpoints": [1, 2]}, {"endpoints": [2, 3]}, {"endpoints": [3, 0]}]},
    "back": {"translation": [-27, 56, -20], "rotation": [0, 0, 0], "label": "leg", "vertices": [[0, 0], [0, 40], [54, 40], [54, 0]],
        "edges": [{"endpoints": [0, 1]}, {"endpoints": [1, 2]}, {"endpoints": [2, 3]}, {"endpoints": [3, 0]}]}},
    "stitches": [[{"panel": "front", "edge": 3}, {"panel": "back", "edge": 0}], [{"panel": "front", "edge": 1}, {"panel": "back", "edge": 2}]]},
    "properties": {"units_in_meter": 100, "curvature_coords": "relative"}}"#;

/// `garment learn` of a pattern text.
fn pattern(name: &'static str, wanted: &'static str, text: String) -> Case {
    Case::new(name, wanted, move |folder| {
        std::fs::write(folder.join("skirt.json"), &text).unwrap();
        words("garment learn --pattern skirt.json --out skirt.safetensors")
    })
}

/// The skirt with one place changed.
fn changed(name: &'static str, wanted: &'static str, [from, to]: [&str; 2]) -> Case {
    assert!(SKIRT.contains(from), "{name}: {from}");
    pattern(name, wanted, SKIRT.replacen(from, to, 1))
}

/// With files and words as they are.
fn asked(name: &'static str, wanted: &'static str, text: &'static str) -> Case {
    Case::new(name, wanted, move |folder| {
        std::fs::write(folder.join("skirt.json"), SKIRT).unwrap();
        words(text)
    })
}

pub(crate) fn cases() -> Vec<Case> {
    [texts(), numbers(), panels(), seams(), requests()].into_iter().flatten().collect()
}

fn texts() -> Vec<Case> {
    let bare = r#"{"pattern": {"panels": {}}, "properties": {"units_in_meter": 100, "curvature_coords": "relative"}}"#;
    vec![
        pattern("empty file", "skirt.json", String::new()),
        pattern("half a file", "skirt.json", SKIRT[..SKIRT.len() / 2].to_owned()),
        pattern("a list", "skirt.json", "[1, 2]".to_owned()),
        pattern("brackets without end", "skirt.json", "[".repeat(100_000)),
        pattern("bytes that are no text", "skirt.json", "\u{0}\u{1}".repeat(99)),
        pattern("no panels", "panel", bare.to_owned()),
        changed("no properties", "skirt.json", ["\"properties\"", "\"other\""]),
        changed(
            "another version of ours",
            "modiste",
            ["\"properties\"", r#""modiste": {"schema": "modiste-pattern-9"}, "properties""#],
        ),
    ]
}

fn numbers() -> Vec<Case> {
    vec![
        changed("a unit too small", "units_in_meter", [": 100,", ": 10000,"]),
        changed("a unit too large", "units_in_meter", [": 100,", ": 1,"]),
        changed("a unit of nothing", "units_in_meter", [": 100,", ": 0,"]),
        changed("a negative unit", "units_in_meter", [": 100,", ": -100,"]),
        changed("a number beyond numbers", "skirt.json", ["[54, 40]", "[54, 1e999]"]),
        changed("a huge corner", "-1000000 to 1000000 in vertices, found 1e300", ["[54, 40]", "[54, 1e300]"]),
        changed("a word for a number", "skirt.json", ["[54, 40]", "[54, \"forty\"]"]),
        changed("no number", "skirt.json", ["[54, 40]", "[54, NaN]"]),
        changed("three coordinates", "skirt.json", ["[54, 40]", "[54, 40, 1]"]),
        changed(
            "a panel at the end of the world",
            "-1000000 to 1000000 in translation",
            ["[-27, 56, 25]", "[-27, 1e200, 25]"],
        ),
        changed(
            "a panel turned beyond measure",
            "rotation",
            ["\"rotation\": [0, 0, 0]", "\"rotation\": [0, 1e300, 0]"],
        ),
        changed(
            "a curve beyond measure",
            "curvature",
            [r#"{"endpoints": [2, 3]}"#, r#"{"endpoints": [2, 3], "curvature": [0.5, 1e300]}"#],
        ),
    ]
}

fn panels() -> Vec<Case> {
    let doubled = SKIRT.replacen("[54, 40], [0, 40]]", "[54, 40], [0, 40], [0, 40]]", 1).replacen(
        r#"{"endpoints": [3, 0]}"#,
        r#"{"endpoints": [3, 4]}, {"endpoints": [4, 0]}"#,
        1,
    );
    vec![
        changed("a panel that crosses itself", "front", ["[54, 0], [54, 40], [0, 40]]", "[54, 40], [54, 0], [0, 40]]"]),
        changed("a panel without area", "front", ["[54, 40], [0, 40]]", "[54, 0], [0, 0]]"]),
        changed("a panel of two corners", "front", ["[[0, 0], [54, 0], [54, 40], [0, 40]]", "[[0, 0], [54, 0]]"]),
        pattern("two corners in one place", "front has two corners in one place", doubled),
        changed("an edge to no corner", "front", [r#""endpoints": [1, 2]"#, r#""endpoints": [1, 7]"#]),
        changed("an edge before the first corner", "skirt.json", [r#""endpoints": [1, 2]"#, r#""endpoints": [-1, 2]"#]),
        changed("an outline with a gap", "front", [r#"{"endpoints": [1, 2]}, "#, ""]),
    ]
}

fn seams() -> Vec<Case> {
    let (head, rest) = SKIRT.split_once("\"stitches\": ").unwrap();
    let (_, tail) = rest.split_once("]]},").unwrap();
    vec![
        changed(
            "seams of different length",
            "cannot be closed",
            ["[0, 40], [54, 40], [54, 0]]", "[0, 4], [54, 4], [54, 0]]"],
        ),
        changed(
            "an edge sewn to itself",
            "the same twice",
            [r#""panel": "back", "edge": 2"#, r#""panel": "front", "edge": 1"#],
        ),
        changed("a seam of no edge", "stitch 1", [r#""panel": "back", "edge": 2"#, r#""panel": "back", "edge": 9"#]),
        changed("a seam of no panel", "stitch 1", [r#""panel": "back", "edge": 2"#, r#""panel": "side", "edge": 2"#]),
        changed(
            "an edge in two seams",
            "edge 3 of panel front is in more than one seam",
            ["}]]},", r#"}], [{"panel": "front", "edge": 3}, {"panel": "back", "edge": 3}]]},"#],
        ),
        pattern("panels without seams", "sewn to nothing", format!("{head}\"stitches\": []}},{tail}")),
    ]
}

fn requests() -> Vec<Case> {
    let known = "no pattern named cape; there are tshirt, longsleeve, shorts, pants, skirt";
    vec![
        asked("a garment that there is not", known, "garment learn cape --out cape.safetensors"),
        asked("a file that is not there", "absent.json", "garment learn --pattern absent.json --out x"),
        asked(
            "a fabric that there is not",
            "no fabric `tin`; known: ",
            "garment learn --pattern skirt.json --fabric tin --out x",
        ),
        asked("a model below a file", "skirt.json", "garment learn --pattern skirt.json --out skirt.json/below"),
        asked("a pattern for a model", "skirt.json", "garment evaluate skirt.json"),
        asked("two bodies", "number of bodies", "garment learn --pattern skirt.json --bodies 2 --out x"),
    ]
}
