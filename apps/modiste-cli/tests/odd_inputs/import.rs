//! Simulations of other programs that cannot be learned from.

use std::path::Path;
use std::sync::LazyLock;

use modiste_io::animated::AnimatedMesh;
use modiste_io::npz::Writer;
use modiste_io::{obj, pc2, write_bytes};

use super::meshes::tube;
use super::{Case, modiste, words};

type Points = Vec<[f32; 3]>;

/// One sequence: a garment and its body, frame by frame.
#[derive(Clone)]
struct Sequence {
    name: String,
    cloth: Vec<Points>,
    faces: Vec<[u32; 3]>,
    body: Vec<Points>,
    body_faces: Vec<[u32; 3]>,
    fps: Option<f32>,
}

/// What a whole import needs: three bodies in the template pose, and the mean one turning around.
#[derive(Clone)]
struct Scene(Vec<Sequence>);

const FRAMES: usize = 12;

static WHOLE: LazyLock<Scene> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let (points, quads) = tube(30);
    let cloth: Points = points.iter().map(|x| x.map(|x| x as f32)).collect();
    let faces: Vec<[u32; 3]> =
        quads.iter().map(|quad| quad.map(|v| v - 1)).flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let mut sequences = Vec::new();
    for (name, shape) in [("mean", "0"), ("slim", "-0.6,0.4"), ("tall", "0.3,0.5")] {
        let output = modiste(&words(&format!("body make --shape={shape} --out {name}.obj")), folder.path());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let (vertices, body_faces) = obj::read(folder.path().join(format!("{name}.obj"))).unwrap();
        let body = vec![vertices.iter().map(|x| x.as_vec3().to_array()).collect()];
        let name = name.to_owned();
        sequences.push(Sequence {
            name,
            cloth: vec![cloth.clone()],
            faces: faces.clone(),
            body,
            body_faces,
            fps: None,
        });
    }
    let mut turn = sequences[0].clone();
    turn.name = "turn".to_owned();
    turn.cloth = (0..FRAMES).map(|frame| turned(&turn.cloth[0], 0.05 * frame as f32)).collect();
    turn.body = (0..FRAMES).map(|frame| turned(&turn.body[0], 0.05 * frame as f32)).collect();
    sequences.push(turn);
    Scene(sequences)
});

/// Turned about the vertical (rad).
fn turned(points: &Points, angle: f32) -> Points {
    let (sin, cos) = angle.sin_cos();
    points.iter().map(|&[x, y, z]| [cos * x + sin * z, y, cos * z - sin * x]).collect()
}

impl Scene {
    /// The one that moves.
    fn turn(&mut self) -> &mut Sequence {
        &mut self.0[3]
    }

    /// Changes all frames of garments and bodies.
    fn all(&mut self, by: impl Fn([f32; 3]) -> [f32; 3]) {
        for sequence in &mut self.0 {
            sequence.cloth.iter_mut().chain(&mut sequence.body).flatten().for_each(|x| *x = by(*x));
        }
    }

    /// Changes all frames of garments.
    fn cloth(&mut self, by: impl Fn([f32; 3]) -> [f32; 3]) {
        self.0.iter_mut().flat_map(|sequence| &mut sequence.cloth).flatten().for_each(|x| *x = by(*x));
    }

    /// Writes `sims/<name>.npz` and `bodies/<name>.npz`.
    fn write(&self, folder: &Path) {
        for sequence in &self.0 {
            let write = |kind: &str, frames: &[Points], faces: &[[u32; 3]]| {
                let shape = [frames.len(), frames.first().map_or(0, Vec::len), 3];
                let mut writer = Writer::new();
                writer.add_f32("vertices", &shape, frames.concat().into_flattened()).add_triangles("faces", faces);
                sequence.fps.into_iter().for_each(|fps| {
                    writer.add_f32("fps", &[], vec![fps]);
                });
                writer.save(folder.join(format!("{kind}/{}.npz", sequence.name))).unwrap();
            };
            write("sims", &sequence.cloth, &sequence.faces);
            write("bodies", &sequence.body, &sequence.body_faces);
        }
    }
}

const IMPORT: &str = "garment import --sequence sims --bodies bodies --out belt.safetensors";

/// `garment import` of a changed scene.
fn scene(name: &'static str, wanted: &'static str, change: impl Fn(&mut Scene) + Sync + 'static) -> Case {
    asked(name, wanted, IMPORT, move |folder| {
        let mut scene = WHOLE.clone();
        change(&mut scene);
        scene.write(folder);
    })
}

/// `garment import` of a whole scene, one of whose files is then written over.
fn file(
    name: &'static str,
    wanted: &'static str,
    path: &'static str,
    bytes: impl Fn(Vec<u8>) -> Vec<u8> + Sync + 'static,
) -> Case {
    asked(name, wanted, IMPORT, move |folder| {
        WHOLE.write(folder);
        let path = folder.join(path);
        let before = std::fs::read(&path).unwrap_or_default();
        write_bytes(&path, &bytes(before)).unwrap();
    })
}

/// A command over files that `make` writes.
fn asked(name: &'static str, wanted: &'static str, text: &'static str, make: impl Fn(&Path) + Sync + 'static) -> Case {
    Case::new(name, wanted, move |folder| {
        make(folder);
        words(text)
    })
}

pub(crate) fn cases() -> Vec<Case> {
    [files(), arrays(), caches(), bodies(), garments(), sets(), requests()].into_iter().flatten().collect()
}

fn files() -> Vec<Case> {
    let objs = |folder: &Path, change: &dyn Fn(usize) -> Option<usize>| {
        WHOLE.write(folder);
        let turn = &WHOLE.0[3];
        std::fs::remove_file(folder.join("sims/turn.npz")).unwrap();
        for frame in 0..FRAMES {
            let Some(number) = change(frame) else { continue };
            let points: Vec<_> = turn.cloth[frame].iter().map(|x| x.map(f64::from).into()).collect();
            let faces = if number == frame { &turn.faces[..] } else { &turn.faces[1..] };
            obj::write(folder.join(format!("sims/turn_{frame:03}.obj")), &points, faces).unwrap();
        }
    };
    vec![
        file("half an npz", "turn.npz", "sims/turn.npz", |bytes| bytes[..bytes.len() / 2].to_vec()),
        file("an empty npz", "turn.npz", "sims/turn.npz", |_| Vec::new()),
        file("a text for an npz", "slim.npz", "bodies/slim.npz", |_| b"body".to_vec()),
        file("an empty OBJ", "new.obj", "sims/new.obj", |_| Vec::new()),
        file("two sequences of one name", "one file or numbered OBJ files", "sims/turn.pc2", |_| Vec::new()),
        file("a sequence without a body", "wanted a body called `robe`", "sims/robe.npz", |_| Vec::new()),
        file("a motion for a body that is none", "slim.bvh", "bodies/slim.bvh", |_| b"HIERARCHY".to_vec()),
        asked("a frame that is missing", "frame 5 after frame 4, found frame 6", IMPORT, move |folder| {
            objs(folder, &|frame| (frame != 5).then_some(frame));
        }),
        asked("a frame of another mesh", "turn_007.obj, mesh: wanted the faces of", IMPORT, move |folder| {
            objs(folder, &|frame| Some(if frame == 7 { 99 } else { frame }));
        }),
    ]
}

fn arrays() -> Vec<Case> {
    let array = |name, wanted, array: &'static str, shape: &'static [usize], value: f32| {
        asked(name, wanted, IMPORT, move |folder| {
            WHOLE.write(folder);
            let data = vec![value; shape.iter().product()];
            Writer::new().add_f32(array, shape, data).save(folder.join("sims/turn.npz")).unwrap();
        })
    };
    vec![
        array("arrays of other names", "an array \"belt\" or \"vertices\"", "points", &[1, 3, 3], 0.0),
        array("two coordinates a vertex", "shape [any, any, 3]", "vertices", &[12, 90, 2], 0.0),
        array("no frames", "at least one frame", "vertices", &[0, 90, 3], 0.0),
        array("a whole flat array", "shape [any, any, 3]", "vertices", &[3240], 0.0),
        scene("a vertex that is no number", "turn.npz, array \"vertices\"", |scene| {
            scene.turn().cloth[7][5][1] = f32::NAN;
        }),
        scene("a body vertex that is no number", "turn.npz, array \"vertices\"", |scene| {
            scene.turn().body[2][100][0] = f32::INFINITY;
        }),
        scene("a rate of nothing", "1 to 1000 frames a second", |scene| scene.turn().fps = Some(0.0)),
        scene("two rates", "frames a second as in", |scene| {
            scene.0[0].fps = Some(30.0);
            scene.turn().fps = Some(24.0);
        }),
        scene("fewer body frames", "as many frames as", |scene| drop(scene.turn().body.pop())),
        scene("another number of vertices", "wanted 90 vertices as in", |scene| {
            scene.turn().cloth.iter_mut().for_each(|frame| frame.truncate(89));
        }),
        scene("other faces", "the same 120 triangles", |scene| scene.turn().faces[3].swap(0, 1)),
        scene("a face beyond the vertices", "vertex 90, where there are 90", |scene| {
            scene.0.iter_mut().for_each(|sequence| sequence.faces[3][0] = 90);
        }),
        scene("no faces", "found none", |scene| scene.0.iter_mut().for_each(|sequence| sequence.faces.clear())),
    ]
}

fn caches() -> Vec<Case> {
    // The garments as point caches, one of them damaged.
    let cache = |name, wanted, text, damage: fn(Vec<u8>) -> Vec<u8>| {
        asked(name, wanted, text, move |folder| {
            WHOLE.write(folder);
            for sequence in &WHOLE.0 {
                let path = folder.join(format!("sims/{}.pc2", sequence.name));
                std::fs::remove_file(path.with_extension("npz")).unwrap();
                pc2::write(&path, &AnimatedMesh::plain("points", &[[0, 1, 2]], &sequence.cloth)).unwrap();
            }
            let path = folder.join("sims/turn.pc2");
            let bytes = damage(std::fs::read(&path).unwrap());
            write_bytes(&path, &bytes).unwrap();
            let (points, quads) = tube(29);
            write_bytes(folder.join("belt.obj"), super::meshes::obj(&points, &quads).as_bytes()).unwrap();
        })
    };
    vec![
        cache("caches without a mesh", "by --mesh", IMPORT, |bytes| bytes),
        cache("caches with another mesh", "belt.obj: wanted the 90 vertices", MESH, |bytes| bytes),
        cache("half a cache", "turn.pc2, samples", IMPORT, |bytes| bytes[..bytes.len() / 2].to_vec()),
        cache("a header of a cache", "turn.pc2, header", IMPORT, |bytes| bytes[..20].to_vec()),
        cache("an empty cache", "turn.pc2, first bytes", IMPORT, |_| Vec::new()),
        cache("a cache of no points", "turn.pc2, number of points", IMPORT, |bytes| word(bytes, 16, 0)),
        cache("a cache of too many samples", "turn.pc2, samples", IMPORT, |bytes| word(bytes, 28, i32::MAX)),
        cache("a cache of fewer than no samples", "number of samples", IMPORT, |bytes| word(bytes, 28, -1)),
        cache("a cache of a later version", "turn.pc2, version", IMPORT, |bytes| word(bytes, 12, 2)),
        cache("a point that is no number", "point 1 of sample 0", IMPORT, |bytes| word(bytes, 44, 0x7fc0_0000)),
    ]
}

const MESH: &str = "garment import --sequence sims --bodies bodies --mesh belt.obj --out belt.safetensors";

/// The bytes with a whole number written over.
fn word(mut bytes: Vec<u8>, at: usize, value: i32) -> Vec<u8> {
    bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
    bytes
}

fn bodies() -> Vec<Case> {
    vec![
        scene("a body of another topology", "the 13380 vertices of this project's bodies, found 90", |scene| {
            let cloth = scene.0[1].cloth.clone();
            scene.0[1].body = cloth;
        }),
        scene("a body of other faces", "triangles of this project's bodies", |scene| {
            scene.turn().body_faces.swap(0, 1);
        }),
        scene("a single body that is bent", "template pose in a single frame", |scene| {
            scene.0[1].body[0].iter_mut().filter(|x| x[0] > 0.3).for_each(|x| x[2] += 0.2);
        }),
        scene("a single body that is turned", "template pose in a single frame", |scene| {
            scene.0[1].body[0] = turned(&scene.0[1].body[0], 0.5);
        }),
        scene("another body in motion", "wanted the mean female body in motion", |scene| {
            let tall = scene.0[2].body[0].clone();
            scene.turn().body = (0..FRAMES).map(|frame| turned(&tall, 0.05 * frame as f32)).collect();
        }),
        scene("a body torn apart in one frame", "turn.npz, frame 6", |scene| {
            scene.turn().body[6].iter_mut().step_by(2).for_each(|x| x[0] += 0.5);
        }),
        scene("bodies in no unit", "wanted a body in metres, decimetres", |scene| scene.all(|x| x.map(|x| 3.7 * x))),
        scene("two units", "as unit as in", |scene| {
            let turn = scene.turn();
            turn.cloth.iter_mut().chain(&mut turn.body).flatten().for_each(|x| *x = x.map(|x| 100.0 * x));
        }),
        scene("bodies of one point", "wanted a body in metres", |scene| {
            scene.0.iter_mut().flat_map(|sequence| &mut sequence.body).flatten().for_each(|x| *x = [0.0; 3]);
        }),
        scene("Z up and nobody says so", "say --up z", |scene| scene.all(|[x, y, z]| [x, -z, y])),
        scene("a motion with Z up and nobody says so", "say --up z", |scene| {
            let turn = scene.turn();
            turn.cloth.iter_mut().chain(&mut turn.body).flatten().for_each(|x| *x = [x[0], -x[2], x[1]]);
        }),
        asked("women for men", "template pose in a single frame", MALE, |folder| WHOLE.write(folder)),
    ]
}

const MALE: &str = "garment import --sequence sims --bodies bodies --gender male --out belt.safetensors";

fn garments() -> Vec<Case> {
    vec![
        scene("garments far from their bodies", "m away from it", |scene| scene.cloth(|[x, y, z]| [x + 3.0, y, z])),
        scene("garments in their bodies", "more than 2 cm inside", |scene| {
            scene.cloth(|[x, y, z]| [0.2 * x, y, 0.2 * z])
        }),
        scene("garments in another unit than bodies", "belt", |scene| scene.cloth(|x| x.map(|x| 100.0 * x))),
        scene("a garment that flies away", "turn, frame 9", |scene| {
            scene.turn().cloth[9].iter_mut().for_each(|x| x[1] += 2.0);
        }),
        scene("a garment that sinks into its body", "turn, frame 4", |scene| {
            scene.turn().cloth[4].iter_mut().for_each(|[x, _, z]| (*x, *z) = (0.2 * *x, 0.2 * *z));
        }),
        scene("a garment on another body", "slim.npz", |scene| {
            scene.0[1].cloth[0].iter_mut().for_each(|x| x[2] += 1.0);
        }),
        scene("cloth that is torn in every frame", "every motion was left out", |scene| {
            scene.turn().cloth.iter_mut().flat_map(|frame| frame.iter_mut().step_by(3)).for_each(|x| x[1] += 0.3);
        }),
        scene("garments with a triangle without area", "triangles with area", |scene| {
            for frame in scene.0.iter_mut().flat_map(|sequence| &mut sequence.cloth) {
                let (a, b) = (frame[0], frame[31]);
                frame[30] = std::array::from_fn(|axis| 0.5 * (a[axis] + b[axis]));
            }
        }),
        scene("garments in pieces", "pieces", |scene| {
            scene.0.iter_mut().for_each(|sequence| sequence.faces.retain(|face| face.iter().all(|v| v % 30 % 15 < 14)));
        }),
        scene("garments with three triangles at an edge", "triangles at one edge", |scene| {
            scene.0.iter_mut().for_each(|sequence| sequence.faces.push([0, 30, 50]));
        }),
    ]
}

fn sets() -> Vec<Case> {
    vec![
        scene("too few bodies", "at least 3 bodies of different shape", |scene| drop(scene.0.remove(1))),
        scene("no motion", "at least one motion of 12 frames, found 0", |scene| drop(scene.0.pop())),
        scene("a short motion", "at least one motion of 12 frames, found 5", |scene| {
            scene.turn().cloth.truncate(5);
            scene.turn().body.truncate(5);
        }),
        asked("no files at all", "at least one npz", IMPORT, |folder| {
            ["sims", "bodies"].iter().for_each(|name| std::fs::create_dir(folder.join(name)).unwrap());
        }),
        asked("a folder with another set", "choose another folder", OTHER, |folder| {
            WHOLE.write(folder);
            let text = r#"{"schema": "modiste-training-set-1", "garment": "robe", "gender": "male", "seed": 1, "units": "",
                "fabric": "", "hashes": {}, "sequences": [], "dropped": []}"#;
            write_bytes(folder.join("set/manifest.json"), text.as_bytes()).unwrap();
        }),
        asked("a folder with half a manifest", "manifest.json", OTHER, |folder| {
            WHOLE.write(folder);
            write_bytes(folder.join("set/manifest.json"), b"{\"schema\": ").unwrap();
        }),
    ]
}

const OTHER: &str = "garment import --sequence sims --bodies bodies --training set --out belt.safetensors";

fn requests() -> Vec<Case> {
    let absent = "garment import --sequence absent.npz --bodies bodies --out belt.safetensors";
    let other = "garment import --sequence sims/belt.fbx --bodies bodies --out belt.safetensors";
    let below = "garment import --sequence sims --bodies bodies --out sims/turn.npz/belt.safetensors";
    let set = "garment import --sequence sims --bodies bodies --training sims/turn.npz --out belt.safetensors";
    let fps = "garment import --sequence sims --bodies bodies --fps nan --out belt.safetensors";
    let alone = "garment import --sequence sims --out belt.safetensors";
    vec![
        asked("a sequence that is not there", "absent.npz", absent, |folder| WHOLE.write(folder)),
        asked("a file of another program", "ends in .npz, .pc2, .obj or .bvh", other, |folder| WHOLE.write(folder)),
        asked("a model below a sequence", "turn.npz", below, |folder| WHOLE.write(folder)),
        asked("a training set below a sequence", "turn.npz", set, |folder| WHOLE.write(folder)),
        asked("a rate that is no number", "1 to 1000 frames a second, found NaN", fps, |folder| WHOLE.write(folder)),
        asked("no bodies", "wanted a body called `mean`", alone, |folder| WHOLE.write(folder)),
    ]
}
