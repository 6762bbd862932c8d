//! Numbers of things of which there is at least one.

use anyhow::{Context, Result, ensure};

/// Reads a number from 1 on.
pub(crate) fn count(text: &str) -> Result<usize> {
    let count = text.parse().with_context(|| format!("`{text}` is not a whole number"))?;
    ensure!(count > 0, "at least 1 is wanted");
    Ok(count)
}
