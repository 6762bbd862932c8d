//! Captured motions on a body, compared with what the file itself says.

#![expect(clippy::unwrap_used, reason = "the helpers of a test fail as the test does")]

use std::path::{Path, PathBuf};
use std::sync::Arc;

use modiste::{Assets, Gender, MotionChoice};
use modiste_body::{Body, Motion, Part, ScapeModel};
use modiste_core::{Affine3, Mat3, Silent, Vec3};
use modiste_io::bvh::{self, BvhClip, Channel};

/// Frames that every clip begins with and that are left out: the calibration pose.
const SKIPPED: usize = 4;

fn body() -> Body {
    let model: Arc<ScapeModel> = ScapeModel::load(Assets::find().unwrap().body(Gender::Female)).unwrap();
    model.body(&[]).unwrap()
}

/// The captured clips beside the repository; says so and gives none where they are absent.
fn clips() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/mocap");
    if !folder.is_dir() {
        eprintln!("skipped: there is no ../shared/data/mocap");
        return Vec::new();
    }
    let files = modiste_io::list_folder(folder).unwrap();
    files.into_iter().filter(|path| path.to_string_lossy().ends_with(".bvh.gz")).collect()
}

fn carried(path: &Path, body: &Body) -> Motion {
    MotionChoice::File(path.to_path_buf()).motion(body, None, 30.0, &Silent).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn every_clip_stands_on_the_floor_and_starts_above_the_origin() {
    let body = body();
    let mut vertices = Vec::new();
    for path in clips() {
        let motion = carried(&path, &body);
        let name = path.display();
        assert!(motion.frames.iter().all(modiste_body::Pose::is_finite), "{name}");
        let start = motion.frames[0].root_translation;
        assert!(start.x.hypot(start.z) < 0.01, "{name} starts at {start}");
        let ahead = motion.frames[0].rotation(Part::Pelvis) * Vec3::Z;
        assert!(ahead.x.abs() < 0.3, "{name} faces {ahead}");
        let step = (motion.frames.len() / 6).max(1);
        let lowest = motion.frames.iter().step_by(step).map(|pose| {
            body.pose(pose, &mut vertices);
            vertices.iter().map(|vertex| vertex.y).fold(f64::INFINITY, f64::min)
        });
        let lowest = lowest.fold(f64::INFINITY, f64::min);
        assert!((-0.05..0.05).contains(&lowest), "{name}: the lowest point of some frames is at {lowest} m");
    }
}

/// World positions of all joints in one frame: plain forward kinematics of the file.
fn joints(clip: &BvhClip, frame: usize) -> Vec<Vec3> {
    let mut world: Vec<Affine3> = Vec::new();
    for joint in &clip.joints {
        let (mut shift, mut turn) = (joint.offset, Mat3::IDENTITY);
        for (channel, value) in joint.channels.iter().zip(&clip.frames[frame][joint.first_channel..]) {
            let angle = value.to_radians();
            match channel {
                Channel::XPosition => shift.x = joint.offset.x + value,
                Channel::YPosition => shift.y = joint.offset.y + value,
                Channel::ZPosition => shift.z = joint.offset.z + value,
                Channel::XRotation => turn *= Mat3::from_rotation_x(angle),
                Channel::YRotation => turn *= Mat3::from_rotation_y(angle),
                Channel::ZRotation => turn *= Mat3::from_rotation_z(angle),
            }
        }
        let local = Affine3::from_mat3_translation(turn, shift);
        world.push(joint.parent.map_or(local, |parent| world[parent] * local));
    }
    world.iter().map(|transform| transform.translation).collect()
}

#[test]
fn limbs_point_where_the_file_says() {
    let body = body();
    let bones = [
        ("LeftUpLeg", "LeftLeg", Part::LeftThigh, Part::LeftShin),
        ("RightUpLeg", "RightLeg", Part::RightThigh, Part::RightShin),
        ("LeftLeg", "LeftFoot", Part::LeftShin, Part::LeftFoot),
        ("RightLeg", "RightFoot", Part::RightShin, Part::RightFoot),
        ("LeftForeArm", "LeftHand", Part::LeftForearm, Part::LeftHand),
        ("RightForeArm", "RightHand", Part::RightForearm, Part::RightHand),
    ];
    for path in clips().iter().filter(|path| path.to_string_lossy().contains("walk_02_01")) {
        let clip = bvh::read(path).unwrap();
        let motion = carried(path, &body);
        let place = |name: &str| clip.joints.iter().position(|joint| joint.name == name).unwrap();
        let mut differences = Vec::new();
        for (index, pose) in motion.frames.iter().enumerate() {
            let seconds = index as f64 / motion.fps;
            let frame = SKIPPED + (seconds / clip.frame_time).round() as usize;
            if frame >= clip.frames.len() {
                break;
            }
            let theirs = joints(&clip, frame);
            let ours = body.joints(pose);
            // A turn about the vertical, which retargeting is free to choose, leaves the height of a direction alone.
            for (near, far, part, end) in bones {
                let rise = |from: Vec3, to: Vec3| (to - from).normalize().y.clamp(-1.0, 1.0).asin().to_degrees();
                let wanted = rise(theirs[place(near)], theirs[place(far)]);
                differences.push((rise(ours[part.index()], ours[end.index()]) - wanted).abs());
            }
        }
        differences.sort_by(f64::total_cmp);
        let (median, most) = (differences[differences.len() / 2], differences[differences.len() * 95 / 100]);
        assert!(median < 3.0 && most < 12.0, "{}: median {median}°, 95% {most}°", path.display());
    }
}
