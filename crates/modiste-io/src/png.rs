//! Pictures: PNG out, PNG and JPEG in.

use std::io::Cursor;
use std::path::Path;

use image::{ColorType, ImageFormat, ImageReader, Limits};

use crate::{IoError, read_bytes, write_bytes};

/// The longest side of a picture that is read (pixels).
const LONGEST_SIDE: u32 = 16_384;

/// A picture in 8-bit sRGB, rows from the top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Width (pixels).
    pub width: usize,
    /// Height (pixels).
    pub height: usize,
    /// Red, green and blue of each pixel.
    pub rgb: Vec<u8>,
}

/// Reads a picture; transparency is dropped.
///
/// # Errors
/// [`IoError`] naming the file and the reason.
pub fn read(path: impl AsRef<Path>) -> Result<Picture, IoError> {
    let path = path.as_ref();
    parse(&read_bytes(path)?, &path.display().to_string())
}

/// Reads from bytes; `name` stands for the file in errors.
///
/// # Errors
/// [`IoError`] when it is no picture, damaged or larger than 16,384 pixels.
pub fn parse(bytes: &[u8], name: &str) -> Result<Picture, IoError> {
    let bad = |error: &dyn std::fmt::Display| IoError::field(name, "the picture", "an intact PNG or JPEG", error);
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|error| bad(&error))?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(LONGEST_SIDE);
    limits.max_image_height = Some(LONGEST_SIDE);
    reader.limits(limits);
    let rgb = reader.decode().map_err(|error| bad(&error))?.into_rgb8();
    Ok(Picture { width: rgb.width() as usize, height: rgb.height() as usize, rgb: rgb.into_raw() })
}

/// Writes a PNG from 8-bit sRGB values, rows from the top.
///
/// # Errors
/// [`IoError`] naming the file, also when the values do not fill the picture.
pub fn write(path: impl AsRef<Path>, width: usize, height: usize, rgb: &[u8]) -> Result<(), IoError> {
    let path = path.as_ref();
    let name = path.display().to_string();
    let sides = u32::try_from(width).ok().zip(u32::try_from(height).ok());
    let fits = width.checked_mul(height).and_then(|pixels| pixels.checked_mul(3)) == Some(rgb.len()) && !rgb.is_empty();
    let Some((wide, high)) = sides.filter(|_| fits) else {
        let wanted = format!("3 bytes for each of {width} × {height} pixels");
        return Err(IoError::field(&name, "the picture", wanted, format!("{} bytes", rgb.len())));
    };
    let mut png = Cursor::new(Vec::new());
    image::write_buffer_with_format(&mut png, rgb, wide, high, ColorType::Rgb8, ImageFormat::Png)
        .map_err(|error| IoError::field(&name, "the picture", "a PNG", error))?;
    write_bytes(path, &png.into_inner())
}

#[cfg(test)]
mod tests {
    use super::{parse, read, write};
    use crate::fuzz::survives_damage;

    #[test]
    fn round_trip_and_errors() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p.png");
        let rgb: Vec<u8> = (0..5 * 4 * 3).collect();
        write(&path, 5, 4, &rgb).unwrap();
        let picture = read(&path).unwrap();
        assert_eq!((picture.width, picture.height, picture.rgb), (5, 4, rgb.clone()));
        assert!(write(&path, 5, 5, &rgb).unwrap_err().to_string().contains("5 × 5 pixels, found 60 bytes"));
        assert!(write(&path, 0, 0, &[]).is_err());
        assert!(parse(b"no picture", "p.png").unwrap_err().to_string().contains("p.png"));
        survives_damage(&crate::read_bytes(&path).unwrap(), |bytes| drop(parse(bytes, "damaged.png")));
    }
}
