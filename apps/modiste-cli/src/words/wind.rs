//! The words for wind.

use anyhow::{Context, Result, bail, ensure};
use modiste::WindDirection;

/// Reads `0.5,+x`.
pub(crate) fn wind(text: &str) -> Result<(f64, WindDirection)> {
    let (strength, direction) = text.split_once(',').context("wanted STRENGTH,DIRECTION, such as 0.5,+x")?;
    let strength: f64 = strength.parse().with_context(|| format!("`{strength}` is not a number"))?;
    ensure!(strength.is_finite() && strength >= 0.0, "the strength of the wind is 0 or more, not {strength}");
    let known = WindDirection::ALL.map(WindDirection::name).join(", ");
    match WindDirection::from_name(direction) {
        Some(direction) => Ok((strength, direction)),
        None => bail!("there is no direction `{direction}`; known: {known}"),
    }
}

#[cfg(test)]
mod tests {
    use super::wind;
    use modiste::WindDirection;

    #[test]
    fn winds_are_read_or_refused() {
        assert_eq!(wind("0.5,+x").unwrap(), (0.5, WindDirection::Left));
        for bad in ["0.5", "x,+x", "-1,+x", "0.5,north"] {
            assert!(wind(bad).is_err(), "{bad}");
        }
    }
}
