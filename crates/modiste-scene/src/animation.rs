//! A dressed person in motion: every vertex of every frame, with what it cost and how well it fits.

use std::path::Path;
use std::sync::Arc;

use modiste_core::{Topology, Vec3};
use modiste_garment::GarmentFlags;
use modiste_io::IoError;
use modiste_io::animated::{FrameSource, SpoolWriter};
use modiste_io::dressed::FrameCounts;
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
    /// What could not be done, frame by frame for each garment in the order of their tracks.
    pub flags: Vec<Vec<GarmentFlags>>,
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

/// In which frames not all could be done for a garment: first and last of each run.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct FlaggedFrames {
    /// Name of the garment.
    pub garment: String,
    /// Vertices were caught between parts of the body that are in each other.
    pub caught: Vec<[usize; 2]>,
    /// Vertices are left inside the body or below a garment.
    pub inside: Vec<[usize; 2]>,
    /// Triangles were left crossing the body or a garment below.
    pub crossing: Vec<[usize; 2]>,
    /// Triangles of the garment are left deep in each other.
    pub folded: Vec<[usize; 2]>,
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
    /// The flags of each garment as an array of the dressed result, `<garment>_flags`.
    pub(crate) fn flag_counts(&self) -> Vec<FrameCounts> {
        let garment = |(index, fit): (usize, &GarmentFit)| FrameCounts {
            name: format!("{}_flags", fit.garment),
            per_frame: GarmentFlags::COUNT,
            values: self.flags.iter().flat_map(|frame| frame[index].to_array()).map(|count| count as u32).collect(),
        };
        self.fits.iter().enumerate().map(garment).collect()
    }

    /// The frames that are flagged, for each garment.
    pub fn flagged(&self) -> Vec<FlaggedFrames> {
        let garment = |(index, fit): (usize, &GarmentFit)| {
            let runs = |what: fn(&GarmentFlags) -> usize| runs(self.flags.iter().map(|frame| what(&frame[index]) > 0));
            FlaggedFrames {
                garment: fit.garment.clone(),
                caught: runs(|flags| flags.caught),
                inside: runs(|flags| flags.inside),
                crossing: runs(|flags| flags.crossing),
                folded: runs(|flags| flags.folded),
            }
        };
        self.fits.iter().enumerate().map(garment).collect()
    }

    /// Number of frames.
    pub fn frame_count(&self) -> usize {
        self.headings.len()
    }
}

/// First and last of each run of frames that are flagged.
fn runs(flagged: impl Iterator<Item = bool>) -> Vec<[usize; 2]> {
    let mut runs: Vec<[usize; 2]> = Vec::new();
    for (frame, _) in flagged.enumerate().filter(|(_, is_flagged)| *is_flagged) {
        match runs.last_mut() {
            Some(run) if run[1] + 1 == frame => run[1] = frame,
            _ => runs.push([frame, frame]),
        }
    }
    runs
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
    use super::{Penetration, runs};

    #[test]
    fn flagged_frames_are_told_in_runs() {
        assert_eq!(runs([false, true, true, false, true].into_iter()), [[1, 2], [4, 4]]);
        assert!(runs([false; 3].into_iter()).is_empty());
    }

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
