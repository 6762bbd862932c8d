//! Files of an animation: scene, arrays, pictures and the report.

use std::path::{Path, PathBuf};

use modiste_core::render::linear_from_srgb;
use modiste_io::{StagedFolder, dressed, glb, png};
use serde::{Deserialize, Serialize};

use crate::timing::{Stage, Summary};
use crate::{Animation, GarmentFit, HairReport, Machine, SceneError};

/// Frames at the start that the times leave out: memory is touched for the first time there.
const WARM_UP: usize = 3;
/// Frames on the contact sheet.
const SHEET_FRAMES: usize = 8;

/// How matt skin and cloth are in the scene.
const SKIN_ROUGHNESS: f32 = 0.6;
const CLOTH_ROUGHNESS: f32 = 0.9;
const HAIR_ROUGHNESS: f32 = 0.45;
/// Schema of `report.json`.
const REPORT_SCHEMA: &str = "modiste-dress-1";

/// Names of the files of a result, in the folder that [`write_results`] fills.
pub mod file_names {
    /// Animated scene.
    pub const SCENE: &str = "dressed.glb";
    /// Vertices of all frames, as design.md says.
    pub const ARRAYS: &str = "dressed.npz";
    /// Eight frames.
    pub const CONTACT_SHEET: &str = "contact_sheet.png";
    /// One frame from four sides.
    pub const TURNAROUND: &str = "turnaround.png";
    /// The report.
    pub const REPORT: &str = "report.json";
}

/// What the report says of the request.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Subject {
    /// `female` or `male`.
    pub gender: String,
    /// Body shape in standard deviations, β.
    pub shape: Vec<f64>,
    /// The motion: a file or a built-in action.
    pub motion: String,
    /// The garments, from the innermost outwards.
    pub garments: Vec<String>,
}

/// `report.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Version of this form.
    pub schema: String,
    /// Who wears what and does what.
    pub subject: Subject,
    /// Number of frames.
    pub frames: usize,
    /// Frames per second.
    pub fps: f64,
    /// Time per frame (ms) of each stage and of all together, after a warm-up of three frames, one character at a time;
    /// absent when there are no more frames than that.
    pub milliseconds_per_frame: Option<Times>,
    /// The machine that they were measured on.
    pub machine: Machine,
    /// Vertices inside the body, before and after the fit.
    pub penetration: Vec<GarmentFit>,
    /// The hair, if there is any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hair: Option<HairReport>,
    /// How far vertices in the scene file lie from those in the arrays: the scene is compressed.
    pub scene_error_mm: SceneAccuracy,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// Distances (mm) between two versions of the same frames, over the worst of the meshes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SceneAccuracy {
    /// Root mean square over vertices and frames.
    pub rms: f64,
    /// The largest.
    pub largest: f64,
}

/// Time per frame (ms).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[expect(missing_docs, reason = "the stages")]
pub struct Times {
    pub body: Summary,
    pub synthesis: Summary,
    pub fit: Summary,
    pub total: Summary,
}

/// Fills the folder with scene, arrays, pictures and report, and moves it to its place; gives the report and the files.
///
/// # Errors
/// A file cannot be written; then nothing is left.
pub fn write_results(
    animation: &Animation,
    subject: Subject,
    warnings: Vec<String>,
    folder: StagedFolder,
) -> Result<(Report, Vec<PathBuf>), SceneError> {
    let report = fill(animation, subject, warnings, folder.path()).map_err(|error| match error {
        SceneError::Io(error) => SceneError::Io(folder.retold(error)),
        other => other,
    })?;
    let folder = folder.commit()?;
    let names =
        [file_names::SCENE, file_names::ARRAYS, file_names::CONTACT_SHEET, file_names::TURNAROUND, file_names::REPORT];
    Ok((report, names.map(|name| folder.join(name)).to_vec()))
}

fn fill(animation: &Animation, subject: Subject, warnings: Vec<String>, folder: &Path) -> Result<Report, SceneError> {
    let at = |name: &str| folder.join(name);
    let scene_error_mm = write_scene(animation, &at(file_names::SCENE))?;
    write_arrays(animation, &at(file_names::ARRAYS))?;
    let sheet = animation.contact_sheet(SHEET_FRAMES);
    png::write(at(file_names::CONTACT_SHEET), sheet.width, sheet.height, &sheet.rgb)?;
    let turnaround = animation.turnaround(animation.frame_count() / 2);
    png::write(at(file_names::TURNAROUND), turnaround.width, turnaround.height, &turnaround.rgb)?;
    let report = report(animation, subject, warnings, scene_error_mm);
    modiste_io::json::write(at(file_names::REPORT), &report)?;
    Ok(report)
}

/// What is known of an animation once its scene is written.
pub fn report(animation: &Animation, subject: Subject, warnings: Vec<String>, scene_error_mm: SceneAccuracy) -> Report {
    let timing = &animation.timing;
    let times = || {
        Some(Times {
            body: timing.stage(Stage::Body, WARM_UP)?,
            synthesis: timing.stage(Stage::Synthesis, WARM_UP)?,
            fit: timing.stage(Stage::Fit, WARM_UP)?,
            total: timing.total(WARM_UP)?,
        })
    };
    Report {
        schema: REPORT_SCHEMA.to_owned(),
        subject,
        frames: animation.frame_count(),
        fps: animation.fps,
        milliseconds_per_frame: times(),
        machine: Machine::this(),
        penetration: animation.fits.clone(),
        hair: animation.hair.as_ref().map(|hair| hair.report.clone()),
        scene_error_mm,
        warnings,
    }
}

/// Writes the animated GLB; tells how far its vertices are from where they should be.
fn write_scene(animation: &Animation, path: &Path) -> Result<SceneAccuracy, SceneError> {
    let meshes: Vec<glb::AnimatedMesh<'_>> = animation
        .tracks
        .iter()
        .enumerate()
        .map(|(layer, track)| {
            let [red, green, blue] = track.colour.map(|component| linear_from_srgb(component.into()) as f32);
            glb::AnimatedMesh {
                name: &track.name,
                faces: track.topology.faces(),
                frames: &track.frames,
                colour: [red, green, blue, 1.0],
                roughness: if layer == 0 { SKIN_ROUGHNESS } else { CLOTH_ROUGHNESS },
                double_sided: layer > 0,
            }
        })
        .collect();
    let strips = animation.hair.as_ref().map(|hair| hair.strips(animation));
    let mut meshes = meshes;
    if let (Some(strips), Some(hair)) = (&strips, &animation.hair) {
        let [red, green, blue] = hair.colour.map(|component| linear_from_srgb(component.into()) as f32);
        meshes.push(glb::AnimatedMesh {
            name: "hair",
            faces: &strips.faces,
            frames: &strips.frames,
            colour: [red, green, blue, 1.0],
            roughness: HAIR_ROUGHNESS,
            double_sided: true,
        });
    }
    let summary = glb::write_animation(path, animation.fps, &meshes)?;
    let worst = |error: fn(&glb::MeshSummary) -> f64| 1e3 * summary.meshes.iter().map(error).fold(0.0, f64::max);
    Ok(SceneAccuracy { rms: worst(|mesh| mesh.rms_error), largest: worst(|mesh| mesh.max_error) })
}

/// Writes `body`, `body_faces`, `<garment>`, `<garment>_faces` and `fps`.
fn write_arrays(animation: &Animation, path: &Path) -> Result<(), SceneError> {
    let meshes: Vec<dressed::MovingMesh<'_>> = animation
        .tracks
        .iter()
        .map(|track| dressed::MovingMesh { name: &track.name, faces: track.topology.faces(), frames: &track.frames })
        .collect();
    let hair = animation.hair.as_ref().map(|hair| dressed::MovingCurves {
        name: "hair",
        points_per_curve: modiste_hair::POINTS,
        frames: &hair.frames,
    });
    Ok(dressed::write_with_curves(path, animation.fps, &meshes, hair.as_slice())?)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::time::Duration;

    use modiste_core::Vec3;
    use modiste_core::shapes::icosphere;
    use modiste_io::{StagedFolder, npz, png};

    use super::{Subject, file_names, write_results};
    use crate::animation::stored;
    use crate::{Animation, Timing, Track};

    /// A ball that rolls, with a larger one around it.
    fn animation(frames: usize) -> Animation {
        let mesh = icosphere(2);
        let track = |name: &str, radius: f64, colour| Track {
            name: name.to_owned(),
            topology: Arc::clone(&mesh.topology),
            frames: (0..frames)
                .map(|frame| {
                    let middle = Vec3::new(0.0, 1.0, 0.1 * frame as f64);
                    stored(&mesh.vertices.iter().map(|vertex| middle + radius * *vertex).collect::<Vec<_>>())
                })
                .collect(),
            colour,
        };
        let mut timing = Timing::default();
        for frame in 0..frames as u64 {
            timing.push([Duration::from_millis(frame), Duration::from_millis(2), Duration::from_millis(3)]);
        }
        Animation {
            fps: 30.0,
            tracks: vec![track("body", 0.5, [0.8, 0.6, 0.5]), track("tshirt", 0.6, [0.7, 0.2, 0.2])],
            headings: vec![0.0; frames],
            timing,
            fits: Vec::new(),
            hair: None,
        }
    }

    fn subject() -> Subject {
        let words = || "x".to_owned();
        Subject { gender: words(), shape: vec![0.5], motion: words(), garments: vec!["tshirt".to_owned()] }
    }

    #[test]
    fn every_file_is_written_and_agrees_with_the_animation() {
        let root = tempfile::tempdir().unwrap();
        let animation = animation(10);
        let staged = StagedFolder::new(root.path().join("out")).unwrap();
        let warnings = vec!["mind the gap".to_owned()];
        let (report, files) = write_results(&animation, subject(), warnings.clone(), staged).unwrap();
        assert_eq!(files.len(), 5);
        assert!(files.iter().all(modiste_io::exists));

        let arrays = npz::Reader::open(root.path().join("out").join(file_names::ARRAYS)).unwrap();
        let cloth = arrays.f32("tshirt").unwrap();
        assert_eq!(cloth.shape, [10, animation.tracks[1].topology.vertex_count(), 3]);
        assert_eq!(cloth.data[..3], animation.tracks[1].frames[0][0]);
        assert_eq!(arrays.triangles("body_faces").unwrap(), animation.tracks[0].topology.faces());

        let read: super::Report = modiste_io::json::read(root.path().join("out").join(file_names::REPORT)).unwrap();
        // Printed numbers may differ in the last bit when they are read again.
        assert!((read.scene_error_mm.largest - report.scene_error_mm.largest).abs() < 1e-12);
        assert_eq!(super::Report { scene_error_mm: report.scene_error_mm, ..read }, report);
        assert_eq!((report.frames, &report.warnings), (10, &warnings));
        let times = report.milliseconds_per_frame.unwrap();
        assert!((times.body.median - 6.0).abs() < 1e-9 && (times.total.median - 11.0).abs() < 1e-9);
        // A rolling ball only moves as a whole, which the scene stores without loss.
        assert!(report.scene_error_mm.largest < 0.01, "{:?}", report.scene_error_mm);

        let sheet = png::read(root.path().join("out").join(file_names::CONTACT_SHEET)).unwrap();
        let red = sheet.rgb.chunks_exact(3).filter(|pixel| pixel[0] > pixel[1].saturating_add(60)).count();
        assert!(red > 8 * 380 * 640 / 10, "{red} pixels of cloth");
    }

    #[test]
    fn short_animations_have_no_times_but_all_files() {
        let root = tempfile::tempdir().unwrap();
        let staged = StagedFolder::new(root.path().join("out")).unwrap();
        let (report, files) = write_results(&animation(1), subject(), Vec::new(), staged).unwrap();
        assert_eq!(report.milliseconds_per_frame, None);
        assert_eq!(files.len(), 5);
    }
}
