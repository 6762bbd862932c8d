//! What other programs simulated, through the front door: the same training set and the same garment as without the way
//! through their files.

#![expect(clippy::unwrap_used, reason = "a test, which fails by it")]

use std::path::{Path, PathBuf};
use std::sync::Arc;

use modiste::{Assets, GarmentImport, Gender, Job, Outcome, UpAxis, run};
use modiste_body::motion::generate;
use modiste_body::{Body, Motion, Part, Pose, ScapeModel};
use modiste_cloth::dress::{Carrier, Mannequin, ReadyMade};
use modiste_core::{Silent, Topology, Vec3};
use modiste_garment::drape::{PoseSequence, ShapeSample};
use modiste_garment::{DrapeModel, Garment, Synthesis, TrainOptions, TrainingSet};
use modiste_io::animated::AnimatedMesh;
use modiste_io::npz::Writer;
use modiste_io::{obj, pc2, read_bytes};

const SIDES: u32 = 24;
const ROWS: u32 = 8;
const FRAMES: usize = 16;

/// A tube around the hips of the mean woman.
fn tube() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let (mut x, mut faces) = (Vec::new(), Vec::new());
    for row in 0..=ROWS {
        for side in 0..SIDES {
            let angle = std::f64::consts::TAU * f64::from(side) / f64::from(SIDES);
            let wide = 0.02 * f64::from(row) / f64::from(ROWS);
            x.push(Vec3::new((0.24 + wide) * angle.sin(), 1.0 - 0.03 * f64::from(row), (0.21 + wide) * angle.cos()));
            if row < ROWS {
                let id = |row: u32, side: u32| row * SIDES + side % SIDES;
                let [a, b, c, d] = [id(row, side), id(row, side + 1), id(row + 1, side + 1), id(row + 1, side)];
                faces.extend([[a, d, c], [a, c, b]]);
            }
        }
    }
    (x, faces)
}

/// The tube on bodies and in motion as a made-up simulation has it, without any file.
struct Truth {
    set: TrainingSet,
    /// The bodies of the shapes, and of each frame of each motion.
    standing: Vec<Vec<Vec3>>,
    moving: Vec<Vec<Vec<Vec3>>>,
}

fn truth(model: &Arc<ScapeModel>) -> Truth {
    let mean = model.body(&[]).unwrap();
    let mannequin = Mannequin::from(&mean);
    let (x, faces) = tube();
    let made = ReadyMade::new(("tube", Gender::Female, "jersey"), &x, &faces, &mannequin, &mannequin).unwrap();
    let x = made.on_mean().to_vec();
    let nearest = |v: u32| {
        let distance = |b: &u32| mean.rest_vertices()[*b as usize].distance_squared(x[v as usize]);
        (0..mean.rest_vertices().len() as u32).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap()
    };
    let mut waist_band = made.band().to_vec();
    waist_band.sort_unstable();
    let garment = Garment {
        name: "tube".into(),
        gender: Gender::Female,
        topology: Arc::clone(made.topology()),
        face_parts: made.face_parts().to_vec(),
        template: x.clone(),
        waist_band,
        anchors: made.anchors().iter().map(|&v| [v, nearest(v)]).collect(),
        uv: made.uv(),
        pattern: String::new(),
    };
    let anchors_of = |body: &[Vec3]| garment.anchors.iter().map(|&[_, v]| body[v as usize]).collect::<Vec<Vec3>>();
    let carrier = Carrier::new(&x, mean.rest_vertices());
    let (mut shapes, mut standing) = (Vec::new(), Vec::new());
    for index in 0..7 {
        let beta = |k: usize| if index == 0 { 0.0 } else { (1.7 * (index * (k + 1)) as f64).sin() };
        let shape: Vec<f64> = (0..model.shape_count()).map(beta).collect();
        let body = model.body(&shape).unwrap();
        let vertices = carrier.carry(made.topology(), &x, mean.rest_vertices(), body.rest_vertices());
        shapes.push(ShapeSample { shape, ease: 0.0, vertices, body_anchors: anchors_of(body.rest_vertices()) });
        standing.push(body.rest_vertices().to_vec());
    }
    let motions = [
        ("turn", generate::turn(&mean, 2.0).unwrap()),
        ("walk", generate::walk(&mean, 2.0).unwrap()),
        ("squat", generate::squat(&mean, 2.0).unwrap()),
    ];
    let (mut sequences, mut moving) = (Vec::new(), Vec::new());
    for (name, motion) in motions {
        let motion = motion.slice(10..10 + FRAMES);
        let bodies: Vec<Vec<Vec3>> = motion.frames.iter().map(|pose| posed(&mean, pose)).collect();
        sequences.push(PoseSequence {
            name: name.into(),
            frames: motion.frames.iter().map(|pose| worn(&mean, &x, pose)).collect(),
            body_anchors: bodies.iter().map(|body| anchors_of(body)).collect(),
            motion,
        });
        moving.push(bodies);
    }
    Truth {
        set: TrainingSet { garment, shapes, sequences, seed: 0, vertex_count: None, sources: Vec::new() },
        standing,
        moving,
    }
}

fn posed(body: &Body, pose: &Pose) -> Vec<Vec3> {
    let mut x = Vec::new();
    body.pose(pose, &mut x);
    x
}

/// The tube follows the pelvis and ripples with the left thigh.
fn worn(mean: &Body, x: &[Vec3], pose: &Pose) -> Vec<Vec3> {
    let turn = pose.world_quaternions()[Part::Pelvis.index()];
    let from = mean.rest_joints()[Part::Pelvis.index()];
    let bend = pose.rotations[Part::LeftThigh.index()].x;
    let ripple = |x: &Vec3| 0.03 * bend * (1.0 - x.y) * (3.0 * x.x.atan2(x.z)).cos();
    x.iter().map(|p| turn * (*p * (1.0 + ripple(p)) - from) + pose.root_translation).collect()
}

impl Truth {
    /// Name, garment frames and body frames of every sequence; the bodies in the template pose are one of them.
    fn sequences(&self) -> Vec<(String, Vec<Vec<Vec3>>, &[Vec<Vec3>])> {
        let shapes = self.set.shapes.iter().map(|sample| sample.vertices.clone()).collect();
        let mut all = vec![("bodies".to_owned(), shapes, &self.standing[..])];
        for (sequence, bodies) in self.set.sequences.iter().zip(&self.moving) {
            all.push((sequence.name.clone(), sequence.frames.clone(), &bodies[..]));
        }
        all
    }

    /// Each sequence in its own file, body and garment together.
    fn write_npz(&self, folder: &Path, body: &Topology) {
        for (name, cloth, bodies) in self.sequences() {
            let shape = |frames: &[Vec<Vec3>]| [frames.len(), frames[0].len(), 3];
            Writer::new()
                .add_f32("tube", &shape(&cloth), flat(&cloth).into_flattened())
                .add_triangles("tube_faces", self.set.garment.topology.faces())
                .add_f32("body", &shape(bodies), flat(bodies).into_flattened())
                .add_triangles("body_faces", body.faces())
                .add_f32("fps", &[], vec![30.0])
                .save(folder.join(format!("{name}.npz")))
                .unwrap();
        }
    }

    /// One OBJ a frame, garments and bodies in folders of their own.
    fn write_objs(&self, folder: &Path, body: &Topology) {
        for (name, cloth, bodies) in self.sequences() {
            for (frame, (cloth, worn_by)) in cloth.iter().zip(bodies).enumerate() {
                let file = |kind: &str| folder.join(format!("{kind}/{name}_{:04}.obj", frame + 1));
                obj::write(file("sims"), cloth, self.set.garment.topology.faces()).unwrap();
                obj::write(file("bodies"), worn_by, body.faces()).unwrap();
            }
        }
    }

    /// Point caches in centimetres, Z up; the faces are in an OBJ beside.
    fn write_pc2(&self, folder: &Path) {
        let as_there = |x: Vec3| 100.0 * Vec3::new(x.x, -x.z, x.y);
        let moved = |frames: &[Vec<Vec3>]| -> Vec<Vec<Vec3>> {
            frames.iter().map(|frame| frame.iter().map(|x| as_there(*x)).collect()).collect()
        };
        for (name, cloth, bodies) in self.sequences() {
            for (kind, frames) in [("sims", &cloth[..]), ("bodies", bodies)] {
                let single = |frame: &Vec<Vec3>| frame.iter().map(|x| x.as_vec3().to_array()).collect();
                let frames: Vec<Vec<[f32; 3]>> = moved(frames).iter().map(single).collect();
                let mesh = AnimatedMesh::plain("points", &[[0, 1, 2]], &frames);
                pc2::write(folder.join(format!("{kind}/{name}.pc2")), &mesh).unwrap();
            }
        }
        let template = moved(std::slice::from_ref(&self.set.garment.template)).remove(0);
        obj::write(folder.join("tube.obj"), &template, self.set.garment.topology.faces()).unwrap();
    }

    /// Nothing but rounding lies between the set in `folder` and this one; gives it back.
    fn compare(&self, folder: &Path) -> TrainingSet {
        let found = TrainingSet::load(folder).unwrap();
        let (mine, theirs) = (&self.set.garment, &found.garment);
        assert_eq!(theirs.topology.faces(), mine.topology.faces());
        assert_eq!(theirs.waist_band, mine.waist_band);
        // Beside a ridge of the body the nearest face is any of its two sides, by rounding.
        let other = theirs.face_parts.iter().zip(&mine.face_parts).filter(|(a, b)| a != b).count();
        assert!(50 * other <= mine.face_parts.len(), "{other} faces are on other parts");
        assert_eq!(theirs.anchors, mine.anchors);
        near(&theirs.template, &mine.template, "template");
        assert_eq!(found.shapes.len(), self.set.shapes.len());
        for (theirs, mine) in found.shapes.iter().zip(&self.set.shapes) {
            let off = theirs.shape.iter().zip(&mine.shape).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off < 2e-3, "β is off by {off}");
            near(&theirs.vertices, &mine.vertices, "shape");
            near(&theirs.body_anchors, &mine.body_anchors, "anchors of a shape");
        }
        assert_eq!(found.sequences.len(), self.set.sequences.len());
        for mine in &self.set.sequences {
            let theirs = found.sequences.iter().find(|sequence| sequence.name == mine.name).unwrap();
            assert_eq!(theirs.frames.len(), FRAMES);
            poses_near(&theirs.motion, &mine.motion);
            near(&theirs.frames.concat(), &mine.frames.concat(), "frames");
            near(&theirs.body_anchors.concat(), &mine.body_anchors.concat(), "anchors of a motion");
        }
        found
    }
}

fn flat(frames: &[Vec<Vec3>]) -> Vec<[f32; 3]> {
    frames.iter().flatten().map(|x| x.as_vec3().to_array()).collect()
}

fn near(a: &[Vec3], b: &[Vec3], what: &str) {
    assert_eq!(a.len(), b.len(), "{what}");
    let off = a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
    assert!(off < 2e-5, "{what}: {off} m");
}

fn poses_near(a: &Motion, b: &Motion) {
    for (a, b) in a.frames.iter().zip(&b.frames) {
        assert!(a.root_translation.distance(b.root_translation) < 2e-5);
        for (a, b) in a.world_quaternions().iter().zip(b.world_quaternions()) {
            assert!(a.angle_between(b) < 2e-4, "{}", a.angle_between(b));
        }
    }
}

fn import(folder: &Path, sequence: &str, bodies: Option<&str>) -> GarmentImport {
    GarmentImport {
        gender: Gender::Female,
        name: "tube".into(),
        sequences: vec![folder.join(sequence)],
        bodies: bodies.iter().map(|bodies| folder.join(bodies)).collect(),
        mesh: None,
        fps: None,
        up: UpAxis::Y,
        training: folder.join("training"),
        out: folder.join("tube.safetensors"),
    }
}

#[test]
fn the_way_through_files_of_all_kinds_changes_nothing() {
    let model = ScapeModel::load(Assets::find().unwrap().body(Gender::Female)).unwrap();
    let truth = truth(&model);
    let place = tempfile::tempdir().unwrap();
    let folder = |kind: &str| place.path().join(kind);
    truth.write_npz(&folder("npz/sims"), model.topology());
    truth.write_objs(&folder("obj"), model.topology());
    truth.write_pc2(&folder("pc2"));
    let caches = GarmentImport {
        mesh: Some(folder("pc2").join("tube.obj")),
        up: UpAxis::Z,
        ..import(&folder("pc2"), "sims", Some("bodies"))
    };
    let jobs: [GarmentImport; 3] =
        [import(&folder("npz"), "sims", None), import(&folder("obj"), "sims", Some("bodies")), caches];
    let direct = DrapeModel::train(&truth.set, &TrainOptions::default(), &Silent).unwrap().0;
    for job in jobs {
        let Ok(Outcome::ImportedGarment(learned)) = run(&Job::GarmentImport(job.clone()), &|_| {}) else { panic!() };
        assert_eq!((learned.simulated.bodies, learned.simulated.sequences), (7, 3));
        assert_eq!((learned.simulated.frames, learned.simulated.dropped.len()), (3 * FRAMES, 0));
        assert_eq!(learned.evaluated.mean_body.frames, FRAMES, "one of three motions is held out");
        truth.compare(&job.training);
        alike(&direct, &DrapeModel::load(&job.out).unwrap(), &truth);
    }
    is_resumed(&import(&folder("npz"), "sims", None));
}

/// Two models make the same garment.
fn alike(a: &DrapeModel, b: &DrapeModel, truth: &Truth) {
    let made = |model: &DrapeModel| -> Vec<Vec3> {
        let mut synthesis = Synthesis::new(Arc::new(model.clone()), &[0.5, -1.0], truth.standing[0].len()).unwrap();
        let frames = truth.set.sequences[1].motion.frames.iter().zip(&truth.moving[1]);
        frames.flat_map(|(pose, body)| synthesis.step(pose, body).to_vec()).collect()
    };
    let (a, b) = (made(a), made(b));
    let off: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a.distance(*b)).collect();
    // The bases are kept in eight bits: what the files round may tip a step of them, which moves some vertices by a millimetre.
    let (mean, most) = (off.iter().sum::<f64>() / off.len() as f64, off.iter().copied().fold(0.0, f64::max));
    assert!(mean < 5e-4 && most < 2.5e-3, "{mean} m, {most} m");
}

/// A second run keeps the motions of the first and writes the same model.
fn is_resumed(job: &GarmentImport) {
    let pose = job.training.join("pose-walk.npz");
    let (kept, learned) = (read_bytes(&pose).unwrap(), DrapeModel::load(&job.out).unwrap());
    // What is finished is not looked into again.
    modiste_io::write_bytes(&pose, &[&kept[..], b" "].concat()).unwrap();
    let spoilt: PathBuf = job.training.join("pose-turn.npz");
    modiste_io::remove_file(&spoilt).unwrap();
    run(&Job::GarmentImport(job.clone()), &|_| {}).unwrap();
    assert_eq!(read_bytes(&pose).unwrap().len(), kept.len() + 1);
    assert!(modiste_io::exists(&spoilt), "what is missing is made again");
    let again = DrapeModel::load(&job.out).unwrap();
    let [learned, again] = [learned, again].map(|model| model.evaluation.unwrap());
    assert_eq!(again.mean_body.len(), 1);
    // How long learning took differs from run to run, and is written beside them.
    assert_eq!(again.mean_body, learned.mean_body);
}
