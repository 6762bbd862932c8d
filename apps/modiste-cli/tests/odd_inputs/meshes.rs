//! Sewn meshes that cannot be worn.

use std::fmt::Write;

use super::{Case, words};

/// Points of a tube around the hips of the mean woman.
type Point = [f64; 3];

/// Corners and quads of a tube in two rows around the hips of the mean woman, as an OBJ counts them.
pub(crate) fn tube(sides: u32) -> (Vec<Point>, Vec<[u32; 4]>) {
    let (mut points, mut quads) = (Vec::new(), Vec::new());
    for row in 0..3 {
        for side in 0..sides {
            let angle = std::f64::consts::TAU * f64::from(side) / f64::from(sides);
            points.push([0.25 * angle.sin(), 1.0 - 0.1 * f64::from(row), 0.22 * angle.cos()]);
            if row < 2 {
                let [a, b] = [side, (side + 1) % sides].map(|side| row * sides + side + 1);
                quads.push([a, a + sides, b + sides, b]);
            }
        }
    }
    (points, quads)
}

pub(crate) fn obj(points: &[Point], faces: &[[u32; 4]]) -> String {
    let mut text = String::new();
    points.iter().for_each(|[x, y, z]| writeln!(text, "v {x} {y} {z}").unwrap());
    faces.iter().for_each(|[a, b, c, d]| writeln!(text, "f {a} {b} {c} {d}").unwrap());
    text
}

/// The tube with every point moved.
fn moved(by: impl Fn(Point) -> Point) -> String {
    let (points, quads) = tube(30);
    obj(&points.into_iter().map(by).collect::<Vec<_>>(), &quads)
}

/// The tube with lines after it.
fn with(lines: &str) -> String {
    moved(|x| x) + lines
}

/// `garment learn` of a mesh text.
fn mesh(name: &'static str, wanted: &'static str, text: String) -> Case {
    Case::new(name, wanted, move |folder| {
        std::fs::write(folder.join("belt.obj"), &text).unwrap();
        words("garment learn --mesh belt.obj --out belt.safetensors")
    })
}

/// With the tube, and words as they are.
fn asked(name: &'static str, wanted: &'static str, text: &'static str) -> Case {
    Case::new(name, wanted, move |folder| {
        std::fs::write(folder.join("belt.obj"), moved(|x| x)).unwrap();
        words(&format!("garment learn --out belt.safetensors --mesh belt.obj {text}"))
    })
}

pub(crate) fn cases() -> Vec<Case> {
    [files(), surfaces(), places(), requests()].into_iter().flatten().collect()
}

fn files() -> Vec<Case> {
    let whole = with("");
    vec![
        mesh("an empty mesh", "belt.obj", String::new()),
        mesh("points alone", "found none", "v 0 1 0\nv 0 0.9 0\n".to_owned()),
        mesh("a corner that there is not", "belt.obj", whole.replacen("f 1 ", "f 999 ", 1)),
        mesh("a coordinate that is no number", "belt.obj", whole.replacen("v 0 1 0.22", "v 0 nan 0.22", 1)),
        mesh("a coordinate beyond numbers", "belt.obj", whole.replacen("v 0 1 0.22", "v 0 1e999 0.22", 1)),
        mesh("two coordinates", "belt.obj", whole.replacen("v 0 1 0.22", "v 0 1", 1)),
        mesh("a face of two corners", "belt.obj", with("f 1 2\n")),
        mesh("a million triangles", "at most 60000", with(&"f 1 2 32\n".repeat(1_000_000))),
    ]
}

fn surfaces() -> Vec<Case> {
    let (points, quads) = tube(30);
    let below: Vec<Point> = points.iter().map(|&[x, y, z]| [x, y - 0.3, z]).collect();
    let lower: Vec<Point> = points.iter().map(|&[x, y, z]| [x, y - 0.6, z]).collect();
    let again = |count: u32| quads.iter().map(move |quad| quad.map(|v| v + 90 * count));
    let three = obj(&[points.clone(), below, lower].concat(), &(0..3).flat_map(again).collect::<Vec<_>>());
    let mut strip: Vec<[u32; 4]> = quads[..30].to_vec();
    strip[29] = [30, 60, 1, 31];
    vec![
        mesh("three triangles at an edge", "triangles at one edge", with("v 0 1 0.3\nf 1 2 91\nf 2 1 91\n")),
        mesh("a triangle twice", "triangles at one edge", with("f 1 31 32\n")),
        mesh("three components", "found 3 pieces", three),
        mesh("a strip with one side", "one side only", obj(&points, &strip)),
        mesh("a triangle without area", "triangles with area", with("v 0.0 0.78 0.22\nv 0.0 0.76 0.22\nf 61 91 92\n")),
        mesh("a closed surface", "without openings", closed()),
        mesh(
            "parts that touch in a point",
            "touch in vertex 0 alone",
            with("v 0.3 1.1 0.22\nv 0.2 1.1 0.25\nf 1 91 92\n"),
        ),
    ]
}

/// The tube with lids.
fn closed() -> String {
    let lids = (0..30).map(|side| {
        let next = (side + 1) % 30;
        format!("f 91 {} {}\nf 92 {} {}\n", side + 1, next + 1, next + 61, side + 61)
    });
    with(&format!("v 0 1.0 0\nv 0 0.8 0\n{}", lids.collect::<String>()))
}

fn places() -> Vec<Case> {
    vec![
        mesh("a garment far from the body", "m away from it", moved(|[x, y, z]| [x + 3.0, y, z])),
        mesh("a garment in centimetres", "m away from it", moved(|x| x.map(|x| 100.0 * x))),
        mesh("a garment at the end of the world", "belt", moved(|[x, y, z]| [x * 1e150, y, z])),
        mesh("a garment inside the body", "inside", moved(|[x, y, z]| [0.2 * x, y, 0.2 * z])),
        mesh("a garment of one point", "found none", moved(|_| [0.0, 1.0, 0.2])),
    ]
}

fn requests() -> Vec<Case> {
    vec![
        asked("a body that is not there", "absent.obj", "--body absent.obj"),
        asked("a body that is none", "triangles of this project's bodies", "--body belt.obj"),
        asked("a mesh of a fabric that there is not", "no fabric `tin`", "--fabric tin"),
    ]
}
