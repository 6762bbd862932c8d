//! Making a training set: bodies and motions in parallel, each finished part kept.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use modiste_body::ScapeModel;
use modiste_core::{Progress, Vec3};
use rayon::prelude::*;

use super::folder::{Entry, Folder, Manifest, SCHEMA, ShapePiece};
use super::wardrobe::simulated_frames;
use super::{Sequence, TrainingError, Wardrobe, draw_eases, draw_shapes};
use crate::dress::{Design, TailorOptions};

pub use super::folder::Dropped;

/// What a training set is made of.
#[derive(Debug, Clone)]
pub struct TrainingOptions {
    /// The garment.
    pub design: Design,
    /// How many bodies of random shape are dressed.
    pub body_count: usize,
    /// How many shape coefficients vary.
    pub dimensions: usize,
    /// Seed of the shapes.
    pub seed: u64,
    /// How bodies are dressed.
    pub tailor: TailorOptions,
}

impl TrainingOptions {
    /// The usual set of a garment: 90 bodies of 20 coefficients.
    pub fn new(design: impl Into<Design>) -> Self {
        Self { design: design.into(), body_count: 90, dimensions: 20, seed: 1, tailor: TailorOptions::default() }
    }
}

/// What was made.
#[derive(Debug, Clone, Default)]
pub struct Summary {
    /// Dressed bodies.
    pub bodies: usize,
    /// Motions.
    pub sequences: usize,
    /// Frames of all motions, lead-ins left out.
    pub frames: usize,
    /// What was left out, and why.
    pub dropped: Vec<Dropped>,
}

/// Name of the hash of a pattern in all its cuts, which the bodies depend on and the motions do not.
const CUTS: &str = "cuts";

/// Spare bodies drawn for those that are dropped, as a share.
const SPARE_SHARE: f64 = 0.25;

/// Dresses random bodies, with a random ease each where the garment is drawn in several cuts, and simulates the mean body
/// through `sequences`, into `folder`.
///
/// One simulation runs per thread of the current rayon pool. A part that an earlier run finished from the same inputs is
/// kept. The result does not depend on the number of threads.
///
/// # Errors
/// A mean body that cannot be dressed, files that cannot be written, or no body left.
pub fn generate(
    model: &Arc<ScapeModel>,
    sequences: &[Sequence],
    options: &TrainingOptions,
    folder: &Path,
    progress: &dyn Progress,
) -> Result<Summary, TrainingError> {
    let title = format!("{} {}", model.gender().name(), options.design.garment());
    let stage = format!("{title}: first body");
    progress.start(&stage, 1);
    let wardrobe = Wardrobe::new(model, options.design.clone(), options.tailor.clone())?;
    progress.finish(&stage);
    let path = folder;
    let folder = Folder::create(path)?;
    let mut manifest = new_manifest(&wardrobe, options);
    if let Some(found) = folder.read_manifest()? {
        found.check_same(&manifest, path)?;
        manifest.sequences = found.sequences;
    }
    folder.write_garment(&wardrobe)?;
    folder.write_manifest(&manifest)?;
    let maker = Maker { wardrobe: &wardrobe, folder: &folder, manifest: Mutex::new(manifest), title: &title, progress };
    maker.motions(sequences)?;
    maker.bodies(options)?;
    let mut manifest = maker.manifest.into_inner().unwrap_or_else(PoisonError::into_inner);
    // Motions that are no longer asked for do not belong to the set.
    manifest.sequences.retain(|e| e.kind == "shape" || sequences.iter().any(|s| s.name == e.name));
    folder.write_manifest(&manifest)?;
    Ok(manifest.summary())
}

impl Manifest {
    /// What is there.
    pub(super) fn summary(&self) -> Summary {
        let kind = |kind: &'static str| self.sequences.iter().filter(move |e| e.kind == kind);
        Summary {
            bodies: kind("shape").map(|e| e.frames).sum(),
            sequences: kind("pose").count(),
            frames: kind("pose").map(|e| e.frames - e.lead_in).sum(),
            dropped: self.dropped.clone(),
        }
    }
}

fn new_manifest(wardrobe: &Wardrobe, options: &TrainingOptions) -> Manifest {
    let design = wardrobe.tailor().design();
    // Motions are simulated in the regular cut: they need not be done again where others change.
    let regular = match design {
        Design::Pattern(pattern) => pattern.regular().to_json(),
        Design::ReadyMade(_) => design.to_json(),
    };
    let points = |x: &[Vec3]| -> Vec<u8> { x.iter().flat_map(|v| v.to_array()).flat_map(f64::to_le_bytes).collect() };
    let hashes = [
        ("pattern", modiste_io::hash(regular.as_bytes())),
        (CUTS, modiste_io::hash(design.to_json().as_bytes())),
        ("body", modiste_io::hash(&points(&wardrobe.mean().vertices))),
        ("template", modiste_io::hash(&points(&wardrobe.template().state.positions))),
        ("options", modiste_io::hash(format!("{:?}", options.tailor).as_bytes())),
    ];
    Manifest {
        schema: SCHEMA.to_owned(),
        garment: design.garment().to_owned(),
        gender: design.gender().to_owned(),
        seed: options.seed,
        units: "metres, radians".to_owned(),
        fabric: design.material().to_owned(),
        vertex_count: Some(options.tailor.vertex_count),
        hashes: BTreeMap::from(hashes.map(|(name, hash)| (name.to_owned(), hash))),
        sequences: Vec::new(),
        dropped: Vec::new(),
    }
}

struct Maker<'a> {
    wardrobe: &'a Wardrobe,
    folder: &'a Folder,
    manifest: Mutex<Manifest>,
    title: &'a str,
    progress: &'a dyn Progress,
}

impl Maker<'_> {
    fn manifest(&self) -> std::sync::MutexGuard<'_, Manifest> {
        self.manifest.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Hash of everything that a part is made from: the set's own inputs, the outer cuts left out, and `more`.
    fn inputs(&self, more: &[u8]) -> String {
        let manifest = self.manifest();
        let shared = manifest.hashes.iter().filter(|(name, _)| *name != CUTS);
        let mut bytes: Vec<u8> = shared.flat_map(|(_, hash)| hash.bytes()).collect();
        bytes.extend_from_slice(more);
        modiste_io::hash(&bytes)
    }

    /// [`Self::inputs`] of what is dressed in all cuts.
    fn inputs_in_cuts(&self, more: &str) -> String {
        let cuts = if self.wardrobe.tailor().has_ease() { self.manifest().hashes[CUTS].clone() } else { String::new() };
        self.inputs(format!("{more}{cuts}").as_bytes())
    }

    fn drop_part(&self, name: String, error: &TrainingError) {
        self.progress.warn(&format!("{}: {name} is left out: {error}", self.title));
        let mut manifest = self.manifest();
        manifest.dropped.push(Dropped { name, why: error.to_string() });
        manifest.dropped.sort_by(|a, b| a.name.cmp(&b.name));
    }

    fn motions(&self, sequences: &[Sequence]) -> Result<(), TrainingError> {
        let body = self.wardrobe.model().body(&[])?;
        let stage = format!("{}: frames", self.title);
        self.progress.start(&stage, sequences.iter().map(|s| simulated_frames(&s.motion)).sum());
        let done = AtomicUsize::new(0);
        let frame_done = || self.progress.advance(&stage, done.fetch_add(1, Ordering::Relaxed) + 1);
        // Longest first, so that no core ends with a long one alone.
        let mut order: Vec<&Sequence> = sequences.iter().collect();
        order.sort_by_key(|s| std::cmp::Reverse(s.motion.frames.len()));
        order.par_iter().with_max_len(1).try_for_each(|sequence| {
            let inputs = self.inputs(&motion_bytes(sequence));
            if self.manifest().is_finished(&sequence.name, &inputs) && self.folder.has_sequence(&sequence.name) {
                (0..simulated_frames(&sequence.motion)).for_each(|_| frame_done());
                return Ok(());
            }
            let run = (sequence.name.as_str(), &sequence.motion);
            let simulation = self.wardrobe.simulate(&body, self.wardrobe.template(), run, &frame_done);
            match simulation.and_then(|whole| whole.soundest()) {
                Ok(simulation) => {
                    self.folder.write_sequence(&sequence.name, &simulation)?;
                    let mut manifest = self.manifest();
                    manifest.put(Entry {
                        name: sequence.name.clone(),
                        kind: "pose".to_owned(),
                        frames: simulation.frames.len(),
                        finished: true,
                        inputs,
                        lead_in: simulation.lead_in,
                        stretch: simulation.stretch.iter().copied().fold(0.0, f64::max),
                        inside: simulation.inside.iter().copied().max().unwrap_or(0),
                    });
                    self.folder.write_manifest(&manifest)?;
                }
                Err(error) => self.drop_part(sequence.name.clone(), &error),
            }
            Ok::<(), TrainingError>(())
        })?;
        self.progress.finish(&stage);
        Ok(())
    }

    fn bodies(&self, options: &TrainingOptions) -> Result<(), TrainingError> {
        let wanted = options.body_count;
        let inputs = self.inputs_in_cuts(&format!("{} {} {}", options.body_count, options.dimensions, options.seed));
        if self.manifest().is_finished("shapes", &inputs) && self.folder.has_shapes() {
            return Ok(());
        }
        let stage = format!("{}: bodies", self.title);
        self.progress.start(&stage, wanted);
        let most = wanted + (SPARE_SHARE * wanted as f64).ceil() as usize;
        let shapes = draw_shapes(most, options.dimensions, options.seed);
        let eases = self.wardrobe.tailor().has_ease().then(|| draw_eases(most, options.seed));
        let piece_inputs = self.inputs_in_cuts(&options.seed.to_string());
        let done = AtomicUsize::new(0);
        let mut pieces: Vec<ShapePiece> = Vec::with_capacity(wanted);
        let mut next = 0;
        let mut last_reason = String::new();
        while pieces.len() < wanted && next < most {
            let round = next..(next + wanted - pieces.len()).min(most);
            next = round.end;
            let results: Vec<Result<ShapePiece, TrainingError>> = round
                .clone()
                .into_par_iter()
                .with_max_len(1)
                .map(|index| {
                    let ease = eases.as_ref().map(|eases| eases[index]);
                    let piece = self.body(index, &piece_inputs, (&shapes[index], ease))?;
                    self.progress.advance(&stage, done.fetch_add(1, Ordering::Relaxed) + 1);
                    Ok(piece)
                })
                .collect();
            for (index, result) in round.zip(results) {
                match result {
                    Ok(piece) => pieces.push(piece),
                    Err(error @ TrainingError::Io(_)) => return Err(error),
                    Err(error) => {
                        last_reason = error.to_string();
                        self.drop_part(format!("body {index}"), &error);
                    }
                }
            }
        }
        if pieces.is_empty() && wanted > 0 {
            return Err(TrainingError::NoBodies(last_reason));
        }
        let anchors = self.wardrobe.anchors();
        let places = |piece: &ShapePiece| -> Result<Vec<Vec3>, TrainingError> {
            let body = self.wardrobe.model().body(&piece.shape)?;
            Ok(anchors.iter().map(|&[_, vertex]| body.rest_vertices()[vertex as usize]).collect())
        };
        let body_anchors = pieces.iter().map(places).collect::<Result<Vec<_>, _>>()?;
        self.folder.write_shapes(&pieces, &body_anchors)?;
        let mut manifest = self.manifest();
        manifest.put(Entry {
            name: "shapes".to_owned(),
            kind: "shape".to_owned(),
            frames: pieces.len(),
            finished: true,
            inputs,
            lead_in: 0,
            stretch: pieces.iter().map(|p| p.stretch).fold(0.0, f64::max),
            inside: 0,
        });
        self.folder.write_manifest(&manifest)?;
        self.folder.remove_pieces(most, &piece_inputs)?;
        self.progress.finish(&stage);
        Ok(())
    }

    /// Dresses one body, or takes it from an earlier run.
    fn body(
        &self,
        index: usize,
        inputs: &str,
        (shape, ease): (&[f64], Option<f64>),
    ) -> Result<ShapePiece, TrainingError> {
        if let Some(piece) = self.folder.read_piece(index, inputs, (shape, ease)) {
            return Ok(piece);
        }
        let dressed = self.wardrobe.dress(&self.wardrobe.model().body(shape)?, ease.unwrap_or(0.0))?;
        let piece = ShapePiece {
            shape: shape.to_vec(),
            ease,
            size: dressed.fitting.size,
            stretch: dressed.quality.stretch,
            vertices: dressed.state.positions,
        };
        self.folder.write_piece(index, inputs, &piece)?;
        Ok(piece)
    }
}

fn motion_bytes(sequence: &Sequence) -> Vec<u8> {
    let mut bytes = sequence.name.clone().into_bytes();
    bytes.extend(sequence.motion.fps.to_le_bytes());
    for pose in &sequence.motion.frames {
        for vector in std::iter::once(&pose.root_translation).chain(&pose.rotations) {
            bytes.extend(vector.to_array().iter().flat_map(|x| x.to_le_bytes()));
        }
    }
    bytes
}
