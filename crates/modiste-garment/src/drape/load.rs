//! Reading a training set from its folder.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use modiste_body::{Gender, Motion, Part, Pose};
use modiste_core::{Topology, Vec3};
use modiste_io::npz::Reader;
use modiste_io::{IoError, json};
use serde::Deserialize;

use super::training_set::{Garment, PoseSequence, ShapeSample, TrainingSet};
use crate::GarmentError;

/// `manifest.json`, as far as it matters here.
#[derive(Debug, Deserialize)]
struct Manifest {
    garment: String,
    gender: Gender,
    #[serde(default)]
    seed: u64,
    #[serde(default)]
    vertex_count: Option<usize>,
    #[serde(default)]
    hashes: BTreeMap<String, String>,
    #[serde(default)]
    sequences: Vec<Entry>,
}

#[derive(Debug, Deserialize)]
struct Entry {
    name: String,
    kind: String,
    #[serde(default = "yes")]
    finished: bool,
}

fn yes() -> bool {
    true
}

impl TrainingSet {
    /// Reads a training set with the sequences that its manifest calls finished.
    ///
    /// # Errors
    /// [`GarmentError`] naming the file, the array, what was wanted and what was found.
    pub fn load(folder: impl AsRef<Path>) -> Result<Self, GarmentError> {
        Self::load_sequences(folder, |_| true)
    }

    /// Reads a training set with those finished sequences for which `wanted` is true.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn load_sequences(folder: impl AsRef<Path>, wanted: impl Fn(&str) -> bool) -> Result<Self, GarmentError> {
        let folder = folder.as_ref();
        let manifest: Manifest = json::read(folder.join("manifest.json"))?;
        let garment = read_garment(&folder.join("garment.npz"), &manifest)?;
        let vertices = garment.topology.vertex_count();
        let shapes = read_shapes(&folder.join("shapes.npz"), vertices, garment.anchors.len())?;
        let is_wanted = |entry: &&Entry| entry.kind == "pose" && entry.finished && wanted(&entry.name);
        let sequences = manifest
            .sequences
            .iter()
            .filter(is_wanted)
            .map(|entry| {
                let path = folder.join(format!("pose-{}.npz", entry.name));
                read_sequence(&path, &entry.name, vertices, garment.anchors.len())
            })
            .collect::<Result<_, _>>()?;
        let sources = manifest.hashes.into_iter().collect();
        let (seed, vertex_count) = (manifest.seed, manifest.vertex_count);
        let set = Self { garment, shapes, sequences, seed, sources, vertex_count };
        set.check()?;
        Ok(set)
    }
}

/// A file and the name that it has in errors.
struct Arrays {
    reader: Reader,
    file: String,
}

impl Arrays {
    fn open(path: &Path) -> Result<Self, GarmentError> {
        Ok(Self { reader: Reader::open(path)?, file: path.display().to_string() })
    }

    /// Points in an array of shape (`lists`, `count`, 3); any number of lists.
    fn point_lists(&self, name: &str, count: usize) -> Result<Vec<Vec<Vec3>>, GarmentError> {
        let array = self.reader.f32(name)?;
        self.reader.check_shape(name, &array.shape, &[None, Some(count), Some(3)])?;
        let points: Vec<Vec3> =
            array.data.as_chunks::<3>().0.iter().map(|point| Vec3::from_array(point.map(f64::from))).collect();
        Ok(points.chunks(count.max(1)).map(<[Vec3]>::to_vec).collect())
    }
}

fn read_garment(path: &Path, manifest: &Manifest) -> Result<Garment, GarmentError> {
    let arrays = Arrays::open(path)?;
    let reader = &arrays.reader;
    let template = reader.points("template")?;
    let faces = reader.triangles("faces")?;
    let count = faces.len();
    let topology = Topology::new(template.len(), faces)
        .map_err(|source| GarmentError::Topology { garment: arrays.file.clone(), source })?;
    let parts = reader.u8("face_parts")?;
    reader.check_shape("face_parts", &parts.shape, &[Some(count)])?;
    let part = |&index: &u8| {
        Part::from_index(usize::from(index)).ok_or_else(|| {
            IoError::field(&arrays.file, "array \"face_parts\"", format!("parts below {}", Part::COUNT), index)
        })
    };
    let anchors = reader.u32("anchors")?;
    reader.check_shape("anchors", &anchors.shape, &[None, Some(2)])?;
    let uv = reader.f32("uv")?;
    reader.check_shape("uv", &uv.shape, &[Some(count), Some(3), Some(2)])?;
    let corner_uv: Vec<[f32; 2]> = uv.data.as_chunks::<2>().0.to_vec();
    // Garments that were simulated elsewhere have none.
    let pattern = path.with_file_name("pattern.json");
    let pattern = if modiste_io::exists(&pattern) { modiste_io::read_text(&pattern)? } else { String::new() };
    Ok(Garment {
        name: manifest.garment.clone(),
        gender: manifest.gender,
        face_parts: parts.data.iter().map(part).collect::<Result<_, _>>()?,
        topology: Arc::new(topology),
        template,
        waist_band: reader.u32("waist_band")?.data,
        anchors: anchors.data.as_chunks::<2>().0.to_vec(),
        uv: corner_uv.as_chunks::<3>().0.to_vec(),
        pattern,
    })
}

fn read_shapes(path: &Path, vertices: usize, anchors: usize) -> Result<Vec<ShapeSample>, GarmentError> {
    let arrays = Arrays::open(path)?;
    let meshes = arrays.point_lists("vertices", vertices)?;
    let beta = arrays.reader.f32("beta")?;
    arrays.reader.check_shape("beta", &beta.shape, &[Some(meshes.len()), None])?;
    let dimensions = beta.shape[1].max(1);
    let shapes = beta.data.chunks(dimensions).map(|row| row.iter().map(|&value| f64::from(value)).collect());
    let places = arrays.point_lists("body_anchors", anchors)?;
    arrays.reader.check_shape("body_anchors", &[places.len()], &[Some(meshes.len())])?;
    let eases = eases(&arrays, meshes.len())?;
    let samples = shapes.zip(eases).zip(meshes.into_iter().zip(places));
    Ok(samples
        .map(|((shape, ease), (vertices, body_anchors))| ShapeSample { shape, ease, vertices, body_anchors })
        .collect())
}

/// The ease of every body; 0 where the garment has one cut.
fn eases(arrays: &Arrays, bodies: usize) -> Result<Vec<f64>, GarmentError> {
    if !arrays.reader.contains("ease") {
        return Ok(vec![0.0; bodies]);
    }
    let ease = arrays.reader.f32("ease")?;
    arrays.reader.check_shape("ease", &ease.shape, &[Some(bodies)])?;
    Ok(ease.data.into_iter().map(f64::from).collect())
}

fn read_sequence(path: &Path, name: &str, vertices: usize, anchors: usize) -> Result<PoseSequence, GarmentError> {
    let arrays = Arrays::open(path)?;
    let frames = arrays.point_lists("vertices", vertices)?;
    let rotations = arrays.point_lists("rotations", Part::COUNT)?;
    let translations = arrays.reader.points("root_translation")?;
    let body_anchors = arrays.point_lists("body_anchors", anchors)?;
    for (array, found) in
        [("rotations", rotations.len()), ("root_translation", translations.len()), ("body_anchors", body_anchors.len())]
    {
        if found != frames.len() {
            let wanted = format!("one entry for each of {} frames", frames.len());
            return Err(IoError::field(&arrays.file, format!("array \"{array}\""), wanted, found).into());
        }
    }
    let fps = arrays.reader.scalar("fps")?;
    if !(fps.is_finite() && fps > 0.0) {
        return Err(IoError::field(&arrays.file, "array \"fps\"", "a positive number", fps).into());
    }
    let pose = |(rotations, root_translation): (&Vec<Vec3>, Vec3)| {
        let mut pose = Pose::template(root_translation);
        pose.rotations.copy_from_slice(rotations);
        pose
    };
    let motion = Motion { fps, frames: rotations.iter().zip(translations).map(pose).collect() };
    Ok(PoseSequence { name: name.to_owned(), motion, frames, body_anchors })
}
