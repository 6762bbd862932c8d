//! AMD TressFX 4: a header of 160 bytes, then four numbers (position and inverse mass) per point.

use modiste_core::Vec3;

use super::Bytes;
use crate::IoError;

pub(super) fn parse(bytes: &[u8], name: &str) -> Result<Vec<Vec<Vec3>>, IoError> {
    let bytes = Bytes { bytes, file: name };
    let version = f32::from_bits(bytes.u32(0, "version")? as u32);
    if !(3.0..5.0).contains(&version) {
        return Err(IoError::field(name, "version", "3 or 4", version));
    }
    let (strands, each, start) =
        (bytes.u32(4, "strands")?, bytes.u32(8, "points of a strand")?, bytes.u32(12, "offset")?);
    if strands == 0 || each < 2 {
        return Err(IoError::field(
            name,
            "strands",
            "one or more, of two points or more",
            format!("{strands} of {each}"),
        ));
    }
    bytes.check_count("strands", strands, 16usize.saturating_mul(each), start)?;
    (0..strands)
        .map(|strand| {
            let at = |point: usize| start + 16 * (strand * each + point);
            (0..each).map(|point| bytes.point(at(point), &format!("strand {strand}, point {point}"))).collect()
        })
        .collect()
}
