//! The words for a length of its own in a region of the scalp.

use anyhow::{Context, Result};
use modiste::HairRegion;

/// Reads `front=0.1`.
pub(crate) fn region_length(text: &str) -> Result<(HairRegion, f64)> {
    let (name, length) = text.split_once('=').with_context(|| format!("`{text}` is not a region=factor"))?;
    let known = HairRegion::ALL.map(HairRegion::name).join(", ");
    let region = HairRegion::from_name(name).with_context(|| format!("there is no region `{name}`; known: {known}"))?;
    let length = length.parse().with_context(|| format!("`{length}` is not a number"))?;
    Ok((region, length))
}

#[cfg(test)]
mod tests {
    use super::region_length;
    use modiste::HairRegion;

    #[test]
    fn lengths_of_regions_are_read_or_refused() {
        let (region, length) = region_length("back=0.25").unwrap();
        assert!(region == HairRegion::Back && (length - 0.25).abs() < 1e-12);
        let message = |text: &str| region_length(text).unwrap_err().to_string();
        assert!(message("fringe=1").contains("known: front, sides, back"));
        assert!(message("front").contains("region=factor"));
        assert!(message("front=long").contains("not a number"));
    }
}
