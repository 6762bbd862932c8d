//! The dressed result as plain arrays that anything can check: body and garments in every frame.

use std::io::{Seek, Write};
use std::path::Path;

use crate::animated::{AnimatedMesh, FrameSource, check};
use crate::npz::{self, ArchiveWriter};
use crate::pc2::keep;
use crate::{IoError, write_atomically};

/// Name of the body among the meshes.
pub const BODY: &str = "body";
/// How the names of arrays of faces end.
const FACES: &str = "_faces";

/// Curves in motion, such as hair.
#[derive(Debug, Clone, Copy)]
pub struct MovingCurves<'a> {
    /// Name of the array.
    pub name: &'a str,
    /// Points of each curve.
    pub points_per_curve: usize,
    /// Points in world (m) of all curves, one after the other, in each frame.
    pub frames: &'a dyn FrameSource,
}

/// Writes an npz with, for each mesh, `<name>` (F, V, 3) f32 and `<name>_faces` (T, 3) u32, and `fps`.
///
/// By convention the first mesh is called "body". Frames go to the file one by one.
///
/// # Errors
/// [`IoError`] naming the mesh: no frames, frames of different sizes, or faces that name absent vertices.
pub fn write(path: impl AsRef<Path>, fps: f64, meshes: &[AnimatedMesh<'_>]) -> Result<(), IoError> {
    write_with(path, fps, meshes, &[], &[])
}

/// Numbers that belong to frames, such as flags.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FrameCounts {
    /// Name of the array.
    pub name: String,
    /// Numbers of each frame.
    pub per_frame: usize,
    /// Those of all frames, one after the other.
    pub values: Vec<u32>,
}

/// [`write`] with, for each set of curves, a further array `<name>` (F, N, P, 3) f32, and for each of counts one (F, C) u32.
///
/// # Errors
/// As [`write`]; also frames that are no whole number of curves, or counts of other frames.
pub fn write_with(
    path: impl AsRef<Path>,
    fps: f64,
    meshes: &[AnimatedMesh<'_>],
    curves: &[MovingCurves<'_>],
    counts: &[FrameCounts],
) -> Result<(), IoError> {
    let path = path.as_ref();
    let file = path.display().to_string();
    let frame_count = check(fps, meshes, &file)?;
    let wrong_count = |name: &str, found: usize| {
        Err(IoError::field(&file, format!("mesh \"{name}\""), format!("{frame_count} frames"), found))
    };
    if let Some(mesh) = meshes.iter().find(|mesh| mesh.frames.frame_count() != frame_count) {
        return wrong_count(mesh.name, mesh.frames.frame_count());
    }
    for curves in curves {
        if curves.frames.frame_count() != frame_count {
            return wrong_count(curves.name, curves.frames.frame_count());
        }
        let points = curves.frames.vertex_count(0);
        if curves.points_per_curve == 0 || !points.is_multiple_of(curves.points_per_curve) {
            let wanted = format!("a multiple of {} points", curves.points_per_curve);
            return Err(IoError::field(&file, format!("curves \"{}\"", curves.name), wanted, points));
        }
    }
    if let Some(counts) = counts.iter().find(|counts| counts.values.len() != frame_count * counts.per_frame) {
        let wanted = format!("{} for each of {frame_count} frames", counts.per_frame);
        return Err(IoError::field(&file, format!("counts \"{}\"", counts.name), wanted, counts.values.len()));
    }
    let mut unread = None;
    let written = write_atomically(path, |file| {
        let mut archive = ArchiveWriter::new(file);
        for mesh in meshes {
            let shape = [frame_count, mesh.vertex_count(), 3];
            add_frames(&mut archive, &mut unread, mesh.name, &shape, mesh.frames)?;
            archive.add(&format!("{}{FACES}", mesh.name), &[mesh.faces.len(), 3], [mesh.faces.as_flattened()])?;
        }
        for curves in curves {
            let each = curves.points_per_curve;
            let shape = [frame_count, curves.frames.vertex_count(0) / each, each, 3];
            add_frames(&mut archive, &mut unread, curves.name, &shape, curves.frames)?;
        }
        for counts in counts {
            archive.add(&counts.name, &[frame_count, counts.per_frame], [&counts.values[..]])?;
        }
        archive.add("fps", &[], [&[fps][..]])?;
        archive.finish()
    });
    unread.map_or(written, Err)
}

/// Adds the array of all frames; `unread` keeps the error of a frame that cannot be read.
fn add_frames<W: Write + Seek>(
    archive: &mut ArchiveWriter<W>,
    unread: &mut Option<IoError>,
    name: &str,
    shape: &[usize],
    frames: &dyn FrameSource,
) -> std::io::Result<()> {
    let mut array = archive.start::<f32>(name, shape)?;
    let mut points = Vec::new();
    for frame in 0..frames.frame_count() {
        keep(unread, frames.read(frame, &mut points))?;
        array.push(points.as_flattened())?;
    }
    array.finish()
}

/// What a dressed result holds, without its frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Contents {
    /// Frames per second.
    pub fps: f64,
    /// Number of frames.
    pub frame_count: usize,
    /// The meshes in the order of the file.
    pub meshes: Vec<Surface>,
}

/// A mesh of a dressed result.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Name of its array.
    pub name: String,
    /// Number of vertices.
    pub vertex_count: usize,
    /// Triangles.
    pub faces: Vec<[u32; 3]>,
}

/// Reads what a result holds; every array (F, V, 3) with `<name>_faces` beside it is a mesh.
///
/// # Errors
/// [`IoError`] naming the array that is missing or of another shape.
pub fn read_contents(path: impl AsRef<Path>) -> Result<Contents, IoError> {
    let file = path.as_ref().display().to_string();
    let reader = npz::Reader::open(path)?;
    let names = reader.names_in_order().iter().filter(|name| reader.contains(&format!("{name}{FACES}")));
    let mut contents = Contents { fps: reader.scalar("fps")?, frame_count: 0, meshes: Vec::new() };
    if !(contents.fps.is_finite() && contents.fps > 0.0) {
        return Err(IoError::field(&file, "array \"fps\"", "a number above 0", contents.fps));
    }
    for name in names {
        let shape = reader.shape(name)?;
        let frames = (!contents.meshes.is_empty()).then_some(contents.frame_count);
        reader.check_shape(name, &shape, &[frames, None, Some(3)])?;
        let faces = reader.triangles(&format!("{name}{FACES}"))?;
        contents.frame_count = shape[0];
        contents.meshes.push(Surface { name: name.clone(), vertex_count: shape[1], faces });
    }
    if !contents.meshes.iter().any(|mesh| mesh.name == BODY) {
        let found = contents.meshes.iter().map(|mesh| mesh.name.as_str()).collect::<Vec<_>>().join(", ");
        let found = if found.is_empty() { "no meshes".to_owned() } else { format!("only {found}") };
        return Err(IoError::field(&file, "the meshes", "one called \"body\"", found));
    }
    Ok(contents)
}

/// Calls `visit` with frame after frame: the vertices (m) of every mesh of `contents`, in their order. One frame is held.
///
/// # Errors
/// [`IoError`] when an array is truncated or not finite; else that of `visit`, which ends the reading.
pub fn for_each_frame<E: From<IoError>>(
    path: impl AsRef<Path>,
    contents: &Contents,
    mut visit: impl FnMut(usize, &[&[[f32; 3]]]) -> Result<(), E>,
) -> Result<(), E> {
    let names: Vec<&str> = contents.meshes.iter().map(|mesh| mesh.name.as_str()).collect();
    npz::for_each_row(path, &names, |frame, rows| {
        let meshes: Vec<&[[f32; 3]]> = rows.iter().map(|row| row.as_chunks().0).collect();
        visit(frame, &meshes)
    })
}

#[cfg(test)]
mod tests {
    use super::{FrameCounts, MovingCurves, write, write_with};
    use crate::animated::AnimatedMesh;
    use crate::npz::Reader;

    #[test]
    fn results_that_cannot_be_read_say_why() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bad.npz");
        let refused = |fill: &dyn Fn(&mut crate::npz::Writer<'_>)| {
            let mut writer = crate::npz::Writer::new();
            fill(&mut writer);
            writer.save(&path).unwrap();
            super::read_contents(&path).unwrap_err().to_string()
        };
        assert!(refused(&|_| {}).contains("array \"fps\""));
        let fps = |writer: &mut crate::npz::Writer<'_>| {
            writer.add_f64("fps", &[], vec![30.0]);
        };
        assert!(refused(&fps).contains("wanted one called \"body\", found no meshes"));
        let flat = refused(&|writer| {
            fps(writer);
            writer.add_f32("body", &[2, 3], vec![0.0; 6]).add_u32("body_faces", &[1, 3], vec![0, 1, 1]);
        });
        assert!(flat.contains("array \"body\": wanted shape [any, any, 3], found shape [2, 3]"), "{flat}");
        let uneven = refused(&|writer| {
            fps(writer);
            writer.add_f32("body", &[2, 1, 3], vec![0.0; 6]).add_u32("body_faces", &[0, 3], vec![]);
            writer.add_f32("shirt", &[1, 1, 3], vec![0.0; 3]).add_u32("shirt_faces", &[0, 3], vec![]);
        });
        assert!(uneven.contains("array \"shirt\": wanted shape [2, any, 3]"), "{uneven}");
    }

    #[test]
    fn arrays_have_the_agreed_names_and_shapes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("dressed.npz");
        let faces = [[0, 1, 2]];
        let body: Vec<Vec<[f32; 3]>> = (0..4).map(|frame| vec![[frame as f32, 0.0, 0.5]; 3]).collect();
        let shirt: Vec<Vec<[f32; 3]>> = vec![vec![[1.0; 3]; 5]; 4];
        let mesh = |name, frames| AnimatedMesh::plain(name, &faces, frames);
        write(&path, 30.0, &[mesh("body", &body), mesh("tshirt", &shirt)]).unwrap();
        let reader = Reader::open(&path).unwrap();
        assert_eq!(reader.names(), ["body", "body_faces", "fps", "tshirt", "tshirt_faces"]);
        let read = reader.f32("body").unwrap();
        assert_eq!(read.shape, [4, 3, 3]);
        assert_eq!(read.data[27..30], [3.0, 0.0, 0.5]);
        assert_eq!(reader.f32("tshirt").unwrap().shape, [4, 5, 3]);
        assert_eq!(reader.triangles("tshirt_faces").unwrap(), faces);
        assert!((reader.scalar("fps").unwrap() - 30.0).abs() < 1e-12);

        let contents = super::read_contents(&path).unwrap();
        assert_eq!((contents.frame_count, contents.meshes.len()), (4, 2));
        assert_eq!(
            contents.meshes[1],
            super::Surface { name: "tshirt".into(), vertex_count: 5, faces: faces.to_vec() }
        );
        let mut seen = Vec::new();
        super::for_each_frame(&path, &contents, |frame, meshes| {
            seen.push((frame, meshes[0][2], meshes[1].len()));
            Ok::<(), crate::IoError>(())
        })
        .unwrap();
        assert_eq!(seen[3], (3, [3.0, 0.0, 0.5], 5));

        let curves = |each| MovingCurves { name: "hair", points_per_curve: each, frames: &shirt };
        let with_hair = folder.path().join("hair.npz");
        write_with(&with_hair, 30.0, &[mesh("body", &body)], &[curves(5)], &[]).unwrap();
        let counts = |values| FrameCounts { name: "shirt_flags".to_owned(), per_frame: 2, values };
        let flagged = folder.path().join("flags.npz");
        write_with(&flagged, 30.0, &[mesh("body", &body)], &[], &[counts((0..8).collect())]).unwrap();
        assert_eq!(super::read_contents(&flagged).unwrap().meshes.len(), 1, "flags are no mesh");
        let few = write_with(&flagged, 30.0, &[mesh("body", &body)], &[], &[counts(vec![0; 7])]).unwrap_err();
        assert!(few.to_string().contains("2 for each of 4 frames, found 7"), "{few}");
        assert_eq!(Reader::open(&with_hair).unwrap().f32("hair").unwrap().shape, [4, 1, 5, 3]);
        let uneven = write_with(&with_hair, 30.0, &[mesh("body", &body)], &[curves(3)], &[]).unwrap_err();
        assert!(uneven.to_string().contains("a multiple of 3 points, found 5"), "{uneven}");

        let (one, two) = (vec![shirt[0].clone()], vec![shirt[0].clone(); 2]);
        let message = |meshes: &[AnimatedMesh<'_>], fps| write(&path, fps, meshes).unwrap_err().to_string();
        assert!(
            message(&[mesh("body", &body), mesh("tshirt", &two)], 30.0)
                .contains("mesh \"tshirt\": wanted 4 frames, or 1, found 2")
        );
        assert!(
            message(&[mesh("body", &body), mesh("tshirt", &one)], 30.0)
                .contains("mesh \"tshirt\": wanted 4 frames, found 1")
        );
        let (few, nan) = (vec![vec![[0.0; 3]; 2]], vec![vec![[f32::NAN; 3]; 3]]);
        assert!(message(&[mesh("body", &few)], 30.0).contains("faces of 2 vertices, found vertex 2"));
        assert!(message(&[mesh("body", &nan)], 30.0).contains("finite"));
        assert!(message(&[mesh("body", &body)], 0.0).contains("fps"));
    }
}
