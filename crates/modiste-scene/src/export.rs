//! Files of an animation: scene, arrays, pictures and the report.

use std::path::{Path, PathBuf};

use modiste_core::Progress;
use modiste_core::render::{Image, linear_from_srgb};
use modiste_io::animated::AnimatedMesh;
use modiste_io::{StagedFolder, glb, png};
use serde::{Deserialize, Serialize};

use crate::timing::{Stage, Summary};
use crate::{Animation, FitMap, FlaggedFrames, Format, GarmentFit, HairReport, Layer, Machine, RegionFit, SceneError};

/// Frames at the start that the times leave out: memory is touched for the first time there.
const WARM_UP: usize = 3;
/// Frames on the contact sheet.
const SHEET_FRAMES: usize = 8;

/// Schema of `report.json`.
const REPORT_SCHEMA: &str = "modiste-dress-1";

/// Names of the files of a result, in the folder that [`write_results`] fills.
pub mod file_names {
    /// Ease and strain from four sides.
    pub const FIT_MAP: &str = "fit_map.png";
    /// One frame in the colours of ease.
    pub const FIT_EASE: &str = "fit_ease.glb";
    /// One frame in the colours of strain.
    pub const FIT_STRAIN: &str = "fit_strain.glb";
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
    /// Frames in which not all could be done for a garment, because the body is in itself or for want of room.
    #[serde(default)]
    pub flagged: Vec<FlaggedFrames>,
    /// How far vertices in the GLB lie from those in the arrays, because it is compressed; absent without a GLB.
    pub scene_error_mm: Option<SceneAccuracy>,
    /// Where the garments are tight and where they are loose; empty if that was not asked for.
    #[serde(default)]
    pub fit_map: Vec<RegionFit>,
    /// The hair, if there is any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hair: Option<HairReport>,
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

/// What goes into the folder of a result beside the pictures.
#[derive(Debug, Clone)]
pub struct Contents<'a> {
    /// What the report says of the request.
    pub subject: Subject,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// The forms in which the animation is written.
    pub formats: &'a [Format],
    /// Where the garments are tight and where they are loose.
    pub fit_map: Option<&'a FitMap>,
}

/// Fills the folder with scenes, pictures and report, and moves it to its place; gives the report and the files.
///
/// # Errors
/// A file cannot be written; then nothing is left.
pub fn write_results(
    animation: &Animation,
    contents: Contents<'_>,
    folder: StagedFolder,
    progress: &dyn Progress,
) -> Result<(Report, Vec<PathBuf>), SceneError> {
    let (report, names) = fill(animation, contents, folder.path(), progress).map_err(|error| match error {
        SceneError::Io(error) => SceneError::Io(folder.retold(error)),
        other => other,
    })?;
    let folder = folder.commit()?;
    Ok((report, names.into_iter().map(|name| folder.join(name)).collect()))
}

/// Fills the folder; gives the report and the names of what was written.
fn fill(
    animation: &Animation,
    contents: Contents<'_>,
    folder: &Path,
    progress: &dyn Progress,
) -> Result<(Report, Vec<&'static str>), SceneError> {
    let mut names = Vec::new();
    let mut scene_error_mm = None;
    for &format in contents.formats {
        let (_, accuracy) = animation.write(format, folder, progress)?;
        scene_error_mm = scene_error_mm.or(accuracy);
        names.push(format.file_name());
    }
    let mut draw = |name: &'static str, image: &Image| {
        names.push(name);
        png::write(folder.join(name), image.width, image.height, &image.rgb)
    };
    let middle = animation.frame_count() / 2;
    draw(file_names::CONTACT_SHEET, &animation.contact_sheet(SHEET_FRAMES)?)?;
    draw(file_names::TURNAROUND, &animation.turnaround(middle)?)?;
    if let Some(map) = contents.fit_map {
        draw(file_names::FIT_MAP, &map.picture(animation, middle)?)?;
        for (layer, name) in Layer::ALL.into_iter().zip([file_names::FIT_EASE, file_names::FIT_STRAIN]) {
            write_coloured(animation, map, layer, (middle, &folder.join(name)))?;
            names.push(name);
        }
    }
    let mut report = report(animation, contents.subject, contents.warnings, scene_error_mm);
    report.fit_map = contents.fit_map.map_or_else(Vec::new, FitMap::regions);
    modiste_io::json::write(folder.join(file_names::REPORT), &report)?;
    names.push(file_names::REPORT);
    Ok((report, names))
}

/// What is known of an animation once its scene is written.
pub fn report(
    animation: &Animation,
    subject: Subject,
    warnings: Vec<String>,
    scene_error_mm: Option<SceneAccuracy>,
) -> Report {
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
        flagged: animation.flagged(),
        scene_error_mm,
        fit_map: Vec::new(),
        warnings,
    }
}

/// Writes one frame as a GLB at rest whose garments have the colours of a map.
fn write_coloured(
    animation: &Animation,
    map: &FitMap,
    layer: Layer,
    (frame, path): (usize, &Path),
) -> Result<(), SceneError> {
    let linear = |colour: &[f32; 3]| colour.map(|component| linear_from_srgb(component.into()) as f32);
    let colours: Vec<Vec<[f32; 3]>> =
        map.colours(layer).iter().map(|garment| garment.iter().map(linear).collect()).collect();
    let mut frames = vec![vec![Vec::new()]; animation.tracks.len()];
    for (track, frames) in animation.tracks.iter().zip(&mut frames) {
        track.frames.read(frame, &mut frames[0])?;
    }
    let meshes: Vec<AnimatedMesh<'_>> = animation
        .meshes()
        .into_iter()
        .zip(&frames)
        .enumerate()
        .map(|(index, (mesh, frames))| match index.checked_sub(1) {
            Some(garment) => {
                AnimatedMesh { frames, vertex_colours: Some(&colours[garment]), colour: [1.0; 4], uv: None, ..mesh }
            }
            None => AnimatedMesh { frames, ..mesh },
        })
        .collect();
    glb::write_animation(path, animation.fps, &meshes)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::time::Duration;

    use modiste_core::shapes::icosphere;
    use modiste_core::{Silent, Vec3};
    use modiste_io::{StagedFolder, npz, png};

    use super::{Contents, Subject, file_names, write_results};
    use crate::animation::Store;
    use crate::{Animation, FitMap, Format, GarmentMap, Region, Timing, Track};

    /// A ball that rolls, with a larger one around it.
    fn animation(frames: usize) -> Animation {
        let mesh = icosphere(2);
        let track = |name: &str, radius: f64, colour, folder: Option<&std::path::Path>| {
            let mut store = Store::new(folder, mesh.vertices.len()).unwrap();
            for frame in 0..frames {
                let middle = Vec3::new(0.0, 1.0, 0.1 * frame as f64);
                store.push(&mesh.vertices.iter().map(|vertex| middle + radius * *vertex).collect::<Vec<_>>()).unwrap();
            }
            Track {
                name: name.to_owned(),
                topology: Arc::clone(&mesh.topology),
                frames: store.finish().unwrap(),
                colour,
                uv: Vec::new(),
            }
        };
        let folder = tempfile::tempdir().unwrap();
        let mut timing = Timing::default();
        for frame in 0..frames as u64 {
            timing.push([Duration::from_millis(frame), Duration::from_millis(2), Duration::from_millis(3)]);
        }
        Animation {
            fps: 30.0,
            tracks: vec![
                track("body", 0.5, [0.8, 0.6, 0.5], None),
                track("tshirt", 0.6, [0.7, 0.2, 0.2], Some(folder.path())),
            ],
            headings: vec![0.0; frames],
            timing,
            fits: Vec::new(),
            flags: vec![Vec::new(); frames],
            hair: None,
        }
    }

    fn subject() -> Subject {
        let words = || "x".to_owned();
        Subject { gender: words(), shape: vec![0.5], motion: words(), garments: vec!["tshirt".to_owned()] }
    }

    fn contents<'a>(formats: &'a [Format], warnings: &[String]) -> Contents<'a> {
        Contents { subject: subject(), warnings: warnings.to_vec(), formats, fit_map: None }
    }

    #[test]
    fn every_form_holds_the_same_vertices() {
        let root = tempfile::tempdir().unwrap();
        let out = root.path().join("out");
        let animation = animation(5);
        let staged = StagedFolder::new(&out).unwrap();
        let (_, files) = write_results(&animation, contents(&Format::ALL, &[]), staged, &Silent).unwrap();
        assert!(files.iter().all(modiste_io::exists));
        let count = animation.tracks[1].topology.vertex_count();
        let mut last = Vec::new();
        animation.tracks[1].frames.read(4, &mut last).unwrap();
        let near = |points: &[Vec3]| {
            let distance = |(p, q): (&Vec3, &[f32; 3])| p.distance(Vec3::from_array(q.map(f64::from)));
            assert!(points.len() == count && points.iter().zip(&last).all(|pair| distance(pair) < 1e-6));
        };
        near(&modiste_io::obj::read(out.join("obj/tshirt_00005.obj")).unwrap().0);
        near(&modiste_io::ply::read(out.join("ply/tshirt_00005.ply")).unwrap().0);
        let cache = modiste_io::read_bytes(out.join("pc2/tshirt.pc2")).unwrap();
        assert_eq!(cache.len(), 32 + 5 * count * 12);
        let floats =
            |bytes: &[u8]| bytes.as_chunks().0.iter().map(|&b| f64::from(f32::from_le_bytes(b))).collect::<Vec<_>>();
        let points: Vec<Vec3> = floats(&cache[32 + 4 * count * 12..]).chunks(3).map(Vec3::from_slice).collect();
        near(&points);
        let first = modiste_io::obj::read(out.join("pc2/tshirt.obj")).unwrap();
        assert_eq!(first.1, animation.tracks[1].topology.faces());
        let usd = modiste_io::read_text(out.join("dressed.usda")).unwrap();
        assert!(usd.contains(&format!("{:.5}", last[0][1])) && usd.contains("endTimeCode = 4"));
    }

    #[test]
    fn a_fit_map_is_drawn_and_told() {
        let root = tempfile::tempdir().unwrap();
        let animation = animation(3);
        let count = animation.tracks[1].topology.vertex_count();
        let map = FitMap {
            garments: vec![GarmentMap {
                garment: "tshirt".into(),
                size: "M".into(),
                ease_mm: vec![60.0; count],
                strain_percent: vec![20.0; count],
                regions: vec![Some(Region::Chest); count],
            }],
        };
        let staged = StagedFolder::new(root.path().join("out")).unwrap();
        let contents = Contents { fit_map: Some(&map), ..contents(&[], &[]) };
        let (report, files) = write_results(&animation, contents, staged, &Silent).unwrap();
        assert_eq!((files.len(), report.fit_map.len(), report.scene_error_mm), (6, 1, None));
        let picture = png::read(root.path().join("out").join(file_names::FIT_MAP)).unwrap();
        let (upper, lower) = picture.rgb.split_at(picture.rgb.len() / 2);
        let pixels = |half: &[u8], high: usize, low: usize| {
            half.chunks_exact(3).filter(|pixel| pixel[high] > pixel[low].saturating_add(60)).count()
        };
        assert!(pixels(upper, 2, 0) > 50_000, "far from the body is blue");
        assert!(pixels(lower, 0, 2) > 50_000, "stretched is red");
    }

    #[test]
    fn every_file_is_written_and_agrees_with_the_animation() {
        let root = tempfile::tempdir().unwrap();
        let animation = animation(10);
        let staged = StagedFolder::new(root.path().join("out")).unwrap();
        let warnings = vec!["mind the gap".to_owned()];
        let contents = contents(&Format::DEFAULT, &warnings);
        let (report, files) = write_results(&animation, contents, staged, &Silent).unwrap();
        assert_eq!(files.len(), 5);
        assert!(files.iter().all(modiste_io::exists));

        let arrays = npz::Reader::open(root.path().join("out").join(Format::Npz.file_name())).unwrap();
        let cloth = arrays.f32("tshirt").unwrap();
        assert_eq!(cloth.shape, [10, animation.tracks[1].topology.vertex_count(), 3]);
        let mut first = Vec::new();
        animation.tracks[1].frames.read(0, &mut first).unwrap();
        assert_eq!(cloth.data[..3], first[0]);
        assert_eq!(arrays.triangles("body_faces").unwrap(), animation.tracks[0].topology.faces());

        let read: super::Report = modiste_io::json::read(root.path().join("out").join(file_names::REPORT)).unwrap();
        // Printed numbers may differ in the last bit when they are read again.
        let error = |report: &super::Report| report.scene_error_mm.unwrap().largest;
        assert!((error(&read) - error(&report)).abs() < 1e-12);
        assert_eq!(super::Report { scene_error_mm: report.scene_error_mm, ..read }, report);
        assert_eq!((report.frames, &report.warnings), (10, &warnings));
        let times = report.milliseconds_per_frame.unwrap();
        assert!((times.body.median - 6.0).abs() < 1e-9 && (times.total.median - 11.0).abs() < 1e-9);
        // A rolling ball only moves as a whole, which the scene stores without loss.
        assert!(error(&report) < 0.01, "{:?}", report.scene_error_mm);

        let sheet = png::read(root.path().join("out").join(file_names::CONTACT_SHEET)).unwrap();
        let red = sheet.rgb.chunks_exact(3).filter(|pixel| pixel[0] > pixel[1].saturating_add(60)).count();
        assert!(red > 8 * 380 * 640 / 10, "{red} pixels of cloth");
    }

    #[test]
    fn short_animations_have_no_times_but_all_files() {
        let root = tempfile::tempdir().unwrap();
        let staged = StagedFolder::new(root.path().join("out")).unwrap();
        let contents = contents(&Format::DEFAULT, &[]);
        let (report, files) = write_results(&animation(1), contents, staged, &Silent).unwrap();
        assert_eq!(report.milliseconds_per_frame, None);
        assert_eq!(files.len(), 5);
    }
}
