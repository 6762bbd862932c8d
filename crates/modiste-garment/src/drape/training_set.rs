//! What a garment is learned from: the same mesh draped over many bodies, and over one body in motion.

use std::sync::Arc;

use modiste_body::{Gender, Motion, Part};
use modiste_core::{Topology, Vec3};

use crate::GarmentError;

/// The constant part of a garment: its mesh on the mean body in the template pose, and how it is tied to the body.
#[derive(Debug, Clone)]
pub struct Garment {
    /// Name, such as `tshirt`.
    pub name: String,
    /// The body model that it belongs to.
    pub gender: Gender,
    /// Triangles, shared by all examples.
    pub topology: Arc<Topology>,
    /// The body part whose rotation each face follows, p(t).
    pub face_parts: Vec<Part>,
    /// Vertices on the mean body in the template pose (m), X.
    pub template: Vec<Vec3>,
    /// Vertices of the waist band, empty where there is none.
    pub waist_band: Vec<u32>,
    /// Pairs of a garment vertex and the body vertex that it stays at; they give the translation.
    pub anchors: Vec<[u32; 2]>,
    /// Texture coordinates of the corners of each face.
    pub uv: Vec<[[f32; 2]; 3]>,
    /// The sewing pattern that it was simulated from, as JSON; empty where there is none.
    pub pattern: String,
}

/// The garment on one body in the template pose, an element of S.
#[derive(Debug, Clone)]
pub struct ShapeSample {
    /// Body shape in standard deviations, β.
    pub shape: Vec<f64>,
    /// How the garment is cut, from slim, -1, to loose, 1; 0 for a garment of one cut.
    pub ease: f64,
    /// Garment vertices (m).
    pub vertices: Vec<Vec3>,
    /// Where the body vertices of the garment's anchors are (m).
    pub body_anchors: Vec<Vec3>,
}

/// The garment on the mean body through one motion, a run of elements of P.
#[derive(Debug, Clone)]
pub struct PoseSequence {
    /// Name of the motion.
    pub name: String,
    /// The poses of the body, one per frame.
    pub motion: Motion,
    /// Garment vertices in the world (m), one list per frame.
    pub frames: Vec<Vec<Vec3>>,
    /// Where the body vertices of the garment's anchors are (m), one list per frame.
    pub body_anchors: Vec<Vec<Vec3>>,
}

/// Everything that a garment is learned from.
#[derive(Debug, Clone)]
pub struct TrainingSet {
    /// The garment.
    pub garment: Garment,
    /// Different bodies in the template pose.
    pub shapes: Vec<ShapeSample>,
    /// The mean body in motion.
    pub sequences: Vec<PoseSequence>,
    /// Seed of the simulation.
    pub seed: u64,
    /// Content hashes of what the set was made from, by name.
    pub sources: Vec<(String, String)>,
    /// About how many vertices the garment was to have when it was cut, where that is known.
    pub vertex_count: Option<usize>,
}

impl Garment {
    /// Checks that all parts of the garment agree.
    ///
    /// # Errors
    /// [`GarmentError::Data`] naming the first part that does not.
    pub fn check(&self) -> Result<(), GarmentError> {
        let (vertices, faces) = (self.topology.vertex_count(), self.topology.face_count());
        let wrong = |field: &str, wanted: String, found: String| {
            GarmentError::data(format!("{} {}", self.name, field), wanted, found)
        };
        for (field, wanted, found) in [
            ("template", vertices, self.template.len()),
            ("face parts", faces, self.face_parts.len()),
            ("texture coordinates", faces, self.uv.len()),
        ] {
            if wanted != found {
                return Err(wrong(field, format!("{wanted} entries"), found.to_string()));
            }
        }
        if let Some(at) = self.template.iter().position(|vertex| !vertex.is_finite()) {
            return Err(wrong("template", "finite coordinates".into(), format!("another at vertex {at}")));
        }
        if self.anchors.is_empty() {
            return Err(wrong("anchors", "at least one".into(), "none".into()));
        }
        let on_garment = self.waist_band.iter().chain(self.anchors.iter().map(|[garment, _]| garment));
        if let Some(vertex) = on_garment.copied().find(|&vertex| vertex as usize >= vertices) {
            let found = format!("vertex {vertex}");
            return Err(wrong("waist band or anchors", format!("vertices below {vertices}"), found));
        }
        Ok(())
    }

    /// The part that most faces at the anchors follow.
    pub fn anchor_part(&self) -> Part {
        let mut counts = [0; Part::COUNT];
        for [vertex, _] in &self.anchors {
            for &face in self.topology.vertex_faces(*vertex as usize) {
                counts[self.face_parts[face as usize].index()] += 1;
            }
        }
        Part::ALL.into_iter().fold(
            Part::Pelvis,
            |most, part| {
                if counts[part.index()] > counts[most.index()] { part } else { most }
            },
        )
    }

    /// The largest body vertex that an anchor names.
    pub fn largest_body_vertex(&self) -> u32 {
        self.anchors.iter().map(|&[_, body]| body).max().unwrap_or(0)
    }
}

impl TrainingSet {
    /// Checks that all examples fit the garment.
    ///
    /// # Errors
    /// [`GarmentError::Data`] naming the first example that does not.
    pub fn check(&self) -> Result<(), GarmentError> {
        self.garment.check()?;
        let vertices = self.garment.topology.vertex_count();
        let check = |what: &dyn Fn() -> String, found: &[Vec3]| {
            if found.len() != vertices {
                return Err(GarmentError::data(what(), format!("{vertices} vertices"), found.len()));
            }
            match found.iter().position(|vertex| !vertex.is_finite()) {
                Some(at) => Err(GarmentError::data(what(), "finite coordinates", format!("another at vertex {at}"))),
                None => Ok(()),
            }
        };
        let body_dimensions = self.shapes.first().map_or(0, |sample| sample.shape.len());
        for (index, sample) in self.shapes.iter().enumerate() {
            check(&|| format!("shape {index}"), &sample.vertices)?;
            if sample.body_anchors.len() != self.garment.anchors.len() {
                let wanted = format!("{} points", self.garment.anchors.len());
                return Err(GarmentError::data(format!("anchors of shape {index}"), wanted, sample.body_anchors.len()));
            }
            if sample.shape.len() != body_dimensions || sample.shape.iter().any(|value| !value.is_finite()) {
                let wanted = format!("{body_dimensions} finite numbers");
                return Err(GarmentError::data(format!("β of shape {index}"), wanted, format!("{:?}", sample.shape)));
            }
            if !(-1.0..=1.0).contains(&sample.ease) {
                return Err(GarmentError::data(format!("ease of shape {index}"), "a number from -1 to 1", sample.ease));
            }
        }
        for sequence in &self.sequences {
            let what = || format!("sequence {}", sequence.name);
            let (poses, frames) = (sequence.motion.frames.len(), sequence.frames.len());
            if poses != frames {
                return Err(GarmentError::data(what(), format!("one pose for each of {frames} frames"), poses));
            }
            if (sequence.motion.fps - self.fps()).abs() > 1e-6 {
                let wanted = format!("{} frames a second as in the other sequences", self.fps());
                return Err(GarmentError::data(what(), wanted, sequence.motion.fps));
            }
            let anchors = self.garment.anchors.len();
            if sequence.body_anchors.len() != frames || sequence.body_anchors.iter().any(|a| a.len() != anchors) {
                let wanted = format!("{anchors} body anchors for each of {frames} frames");
                return Err(GarmentError::data(what(), wanted, "another number"));
            }
            for (frame, vertices) in sequence.frames.iter().enumerate() {
                check(&|| format!("sequence {}, frame {frame}", sequence.name), vertices)?;
            }
        }
        Ok(())
    }

    /// Frames a second of the sequences; 30 where there are none.
    pub fn fps(&self) -> f64 {
        self.sequences.first().map_or(30.0, |sequence| sequence.motion.fps)
    }

    /// Number of frames in all sequences.
    pub fn frame_count(&self) -> usize {
        self.sequences.iter().map(|sequence| sequence.frames.len()).sum()
    }

    /// Takes out the sequences for which `held_out` is true, so that they can be tested on.
    pub fn hold_out(&mut self, held_out: impl Fn(&str) -> bool) -> Vec<PoseSequence> {
        let (out, kept) =
            std::mem::take(&mut self.sequences).into_iter().partition(|sequence| held_out(&sequence.name));
        self.sequences = kept;
        out
    }
}
