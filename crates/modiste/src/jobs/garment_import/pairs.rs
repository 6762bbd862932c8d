//! Which garment sequence belongs to which body.

use std::path::PathBuf;

use modiste_body::motion::{RetargetOptions, retarget};
use modiste_body::{Body, Motion, ScapeModel};
use modiste_core::{Progress, Vec3};
use modiste_io::bvh;
use modiste_io::sequence::{MeshSequence, SequenceFiles, gather};

use super::UpAxis;
use super::place::Frame;
use crate::JobError;

/// Arrays that hold a body in an npz, and a garment beside one of its own name.
const BODY_ARRAYS: [&str; 2] = ["body", "vertices"];
const GARMENT_ARRAY: &str = "vertices";

/// A garment sequence with its body.
#[derive(Debug, Clone)]
pub(super) struct Pair {
    pub(super) name: String,
    garment: SequenceFiles,
    body: SequenceFiles,
}

/// Pairs sequences with the bodies of their names; one sequence and one body belong together whatever they are called. An npz
/// may hold its own body in the array `body`.
///
/// # Errors
/// Files that make no sequence, or a sequence without a body.
pub(super) fn pairs(sequences: &[PathBuf], bodies: &[PathBuf], progress: &dyn Progress) -> Result<Vec<Pair>, JobError> {
    let (sequences, bodies) = (gather(sequences)?, gather(bodies)?);
    if sequences.is_empty() {
        return Err(JobError::Request("--sequence: at least one npz, pc2 or OBJ file was wanted, found none".into()));
    }
    let mut found = Vec::new();
    let mut used = vec![false; bodies.len()];
    for garment in sequences {
        let of_name = bodies.iter().position(|body| body.name == garment.name);
        let index =
            if found.is_empty() && bodies.len() == 1 && used.len() == 1 { of_name.or(Some(0)) } else { of_name };
        let body = match index {
            Some(index) => {
                used[index] = true;
                bodies[index].clone()
            }
            None if has_body(&garment) => garment.clone(),
            None => {
                let names: Vec<&str> = bodies.iter().map(|body| body.name.as_str()).collect();
                let names = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
                return Err(JobError::Request(format!(
                    "{}: wanted a body called `{}` among --bodies, or an array \"body\" in the same npz, found {names}",
                    garment.file().display(),
                    garment.name
                )));
            }
        };
        found.push(Pair { name: garment.name.clone(), garment, body });
    }
    for (body, _) in bodies.iter().zip(&used).filter(|(_, used)| !**used) {
        progress.warn(&format!("{}: no sequence is called `{}`, so it is not used", body.file().display(), body.name));
    }
    Ok(found)
}

fn has_body(files: &SequenceFiles) -> bool {
    files.file().extension().is_some_and(|ending| ending == "npz") && files.open(&BODY_ARRAYS[..1]).is_ok()
}

/// The frames of a garment and how its body moves.
#[derive(Debug)]
pub(super) struct Opened {
    pub(super) garment: MeshSequence,
    pub(super) body: OpenedBody,
    pub(super) fps: f64,
}

/// A body as meshes, or as a motion of the mean body.
#[derive(Debug)]
pub(super) enum OpenedBody {
    Meshes(MeshSequence),
    Motion(Motion),
}

impl Pair {
    /// The file of the garment, for errors.
    pub(super) fn file(&self) -> String {
        self.garment.file().display().to_string()
    }

    /// The file of the body, for errors.
    pub(super) fn body_file(&self) -> String {
        self.body.file().display().to_string()
    }

    /// The bytes of all files, for a hash.
    pub(super) fn bytes(&self) -> Result<Vec<u8>, JobError> {
        Ok([self.garment.bytes()?, self.body.bytes()?].concat())
    }

    /// Opens both, and checks that they have the same number of frames and that the body is one of ours.
    pub(super) fn open(
        &self,
        name: &str,
        fps: Option<f64>,
        mean: &Body,
        progress: &dyn Progress,
    ) -> Result<Opened, JobError> {
        let garment = self.garment.open(&[name, GARMENT_ARRAY])?;
        let told = |body: Option<f64>| garment.fps().or(body).or(fps).unwrap_or(super::DEFAULT_FPS);
        let (body, fps, frames) = if self.body.is_bvh() {
            let fps = told(None);
            let options = RetargetOptions { fps, ..RetargetOptions::default() };
            let clip = bvh::read(self.body.file())?;
            let motion = retarget(&clip, mean, &options, progress).map_err(JobError::in_file(self.body.file()))?;
            let frames = motion.frames.len();
            (OpenedBody::Motion(motion), fps, frames)
        } else {
            let body = self.body.open(&BODY_ARRAYS)?;
            check_body(&body, mean.model())?;
            let (fps, frames) = (told(body.fps()), body.frame_count());
            (OpenedBody::Meshes(body), fps, frames)
        };
        if !(1.0..=1000.0).contains(&fps) {
            return Err(JobError::Request(format!("{}: wanted 1 to 1000 frames a second, found {fps}", self.file())));
        }
        if frames != garment.frame_count() {
            return Err(JobError::Request(format!(
                "{}: wanted as many frames as {} has, {frames}, found {}",
                self.file(),
                self.body_file(),
                garment.frame_count()
            )));
        }
        Ok(Opened { garment, body, fps })
    }
}

fn check_body(body: &MeshSequence, model: &ScapeModel) -> Result<(), JobError> {
    let topology = model.topology();
    let wrong = |wanted: String, found: usize| {
        Err(JobError::Request(format!(
            "{}: wanted the {wanted} of this project's bodies, found {found}; simulate on a body that `modiste body make` or \
             `modiste dress` writes",
            body.file()
        )))
    };
    if body.vertex_count() != topology.vertex_count() {
        return wrong(format!("{} vertices", topology.vertex_count()), body.vertex_count());
    }
    match body.faces() {
        Some(faces) if faces != topology.faces() => wrong(format!("{} triangles", topology.face_count()), faces.len()),
        _ => Ok(()),
    }
}

impl Opened {
    /// The unit of the files, as far as the body tells.
    pub(super) fn frame_of(&self, model: &ScapeModel, up: UpAxis) -> Result<Frame, JobError> {
        match &self.body {
            OpenedBody::Meshes(body) => Frame::of_body(model, &body.frame(0)?, up, body.file()),
            OpenedBody::Motion(_) => Ok(Frame::metres(up)),
        }
    }

    /// The vertices of the garment in one frame (m).
    pub(super) fn cloth(&self, frame: usize, place: Frame) -> Result<Vec<Vec3>, JobError> {
        Ok(place.all(self.garment.frame(frame)?))
    }

    /// Some vertices of the body (m), one list per frame; none where the body is a motion.
    pub(super) fn body_vertices(&self, vertices: &[u32], place: Frame) -> Result<Option<Vec<Vec<Vec3>>>, JobError> {
        let OpenedBody::Meshes(body) = &self.body else { return Ok(None) };
        let frame = |frame| Ok(super::taken(&place.all(body.frame(frame)?), vertices));
        (0..body.frame_count()).map(frame).collect::<Result<_, JobError>>().map(Some)
    }
}
