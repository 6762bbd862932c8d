//! What a section of a report holds.

use std::collections::BTreeMap;
use std::fmt::{Display, Write};

use anyhow::Result;
use serde::{Deserialize, Serialize};

/// A figure that the project answers for.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Claim {
    /// What is measured.
    pub(crate) what: String,
    /// What it must be, in words.
    pub(crate) target: String,
    /// What it is, in words.
    pub(crate) found: String,
    /// Whether that is enough.
    pub(crate) met: bool,
}

/// A section: text with tables, claims, figures and plots.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct Page {
    pub(crate) title: String,
    pub(crate) text: String,
    pub(crate) claims: Vec<Claim>,
    /// Every figure behind text and plots.
    pub(crate) figures: BTreeMap<String, serde_json::Value>,
    /// File name and SVG of each plot; they are files of their own.
    #[serde(skip)]
    pub(crate) plots: Vec<(String, String)>,
}

impl Page {
    /// An empty section.
    pub(crate) fn new(title: &str) -> Self {
        Self { title: title.to_owned(), ..Self::default() }
    }

    /// Adds a paragraph.
    pub(crate) fn paragraph(&mut self, text: impl Display) {
        // Writing to a string cannot fail.
        let _always_ok = write!(self.text, "{text}\n\n");
    }

    /// Adds a table.
    pub(crate) fn table<R: AsRef<[String]>>(&mut self, header: &[&str], rows: impl IntoIterator<Item = R>) {
        let rule = vec!["---"; header.len()].join("|");
        let mut text = format!("| {} |\n|{rule}|\n", header.join(" | "));
        for row in rows {
            text += &format!("| {} |\n", row.as_ref().join(" | "));
        }
        self.paragraph(text.trim_end());
    }

    /// Adds a plot; `name` is its file name without the ending.
    pub(crate) fn plot(&mut self, name: &str, caption: &str, svg: String) {
        let file = format!("{name}.svg");
        self.paragraph(format!("![{caption}]({file})"));
        self.plots.push((file, svg));
    }

    /// Adds figures.
    ///
    /// # Errors
    /// The value has no JSON form.
    pub(crate) fn figures(&mut self, name: &str, value: &impl Serialize) -> Result<()> {
        self.figures.insert(name.to_owned(), serde_json::to_value(value)?);
        Ok(())
    }

    /// Adds a claim that a value is at most `limit`.
    pub(crate) fn at_most(&mut self, what: &str, found: f64, limit: f64, unit: &str) {
        self.claim(what, format!("at most {limit} {unit}"), format!("{} {unit}", rounded(found)), found <= limit);
    }

    /// Adds a claim that a value is at least `limit`.
    pub(crate) fn at_least(&mut self, what: &str, found: f64, limit: f64, unit: &str) {
        self.claim(what, format!("at least {limit} {unit}"), format!("{} {unit}", rounded(found)), found >= limit);
    }

    /// Adds a claim of any kind.
    pub(crate) fn claim(&mut self, what: &str, target: String, found: String, met: bool) {
        self.claims.push(Claim { what: what.to_owned(), target, found, met });
    }

    /// Shows the claims on the terminal.
    pub(crate) fn print(&self) {
        for claim in &self.claims {
            let met = if claim.met { "  met" } else { "  NOT MET" };
            println!("{met}: {} = {} (wanted {})", claim.what, claim.found, claim.target);
        }
    }
}

/// Three significant digits, without an exponent.
pub(crate) fn rounded(value: f64) -> String {
    let magnitude = if value.abs() > 1e-12 { value.abs().log10().floor() as i32 } else { 0 };
    let decimals = (2 - magnitude).clamp(0, 6) as usize;
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::{Page, rounded};

    #[test]
    fn three_digits_count() {
        assert_eq!(rounded(0.012_345), "0.0123");
        assert_eq!(rounded(12.345), "12.3");
        assert_eq!(rounded(1234.5), "1234");
        assert_eq!(rounded(0.0), "0.00");
    }

    #[test]
    fn claims_know_whether_they_are_met() {
        let mut page = Page::new("x");
        page.at_most("a", 3.0, 4.0, "mm");
        page.at_least("b", 0.8, 0.85, "");
        assert_eq!(page.claims.iter().map(|claim| claim.met).collect::<Vec<_>>(), [true, false]);
        page.table(&["a", "b"], [["1".to_owned(), "2".to_owned()]]);
        assert_eq!(page.text, "| a | b |\n|---|---|\n| 1 | 2 |\n\n");
    }
}
