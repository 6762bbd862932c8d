//! Point caches (`.pc2`): the vertices of a mesh in every frame, as Blender's Mesh Cache modifier, 3ds Max and Marvelous
//! Designer read and write them.
//!
//! A header of 32 bytes ("POINTCACHE2\0", version 1, number of points, first frame, frames from one sample to the next, number of
//! samples), then three `f32` a point, sample after sample, little-endian. There are no faces in it.

use std::io::Write;
use std::path::Path;

use crate::animated::{AnimatedMesh, check};
use crate::{IoError, read_bytes, write_atomically};

const MAGIC: &[u8; 12] = b"POINTCACHE2\0";
const HEADER: usize = 32;

/// The vertices of a mesh in some samples.
#[derive(Debug, Clone, PartialEq)]
pub struct PointCache {
    /// Number of points in a sample.
    pub point_count: usize,
    /// Coordinates of all points of all samples, in the unit of the file.
    pub points: Vec<[f32; 3]>,
}

impl PointCache {
    /// Number of samples.
    pub fn sample_count(&self) -> usize {
        self.points.len() / self.point_count.max(1)
    }

    /// The points of one sample, in the unit of the file; empty beyond the last.
    pub fn sample(&self, index: usize) -> &[[f32; 3]] {
        self.points.chunks(self.point_count.max(1)).nth(index).unwrap_or_default()
    }
}

/// Reads a point cache.
///
/// # Errors
/// [`IoError`] naming the file and the field.
pub fn read(path: impl AsRef<Path>) -> Result<PointCache, IoError> {
    let path = path.as_ref();
    parse(&read_bytes(path)?, &path.display().to_string())
}

/// Reads from bytes; `name` stands for the file in errors.
///
/// # Errors
/// [`IoError`] naming the field.
pub fn parse(bytes: &[u8], name: &str) -> Result<PointCache, IoError> {
    let wrong = |field: &str, wanted: &str, found: String| Err(IoError::field(name, field, wanted, found));
    if !bytes.starts_with(MAGIC) {
        return wrong("first bytes", "POINTCACHE2", format!("another file of {} bytes", bytes.len()));
    }
    let Some(header) = bytes.get(MAGIC.len()..HEADER) else {
        return wrong("header", "32 bytes", format!("{} bytes", bytes.len()));
    };
    let word = |index: usize| -> [u8; 4] { std::array::from_fn(|byte| header[4 * index + byte]) };
    let whole = |index: usize| i32::from_le_bytes(word(index));
    if whole(0) != 1 {
        return wrong("version", "1", whole(0).to_string());
    }
    let count = |index: usize, field: &str| match usize::try_from(whole(index)) {
        Ok(count) if count > 0 => Ok(count),
        _ => Err(IoError::field(name, field, "1 or more", whole(index))),
    };
    let (point_count, sample_count) = (count(1, "number of points")?, count(4, "number of samples")?);
    let body = &bytes[HEADER..];
    let wanted = point_count.checked_mul(sample_count).and_then(|points| points.checked_mul(12));
    if wanted != Some(body.len()) {
        let wanted = format!("{sample_count} samples of {point_count} points, 12 bytes each");
        return wrong("samples", &wanted, format!("{} bytes", body.len()));
    }
    let point = |bytes: &[[u8; 4]; 3]| bytes.map(f32::from_le_bytes);
    let points: Vec<[f32; 3]> = body.as_chunks::<4>().0.as_chunks::<3>().0.iter().map(point).collect();
    if let Some(at) = points.iter().position(|point| point.iter().any(|x| !x.is_finite())) {
        let (sample, found) = (at / point_count, points[at]);
        let field = format!("point {} of sample {sample}", at % point_count);
        return wrong(&field, "finite coordinates", format!("{found:?}"));
    }
    Ok(PointCache { point_count, points })
}

/// Writes the frames of a mesh: metres, Y up, in the order of the mesh's vertices.
///
/// # Errors
/// [`IoError`] naming the mesh and what is wrong with it, or the file.
pub fn write(path: impl AsRef<Path>, mesh: &AnimatedMesh<'_>) -> Result<(), IoError> {
    let path = path.as_ref();
    let frame_count = check(30.0, std::slice::from_ref(mesh), &path.display().to_string())?;
    let mut unread = None;
    let written = write_atomically(path, |file| {
        file.write_all(MAGIC)?;
        file.write_all(&1i32.to_le_bytes())?;
        file.write_all(&(mesh.vertex_count() as i32).to_le_bytes())?;
        file.write_all(&0.0f32.to_le_bytes())?;
        file.write_all(&1.0f32.to_le_bytes())?;
        file.write_all(&(frame_count as i32).to_le_bytes())?;
        let mut vertices = Vec::new();
        for frame in 0..frame_count {
            keep(&mut unread, mesh.frames.read(frame, &mut vertices))?;
            file.write_all(bytemuck::cast_slice(&vertices))?;
        }
        Ok(())
    });
    unread.map_or(written, Err)
}

/// Lets an error of reading through [`write_atomically`], which knows only those of writing.
pub(crate) fn keep<T>(unread: &mut Option<IoError>, read: Result<T, IoError>) -> std::io::Result<T> {
    read.map_err(|error| {
        let stop = std::io::Error::other(error.to_string());
        *unread = Some(error);
        stop
    })
}

#[cfg(test)]
mod tests {
    use super::{parse, read, write};
    use crate::animated::AnimatedMesh;

    type Frames = Vec<Vec<[f32; 3]>>;

    fn frames() -> Frames {
        (0..4).map(|frame| vec![[frame as f32, 0.5, -2.0]; 3]).collect()
    }

    fn mesh(frames: &Frames) -> AnimatedMesh<'_> {
        AnimatedMesh::plain("a", &[[0, 1, 2]], frames)
    }

    fn bytes() -> Vec<u8> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.pc2");
        write(&path, &mesh(&frames())).unwrap();
        crate::read_bytes(path).unwrap()
    }

    #[test]
    fn what_was_written_is_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.pc2");
        write(&path, &mesh(&frames())).unwrap();
        let cache = read(&path).unwrap();
        assert_eq!((cache.point_count, cache.sample_count()), (3, 4));
        assert_eq!(cache.points, frames().concat());
        assert_eq!(cache.sample(2), &frames()[2][..]);
        assert!(cache.sample(4).is_empty());
    }

    #[test]
    fn the_layout_is_that_of_the_format() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.pc2");
        let frames = frames();
        let mut mesh = mesh(&frames);
        write(&path, &mesh).unwrap();
        let bytes = crate::read_bytes(&path).unwrap();
        assert_eq!(bytes.len(), 32 + 4 * 3 * 12);
        assert_eq!(&bytes[..12], b"POINTCACHE2\0");
        let word = |at: usize| i32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        assert_eq!([12, 16, 28].map(word), [1, 3, 4]);
        let float = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        assert_eq!([20, 24, 32 + 36, 32 + 36 + 8].map(float), [0.0f32, 1.0, 1.0, -2.0].map(f32::to_bits));
        mesh.faces = &[[0, 1, 5]];
        assert!(write(&path, &mesh).unwrap_err().to_string().contains("vertex 5"));
    }

    #[test]
    fn what_is_no_cache_is_refused_by_field() {
        let message = |bytes: &[u8]| parse(bytes, "bad.pc2").unwrap_err().to_string();
        let changed = |at: usize, value: u8| {
            let mut bytes = bytes();
            bytes[at] = value;
            message(&bytes)
        };
        assert!(message(b"").contains("bad.pc2, first bytes: wanted POINTCACHE2"));
        assert!(message(&bytes()[..20]).contains("header"));
        assert!(changed(12, 2).contains("version: wanted 1, found 2"));
        assert!(changed(16, 0).contains("number of points: wanted 1 or more, found 0"));
        assert!(changed(19, 0xff).contains("number of points"));
        assert!(changed(28, 9).contains("9 samples of 3 points"));
        assert!(message(&bytes()[..100]).contains("found 68 bytes"));
        let mut nan = bytes();
        nan[32 + 12 * 4..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
        assert!(message(&nan).contains("point 1 of sample 1: wanted finite"), "{}", message(&nan));
    }

    #[test]
    fn damage_never_panics() {
        crate::fuzz::survives_damage(&bytes(), |bytes| drop(parse(bytes, "damaged.pc2")));
    }
}
