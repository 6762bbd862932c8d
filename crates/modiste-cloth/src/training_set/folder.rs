//! The folder of a training set.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use modiste_core::Vec3;
use modiste_io::npz::{Reader, Writer};
use modiste_io::{IoError, json};
use serde::{Deserialize, Serialize};

use super::TrainingError;
use super::wardrobe::{Simulation, Wardrobe, rotations};
use crate::dress::SewnGarment;

/// Version of the folder's format.
pub(super) const SCHEMA: &str = "modiste-training-set-1";

/// The pattern that the garment was sewn from.
const PATTERN_FILE: &str = "pattern.json";

/// `manifest.json`: what the set is and what of it is finished.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Manifest {
    pub(super) schema: String,
    pub(super) garment: String,
    pub(super) gender: String,
    pub(super) seed: u64,
    pub(super) units: String,
    pub(super) fabric: String,
    /// About how many vertices were asked for; absent in sets of before.
    #[serde(default)]
    pub(super) vertex_count: Option<usize>,
    pub(super) hashes: BTreeMap<String, String>,
    pub(super) sequences: Vec<Entry>,
    pub(super) dropped: Vec<Dropped>,
}

/// A finished part of the set.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Entry {
    pub(super) name: String,
    /// `shape` or `pose`.
    pub(super) kind: String,
    /// Bodies of the shape set, or frames of a motion.
    pub(super) frames: usize,
    pub(super) finished: bool,
    /// Hash of what it was made from.
    #[serde(default)]
    pub(super) inputs: String,
    /// Frames of the lead-in from the template pose.
    #[serde(default)]
    pub(super) lead_in: usize,
    /// Largest 99th percentile of edge stretch.
    #[serde(default)]
    pub(super) stretch: f64,
    /// Largest number of garment vertices inside the body.
    #[serde(default)]
    pub(super) inside: usize,
}

/// A body or motion that was left out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Dropped {
    /// The body or motion.
    pub name: String,
    /// The reason.
    pub why: String,
}

/// One dressed body.
#[derive(Debug, Clone)]
pub(super) struct ShapePiece {
    pub(super) shape: Vec<f64>,
    /// `None` for a garment of one cut.
    pub(super) ease: Option<f64>,
    pub(super) size: f64,
    pub(super) stretch: f64,
    pub(super) vertices: Vec<Vec3>,
}

/// The folder and the names in it.
#[derive(Debug, Clone)]
pub(super) struct Folder {
    path: PathBuf,
}

impl Folder {
    pub(super) fn create(path: &Path) -> Result<Self, IoError> {
        modiste_io::create_folder(path)?;
        Ok(Self { path: path.to_owned() })
    }

    fn manifest_path(&self) -> PathBuf {
        self.path.join("manifest.json")
    }

    pub(super) fn read_manifest(&self) -> Result<Option<Manifest>, IoError> {
        let path = self.manifest_path();
        if modiste_io::exists(&path) { json::read(&path).map(Some) } else { Ok(None) }
    }

    pub(super) fn write_manifest(&self, manifest: &Manifest) -> Result<(), IoError> {
        json::write(self.manifest_path(), manifest)
    }

    pub(super) fn has_sequence(&self, name: &str) -> bool {
        modiste_io::exists(self.sequence_path(name))
    }

    pub(super) fn has_shapes(&self) -> bool {
        modiste_io::exists(self.path.join("shapes.npz"))
    }

    fn sequence_path(&self, name: &str) -> PathBuf {
        self.path.join(format!("pose-{name}.npz"))
    }

    /// Writes what is constant: mesh, parts, template, band, anchors, texture coordinates, pattern.
    pub(super) fn write_garment(&self, wardrobe: &Wardrobe) -> Result<(), IoError> {
        let garment = wardrobe.tailor().garment(wardrobe.template(), wardrobe.mean());
        self.write_mesh(&garment, &wardrobe.template().state.positions, &wardrobe.anchors())?;
        let pattern = wardrobe.tailor().design().to_json();
        modiste_io::write_bytes(self.path.join(PATTERN_FILE), pattern.as_bytes())
    }

    /// Writes what is constant but for the pattern; `template` (m) is the garment on the mean body.
    pub(super) fn write_mesh(
        &self,
        garment: &SewnGarment,
        template: &[Vec3],
        anchors: &[[u32; 2]],
    ) -> Result<(), IoError> {
        let parts: Vec<u8> = garment.face_parts.iter().map(|part| part.index() as u8).collect();
        let uv: Vec<f32> = garment.uv.iter().flatten().flatten().copied().collect();
        let count = garment.topology.face_count();
        Writer::new()
            .add_triangles("faces", garment.topology.faces())
            .add_u8("face_parts", &[count], parts)
            .add_points("template", template)
            .add_u32("waist_band", &[garment.waist_band.len()], garment.waist_band.clone())
            .add_u32("anchors", &[anchors.len(), 2], anchors.as_flattened().to_vec())
            .add_f32("uv", &[count, 3, 2], uv)
            .save(self.path.join("garment.npz"))
    }

    /// Writes a finished motion.
    pub(super) fn write_sequence(&self, name: &str, simulation: &Simulation) -> Result<(), IoError> {
        let motion = &simulation.motion;
        let (frames, count) = (simulation.frames.len(), simulation.frames.first().map_or(0, Vec::len));
        let anchors = simulation.body_anchors.first().map_or(0, Vec::len);
        let roots: Vec<Vec3> = motion.frames.iter().map(|pose| pose.root_translation).collect();
        Writer::new()
            .add_f32("vertices", &[frames, count, 3], flat(&simulation.frames))
            .add_f32("rotations", &[frames, modiste_body::Part::COUNT, 3], rotations(motion))
            .add_points("root_translation", &roots)
            .add_f32("body_anchors", &[frames, anchors, 3], flat(&simulation.body_anchors))
            .add_f32("fps", &[], vec![motion.fps as f32])
            .save(self.sequence_path(name))
    }

    /// Writes all dressed bodies.
    ///
    /// `body_anchors` are the body vertices (m) of the garment's anchors, one list per body.
    pub(super) fn write_shapes(&self, pieces: &[ShapePiece], body_anchors: &[Vec<Vec3>]) -> Result<(), IoError> {
        let count = pieces.first().map_or(0, |p| p.vertices.len());
        let dimensions = pieces.first().map_or(0, |p| p.shape.len());
        let beta: Vec<f32> = pieces.iter().flat_map(|p| p.shape.iter().map(|&b| b as f32)).collect();
        let vertices: Vec<Vec<Vec3>> = pieces.iter().map(|p| p.vertices.clone()).collect();
        let sizes: Vec<f32> = pieces.iter().map(|p| p.size as f32).collect();
        let eases: Option<Vec<f32>> = pieces.iter().map(|p| p.ease.map(|ease| ease as f32)).collect();
        let mut writer = Writer::new();
        if let Some(eases) = eases {
            writer.add_f32("ease", &[eases.len()], eases);
        }
        writer
            .add_f32("beta", &[pieces.len(), dimensions], beta)
            .add_f32("vertices", &[pieces.len(), count, 3], flat(&vertices))
            .add_f32("body_anchors", &[pieces.len(), body_anchors.first().map_or(0, Vec::len), 3], flat(body_anchors))
            .add_f32("size", &[pieces.len()], sizes)
            .save(self.path.join("shapes.npz"))
    }

    fn piece_path(&self, index: usize, inputs: &str) -> PathBuf {
        self.path.join("unfinished").join(format!("shape-{index:04}-{}.npz", &inputs[..16.min(inputs.len())]))
    }

    /// Keeps one dressed body until all are there.
    pub(super) fn write_piece(&self, index: usize, inputs: &str, piece: &ShapePiece) -> Result<(), IoError> {
        Writer::new()
            .add_points("vertices", &piece.vertices)
            .add_f64("size", &[], vec![piece.size])
            .add_f64("stretch", &[], vec![piece.stretch])
            .save(self.piece_path(index, inputs))
    }

    /// A body that was dressed in an earlier run from the same inputs.
    pub(super) fn read_piece(
        &self,
        index: usize,
        inputs: &str,
        (shape, ease): (&[f64], Option<f64>),
    ) -> Option<ShapePiece> {
        let reader = Reader::open(self.piece_path(index, inputs)).ok()?;
        Some(ShapePiece {
            shape: shape.to_vec(),
            ease,
            size: reader.scalar("size").ok()?,
            stretch: reader.scalar("stretch").ok()?,
            vertices: reader.points("vertices").ok()?,
        })
    }

    pub(super) fn remove_pieces(&self, count: usize, inputs: &str) -> Result<(), IoError> {
        (0..count).try_for_each(|index| modiste_io::remove_file(self.piece_path(index, inputs)))
    }
}

impl Manifest {
    /// Whether the part `name` was finished from these inputs.
    pub(super) fn is_finished(&self, name: &str, inputs: &str) -> bool {
        self.sequences.iter().any(|entry| entry.name == name && entry.finished && entry.inputs == inputs)
    }

    /// Puts an entry in place of an earlier one of its name; entries stay sorted by name.
    pub(super) fn put(&mut self, entry: Entry) {
        self.sequences.retain(|other| other.name != entry.name);
        let place = self.sequences.partition_point(|other| other.name < entry.name);
        self.sequences.insert(place, entry);
    }

    /// Checks that a folder found holds the set wanted.
    pub(super) fn check_same(&self, wanted: &Self, folder: &Path) -> Result<(), TrainingError> {
        let what = |m: &Self| format!("{} {} ({})", m.gender, m.garment, m.schema);
        if what(self) == what(wanted) {
            return Ok(());
        }
        Err(TrainingError::OtherSet { folder: folder.to_owned(), wanted: what(wanted), found: what(self) })
    }
}

fn flat(frames: &[Vec<Vec3>]) -> Vec<f32> {
    frames.iter().flatten().flat_map(|v| v.as_vec3().to_array()).collect()
}
