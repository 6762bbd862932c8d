//! A training set of what was simulated elsewhere.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use modiste_body::{Body, Motion, ScapeModel};
use modiste_core::{Progress, Topology, TriangleBvh, Vec3};

use super::folder::{Dropped, Entry, Folder, Manifest, SCHEMA, ShapePiece};
use super::wardrobe::{Simulation, TORN, anchored};
use super::{Summary, TrainingError};
use crate::dress::{Mannequin, ReadyMade, SewnGarment};

/// Half of a garment's vertices are nearer to its body than this (m).
const FARTHEST_MEDIAN: f64 = 0.25;

/// No more than this share of the vertices lies deeper than [`DEEP`] (m) inside the body; from the second on it is said.
const MOST_INSIDE: f64 = 0.3;
const WARN_INSIDE: f64 = 0.05;
const DEEP: f64 = 0.02;

/// The garment on a body in the template pose.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedShape {
    /// Where it comes from, for errors.
    pub name: String,
    /// β of the body.
    pub shape: Vec<f64>,
    /// Garment vertices (m) on [`Body::rest_vertices`] of that shape.
    pub vertices: Vec<Vec3>,
}

/// The garment on the mean body in motion.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedMotion {
    /// Name of the sequence.
    pub name: String,
    /// The poses of the mean body.
    pub motion: Motion,
    /// Garment vertices in world (m), one list per frame.
    pub frames: Vec<Vec<Vec3>>,
    /// Where the body had [`Importer::anchor_vertices`] (m), one list per frame; without it they are posed. Where skin touches
    /// skin a pose found from vertices does not bring these back to the last tenth of a millimetre.
    pub body_anchors: Option<Vec<Vec<Vec3>>>,
}

/// Fills the folder of a training set from sequences of one mesh that another program simulated.
#[derive(Debug)]
pub struct Importer {
    body: Body,
    mean: Mannequin,
    mesh: SewnGarment,
    anchors: Vec<[u32; 2]>,
    /// Length of each edge in the template (m).
    edge_lengths: Vec<f64>,
    folder: Folder,
    manifest: Mutex<Manifest>,
}

impl Importer {
    /// Begins, or goes on where an earlier run stopped. `garment` tells the mesh, its parts, band and anchors; `template` (m)
    /// is how the simulation drapes it over the mean body in the template pose.
    ///
    /// # Errors
    /// A folder with another set, or that cannot be written.
    pub fn new(
        model: &Arc<ScapeModel>,
        garment: &ReadyMade,
        template: &[Vec3],
        path: &Path,
    ) -> Result<Self, TrainingError> {
        let body = model.body(&[])?;
        let mean = Mannequin::from(&body);
        let mut band = garment.band().to_vec();
        band.sort_unstable();
        let mesh = SewnGarment {
            name: garment.garment().to_owned(),
            size: "as simulated".to_owned(),
            topology: Arc::clone(garment.topology()),
            rest_faces: Vec::new(),
            face_parts: garment.face_parts().to_vec(),
            waist_band: band,
            anchors: garment.anchors().to_vec(),
            uv: garment.uv(),
        };
        let anchors = anchored(&mesh.anchors, template, &mean);
        let folder = Folder::create(path)?;
        let mut manifest = new_manifest(&mesh, template, &mean, garment.gender());
        if let Some(found) = folder.read_manifest()? {
            found.check_same(&manifest, path)?;
            manifest.sequences = found.sequences;
        }
        folder.write_mesh(&mesh, template, &anchors)?;
        folder.write_manifest(&manifest)?;
        let edge_lengths = edge_lengths(&mesh.topology, template).collect();
        Ok(Self { body, mean, mesh, anchors, edge_lengths, folder, manifest: Mutex::new(manifest) })
    }

    fn manifest(&self) -> MutexGuard<'_, Manifest> {
        self.manifest.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The mean body, on which motions are simulated.
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// The vertices of the body that the garment's anchors follow.
    pub fn anchor_vertices(&self) -> impl Iterator<Item = u32> {
        self.anchors.iter().map(|&[_, vertex]| vertex)
    }

    /// Hash of what a sequence is made from: the garment and the bytes of its files.
    pub fn inputs(&self, files: &[u8]) -> String {
        let mut bytes: Vec<u8> = self.manifest().hashes.values().flat_map(|hash| hash.bytes()).collect();
        bytes.extend_from_slice(files);
        modiste_io::hash(&bytes)
    }

    /// Whether an earlier run finished a motion from the same inputs.
    pub fn has_motion(&self, name: &str, inputs: &str) -> bool {
        self.manifest().is_finished(name, inputs) && self.folder.has_sequence(name)
    }

    /// Keeps a motion: its longest run of frames in which the cloth is not torn.
    ///
    /// What is torn throughout is left out and named in the summary.
    ///
    /// # Errors
    /// Cloth that is not on the body, or a file that cannot be written.
    pub fn add_motion(
        &self,
        imported: ImportedMotion,
        inputs: String,
        progress: &dyn Progress,
    ) -> Result<(), TrainingError> {
        let ImportedMotion { name, motion, frames, body_anchors } = imported;
        let told = body_anchors.as_ref().map_or(frames.len(), Vec::len);
        if motion.frames.is_empty() || motion.frames.len() != frames.len() || told != frames.len() {
            return Err(TrainingError::NoFrames(name));
        }
        let mut simulation = Simulation {
            motion,
            lead_in: 0,
            stretch: frames.iter().map(|frame| self.stretch(frame)).collect(),
            frames,
            body_anchors: Vec::new(),
            inside: Vec::new(),
        };
        let mut posed = Vec::new();
        let mut worst = (0.0, 0);
        let mut tree = TriangleBvh::new(&self.mean.topology, &self.mean.vertices);
        for (frame, (pose, cloth)) in simulation.motion.frames.iter().zip(&simulation.frames).enumerate() {
            self.body.pose(pose, &mut posed);
            tree.refit(&posed);
            let (share, inside) = check_place(&format!("{name}, frame {frame}"), cloth, &posed, &tree)?;
            if share > worst.0 {
                worst = (share, frame);
            }
            simulation.inside.push(inside);
            let anchors = match &body_anchors {
                Some(told) => told[frame].clone(),
                None => self.anchor_vertices().map(|vertex| posed[vertex as usize]).collect(),
            };
            simulation.body_anchors.push(anchors);
        }
        if worst.0 > WARN_INSIDE {
            let percent = 100.0 * worst.0;
            progress.warn(&format!("{name}: {percent:.0} % of the garment is inside the body in frame {}", worst.1));
        }
        let whole = simulation.frames.len();
        let kept = match simulation.longest_run(|frame| simulation.stretch[frame] <= TORN) {
            Ok(kept) => kept,
            Err(error) => {
                progress.warn(&format!("{name} is left out: {error}"));
                self.manifest().dropped.push(Dropped { name, why: error.to_string() });
                return Ok(());
            }
        };
        if kept.frames.len() < whole {
            progress.warn(&format!(
                "{name}: {} of {whole} frames are kept, in the others cloth is torn",
                kept.frames.len()
            ));
        }
        self.folder.write_sequence(&name, &kept)?;
        let mut manifest = self.manifest();
        manifest.put(Entry {
            name,
            kind: "pose".to_owned(),
            frames: kept.frames.len(),
            finished: true,
            inputs,
            lead_in: 0,
            stretch: kept.stretch.iter().copied().fold(0.0, f64::max),
            inside: kept.inside.iter().copied().max().unwrap_or(0),
        });
        Ok(self.folder.write_manifest(&manifest)?)
    }

    /// Keeps all bodies in the template pose.
    ///
    /// # Errors
    /// Cloth that is not on its body, or a file that cannot be written.
    pub fn write_shapes(&self, shapes: &[ImportedShape]) -> Result<(), TrainingError> {
        let (mut pieces, mut body_anchors) = (Vec::new(), Vec::new());
        for imported in shapes {
            let body = self.body.model().body(&imported.shape)?;
            let tree = TriangleBvh::new(&self.mean.topology, body.rest_vertices());
            check_place(&imported.name, &imported.vertices, body.rest_vertices(), &tree)?;
            let stretch = self.stretch(&imported.vertices);
            body_anchors.push(self.anchors.iter().map(|&[_, v]| body.rest_vertices()[v as usize]).collect());
            let (shape, vertices) = (imported.shape.clone(), imported.vertices.clone());
            pieces.push(ShapePiece { shape, ease: None, size: 0.0, stretch, vertices });
        }
        self.folder.write_shapes(&pieces, &body_anchors)?;
        let inputs = self.inputs(&[]);
        let mut manifest = self.manifest();
        manifest.put(Entry {
            name: "shapes".to_owned(),
            kind: "shape".to_owned(),
            frames: pieces.len(),
            finished: true,
            inputs,
            lead_in: 0,
            stretch: pieces.iter().map(|piece| piece.stretch).fold(0.0, f64::max),
            inside: 0,
        });
        Ok(self.folder.write_manifest(&manifest)?)
    }

    /// Ends the set: motions that are not among `names` do not belong to it.
    ///
    /// # Errors
    /// A manifest that cannot be written.
    pub fn finish(self, names: &[String]) -> Result<Summary, TrainingError> {
        let mut manifest = self.manifest.into_inner().unwrap_or_else(PoisonError::into_inner);
        let is_dropped = |name: &String| manifest.dropped.iter().any(|dropped| dropped.name == *name);
        manifest.sequences.retain(|e| e.kind == "shape" || (names.contains(&e.name) && !is_dropped(&e.name)));
        manifest.dropped.sort_by(|a, b| a.name.cmp(&b.name));
        self.folder.write_manifest(&manifest)?;
        Ok(manifest.summary())
    }

    /// Number of vertices of the garment.
    pub fn vertex_count(&self) -> usize {
        self.mesh.topology.vertex_count()
    }

    /// 99th percentile of how much longer or shorter edges are than in the template.
    fn stretch(&self, cloth: &[Vec3]) -> f64 {
        let lengths = edge_lengths(&self.mesh.topology, cloth).zip(&self.edge_lengths);
        let mut strains: Vec<f64> = lengths.map(|(now, then)| (now / then - 1.0).max(0.0)).collect();
        strains.sort_by(f64::total_cmp);
        strains.get(strains.len().saturating_sub(1) * 99 / 100).copied().unwrap_or(0.0)
    }
}

fn edge_lengths(topology: &Topology, x: &[Vec3]) -> impl Iterator<Item = f64> {
    topology.edges().iter().map(|edge| x[edge.vertices[0] as usize].distance(x[edge.vertices[1] as usize]))
}

/// The share of the vertices deep inside the body, and the number of those inside it at all.
fn check_place(name: &str, cloth: &[Vec3], body: &[Vec3], tree: &TriangleBvh) -> Result<(f64, usize), TrainingError> {
    let wrong = |why: String| Err(TrainingError::Imported { name: name.to_owned(), why });
    let distances: Vec<f64> = cloth
        .iter()
        .map(|&x| {
            let distance = tree.closest_point(body, x, f64::INFINITY).map_or(f64::INFINITY, |near| near.distance);
            if tree.contains(body, x) { -distance } else { distance }
        })
        .collect();
    let inside = distances.iter().filter(|&&distance| distance < 0.0).count();
    let share = distances.iter().filter(|&&distance| distance < -DEEP).count() as f64 / cloth.len().max(1) as f64;
    if share > MOST_INSIDE {
        let percent = 100.0 * share;
        return wrong(format!(
            "a garment around its body was wanted, found {percent:.0} % of it more than 2 cm inside"
        ));
    }
    let mut sorted = distances;
    sorted.sort_by(f64::total_cmp);
    let median = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
    if median > FARTHEST_MEDIAN {
        return wrong(format!("a garment on its body was wanted, found half of it more than {median:.2} m away"));
    }
    Ok((share, inside))
}

fn new_manifest(mesh: &SewnGarment, template: &[Vec3], mean: &Mannequin, gender: &str) -> Manifest {
    let points = |x: &[Vec3]| -> Vec<u8> { x.iter().flat_map(|v| v.to_array()).flat_map(f64::to_le_bytes).collect() };
    let faces: Vec<u8> = mesh.topology.faces().as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
    let hashes = [
        ("body", modiste_io::hash(&points(&mean.vertices))),
        ("faces", modiste_io::hash(&faces)),
        ("template", modiste_io::hash(&points(template))),
    ];
    Manifest {
        schema: SCHEMA.to_owned(),
        garment: mesh.name.clone(),
        gender: gender.to_owned(),
        seed: 0,
        vertex_count: None,
        units: "metres, radians".to_owned(),
        fabric: "as simulated elsewhere".to_owned(),
        hashes: BTreeMap::from(hashes.map(|(name, hash)| (name.to_owned(), hash))),
        sequences: Vec::new(),
        dropped: Vec::new(),
    }
}
