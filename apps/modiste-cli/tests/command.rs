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
    refused(
        &["dress", "--garments", "cape"],
        "no garment `cape` for a female body; known: longsleeve, pants, shorts, skirt, tshirt",
    );
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
        &["garment", "import", "--help"],
    ] {
        let output = modiste(words, folder.path());
        assert!(output.status.success());
        assert!(String::from_utf8_lossy(&output.stdout).contains("Example:\n  modiste"), "{words:?}");
    }
}
