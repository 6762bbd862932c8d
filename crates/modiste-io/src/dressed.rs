//! The dressed result as plain arrays that anything can check: body and garments in every frame.

use std::path::Path;

use crate::npz::ArchiveWriter;
use crate::{IoError, write_atomically};

/// A mesh in motion.
#[derive(Debug, Clone, Copy)]
pub struct MovingMesh<'a> {
    /// Name of its array; the faces go to `<name>_faces`.
    pub name: &'a str,
    /// Triangles.
    pub faces: &'a [[u32; 3]],
    /// Vertices in world (m) in each frame.
    pub frames: &'a [Vec<[f32; 3]>],
}

/// Curves in motion, such as hair.
#[derive(Debug, Clone, Copy)]
pub struct MovingCurves<'a> {
    /// Name of the array.
    pub name: &'a str,
    /// Points of each curve.
    pub points_per_curve: usize,
    /// Points in world (m) of all curves, one after the other, in each frame.
    pub frames: &'a [Vec<[f32; 3]>],
}

/// [`write`] with, for each set of curves, a further array `<name>` (F, N, P, 3) f32.
///
/// # Errors
/// As [`write`]; also frames that are no whole number of curves.
pub fn write_with_curves(
    path: impl AsRef<Path>,
    fps: f64,
    meshes: &[MovingMesh<'_>],
    curves: &[MovingCurves<'_>],
) -> Result<(), IoError> {
    let path = path.as_ref();
    let file = path.display().to_string();
    if !(fps.is_finite() && fps > 0.0) {
        return Err(IoError::field(&file, "fps", "a number above 0", fps));
    }
    let frame_count = meshes.first().map_or(0, |mesh| mesh.frames.len());
    for mesh in meshes {
        check(mesh, frame_count, &file)?;
    }
    for curves in curves {
        check(&MovingMesh { name: curves.name, faces: &[], frames: curves.frames }, frame_count, &file)?;
        let points = curves.frames[0].len();
        if curves.points_per_curve == 0 || !points.is_multiple_of(curves.points_per_curve) {
            let wanted = format!("a multiple of {} points", curves.points_per_curve);
            return Err(IoError::field(&file, format!("curves \"{}\"", curves.name), wanted, points));
        }
    }
    write_atomically(path, |file| {
        let mut archive = ArchiveWriter::new(file);
        for mesh in meshes {
            let vertex_count = mesh.frames.first().map_or(0, Vec::len);
            let frames = mesh.frames.iter().map(|frame| frame.as_flattened());
            archive.add(mesh.name, &[mesh.frames.len(), vertex_count, 3], frames)?;
            archive.add(&format!("{}_faces", mesh.name), &[mesh.faces.len(), 3], [mesh.faces.as_flattened()])?;
        }
        for curves in curves {
            let each = curves.points_per_curve;
            let shape = [curves.frames.len(), curves.frames[0].len() / each, each, 3];
            archive.add(curves.name, &shape, curves.frames.iter().map(|frame| frame.as_flattened()))?;
        }
        archive.add("fps", &[], [&[fps][..]])?;
        archive.finish()
    })
}

/// Writes an npz with, for each mesh, `<name>` (F, V, 3) f32 and `<name>_faces` (T, 3) u32, and `fps`.
///
/// By convention the first mesh is called "body". Frames go to the file one by one.
///
/// # Errors
/// [`IoError`] naming the mesh: no frames, frames of different sizes, or faces that name absent vertices.
pub fn write(path: impl AsRef<Path>, fps: f64, meshes: &[MovingMesh<'_>]) -> Result<(), IoError> {
    write_with_curves(path, fps, meshes, &[])
}

fn check(mesh: &MovingMesh<'_>, frame_count: usize, file: &str) -> Result<(), IoError> {
    let wrong =
        |wanted: String, found: String| Err(IoError::field(file, format!("mesh \"{}\"", mesh.name), wanted, found));
    if mesh.frames.is_empty() || mesh.frames.len() != frame_count {
        return wrong(format!("{} frames", frame_count.max(1)), mesh.frames.len().to_string());
    }
    let vertex_count = mesh.frames[0].len();
    for (index, frame) in mesh.frames.iter().enumerate() {
        if frame.len() != vertex_count {
            return wrong(format!("{vertex_count} vertices in frame {index}"), frame.len().to_string());
        }
        if let Some(at) = frame.iter().position(|vertex| vertex.iter().any(|x| !x.is_finite())) {
            return wrong("finite vertices".to_owned(), format!("{:?} at vertex {at} of frame {index}", frame[at]));
        }
    }
    match mesh.faces.as_flattened().iter().find(|&&vertex| vertex as usize >= vertex_count) {
        Some(vertex) => wrong(format!("faces of {vertex_count} vertices"), format!("vertex {vertex}")),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::{MovingCurves, MovingMesh, write, write_with_curves};
    use crate::npz::Reader;

    #[test]
    fn arrays_have_the_agreed_names_and_shapes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("dressed.npz");
        let faces = [[0, 1, 2]];
        let body: Vec<Vec<[f32; 3]>> = (0..4).map(|frame| vec![[frame as f32, 0.0, 0.5]; 3]).collect();
        let shirt: Vec<Vec<[f32; 3]>> = vec![vec![[1.0; 3]; 5]; 4];
        let mesh = |name, frames| MovingMesh { name, faces: &faces, frames };
        write(&path, 30.0, &[mesh("body", &body), mesh("tshirt", &shirt)]).unwrap();
        let reader = Reader::open(&path).unwrap();
        assert_eq!(reader.names(), ["body", "body_faces", "fps", "tshirt", "tshirt_faces"]);
        let read = reader.f32("body").unwrap();
        assert_eq!(read.shape, [4, 3, 3]);
        assert_eq!(read.data[27..30], [3.0, 0.0, 0.5]);
        assert_eq!(reader.f32("tshirt").unwrap().shape, [4, 5, 3]);
        assert_eq!(reader.triangles("tshirt_faces").unwrap(), faces);
        assert!((reader.scalar("fps").unwrap() - 30.0).abs() < 1e-12);

        let curves = |each, frames| MovingCurves { name: "hair", points_per_curve: each, frames };
        write_with_curves(&path, 30.0, &[mesh("body", &body)], &[curves(5, &shirt)]).unwrap();
        assert_eq!(Reader::open(&path).unwrap().f32("hair").unwrap().shape, [4, 1, 5, 3]);
        let uneven = write_with_curves(&path, 30.0, &[mesh("body", &body)], &[curves(3, &shirt)]).unwrap_err();
        assert!(uneven.to_string().contains("a multiple of 3 points, found 5"), "{uneven}");

        let message = |meshes: &[MovingMesh<'_>], fps| write(&path, fps, meshes).unwrap_err().to_string();
        assert!(
            message(&[mesh("body", &body), mesh("tshirt", &shirt[..2])], 30.0)
                .contains("mesh \"tshirt\": wanted 4 frames, found 2")
        );
        let (few, nan) = ([vec![[0.0; 3]; 2]], [vec![[f32::NAN; 3]; 3]]);
        assert!(message(&[mesh("body", &few)], 30.0).contains("faces of 2 vertices, found vertex 2"));
        assert!(message(&[mesh("body", &nan)], 30.0).contains("finite"));
        assert!(message(&[mesh("body", &body)], 0.0).contains("fps"));
    }
}
