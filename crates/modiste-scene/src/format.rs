//! The forms in which an animation goes to files.

use std::path::{Path, PathBuf};

use modiste_core::Progress;
use modiste_core::render::linear_from_srgb;
use modiste_io::animated::AnimatedMesh;
use modiste_io::{create_folder, dressed, glb, obj, pc2, ply, usd};
use serde::{Deserialize, Serialize};

use crate::export::SceneAccuracy;
use crate::{Animation, SceneError, Track};

/// How matt skin and cloth are.
const SKIN_ROUGHNESS: f32 = 0.6;
const CLOTH_ROUGHNESS: f32 = 0.9;
/// Materials of the OBJ files, in the same folder.
const MATERIALS: &str = "dressed.mtl";

/// A form in which an animation goes to files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Format {
    /// One file that every viewer plays; compressed by bones and morph targets.
    Glb,
    /// A USD layer with all vertices of every frame.
    Usd,
    /// An OBJ for each mesh with a point cache beside it, for Blender's Mesh Cache modifier.
    Pc2,
    /// An OBJ for each mesh and frame.
    Obj,
    /// A PLY for each mesh and frame.
    Ply,
    /// Plain arrays of all vertices.
    Npz,
}

impl Format {
    /// All forms.
    pub const ALL: [Self; 6] = [Self::Glb, Self::Usd, Self::Pc2, Self::Obj, Self::Ply, Self::Npz];
    /// Those that are written when none are named.
    pub const DEFAULT: [Self; 2] = [Self::Glb, Self::Npz];

    /// The file or folder that it is written to, where others are called `dressed` too.
    pub fn file_name(self) -> &'static str {
        match self {
            Self::Glb => "dressed.glb",
            Self::Usd => "dressed.usda",
            Self::Pc2 => "pc2",
            Self::Obj => "obj",
            Self::Ply => "ply",
            Self::Npz => "dressed.npz",
        }
    }
}

impl Track {
    /// The track with its looks for a file; `layer` is 0 for the body.
    pub(crate) fn mesh(&self, layer: usize) -> AnimatedMesh<'_> {
        let [red, green, blue] = self.colour.map(|component| linear_from_srgb(component.into()) as f32);
        AnimatedMesh {
            name: &self.name,
            faces: self.topology.faces(),
            frames: &*self.frames,
            uv: (!self.uv.is_empty()).then_some(self.uv.as_slice()),
            vertex_colours: None,
            colour: [red, green, blue, 1.0],
            roughness: if layer == 0 { SKIN_ROUGHNESS } else { CLOTH_ROUGHNESS },
            double_sided: layer > 0,
        }
    }
}

impl Animation {
    pub(crate) fn meshes(&self) -> Vec<AnimatedMesh<'_>> {
        self.tracks.iter().enumerate().map(|(layer, track)| track.mesh(layer)).collect()
    }

    /// Writes the animation in one form into `folder`, frame by frame; gives the file or folder, and of a compressed form how
    /// far its vertices are from where they should be.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(
        &self,
        format: Format,
        folder: &Path,
        progress: &dyn Progress,
    ) -> Result<(PathBuf, Option<SceneAccuracy>), SceneError> {
        let path = folder.join(format.file_name());
        let meshes = self.meshes();
        let mut accuracy = None;
        match format {
            Format::Glb => {
                let strips = self.hair.as_ref().map(|hair| hair.strips(self)).transpose()?;
                let hair = self.hair.as_ref().zip(strips.as_ref()).map(|(hair, strips)| hair.mesh(strips));
                let meshes: Vec<AnimatedMesh<'_>> = meshes.into_iter().chain(hair).collect();
                let summary = glb::write_animation(&path, self.fps, &meshes)?;
                let worst =
                    |error: fn(&glb::MeshSummary) -> f64| 1e3 * summary.meshes.iter().map(error).fold(0.0, f64::max);
                accuracy =
                    Some(SceneAccuracy { rms: worst(|mesh| mesh.rms_error), largest: worst(|mesh| mesh.max_error) });
            }
            Format::Usd => usd::write(&path, self.fps, &meshes)?,
            Format::Npz => {
                let hair = self.hair.as_ref().map(|hair| dressed::MovingCurves {
                    name: "hair",
                    points_per_curve: modiste_hair::POINTS,
                    frames: &hair.frames,
                });
                let counts: Vec<_> = self.flag_counts();
                dressed::write_with(&path, self.fps, &meshes, hair.as_slice(), &counts)?;
            }
            Format::Pc2 => {
                create_folder(&path)?;
                obj::write_materials(path.join(MATERIALS), &meshes)?;
                let mut first = Vec::new();
                for mesh in &meshes {
                    mesh.frames.read(0, &mut first)?;
                    obj::write_frame(path.join(format!("{}.obj", mesh.name)), mesh, &first, MATERIALS)?;
                    pc2::write(path.join(format!("{}.pc2", mesh.name)), mesh)?;
                }
            }
            Format::Obj => {
                create_folder(&path)?;
                obj::write_materials(path.join(MATERIALS), &meshes)?;
                self.write_sequence(progress, |mesh, frame, vertices| {
                    obj::write_frame(path.join(sequence_name(mesh.name, frame, "obj")), mesh, vertices, MATERIALS)
                })?;
            }
            Format::Ply => self.write_sequence(progress, |mesh, frame, vertices| {
                ply::write_frame(path.join(sequence_name(mesh.name, frame, "ply")), mesh.faces, vertices)
            })?,
        }
        Ok((path, accuracy))
    }

    /// Calls `write` for every mesh in every frame.
    fn write_sequence(
        &self,
        progress: &dyn Progress,
        write: impl Fn(&AnimatedMesh<'_>, usize, &[[f32; 3]]) -> Result<(), modiste_io::IoError>,
    ) -> Result<(), SceneError> {
        const STAGE: &str = "write a file for each frame";
        let meshes = self.meshes();
        progress.start(STAGE, meshes.len() * self.frame_count());
        for (index, mesh) in meshes.iter().enumerate() {
            mesh.for_each_frame(|frame, vertices| {
                progress.advance(STAGE, index * self.frame_count() + frame + 1);
                write(mesh, frame, vertices)
            })?;
        }
        progress.finish(STAGE);
        Ok(())
    }
}

/// Frames count from 1 here, as those who read such sequences do.
fn sequence_name(mesh: &str, frame: usize, ending: &str) -> String {
    format!("{mesh}_{:05}.{ending}", frame + 1)
}
