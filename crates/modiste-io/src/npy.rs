//! One array in numpy's `.npy` layout: magic, version, a Python dictionary as header, then the elements.

use std::io::{self, Read, Write};

use crate::IoError;
use crate::error::quote;

/// Longest header that is read piece by piece (bytes); a damaged length must not fill memory.
const LONGEST_HEADER: usize = 1 << 16;

/// The element kinds that we read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Float(usize),
    Signed(usize),
    Unsigned(usize),
}

/// What the header of an array says.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Header {
    pub(crate) kind: Kind,
    pub(crate) big_endian: bool,
    pub(crate) column_major: bool,
    pub(crate) shape: Vec<usize>,
    /// The kind as the file spells it, such as `<f4`.
    pub(crate) spelling: String,
}

impl Kind {
    pub(crate) fn size(self) -> usize {
        match self {
            Self::Float(size) | Self::Signed(size) | Self::Unsigned(size) => size,
        }
    }
}

/// Reads the header of an `.npy`, up to the first element.
pub(crate) fn read_header(reader: &mut impl Read, file: &str, name: &str) -> Result<Header, IoError> {
    let bad = |wanted: &str, found: String| IoError::field(file, format!("array \"{name}\""), wanted, found);
    let mut exactly = |count: usize| {
        let mut bytes = vec![0; count];
        let read = reader.read_exact(&mut bytes);
        read.map(|()| bytes).map_err(|error| bad("a whole npy header", error.to_string()))
    };
    let start = exactly(8)?;
    if !start.starts_with(b"\x93NUMPY") {
        return Err(bad("numpy's npy layout", "other bytes".to_owned()));
    }
    let length = match start[6] {
        1 => exactly(2)?.iter().rev().fold(0, |length, &byte| length << 8 | usize::from(byte)),
        2 | 3 => exactly(4)?.iter().rev().fold(0, |length, &byte| length << 8 | usize::from(byte)),
        other => return Err(bad("npy version 1, 2 or 3", format!("version {other}"))),
    };
    if length > LONGEST_HEADER {
        return Err(bad("a header of a few hundred bytes", format!("{length} bytes")));
    }
    let text = String::from_utf8(exactly(length)?).map_err(|error| bad("a header in UTF-8", error.to_string()))?;
    parse_header(&text).map_err(|(wanted, found)| bad(wanted, found))
}

/// Splits an `.npy` into its header and the bytes of its elements, whose number is checked against the shape.
pub(crate) fn split<'a>(bytes: &'a [u8], file: &str, name: &str) -> Result<(Header, &'a [u8]), IoError> {
    let bad = |wanted: &str, found: String| IoError::field(file, format!("array \"{name}\""), wanted, found);
    let truncated = || bad("a whole npy header", format!("{} bytes", bytes.len()));
    if !bytes.starts_with(b"\x93NUMPY") {
        return Err(bad("numpy's npy layout", "other bytes".to_owned()));
    }
    let version = *bytes.get(6).ok_or_else(truncated)?;
    let (length, start) = match version {
        1 => (usize::from(u16::from_le_bytes(fixed(bytes, 8).ok_or_else(truncated)?)), 10),
        2 | 3 => (u32::from_le_bytes(fixed(bytes, 8).ok_or_else(truncated)?) as usize, 12),
        other => return Err(bad("npy version 1, 2 or 3", format!("version {other}"))),
    };
    let text = bytes.get(start..start + length).ok_or_else(truncated)?;
    let text = std::str::from_utf8(text).map_err(|error| bad("a header in UTF-8", error.to_string()))?;
    let header = parse_header(text).map_err(|(wanted, found)| bad(wanted, found))?;
    let elements = &bytes[start + length..];
    let wanted = header.shape.iter().try_fold(header.kind.size(), |product, &extent| product.checked_mul(extent));
    if wanted != Some(elements.len()) {
        let wanted = format!("the elements of shape {:?} ({})", header.shape, header.spelling);
        return Err(bad(&wanted, format!("{} bytes", elements.len())));
    }
    Ok((header, elements))
}

fn fixed<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..at + N)?.try_into().ok()
}

/// Reads `{'descr': '<f4', 'fortran_order': False, 'shape': (3, 4), }`.
fn parse_header(text: &str) -> Result<Header, (&'static str, String)> {
    let after = |key: &'static str| {
        let at = text.find(&format!("'{key}'")).ok_or(("a header with descr, fortran_order and shape", quote(text)))?;
        let rest = text[at + key.len() + 2..].trim_start();
        rest.strip_prefix(':').map(str::trim_start).ok_or(("a header of keys and values", quote(text)))
    };
    let descr = after("descr")?;
    let spelling = descr.strip_prefix('\'').and_then(|rest| rest.split_once('\'')).map(|(word, _)| word);
    let spelling = spelling.ok_or(("an array of plain numbers", quote(descr)))?;
    let (big_endian, kind) = element_kind(spelling).ok_or(("an array of plain numbers", quote(spelling)))?;
    let order = after("fortran_order")?;
    let column_major = if order.starts_with("True") {
        true
    } else if order.starts_with("False") {
        false
    } else {
        return Err(("fortran_order True or False", quote(order)));
    };
    let shape = after("shape")?;
    let extents = shape.strip_prefix('(').and_then(|rest| rest.split_once(')')).map(|(inside, _)| inside);
    let shape = extents
        .ok_or(("a shape in brackets", quote(shape)))?
        .split(',')
        .map(str::trim)
        .filter(|extent| !extent.is_empty())
        .map(|extent| {
            extent.parse().map_err(|error| ("a shape of whole numbers", format!("{} ({error})", quote(extent))))
        })
        .collect::<Result<_, _>>()?;
    Ok(Header { kind, big_endian, column_major, shape, spelling: spelling.to_owned() })
}

fn element_kind(spelling: &str) -> Option<(bool, Kind)> {
    let mut letters = spelling.chars();
    let big_endian = match letters.next()? {
        '<' | '|' => false,
        '>' => true,
        _ => return None,
    };
    let kind = match letters.as_str() {
        "f4" => Kind::Float(4),
        "f8" => Kind::Float(8),
        "i1" => Kind::Signed(1),
        "i2" => Kind::Signed(2),
        "i4" => Kind::Signed(4),
        "i8" => Kind::Signed(8),
        "u1" | "b1" => Kind::Unsigned(1),
        "u2" => Kind::Unsigned(2),
        "u4" => Kind::Unsigned(4),
        "u8" => Kind::Unsigned(8),
        _ => return None,
    };
    Some((big_endian, kind))
}

/// Writes an `.npy` header, padded so that the elements start at a multiple of 64 bytes as numpy does it.
pub(crate) fn write_header(writer: &mut impl Write, spelling: &str, shape: &[usize]) -> io::Result<()> {
    let mut extents = shape.iter().map(|extent| extent.to_string()).collect::<Vec<_>>().join(", ");
    if shape.len() == 1 {
        extents.push(',');
    }
    let mut header = format!("{{'descr': '{spelling}', 'fortran_order': False, 'shape': ({extents}), }}");
    let unpadded = 10 + header.len() + 1;
    header.extend(std::iter::repeat_n(' ', unpadded.next_multiple_of(64) - unpadded));
    header.push('\n');
    let length = u16::try_from(header.len()).map_err(|error| io::Error::new(io::ErrorKind::InvalidInput, error))?;
    writer.write_all(b"\x93NUMPY\x01\x00")?;
    writer.write_all(&length.to_le_bytes())?;
    writer.write_all(header.as_bytes())
}

/// Puts the elements of a column-major array into row-major order.
pub(crate) fn row_major<T: Copy>(data: &[T], shape: &[usize]) -> Vec<T> {
    if data.is_empty() {
        return Vec::new(); // The extents beside a zero may be of any size.
    }
    let mut strides = vec![1usize; shape.len()];
    for axis in 1..shape.len() {
        strides[axis] = strides[axis - 1] * shape[axis - 1];
    }
    let mut index = vec![0usize; shape.len()];
    let mut out = Vec::with_capacity(data.len());
    for _ in 0..data.len() {
        out.push(data[index.iter().zip(&strides).map(|(i, stride)| i * stride).sum::<usize>()]);
        for axis in (0..shape.len()).rev() {
            index[axis] += 1;
            if index[axis] < shape[axis] {
                break;
            }
            index[axis] = 0;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::{Kind, row_major, split, write_header};

    #[test]
    fn header_round_trips() {
        for shape in [vec![], vec![5], vec![2, 3], vec![1, 2, 3]] {
            let mut bytes = Vec::new();
            write_header(&mut bytes, "<f4", &shape).unwrap();
            assert_eq!(bytes.len() % 64, 0);
            bytes.resize(bytes.len() + 4 * shape.iter().product::<usize>(), 0);
            let (header, _) = split(&bytes, "t.npz", "a").unwrap();
            assert_eq!((header.kind, header.shape, header.column_major), (Kind::Float(4), shape, false));
        }
    }

    #[test]
    fn column_major_is_reordered() {
        // [[1, 2, 3], [4, 5, 6]] stored by columns.
        assert_eq!(row_major(&[1, 4, 2, 5, 3, 6], &[2, 3]), [1, 2, 3, 4, 5, 6]);
        assert_eq!(row_major(&[7], &[]), [7]);
    }

    #[test]
    fn damage_never_panics() {
        let mut bytes = Vec::new();
        write_header(&mut bytes, "<u2", &[2, 3]).unwrap();
        bytes.extend([7; 12]);
        crate::fuzz::survives_damage(&bytes, |bytes| {
            if let Ok((header, elements)) = split(bytes, "damaged.npz", "a") {
                assert_eq!(header.shape.iter().product::<usize>() * header.kind.size(), elements.len());
            }
        });
        assert!(row_major::<u8>(&[], &[0, usize::MAX, usize::MAX]).is_empty());
    }

    #[test]
    fn absurd_shapes_are_refused() {
        let mut bytes = Vec::new();
        write_header(&mut bytes, "<f8", &[usize::MAX, 9]).unwrap();
        let error = split(&bytes, "t.npz", "big").unwrap_err().to_string();
        assert!(error.contains("array \"big\"") && error.contains("0 bytes"), "{error}");
    }
}
