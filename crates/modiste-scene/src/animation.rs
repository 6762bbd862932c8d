//! A dressed person in motion: every vertex of every frame, with what it cost and how well it fits.

use std::path::Path;
use std::sync::Arc;

use modiste_core::{Topology, Vec3};
use modiste_io::IoError;
use modiste_io::animated::{FrameSource, SpoolWriter};
use serde::{Deserialize, Serialize};

use crate::Timing;

/// One mesh through all frames.
#[derive(Debug, Clone)]
pub struct Track {
    /// Name in files, such as `body` or `tshirt`.
    pub name: String,
    /// The faces, the same in every frame.
    pub topology: Arc<Topology>,
    /// Vertices in world (m) of every frame, in memory or on disk.
    pub frames: Arc<dyn FrameSource>,
    /// Colour in pictures and scene files (sRGB, 0–1).
    pub colour: [f32; 3],
    /// Texture coordinates of the corners of each face, from the pattern; empty where there is none.
    pub uv: Vec<[[f32; 2]; 3]>,
}

/// A dressed person in motion.
#[derive(Debug, Clone)]
pub struct Animation {
    /// Frames per second.
    pub fps: f64,
    /// The body first, then the garments from the innermost outwards.
    pub tracks: Vec<Track>,
    /// The hair, if there is any.
    pub hair: Option<crate::HairTrack>,
    /// Heading of the person in every frame (rad), about Y from +Z.
    pub headings: Vec<f64>,
    /// What every frame took.
    pub timing: Timing,
    /// How each garment lay in the body before and after the fit, in the order of their tracks.
    pub fits: Vec<GarmentFit>,
}

/// Vertices of a garment inside the body, over all frames.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Penetration {
    /// Frames with at least one vertex inside.
    pub frames: usize,
    /// Mean number of vertices inside, per frame.
    pub vertices_per_frame: f64,
    /// Depth of the deepest vertex (mm); 0 when none is inside.
    pub deepest_mm: f64,
}

/// How a garment lay in the body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GarmentFit {
    /// Name of the garment.
    pub garment: String,
    /// Number of its vertices.
    pub vertices: usize,
    /// As synthesised.
    pub before: Penetration,
    /// As worn.
    pub after: Penetration,
}

impl Penetration {
    /// Sums up the frames.
    pub fn over_frames(frames: &[modiste_garment::refine::Penetration]) -> Self {
        let vertices: usize = frames.iter().map(|frame| frame.count).sum();
        Self {
            frames: frames.iter().filter(|frame| frame.count > 0).count(),
            vertices_per_frame: vertices as f64 / frames.len().max(1) as f64,
            deepest_mm: 1e3 * frames.iter().map(|frame| frame.worst_depth).fold(0.0, f64::max),
        }
    }
}

impl Track {
    /// The vertices of one frame in double precision.
    ///
    /// # Errors
    /// Frames on disk that cannot be read.
    pub fn points(&self, frame: usize) -> Result<Vec<Vec3>, IoError> {
        let mut points = Vec::new();
        self.frames.read(frame, &mut points)?;
        Ok(points.iter().map(|point| Vec3::from_array(point.map(f64::from))).collect())
    }
}

impl Animation {
    /// Number of frames.
    pub fn frame_count(&self) -> usize {
        self.headings.len()
    }
}

/// Where frames are kept as they are made.
pub(crate) enum Store {
    Memory(Vec<Vec<[f32; 3]>>),
    Disk(SpoolWriter),
}

impl Store {
    /// On disk in `folder` if there is one, for a mesh of so many vertices.
    pub(crate) fn new(folder: Option<&Path>, vertex_count: usize) -> Result<Self, IoError> {
        Ok(match folder {
            Some(folder) => Self::Disk(SpoolWriter::new(folder, vertex_count)?),
            None => Self::Memory(Vec::new()),
        })
    }

    pub(crate) fn push(&mut self, points: &[Vec3]) -> Result<(), IoError> {
        match self {
            Self::Memory(frames) => {
                frames.push(stored(points));
                Ok(())
            }
            Self::Disk(spool) => spool.push(&stored(points)),
        }
    }

    pub(crate) fn finish(self) -> Result<Arc<dyn FrameSource>, IoError> {
        Ok(match self {
            Self::Memory(frames) => Arc::new(frames),
            Self::Disk(spool) => Arc::new(spool.finish()?),
        })
    }
}

/// Points as they are stored.
pub(crate) fn stored(points: &[Vec3]) -> Vec<[f32; 3]> {
    points.iter().map(|point| point.to_array().map(|component| component as f32)).collect()
}

#[cfg(test)]
mod tests {
    use super::Penetration;

    #[test]
    fn penetration_counts_frames_vertices_and_the_worst() {
        let frame = |count, worst_depth| modiste_garment::refine::Penetration { count, worst_depth, vertices: 9 };
        let found = Penetration::over_frames(&[frame(0, 0.0), frame(2, 0.003), frame(1, 0.002), frame(0, 0.0)]);
        assert_eq!(found.frames, 2);
        assert!((found.vertices_per_frame - 0.75).abs() < 1e-12);
        assert!((found.deepest_mm - 3.0).abs() < 1e-12);
        assert_eq!(Penetration::over_frames(&[]), Penetration::default());
    }
}
