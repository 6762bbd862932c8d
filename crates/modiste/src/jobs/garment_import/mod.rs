//! Physics done elsewhere becomes a learned garment.

mod measure;
mod pairs;
mod place;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use modiste_body::recover::{PoseFinder, ShapeFinder};
use modiste_body::{Body, Gender, Motion, Pose, ScapeModel};
use modiste_cloth::dress::{Carrier, Mannequin, ReadyMade};
use modiste_cloth::training_set::{ImportedMotion, ImportedShape, Importer};
use modiste_core::{Progress, Vec3};
use modiste_garment::{DrapeModel, TrainOptions, TrainingSet};
use modiste_io::obj;
use rayon::prelude::*;

use super::{EvaluatedGarment, LearnedGarment, SimulatedGarment};
use crate::event::Reporter;
use crate::{Assets, JobError};
use pairs::{Opened, OpenedBody, Pair, pairs};
use place::Frame;

/// Frames a second where neither file nor request says so.
const DEFAULT_FPS: f64 = 30.0;

/// A body is in the template pose, or in a pose of the mean body, if its vertices are nearer than this (m, root mean square).
const SAME_BODY: f64 = 0.003;

/// Shape coefficients below this (root mean square) are those of the mean body.
const MEAN_SHAPE: f64 = 0.02;

/// Fewest bodies that a garment's shape can be learned from.
const FEWEST_BODIES: usize = 3;

/// Fewest frames of a motion.
const FEWEST_FRAMES: usize = 12;

/// Which way is up in the files.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum UpAxis {
    /// Y, as this project has it and most programs write OBJ.
    #[default]
    Y,
    /// Z, as in Blender's own coordinates; the body faces -Y.
    Z,
}

/// Learns a garment from sequences that another program simulated, measures it and writes the model with its figures inside.
///
/// Each sequence is the garment, as one mesh throughout, on a body of this project: single frames (or several) in the
/// template pose on bodies of other shapes, and motions of the mean body. Shapes and poses are found from the bodies'
/// vertices. What an interrupted run read is kept.
#[derive(Debug, Clone, PartialEq)]
pub struct GarmentImport {
    /// Whose bodies.
    pub gender: Gender,
    /// What the garment is called.
    pub name: String,
    /// Garment sequences: npz, pc2, OBJ files with numbers, or folders of them.
    pub sequences: Vec<PathBuf>,
    /// Their bodies, of the same names: the same kinds of files, or BVH for motions of the mean body.
    pub bodies: Vec<PathBuf>,
    /// The garment's mesh on the mean body in the template pose; otherwise the frame on the body nearest to it. Needed where
    /// all sequences are point caches, which have no faces.
    pub mesh: Option<PathBuf>,
    /// Frames a second of files that do not say so.
    pub fps: Option<f64>,
    /// Which way is up in the files.
    pub up: UpAxis,
    /// The folder for the training set.
    pub training: PathBuf,
    /// The model file.
    pub out: PathBuf,
}

/// A motion still in its files.
struct MotionFiles {
    pair: Pair,
    frames: usize,
}

/// What the files hold.
struct Found {
    shapes: Vec<ImportedShape>,
    motions: Vec<MotionFiles>,
    faces: Vec<[u32; 3]>,
    place: Frame,
}

impl GarmentImport {
    pub(crate) fn run(&self, reporter: &Reporter<'_>) -> Result<LearnedGarment, JobError> {
        modiste_io::check_writable(&self.out)?;
        modiste_io::check_writable(self.training.join("manifest.json"))?;
        let started = Instant::now();
        let pairs = pairs(&self.sequences, &self.bodies, reporter)?;
        let model = ScapeModel::load(Assets::find()?.body(self.gender))?;
        let mean = model.body(&[])?;
        let mut found = self.read(&model, &mean, pairs, reporter)?;
        found.check()?;
        let (garment, sources) = self.garment(&model, &found)?;
        for imported in &mut found.shapes {
            imported.vertices = taken(&imported.vertices, &sources);
        }
        let template = on_mean_body(&found.shapes, &garment, &model)?;
        let importer = Importer::new(&model, &garment, &template, &self.training)?;
        importer.write_shapes(&found.shapes)?;
        self.motions(&importer, &found, &sources, reporter)?;
        let names: Vec<String> = found.motions.iter().map(|motion| motion.pair.name.clone()).collect();
        let summary = importer.finish(&names)?;
        if summary.sequences == 0 {
            let why = summary.dropped.first().map_or("", |dropped| dropped.why.as_str());
            return Err(JobError::Request(format!("{}: every motion was left out; {why}", self.name)));
        }
        let simulated = SimulatedGarment {
            folder: self.training.clone(),
            bodies: summary.bodies,
            sequences: summary.sequences,
            frames: summary.frames,
            dropped: summary.dropped.iter().map(|part| format!("{}: {}", part.name, part.why)).collect(),
        };
        let set = TrainingSet::load(&self.training)?;
        let mut evaluation = measure::held_out(&set, &mean, reporter)?;
        let (mut learned, _) = DrapeModel::train(&set, &TrainOptions::default(), reporter)?;
        evaluation.training_seconds = started.elapsed().as_secs_f64();
        learned.provenance.licence = "that of the simulation that it was learned from".to_owned();
        learned.provenance.command =
            format!("modiste garment import --gender {} --name {}", self.gender.name(), self.name);
        learned.evaluation = Some(evaluation.clone());
        learned.save(&self.out)?;
        reporter.wrote(&self.out);
        let evaluated = EvaluatedGarment::of(&learned, evaluation, modiste_io::file_size(&self.out)?);
        Ok(LearnedGarment { file: self.out.clone(), simulated, evaluated })
    }

    /// Opens every pair once: keeps the garment where the body stands in the template pose, and remembers the motions.
    fn read(
        &self,
        model: &Arc<ScapeModel>,
        mean: &Body,
        pairs: Vec<Pair>,
        reporter: &Reporter<'_>,
    ) -> Result<Found, JobError> {
        let stage = format!("{} {}: read", self.gender.name(), self.name);
        reporter.start(&stage, pairs.len());
        let finder = ShapeFinder::new(model);
        let (mut shapes, mut motions) = (Vec::new(), Vec::new());
        let mut faces: Option<Vec<[u32; 3]>> = None;
        let mut first: Option<(Frame, f64, usize, String)> = None;
        for (index, pair) in pairs.into_iter().enumerate() {
            let opened = pair.open(&self.name, self.fps, mean, reporter)?;
            let place = opened.frame_of(model, self.up)?;
            let alike = (place, opened.fps, opened.garment.vertex_count(), pair.file());
            check_alike(first.get_or_insert_with(|| alike.clone()), &alike)?;
            if let Some(own) = opened.garment.faces() {
                let known = faces.get_or_insert_with(|| own.to_vec());
                if *known != own {
                    let (wanted, found) = (known.len(), own.len());
                    return Err(JobError::Request(format!(
                        "{}: wanted the same {wanted} triangles as in the other sequences, found {found} others",
                        pair.file()
                    )));
                }
            }
            match standing(&pair, &opened, place, &finder)? {
                Some(found) => shapes.extend(found),
                None => motions.push(MotionFiles { frames: opened.garment.frame_count(), pair }),
            }
            reporter.advance(&stage, index + 1);
        }
        reporter.finish(&stage);
        let Some((place, ..)) = first else {
            return Err(JobError::Request("--sequence: at least one file was wanted, found none".into()));
        };
        if place.unit != Frame::metres(self.up).unit {
            reporter.warn(&format!("the files are taken to be in {}, as the bodies in them are so large", place.unit));
        }
        Ok(Found { shapes, motions, faces: faces.unwrap_or_default(), place })
    }

    /// The mesh with its parts, band and anchors, and the vertex of the files that each of its vertices is.
    fn garment(&self, model: &Arc<ScapeModel>, found: &Found) -> Result<(ReadyMade, Vec<u32>), JobError> {
        let mean = Mannequin::from(&model.body(&[])?);
        let named = (self.name.as_str(), self.gender, "jersey");
        let nearest = &found.shapes[nearest_to_mean(&found.shapes)];
        let Some(path) = &self.mesh else {
            if found.faces.is_empty() {
                return Err(JobError::Request(format!(
                    "{}: wanted the faces of the garment, found none; name an OBJ of it on the mean body by --mesh",
                    nearest.name
                )));
            }
            let body = Mannequin::from(&model.body(&nearest.shape)?);
            return Ok(ReadyMade::with_sources(named, &nearest.vertices, &found.faces, &body, &mean)?);
        };
        let (vertices, faces) = obj::read(path)?;
        let name = path.display();
        if vertices.len() != nearest.vertices.len() {
            return Err(JobError::Request(format!(
                "{name}: wanted the {} vertices of the sequences, found {}",
                nearest.vertices.len(),
                vertices.len()
            )));
        }
        if !found.faces.is_empty() && faces != found.faces {
            let (wanted, faces) = (found.faces.len(), faces.len());
            return Err(JobError::Request(format!(
                "{name}: wanted the {wanted} triangles of the sequences, found {faces} others"
            )));
        }
        let vertices = found.place.all(vertices);
        Ok(ReadyMade::with_sources(named, &vertices, &faces, &mean, &mean)?)
    }

    /// Finds the poses of all motions and keeps them with their frames, one motion a core.
    fn motions(
        &self,
        importer: &Importer,
        found: &Found,
        sources: &[u32],
        reporter: &Reporter<'_>,
    ) -> Result<(), JobError> {
        let stage = format!("{} {}: frames", self.gender.name(), self.name);
        reporter.start(&stage, found.motions.iter().map(|motion| motion.frames).sum());
        let done = AtomicUsize::new(0);
        let advance = || reporter.advance(&stage, done.fetch_add(1, Ordering::Relaxed) + 1);
        // Longest first, so that no core ends with a long one alone.
        let mut order: Vec<&MotionFiles> = found.motions.iter().collect();
        order.sort_by_key(|motion| std::cmp::Reverse(motion.frames));
        order.par_iter().with_max_len(1).try_for_each(|files| {
            let mut bytes = files.pair.bytes()?;
            bytes.extend(format!("{:?} {:?} {:?}", found.place, self.fps, sources.len()).into_bytes());
            let inputs = importer.inputs(&bytes);
            drop(bytes);
            if importer.has_motion(&files.pair.name, &inputs) {
                (0..files.frames).for_each(|_| advance());
                return Ok(());
            }
            let opened = files.pair.open(&self.name, self.fps, importer.body(), reporter)?;
            let motion = self.poses(&files.pair, &opened, found.place, importer.body(), &advance)?;
            let frames = (0..files.frames)
                .map(|frame| Ok(taken(&opened.cloth(frame, found.place)?, sources)))
                .collect::<Result<Vec<_>, JobError>>()?;
            let name = files.pair.name.clone();
            let body_anchors = opened.body_vertices(&importer.anchor_vertices().collect::<Vec<_>>(), found.place)?;
            importer.add_motion(ImportedMotion { name, motion, frames, body_anchors }, inputs, reporter)?;
            Ok::<(), JobError>(())
        })?;
        reporter.finish(&stage);
        Ok(())
    }

    /// The poses of the mean body in a motion.
    fn poses(
        &self,
        pair: &Pair,
        opened: &Opened,
        place: Frame,
        mean: &Body,
        advance: &dyn Fn(),
    ) -> Result<Motion, JobError> {
        let meshes = match &opened.body {
            OpenedBody::Motion(motion) => {
                motion.frames.iter().for_each(|_| advance());
                return Ok(motion.clone());
            }
            OpenedBody::Meshes(meshes) => meshes,
        };
        let finder = PoseFinder::new(mean);
        let mut frames: Vec<Pose> = Vec::new();
        for frame in 0..meshes.frame_count() {
            let found = finder.find(&place.all(meshes.frame(frame)?), frames.last())?;
            if !(found.rms <= SAME_BODY) {
                let (file, gender, off) = (pair.body_file(), self.gender.name(), 1e3 * found.rms);
                return Err(JobError::Request(format!(
                    "{file}, frame {frame}: wanted the mean {gender} body in motion (`modiste body make --shape 0` writes it), \
                     found one {off:.1} mm off in the nearest pose"
                )));
            }
            let lies = (found.pose.rotation(modiste_body::Part::Pelvis) * Vec3::Y).y < 0.3;
            if frame == 0 && lies && self.up == UpAxis::Y && self.lies_throughout(meshes, place)? {
                return Err(JobError::Request(format!(
                    "{}: wanted a body that stands, found one that lies in every frame; if Z is up in the files, say --up z",
                    pair.body_file()
                )));
            }
            frames.push(found.pose);
            advance();
        }
        Ok(Motion { fps: opened.fps, frames })
    }

    /// Whether a body is never as high as it is deep: Z was up where the files were written.
    fn lies_throughout(&self, meshes: &modiste_io::sequence::MeshSequence, place: Frame) -> Result<bool, JobError> {
        for frame in 0..meshes.frame_count() {
            let (low, high) = modiste_core::bounds(&place.all(meshes.frame(frame)?)).unwrap_or_default();
            if high.y - low.y > high.z - low.z {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

/// The garment on each body of a sequence if all of them stand in the template pose in different shapes; none for a motion.
fn standing(
    pair: &Pair,
    opened: &Opened,
    place: Frame,
    finder: &ShapeFinder<'_>,
) -> Result<Option<Vec<ImportedShape>>, JobError> {
    let OpenedBody::Meshes(meshes) = &opened.body else { return Ok(None) };
    let count = meshes.frame_count();
    let mut shapes = Vec::new();
    for frame in 0..count {
        let found = finder.find(&place.all(meshes.frame(frame)?))?;
        if !(found.rms <= SAME_BODY) {
            if count > 1 {
                return Ok(None);
            }
            return Err(JobError::Request(format!(
                "{}: wanted a body in the template pose in a single frame, as `modiste body make` writes it, found one {:.1} mm \
                 off; if Z is up in the files, say --up z",
                pair.body_file(),
                1e3 * found.rms
            )));
        }
        let cloth = opened.cloth(frame, place)?;
        let vertices = cloth.iter().map(|x| *x - found.translation).collect();
        let name = if count > 1 { format!("{}, frame {frame}", pair.file()) } else { pair.file() };
        shapes.push(ImportedShape { name, shape: found.shape, vertices });
    }
    let stays_mean = count > 1 && shapes.iter().all(|imported| size_of(&imported.shape) < MEAN_SHAPE);
    Ok((!stays_mean).then_some(shapes))
}

impl Found {
    /// Refuses too little to learn from.
    fn check(&self) -> Result<(), JobError> {
        if self.shapes.len() < FEWEST_BODIES {
            return Err(JobError::Request(format!(
                "--sequence: wanted the garment on at least {FEWEST_BODIES} bodies of different shape in the template pose, \
                 found {}; `modiste body make --shape …` writes such bodies",
                self.shapes.len()
            )));
        }
        let longest = self.motions.iter().map(|motion| motion.frames).max().unwrap_or(0);
        if longest < FEWEST_FRAMES {
            return Err(JobError::Request(format!(
                "--sequence: wanted the garment on the mean body in at least one motion of {FEWEST_FRAMES} frames, found \
                 {longest} frames"
            )));
        }
        Ok(())
    }
}

/// All sequences have one unit, rate and mesh.
fn check_alike(first: &(Frame, f64, usize, String), other: &(Frame, f64, usize, String)) -> Result<(), JobError> {
    let wrong = |what: &str, wanted: String, found: String| {
        Err(JobError::Request(format!("{}: wanted {wanted} {what} as in {}, found {found}", other.3, first.3)))
    };
    if other.2 != first.2 {
        return wrong("vertices", first.2.to_string(), other.2.to_string());
    }
    if other.0 != first.0 {
        return wrong("as unit", first.0.unit.to_owned(), other.0.unit.to_owned());
    }
    if (other.1 - first.1).abs() > 1e-6 {
        return wrong("frames a second", first.1.to_string(), other.1.to_string());
    }
    Ok(())
}

/// Root mean square of shape coefficients.
fn size_of(shape: &[f64]) -> f64 {
    (shape.iter().map(|beta| beta * beta).sum::<f64>() / shape.len().max(1) as f64).sqrt()
}

/// The shape nearest to the mean; there is one.
fn nearest_to_mean(shapes: &[ImportedShape]) -> usize {
    let sizes = shapes.iter().map(|imported| size_of(&imported.shape)).enumerate();
    sizes.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(index, _)| index)
}

/// The garment on the mean body (m): as simulated, or carried over from the nearest other.
fn on_mean_body(shapes: &[ImportedShape], garment: &ReadyMade, model: &Arc<ScapeModel>) -> Result<Vec<Vec3>, JobError> {
    let nearest = &shapes[nearest_to_mean(shapes)];
    if size_of(&nearest.shape) < MEAN_SHAPE {
        return Ok(nearest.vertices.clone());
    }
    let (body, mean) = (model.body(&nearest.shape)?, model.body(&[])?);
    let (from, to) = (body.rest_vertices(), mean.rest_vertices());
    Ok(Carrier::new(&nearest.vertices, from).carry(garment.topology(), &nearest.vertices, from, to))
}

fn taken(vertices: &[Vec3], sources: &[u32]) -> Vec<Vec3> {
    sources.iter().map(|&source| vertices[source as usize]).collect()
}
