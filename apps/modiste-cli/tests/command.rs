//! The command as a user meets it: words in, files or one sentence out.
#![expect(clippy::unwrap_used, clippy::disallowed_methods, reason = "a test, which looks at the disk from outside")]

use std::path::Path;
use std::process::{Command, Output};

fn modiste(words: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_modiste")).args(words).current_dir(folder).output().expect("the program starts")
}

/// The command fails, with one line that holds `wanted`, and leaves nothing in the folder.
fn refused(words: &[&str], wanted: &str) {
    let folder = tempfile::tempdir().unwrap();
    refused_in(folder.path(), words, wanted);
    let left: Vec<_> = modiste_files(folder.path());
    assert!(left.is_empty(), "{words:?} left {left:?}");
}

fn refused_in(folder: &Path, words: &[&str], wanted: &str) {
    let output = modiste(words, folder);
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success(), "{words:?} was accepted");
    let error = text.lines().find(|line| line.starts_with("error: ")).unwrap_or_default();
    assert!(error.contains(wanted), "{words:?} said {text:?}, wanted {wanted:?}");
    assert!(!text.contains("panicked"), "{text}");
}

fn modiste_files(folder: &Path) -> Vec<std::ffi::OsString> {
    walk(folder).into_iter().map(|path| path.into_os_string()).collect()
}

fn walk(folder: &Path) -> Vec<std::path::PathBuf> {
    std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect()
}

fn write(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path.to_string_lossy().into_owned()
}

fn read(path: impl AsRef<Path>) -> String {
    std::fs::read_to_string(path).unwrap()
}

#[test]
fn dress_writes_the_whole_folder() {
    let folder = tempfile::tempdir().unwrap();
    let output = modiste(&["dress", "--frames", "5", "--json"], folder.path());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let result: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(result["dressed"]["report"]["frames"], 5);
    let out = folder.path().join("out/dress");
    for name in ["contact_sheet.png", "dressed.glb", "dressed.npz", "report.json", "turnaround.png"] {
        assert!(out.join(name).is_file(), "{name}");
    }
    assert_eq!(walk(&out).len(), 5);
    let report: serde_json::Value = serde_json::from_str(&read(out.join("report.json"))).unwrap();
    assert_eq!(report["subject"]["garments"], serde_json::json!(["shorts", "tshirt"]));
    for fit in report["penetration"].as_array().unwrap() {
        assert!(fit["after"]["deepest_mm"].as_f64().unwrap() <= 0.5, "{fit}");
    }
    assert!(String::from_utf8_lossy(&output.stderr).contains("dress: done"), "plain lines tell of the progress");
}

#[test]
fn a_made_body_measures_as_it_was_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let words =
        ["body", "make", "--height", "1.65", "--weight", "60", "--chest", "0.92", "--waist", "0.75", "--hip", "0.98"];
    let made = modiste(&words, folder.path());
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let measured = modiste(&["body", "measure", "body.obj", "--json"], folder.path());
    let json: serde_json::Value = serde_json::from_slice(&measured.stdout).unwrap();
    let value = |name: &str| json["measured_body"]["measurements"][name].as_f64().unwrap();
    assert!((value("stature") - 1.65).abs() < 0.005, "{json}");
    assert!((value("body_mass") - 60.0).abs() < 0.5, "{json}");
    assert!((value("hip_girth") - 0.98).abs() < 0.005, "{json}");
    let table = modiste(&["body", "measure", "body.obj"], folder.path());
    assert!(String::from_utf8_lossy(&table.stdout).contains("waist girth"));
}

#[test]
fn numbers_that_no_adult_has_are_refused() {
    refused(&["dress", "--height", "5"], "stature: wanted 1.2 to 2.3 m, found 5");
    refused(&["dress", "--height", "NaN"], "stature");
    refused(&["dress", "--shape", "1,-90"], "shape coefficient 2");
    refused(&["dress", "--shape", "inf"], "shape coefficient 1");
    refused(&["body", "make", "--weight", "1000"], "body mass");
    refused(&["dress", "--seconds", "1e9"], "length of the animation");
    refused(&["dress", "--frames", "0"], "length of the animation");
}

#[test]
fn unknown_garments_and_absent_files_are_named() {
    refused(&["dress", "--garments", "cape"], "no garment `cape` for a female body; known: shorts, tshirt");
    refused(&["dress", "--garments", "shorts,shorts"], "shorts is worn twice");
    refused(&["dress", "--motion", "absent.bvh"], "absent.bvh");
    refused(&["body", "measure", "absent.obj"], "absent.obj");
    refused(&["body", "make"], "nothing says which body");
}

#[test]
fn damaged_motions_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let header = "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation\n";
    let truncated = write(folder.path(), "truncated.bvh", header);
    refused_in(folder.path(), &["dress", "--motion", &truncated], "truncated.bvh");
    let body = "End Site\n{\nOFFSET 0 1 0\n}\n}\nMOTION\nFrames: 2\nFrame Time: 0.033\n";
    let nan = write(folder.path(), "nan.bvh", &format!("{header}{body}0 0 0 0 nan 0\n0 0 0 0 0 0\n"));
    refused_in(folder.path(), &["dress", "--motion", &nan], "nan.bvh");
    let joint = header.replace("Hips", "Tentacle");
    let unknown = write(folder.path(), "joint.bvh", &format!("{joint}{body}0 0 0 0 0 0\n0 0 0 0 0 0\n"));
    refused_in(folder.path(), &["dress", "--motion", &unknown], "joint.bvh");
    assert_eq!(walk(folder.path()).len(), 3, "nothing but the bad files is there");
}

/// A skirt of two rectangles in centimetres, as GarmentCode draws one.
const SKIRT: &str = r#"{"pattern": {"panels": {
    "front": {"translation": [-27, 56, 25], "rotation": [0, 0, 0], "label": "leg", "vertices": [[0, 0], [54, 0], [54, 40], [0, 40]],
        "edges": [{"endpoints": [0, 1]}, {"endpoints": [1, 2]}, {"endpoints": [2, 3]}, {"endpoints": [3, 0]}]},
    "back": {"translation": [-27, 56, -20], "rotation": [0, 0, 0], "label": "leg", "vertices": [[0, 0], [0, 40], [54, 40], [54, 0]],
        "edges": [{"endpoints": [0, 1]}, {"endpoints": [1, 2]}, {"endpoints": [2, 3]}, {"endpoints": [3, 0]}]}},
    "stitches": [[{"panel": "front", "edge": 3}, {"panel": "back", "edge": 0}], [{"panel": "front", "edge": 1}, {"panel": "back", "edge": 2}]]},
    "properties": {"units_in_meter": 100, "curvature_coords": "relative"}}"#;

#[test]
fn patterns_that_cannot_be_worn_are_refused_before_work() {
    let folder = tempfile::tempdir().unwrap();
    let learn = |name: &str, text: &str, wanted: &str| {
        let file = write(folder.path(), name, text);
        let words = ["garment", "learn", "--pattern", &file, "--out", "skirt.safetensors"];
        refused_in(folder.path(), &words, wanted);
        std::fs::remove_file(file).unwrap();
    };
    let changed = |from: &str, to: &str| {
        assert!(SKIRT.contains(from), "{from}");
        SKIRT.replacen(from, to, 1)
    };
    learn("empty.json", "", "empty.json");
    learn("half.json", &SKIRT[..SKIRT.len() / 2], "half.json");
    learn("list.json", "[1, 2]", "list.json");
    learn(
        "bare.json",
        r#"{"pattern": {"panels": {}}, "properties": {"units_in_meter": 100, "curvature_coords": "relative"}}"#,
        "panel",
    );
    learn("small.json", &changed(": 100,", ": 10000,"), "units_in_meter");
    learn("large.json", &changed(": 100,", ": 1,"), "units_in_meter");
    learn("zero.json", &changed(": 100,", ": 0,"), "units_in_meter");
    learn("crossed.json", &changed("[54, 0], [54, 40], [0, 40]]", "[54, 40], [54, 0], [0, 40]]"), "front");
    learn("flat.json", &changed("[54, 40], [0, 40]]", "[54, 0], [0, 0]]"), "front");
    learn("seam.json", &changed("[0, 40], [54, 40], [54, 0]]", "[0, 4], [54, 4], [54, 0]]"), "cannot be closed");
    learn("twice.json", &changed(r#""panel": "back", "edge": 2"#, r#""panel": "front", "edge": 1"#), "the same twice");
    learn("edge.json", &changed(r#""panel": "back", "edge": 2"#, r#""panel": "back", "edge": 9"#), "stitch 1");
    learn("panel.json", &changed(r#""panel": "back", "edge": 2"#, r#""panel": "side", "edge": 2"#), "stitch 1");
    learn("corner.json", &changed(r#""endpoints": [1, 2]"#, r#""endpoints": [1, 7]"#), "front");
    learn("number.json", &changed("[54, 40]", "[54, 1e999]"), "number.json");
    learn(
        "ours.json",
        &changed(r#""properties""#, r#""modiste": {"schema": "modiste-pattern-9"}, "properties""#),
        "modiste",
    );
    let doubled = changed("[54, 40], [0, 40]]", "[54, 40], [0, 40], [0, 40]]").replacen(
        r#"{"endpoints": [3, 0]}"#,
        r#"{"endpoints": [3, 4]}, {"endpoints": [4, 0]}"#,
        1,
    );
    learn("doubled.json", &doubled, "front has two corners in one place");
    let (head, rest) = SKIRT.split_once("\"stitches\": ").unwrap();
    let (_, tail) = rest.split_once("]]},").unwrap();
    learn("alone.json", &format!("{head}\"stitches\": []}},{tail}"), "sewn to nothing");
    let thrice = changed("}]]},", r#"}], [{"panel": "front", "edge": 3}, {"panel": "back", "edge": 3}]]},"#);
    learn("thrice.json", &thrice, "edge 3 of panel front is in more than one seam");
    let words = ["garment", "learn", "cape", "--out", "cape.safetensors"];
    refused_in(folder.path(), &words, "no pattern named cape; there are tshirt, longsleeve, shorts, pants, skirt");
    refused_in(folder.path(), &["garment", "learn", "--pattern", "absent.json", "--out", "x"], "absent.json");
    let file = write(folder.path(), "skirt.json", SKIRT);
    let words = ["garment", "learn", "--pattern", &file, "--fabric", "tin", "--out", "x"];
    refused_in(folder.path(), &words, "no fabric `tin`; known: ");
    let words = ["garment", "learn", "--pattern", &file, "--out", &format!("{file}/below")];
    refused_in(folder.path(), &words, "skirt.json");
    refused_in(folder.path(), &["garment", "evaluate", &file], "skirt.json");
    assert_eq!(walk(folder.path()).len(), 1, "nothing but the pattern is there");
}

/// A tube of `sides` quads in each of two rows around the hips of the mean woman, `shift` metres aside, in units of which
/// `unit` are a metre.
fn tube(sides: u32, shift: f64, unit: f64) -> String {
    let mut text = String::new();
    for row in 0..3 {
        for side in 0..sides {
            let angle = std::f64::consts::TAU * f64::from(side) / f64::from(sides);
            let (x, y, z) = (0.25 * angle.sin() + shift, 1.0 - 0.1 * f64::from(row), 0.22 * angle.cos());
            text += &format!("v {} {} {}\n", x * unit, y * unit, z * unit);
        }
    }
    for row in 0..2 {
        for side in 0..sides {
            let [a, b] = [side, (side + 1) % sides].map(|side| row * sides + side + 1);
            text += &format!("f {a} {} {} {b}\n", a + sides, b + sides);
        }
    }
    text
}

#[test]
fn meshes_that_cannot_be_worn_are_refused_before_work() {
    let folder = tempfile::tempdir().unwrap();
    let learn = |text: &str, wanted: &str| {
        let file = write(folder.path(), "belt.obj", text);
        refused_in(folder.path(), &["garment", "learn", "--mesh", &file, "--out", "belt.safetensors"], wanted);
        std::fs::remove_file(file).unwrap();
    };
    let whole = tube(30, 0.0, 1.0);
    learn("", "belt.obj");
    learn("v 0 1 0\nv 0 0.9 0\n", "found none");
    learn(&whole.replacen("f 1 ", "f 999 ", 1), "belt.obj");
    learn(&whole.replacen("v 0 1 0.22", "v 0 nan 0.22", 1), "belt.obj");
    learn(&tube(30, 3.0, 1.0), "m away from it");
    learn(&tube(30, 0.0, 100.0), "m away from it");
    learn(&format!("{whole}v 0 1 0.3\nf 1 2 91\nf 2 1 91\n"), "triangles at one edge");
    let (points, faces) = whole.split_at(whole.find('f').unwrap());
    let lower = points.replace(" 1 ", " 0.7 ").replace(" 0.9 ", " 0.65 ").replace(" 0.8 ", " 0.6 ");
    let offset = |word: &str| word.parse::<u32>().map_or(word.to_owned(), |index| (index + 90).to_string());
    let others: Vec<String> =
        faces.lines().map(|line| line.split(' ').map(offset).collect::<Vec<_>>().join(" ")).collect();
    learn(&format!("{points}{lower}{faces}{}\n", others.join("\n")), "found 2 pieces");
    let file = write(folder.path(), "belt.obj", &whole);
    let words = |more: &[&'static str]| {
        let mut words = vec!["garment", "learn", "--out", "belt.safetensors", "--mesh", "belt.obj"];
        words.extend(more);
        words
    };
    refused_in(folder.path(), &words(&["--body", "absent.obj"]), "absent.obj");
    refused_in(folder.path(), &words(&["--body", "belt.obj"]), "triangles of this project's bodies");
    refused_in(folder.path(), &words(&["--fabric", "tin"]), "no fabric `tin`");
    std::fs::remove_file(file).unwrap();
    assert!(walk(folder.path()).is_empty(), "nothing is left behind");
}

#[test]
fn folders_that_cannot_be_written_are_refused_before_work() {
    let folder = tempfile::tempdir().unwrap();
    let file = write(folder.path(), "file", "");
    refused_in(folder.path(), &["dress", "--out", &file], "file");
    refused_in(folder.path(), &["dress", "--out", &format!("{file}/below")], "file");
    assert_eq!(walk(folder.path()).len(), 1);
}

#[test]
fn models_of_another_version_or_none_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "body-female.safetensors", "not a model");
    write(folder.path(), "female-tshirt.safetensors", "not a model");
    let run = |assets: &Path| {
        let words = ["dress", "--garments", "tshirt"];
        let output = Command::new(env!("CARGO_BIN_EXE_modiste"))
            .args(words)
            .current_dir(folder.path())
            .env("MODISTE_ASSETS", assets)
            .output()
            .unwrap();
        assert!(!output.status.success());
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let damaged = run(folder.path());
    assert!(damaged.contains("body-female.safetensors"), "{damaged}");
    let absent = run(&folder.path().join("nowhere"));
    assert!(absent.contains("nowhere") && absent.contains("cargo xtask assets"), "{absent}");
}

#[test]
fn help_shows_an_example_of_everything() {
    let folder = tempfile::tempdir().unwrap();
    for words in [
        &["dress", "--help"][..],
        &["body", "make", "--help"],
        &["body", "measure", "--help"],
        &["body", "population", "--help"],
        &["body", "train", "--help"],
        &["garment", "simulate", "--help"],
        &["garment", "train", "--help"],
        &["garment", "learn", "--help"],
        &["garment", "evaluate", "--help"],
    ] {
        let output = modiste(words, folder.path());
        assert!(output.status.success());
        assert!(String::from_utf8_lossy(&output.stdout).contains("Example:\n  modiste"), "{words:?}");
    }
}
