//! Cem Yuksel's `.hair`: a header of 128 bytes, segments per strand where they differ, then the points.

use modiste_core::Vec3;

use super::Bytes;
use crate::IoError;

const HEADER: usize = 128;
/// Bits of the header that say which arrays there are.
const HAS_SEGMENTS: usize = 1;
const HAS_POINTS: usize = 2;

pub(super) fn parse(bytes: &[u8], name: &str) -> Result<Vec<Vec<Vec3>>, IoError> {
    if !bytes.starts_with(b"HAIR") || bytes.len() < HEADER {
        return Err(IoError::field(name, "header", "HAIR and 128 bytes", format!("{} bytes", bytes.len())));
    }
    let reader = Bytes { bytes, file: name };
    let (strands, points) = (reader.u32(4, "strands")?, reader.u32(8, "points")?);
    let (flags, segments) = (reader.u32(12, "arrays")?, reader.u32(16, "segments")?);
    if strands == 0 || flags & HAS_POINTS == 0 {
        return Err(IoError::field(name, "arrays", "points of one strand or more", format!("{strands} strands")));
    }
    let mut start = HEADER;
    let mut counts = Vec::new();
    if flags & HAS_SEGMENTS == 0 {
        reader.check_count("strands", strands, 12, start)?;
        counts.resize(strands, segments);
    } else {
        reader.check_count("strands", strands, 2, start)?;
        counts.extend(
            bytes[start..start + 2 * strands].chunks_exact(2).map(|b| usize::from(u16::from_le_bytes([b[0], b[1]]))),
        );
        start += 2 * strands;
    }
    let total = counts.iter().fold(strands, |sum, count| sum.saturating_add(*count));
    if total != points {
        return Err(IoError::field(name, "points", total, points));
    }
    reader.check_count("points", points, 12, start)?;
    let mut at = start;
    counts
        .into_iter()
        .enumerate()
        .map(|(strand, segments)| {
            (0..=segments)
                .map(|point| {
                    at += 12;
                    reader.point(at - 12, &format!("strand {strand}, point {point}"))
                })
                .collect()
        })
        .collect()
}
