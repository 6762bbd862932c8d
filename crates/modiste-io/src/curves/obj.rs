//! Lines (`l`) of a Wavefront OBJ.

use modiste_core::Vec3;

use crate::IoError;
use crate::text::{lines, lossy};

pub(super) fn parse(bytes: &[u8], name: &str) -> Result<Vec<Vec<Vec3>>, IoError> {
    let text = lossy(bytes);
    let mut vertices = Vec::new();
    let mut curves = Vec::new();
    for line in lines(&text, name) {
        let mut words = line.text.split('#').next().unwrap_or_default().split_whitespace();
        match words.next() {
            Some("v") => vertices.push(line.point(&mut words, "three finite coordinates after v")?),
            Some("l") => {
                let mut curve = Vec::new();
                for word in words {
                    let index: i64 = line.whole(word.split('/').next().unwrap_or_default(), "a vertex")?;
                    // Negative numbers count back from the last vertex.
                    let place = if index < 0 { vertices.len() as i64 + index } else { index - 1 };
                    let vertex = usize::try_from(place).ok().and_then(|place| vertices.get(place));
                    curve.push(*vertex.ok_or_else(|| line.error("a vertex that stands above", word))?);
                }
                if curve.len() < 2 {
                    return Err(line.error("a line of two vertices or more", line.text));
                }
                curves.push(curve);
            }
            _ => {}
        }
    }
    if curves.is_empty() {
        return Err(IoError::field(name, "lines", "one or more (l)", "none"));
    }
    Ok(curves)
}
