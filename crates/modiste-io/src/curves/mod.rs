//! Hair as curves: TressFX (`.tfx`), Cem Yuksel's `.hair`, and lines of an OBJ. One file per format.

mod hair;
mod obj;
mod tfx;

use std::path::Path;

use modiste_core::Vec3;

use crate::{IoError, read_bytes};

/// The most curves and points that are read: beyond that a header is taken for damaged.
const MOST: usize = 50_000_000;

/// Reads curves, the root first, in the unit of the file; the ending of the name says which format it is.
///
/// # Errors
/// [`IoError`] naming the file and the place; also an ending that is none of `.tfx`, `.hair` and `.obj`.
pub fn read(path: impl AsRef<Path>) -> Result<Vec<Vec<Vec3>>, IoError> {
    let path = path.as_ref();
    let name = path.display().to_string();
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_ascii_lowercase();
    let parse: fn(&[u8], &str) -> Result<Vec<Vec<Vec3>>, IoError> = match ending.as_str() {
        "tfx" => tfx::parse,
        "hair" => hair::parse,
        "obj" => obj::parse,
        other => return Err(IoError::field(&name, "ending", ".tfx, .hair or .obj", format!(".{other}"))),
    };
    parse(&read_bytes(path)?, &name)
}

/// Little-endian numbers out of bytes, with the file and the field for the error.
struct Bytes<'a> {
    bytes: &'a [u8],
    file: &'a str,
}

impl Bytes<'_> {
    fn word(&self, at: usize, field: &str) -> Result<[u8; 4], IoError> {
        let found = self.bytes.get(at..at + 4).and_then(|bytes| bytes.try_into().ok());
        found.ok_or_else(|| IoError::field(self.file, field, "four bytes", "the end of the file"))
    }

    fn u32(&self, at: usize, field: &str) -> Result<usize, IoError> {
        Ok(u32::from_le_bytes(self.word(at, field)?) as usize)
    }

    /// Three finite numbers.
    fn point(&self, at: usize, field: &str) -> Result<Vec3, IoError> {
        let mut numbers = [0.0; 3];
        for (axis, number) in numbers.iter_mut().enumerate() {
            *number = f64::from(f32::from_le_bytes(self.word(at + 4 * axis, field)?));
        }
        let point = Vec3::from_array(numbers);
        if point.is_finite() { Ok(point) } else { Err(IoError::field(self.file, field, "finite coordinates", point)) }
    }

    /// Refuses a count that the file is too short for.
    fn check_count(&self, field: &str, count: usize, bytes_each: usize, from: usize) -> Result<(), IoError> {
        let room = self.bytes.len().saturating_sub(from) / bytes_each.max(1);
        if count <= room.min(MOST) {
            return Ok(());
        }
        Err(IoError::field(self.file, field, format!("at most {}, for which there is room", room.min(MOST)), count))
    }
}

#[cfg(test)]
mod tests {
    use super::{hair, obj, read, tfx};
    use crate::fuzz::survives_damage;
    use modiste_core::Vec3;

    fn tfx_file() -> Vec<u8> {
        let mut bytes = 4.0f32.to_le_bytes().to_vec();
        for word in [2u32, 3, 160] {
            bytes.extend(word.to_le_bytes());
        }
        bytes.resize(160, 0);
        for i in 0..6 {
            for number in [i as f32, 2.0, -1.0, f32::from(i % 3 != 0)] {
                bytes.extend(number.to_le_bytes());
            }
        }
        bytes
    }

    fn hair_file(segments: Option<[u16; 2]>) -> Vec<u8> {
        let mut bytes = b"HAIR".to_vec();
        let flags = 2 + u32::from(segments.is_some());
        for word in [2u32, 5, flags, 1] {
            bytes.extend(word.to_le_bytes());
        }
        bytes.resize(128, 0);
        for count in segments.into_iter().flatten() {
            bytes.extend(count.to_le_bytes());
        }
        for i in 0..5 {
            for number in [i as f32, 0.5, 0.0] {
                bytes.extend(number.to_le_bytes());
            }
        }
        bytes
    }

    const LINES: &[u8] = b"v 0 0 0\nv 0 1 0\nv 0 2 0\nl 1 2 3\nl -1 -2\nf 1 2 3\n";

    #[test]
    fn each_format_gives_its_curves() {
        let curves = tfx::parse(&tfx_file(), "a.tfx").unwrap();
        assert_eq!(curves.len(), 2);
        assert_eq!(curves[1], [3.0, 4.0, 5.0].map(|x| Vec3::new(x, 2.0, -1.0)));
        let curves = hair::parse(&hair_file(Some([1, 2])), "a.hair").unwrap();
        assert_eq!((curves[0].len(), curves[1].len(), curves[1][0].x), (2, 3, 2.0));
        let message = hair::parse(&hair_file(None), "a.hair").unwrap_err().to_string();
        assert!(message.contains("a.hair, points: wanted 4, found 5"), "{message}");
        let curves = obj::parse(LINES, "a.obj").unwrap();
        assert_eq!((curves.len(), curves[0].len(), curves[1][1].y), (2, 3, 1.0));
    }

    #[test]
    fn damage_is_an_error_and_no_panic() {
        survives_damage(&tfx_file(), |bytes| drop(tfx::parse(bytes, "x")));
        survives_damage(&hair_file(Some([1, 2])), |bytes| drop(hair::parse(bytes, "x")));
        survives_damage(LINES, |bytes| drop(obj::parse(bytes, "x")));
        assert!(read("hair.fbx").unwrap_err().to_string().contains("wanted .tfx, .hair or .obj"));
        assert!(obj::parse(b"v 0 0 0\n", "x").unwrap_err().to_string().contains("lines"));
    }

    #[test]
    fn a_real_file_is_read() {
        let Some(folder) = crate::shared_data("hair/sintel") else { return };
        let curves = read(folder.join("sintel_hair.tfx")).unwrap();
        assert_eq!((curves.len(), curves[0].len()), (228, 32));
    }
}
