//! PC2 point caches, as Blender, 3ds Max and Marvelous Designer write them: the vertices of one mesh, sample after sample.
//!
//! A header of 32 bytes (the letters `POINTCACHE2` and a zero, version 1, number of points, first frame, frames from one
//! sample to the next, number of samples), then three `f32` a point, little-endian. There are no faces in it.

use std::io::Write;
use std::path::Path;

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

/// Writes a point cache whose first sample is that of frame 0, one sample a frame.
///
/// # Errors
/// [`IoError`] naming the file: no points, or more than the format counts.
pub fn write(path: impl AsRef<Path>, cache: &PointCache) -> Result<(), IoError> {
    let path = path.as_ref();
    let count = |what: &str, count: usize| match i32::try_from(count) {
        Ok(count) if count > 0 => Ok(count),
        _ => Err(IoError::field(&path.display().to_string(), what, "1 to 2147483647", count)),
    };
    let (points, samples) =
        (count("number of points", cache.point_count)?, count("number of samples", cache.sample_count())?);
    write_atomically(path, |file| {
        file.write_all(MAGIC)?;
        for word in [1i32.to_le_bytes(), points.to_le_bytes(), 0f32.to_le_bytes(), 1f32.to_le_bytes()] {
            file.write_all(&word)?;
        }
        file.write_all(&samples.to_le_bytes())?;
        cache.points.as_flattened().iter().try_for_each(|x| file.write_all(&x.to_le_bytes()))
    })
}

#[cfg(test)]
mod tests {
    use super::{PointCache, parse, read, write};

    fn some_cache() -> PointCache {
        let points = (0..12i16).map(|i| [f32::from(i), 0.5, -1.0 / f32::from(i + 1)]).collect();
        PointCache { point_count: 4, points }
    }

    fn bytes() -> Vec<u8> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.pc2");
        write(&path, &some_cache()).unwrap();
        crate::read_bytes(path).unwrap()
    }

    #[test]
    fn a_cache_is_read_back_exactly() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.pc2");
        write(&path, &some_cache()).unwrap();
        let again = read(&path).unwrap();
        assert_eq!(again, some_cache());
        assert_eq!((again.sample_count(), again.sample(2)), (3, &some_cache().points[8..]));
        assert!(again.sample(3).is_empty());
        // The layout: 12 letters, version, points, start, rate, samples.
        let bytes = bytes();
        assert_eq!(bytes.len(), 32 + 12 * 12);
        assert_eq!((&bytes[..12], bytes[12], bytes[16], bytes[28]), (&b"POINTCACHE2\0"[..], 1, 4, 3));
        assert!(write(&path, &PointCache { point_count: 0, points: Vec::new() }).is_err());
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
        assert!(changed(28, 9).contains("9 samples of 4 points"));
        assert!(message(&bytes()[..100]).contains("found 68 bytes"));
        let mut nan = bytes();
        nan[32 + 12 * 5..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
        assert!(message(&nan).contains("point 1 of sample 1: wanted finite"), "{}", message(&nan));
    }

    #[test]
    fn damage_never_panics() {
        crate::fuzz::survives_damage(&bytes(), |bytes| drop(parse(bytes, "damaged.pc2")));
    }
}
