//! PLY meshes, ASCII and binary of either byte order: positions and polygons; other properties are skipped.

use std::io::{BufRead, Cursor, Write};
use std::path::Path;

use modiste_core::Vec3;

use crate::animated::normals;
use crate::error::quote;
use crate::{IoError, read_bytes, write_atomically};

/// Reads vertices and triangles (polygons are cut as fans).
///
/// # Errors
/// [`IoError`] naming the file and the line or element.
pub fn read(path: impl AsRef<Path>) -> Result<(Vec<Vec3>, Vec<[u32; 3]>), IoError> {
    let path = path.as_ref();
    parse(&read_bytes(path)?, &path.display().to_string())
}

/// Reads from bytes; `name` stands for the file in errors.
///
/// # Errors
/// [`IoError`] naming the line of the header or the element.
pub fn parse(bytes: &[u8], name: &str) -> Result<(Vec<Vec3>, Vec<[u32; 3]>), IoError> {
    let mut cursor = Cursor::new(bytes);
    let header = read_header(&mut cursor, name)?;
    let body = &bytes[cursor.position() as usize..];
    let mut values: Box<dyn FnMut(Number) -> Option<f64>> = match header.encoding {
        Encoding::Ascii => {
            let text = String::from_utf8_lossy(body).into_owned();
            let words: Vec<f64> = text.split_ascii_whitespace().map_while(|word| word.parse().ok()).collect();
            let mut words = words.into_iter();
            Box::new(move |_| words.next())
        }
        Encoding::Binary { big_endian } => {
            let mut rest = body;
            Box::new(move |number| {
                let (value, after) = number.take(rest, big_endian)?;
                rest = after;
                Some(value)
            })
        }
    };
    let mut vertices = Vec::new();
    let mut faces = Vec::new();
    for element in &header.elements {
        for index in 0..element.count {
            let row = format!("{} {index}", element.name);
            let wrong = |wanted: &str, found: &dyn std::fmt::Display| IoError::field(name, &row, wanted, found);
            let mut next = |number| values(number).ok_or_else(|| wrong("another value", &"the end or no number"));
            let mut point = [None; 3];
            for property in &element.properties {
                let Some(count) = property.list_count else {
                    let value = next(property.number)?;
                    if let Some(axis) = ["x", "y", "z"].iter().position(|axis| *axis == property.name) {
                        point[axis] = Some(value);
                    }
                    continue;
                };
                let count = next(count)?;
                let mut corners = Vec::new();
                for _ in 0..checked_index(count).ok_or_else(|| wrong("a list length", &count))? {
                    corners.push(next(property.number)?);
                }
                if element.name == "face" && property.name.starts_with("vertex_ind") {
                    let vertex = |value: &f64| checked_index(*value).ok_or_else(|| wrong("vertex indices", value));
                    let corners = corners.iter().map(vertex).collect::<Result<Vec<u32>, _>>()?;
                    if corners.len() < 3 {
                        return Err(wrong("three or more corners", &corners.len()));
                    }
                    faces.extend(corners.windows(2).skip(1).map(|edge| [corners[0], edge[0], edge[1]]));
                }
            }
            if element.name == "vertex" {
                match point {
                    [Some(x), Some(y), Some(z)] if x.is_finite() && y.is_finite() && z.is_finite() => {
                        vertices.push(Vec3::new(x, y, z));
                    }
                    _ => return Err(wrong("finite x, y and z", &format!("{point:?}"))),
                }
            }
        }
    }
    if vertices.is_empty() {
        return Err(IoError::field(name, "element vertex", "at least one", "none"));
    }
    match faces.as_flattened().iter().find(|&&vertex| vertex as usize >= vertices.len()) {
        Some(vertex) => Err(IoError::field(name, "element face", format!("indices below {}", vertices.len()), vertex)),
        None => Ok((vertices, faces)),
    }
}

/// Writes vertices and triangles, binary little-endian, positions as doubles.
///
/// # Errors
/// [`IoError`] naming the file.
pub fn write(path: impl AsRef<Path>, vertices: &[Vec3], faces: &[[u32; 3]]) -> Result<(), IoError> {
    write_atomically(path, |file| {
        write!(
            file,
            "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\n\
             property double z\nelement face {}\nproperty list uchar uint vertex_indices\nend_header\n",
            vertices.len(),
            faces.len()
        )?;
        for vertex in vertices {
            vertex.to_array().iter().try_for_each(|x| file.write_all(&x.to_le_bytes()))?;
        }
        for face in faces {
            file.write_all(&[3])?;
            face.iter().try_for_each(|vertex| file.write_all(&vertex.to_le_bytes()))?;
        }
        Ok(())
    })
}

/// Writes one frame of a mesh with normals, binary little-endian, all as floats.
///
/// # Errors
/// [`IoError`] naming the file.
pub fn write_frame(path: impl AsRef<Path>, faces: &[[u32; 3]], vertices: &[[f32; 3]]) -> Result<(), IoError> {
    write_atomically(path, |file| {
        write!(
            file,
            "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
             property float z\nproperty float nx\nproperty float ny\nproperty float nz\nelement face {}\n\
             property list uchar uint vertex_indices\nend_header\n",
            vertices.len(),
            faces.len()
        )?;
        for (vertex, normal) in vertices.iter().zip(normals(faces, vertices)) {
            file.write_all(bytemuck::cast_slice(&[*vertex, normal]))?;
        }
        for face in faces {
            file.write_all(&[3])?;
            face.iter().try_for_each(|vertex| file.write_all(&vertex.to_le_bytes()))?;
        }
        Ok(())
    })
}

#[derive(Clone, Copy)]
enum Encoding {
    Ascii,
    Binary { big_endian: bool },
}

/// A number's kind: signed, unsigned or float, and its size (bytes).
#[derive(Clone, Copy)]
enum Number {
    Signed(usize),
    Unsigned(usize),
    Float(usize),
}

struct Property {
    name: String,
    number: Number,
    /// For a list, the kind of its length.
    list_count: Option<Number>,
}

struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
}

struct Header {
    encoding: Encoding,
    elements: Vec<Element>,
}

impl Number {
    fn from_name(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::Signed(1),
            "uchar" | "uint8" => Self::Unsigned(1),
            "short" | "int16" => Self::Signed(2),
            "ushort" | "uint16" => Self::Unsigned(2),
            "int" | "int32" => Self::Signed(4),
            "uint" | "uint32" => Self::Unsigned(4),
            "float" | "float32" => Self::Float(4),
            "double" | "float64" => Self::Float(8),
            _ => return None,
        })
    }

    /// Takes one number off the front.
    fn take(self, bytes: &[u8], big_endian: bool) -> Option<(f64, &[u8])> {
        let (Self::Signed(size) | Self::Unsigned(size) | Self::Float(size)) = self;
        let (number, rest) = bytes.split_at_checked(size)?;
        let mut little = [0u8; 8];
        for (at, byte) in number.iter().enumerate() {
            little[if big_endian { size - 1 - at } else { at }] = *byte;
        }
        let raw = u64::from_le_bytes(little);
        let value = match self {
            Self::Unsigned(_) => raw as f64,
            Self::Signed(size) => {
                let unused = 64 - 8 * size as u32;
                (((raw << unused) as i64) >> unused) as f64
            }
            Self::Float(4) => f64::from(f32::from_bits(raw as u32)),
            Self::Float(_) => f64::from_bits(raw),
        };
        Some((value, rest))
    }
}

fn checked_index(value: f64) -> Option<u32> {
    (value.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&value)).then_some(value as u32)
}

fn read_header(cursor: &mut Cursor<&[u8]>, name: &str) -> Result<Header, IoError> {
    const WANTED: &str = "format, element, property, comment or end_header";
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    for number in 1usize.. {
        let mut line = Vec::new();
        let broken = |wanted: &str, found: &str| IoError::line(name, number, wanted, quote(found));
        let length = cursor.read_until(b'\n', &mut line).map_err(|error| broken(WANTED, &error.to_string()))?;
        let text = String::from_utf8_lossy(&line);
        let text = text.trim();
        let words: Vec<&str> = text.split_whitespace().collect();
        match words.as_slice() {
            ["ply"] if number == 1 => {}
            _ if number == 1 => return Err(broken("ply", text)),
            ["format", "ascii", _] => encoding = Some(Encoding::Ascii),
            ["format", "binary_little_endian", _] => encoding = Some(Encoding::Binary { big_endian: false }),
            ["format", "binary_big_endian", _] => encoding = Some(Encoding::Binary { big_endian: true }),
            ["element", element, count] => {
                let count = count.parse().map_err(|_unparsed| broken("a count of elements", text))?;
                elements.push(Element { name: (*element).to_owned(), count, properties: Vec::new() });
            }
            ["property", kinds @ .., property] => {
                let element = elements.last_mut().ok_or_else(|| broken("an element before its properties", text))?;
                let (list_count, number) = match kinds {
                    [number] => (Some(None), Number::from_name(number)),
                    ["list", count, number] => (Number::from_name(count).map(Some), Number::from_name(number)),
                    _ => (None, None),
                };
                let (Some(list_count), Some(number)) = (list_count, number) else {
                    return Err(broken("a property of a known kind", text));
                };
                element.properties.push(Property { name: (*property).to_owned(), number, list_count });
            }
            ["end_header"] => {
                let encoding = encoding.ok_or_else(|| broken("a format before the end of the header", text))?;
                // An element without properties takes no bytes, so its count would be unbounded work.
                elements.retain(|element| !element.properties.is_empty());
                return Ok(Header { encoding, elements });
            }
            ["comment" | "obj_info", ..] => {}
            [] if length > 0 => {}
            _ => return Err(broken(WANTED, text)),
        }
    }
    Err(IoError::line(name, 1, WANTED, "an endless header"))
}

#[cfg(test)]
mod tests {
    use super::{parse, read, write};
    use crate::fuzz::survives_damage;
    use modiste_core::Vec3;

    const ASCII: &str = "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 255\n1 0 0 255\n1 1 0 0\n0 1 -0.5 0\n4 0 1 2 3\n";

    #[test]
    fn ascii_quads_become_triangles() {
        let (vertices, faces) = parse(ASCII.as_bytes(), "m.ply").unwrap();
        assert_eq!(vertices[3], Vec3::new(0.0, 1.0, -0.5));
        assert_eq!(faces, [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn binary_round_trip_and_big_endian() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.ply");
        let vertices = vec![Vec3::new(0.1, -2.0, 1.0 / 3.0), Vec3::X, Vec3::Y];
        write(&path, &vertices, &[[2, 0, 1]]).unwrap();
        assert_eq!(read(&path).unwrap(), (vertices, vec![[2, 0, 1]]));
        survives_damage(&crate::read_bytes(&path).unwrap(), |bytes| drop(parse(bytes, "damaged.ply")));
        let frame = [[0.0, 0.5, 1.0], [1.0, 0.5, 1.0], [0.0, 0.5, 0.0]];
        super::write_frame(&path, &[[0, 1, 2]], &frame).unwrap();
        assert_eq!(read(&path).unwrap().0[1], Vec3::new(1.0, 0.5, 1.0));
        let bytes = crate::read_bytes(&path).unwrap();
        let normal = f32::from_le_bytes(bytes[bytes.len() - 13 - 8..][..4].try_into().unwrap());
        assert!((normal - 1.0).abs() < 1e-6, "the normal of the last vertex is up, not {normal}");
        let mut big = b"ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty short x\nproperty float y\nproperty double z\nend_header\n".to_vec();
        big.extend((-3i16).to_be_bytes());
        big.extend(1.5f32.to_be_bytes());
        big.extend(0.1f64.to_be_bytes());
        assert_eq!(parse(&big, "m.ply").unwrap().0, [Vec3::new(-3.0, 1.5, 0.1)]);
    }

    #[test]
    fn errors_name_line_or_element() {
        let message =
            |from: &str, to: &str| parse(ASCII.replacen(from, to, 1).as_bytes(), "m").unwrap_err().to_string();
        assert!(message("4 0 1 2 3", "4 0 1 2 4").contains("indices below 4, found 4"));
        assert!(message("4 0 1 2 3", "4 0 1 2").contains("face 0: wanted another value"));
        assert!(message("4 0 1 2 3", "2 0 1").contains("three or more corners"));
        assert!(message("4 0 1 2 3", "-1 0 1").contains("a list length, found -1"));
        assert!(message("1 1 0 0", "1 inf 0 0").contains("vertex 2: wanted finite x, y and z"));
        assert!(message("float z", "float w").contains("vertex 0: wanted finite x, y and z"));
        assert!(message("property uchar red", "property word red").contains("m, line 8"));
        assert!(message("element vertex 4", "element vertex many").contains("a count of elements"));
        assert!(message("end_header", "end").contains("m, line 11"));
        assert!(message("ply", "obj").contains("m, line 1: wanted ply"));
        assert!(message("element vertex 4", "element vertex 99999999999").contains("another value"));
        assert!(parse(b"", "m").unwrap_err().to_string().contains("wanted ply"));
    }

    #[test]
    fn damage_never_panics() {
        survives_damage(ASCII.as_bytes(), |bytes| drop(parse(bytes, "damaged.ply")));
    }
}
