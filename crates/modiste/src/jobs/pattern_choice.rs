//! Which sewing pattern.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use modiste_body::Body;
use modiste_cloth::Fabric;
use modiste_cloth::dress::Mannequin;
use modiste_cloth::pattern::{GradedPattern, known};
use modiste_core::Progress;

use crate::JobError;
use crate::event::Reporter;

/// Which sewing pattern a garment is cut from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PatternChoice {
    /// One of those that ship with the program, by name.
    BuiltIn(String),
    /// A pattern file: GarmentCode's specification, drawn for one body, or ours, with its sizes.
    File {
        /// The file.
        path: PathBuf,
        /// Name of the garment; otherwise that of the file.
        name: Option<String>,
        /// Name of the fabric; otherwise tops are of jersey, the rest of twill.
        fabric: Option<String>,
    },
}

impl PatternChoice {
    /// What the garment is called.
    pub fn garment(&self) -> String {
        match self {
            Self::BuiltIn(name) => name.clone(),
            Self::File { name: Some(name), .. } => name.clone(),
            Self::File { path, .. } => file_name(path),
        }
    }

    /// The pattern in all its sizes. A pattern without sizes is graded around `body`.
    pub(crate) fn load(&self, body: &Body, reporter: &Reporter<'_>) -> Result<Arc<GradedPattern>, JobError> {
        let gender = body.model().gender();
        let (path, fabric) = match self {
            Self::BuiltIn(name) => return Ok(Arc::new(known(name, gender)?)),
            Self::File { path, fabric, .. } => (path, fabric.as_deref()),
        };
        if let Some(fabric) = fabric.filter(|name| Fabric::from_name(name).is_none()) {
            let known: Vec<String> = Fabric::all().into_iter().map(|fabric| fabric.name).collect();
            return Err(JobError::Request(format!("there is no fabric `{fabric}`; known: {}", known.join(", "))));
        }
        let name = path.display().to_string();
        let text = modiste_io::read_text(path)?;
        let spec = modiste_io::pattern::parse(text.as_bytes(), &name)?;
        if spec.other.contains_key("modiste") {
            let mut pattern = GradedPattern::from_json(&name, &text)?;
            if pattern.gender != gender.name() {
                return Err(JobError::Request(format!(
                    "{name} is cut for {} bodies, not for {} ones",
                    pattern.gender,
                    gender.name()
                )));
            }
            pattern.garment = self.garment();
            if let Some(fabric) = fabric {
                fabric.clone_into(&mut pattern.material);
            }
            return Ok(Arc::new(pattern));
        }
        let wearer = Mannequin::from(body).wearer(gender);
        let (pattern, notes) = GradedPattern::from_ungraded(&spec, &name, &self.garment(), fabric, &wearer)?;
        for note in notes {
            reporter.warn(&format!("{name}: {note}"));
        }
        Ok(Arc::new(pattern))
    }
}

/// The name of a file without its endings, and without what GarmentCode adds to it.
fn file_name(path: &Path) -> String {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or("garment");
    let stem = name.split('.').next().unwrap_or(name);
    stem.strip_suffix("_specification").unwrap_or(stem).to_owned()
}

#[cfg(test)]
mod tests {
    use super::PatternChoice;

    #[test]
    fn garments_are_named_after_their_file() {
        let file = |path: &str| PatternChoice::File { path: path.into(), name: None, fabric: None }.garment();
        assert_eq!(file("a/skirt2_specification.json"), "skirt2");
        assert_eq!(file("cape.json"), "cape");
        let named = PatternChoice::File { path: "x.json".into(), name: Some("robe".into()), fabric: None };
        assert_eq!(named.garment(), "robe");
    }
}
