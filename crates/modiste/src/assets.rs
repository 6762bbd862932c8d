//! Where the trained models are.

use std::path::{Path, PathBuf};

use modiste_body::Gender;

use crate::JobError;

/// Name of the environment variable that says where the models are.
pub const ASSETS_VARIABLE: &str = "MODISTE_ASSETS";

/// How the files of models end.
const ENDING: &str = ".safetensors";

/// A folder of trained models: `body-<gender>.safetensors` and `<gender>-<garment>.safetensors`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Assets {
    folder: PathBuf,
}

impl Assets {
    /// Takes this folder.
    ///
    /// # Errors
    /// [`JobError::Assets`] when it is not there.
    pub fn at(folder: impl Into<PathBuf>) -> Result<Self, JobError> {
        let folder = folder.into();
        if folder.is_dir() {
            Ok(Self { folder })
        } else {
            Err(JobError::Assets { looked: folder.display().to_string() })
        }
    }

    /// Looks for the models: in the folder that `MODISTE_ASSETS` names; otherwise in `assets` below the current folder or
    /// one above it, and in `assets` of the source tree that the program was built from.
    ///
    /// # Errors
    /// [`JobError::Assets`] says where it looked.
    pub fn find() -> Result<Self, JobError> {
        if let Some(named) = std::env::var_os(ASSETS_VARIABLE) {
            return Self::at(named);
        }
        let current = std::env::current_dir().unwrap_or_default();
        let candidates: Vec<PathBuf> =
            current.ancestors().map(Path::to_path_buf).chain([source_tree()]).map(|root| root.join("assets")).collect();
        match candidates.iter().find(|folder| is_models_folder(folder)) {
            Some(folder) => Self::at(folder),
            None => Err(JobError::Assets {
                looked: format!("{} and {}", current.join("assets").display(), source_tree().join("assets").display()),
            }),
        }
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The body model of a gender.
    pub fn body(&self, gender: Gender) -> PathBuf {
        self.folder.join(format!("body-{}.safetensors", gender.name()))
    }

    /// The model of a garment for a gender; a name with a `/` or the ending `.safetensors` is a file of its own.
    ///
    /// # Errors
    /// [`JobError::UnknownGarment`] lists those that there are.
    pub fn garment(&self, gender: Gender, name: &str) -> Result<PathBuf, JobError> {
        if name.contains(std::path::MAIN_SEPARATOR) || name.ends_with(ENDING) {
            return Ok(PathBuf::from(name));
        }
        let known = self.garments(gender)?;
        if known.iter().any(|garment| garment == name) {
            return Ok(self.folder.join(format!("{}-{name}.safetensors", gender.name())));
        }
        Err(JobError::UnknownGarment { name: name.to_owned(), gender, known })
    }

    /// The model of learned hair; a name with a `/` or the ending `.safetensors` is a file of its own.
    ///
    /// # Errors
    /// [`JobError::UnknownHair`] lists those that there are, and says how to learn one.
    pub fn hair(&self, name: &str) -> Result<PathBuf, JobError> {
        if name.contains(std::path::MAIN_SEPARATOR) || name.ends_with(ENDING) {
            return Ok(PathBuf::from(name));
        }
        let known = self.names("hair-")?;
        if known.iter().any(|hair| hair == name) {
            return Ok(self.folder.join(format!("hair-{name}{ENDING}")));
        }
        Err(JobError::UnknownHair { name: name.to_owned(), known })
    }

    fn names(&self, prefix: &str) -> Result<Vec<String>, JobError> {
        let mut names = Vec::new();
        for path in modiste_io::list_folder(&self.folder)? {
            let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
            if let Some(model) = name.strip_prefix(prefix).and_then(|rest| rest.strip_suffix(ENDING)) {
                names.push(model.to_owned());
            }
        }
        Ok(names)
    }

    /// Names of the garments that there are for a gender, sorted.
    ///
    /// # Errors
    /// The folder cannot be read.
    pub fn garments(&self, gender: Gender) -> Result<Vec<String>, JobError> {
        self.names(&format!("{}-", gender.name()))
    }
}

/// The workspace that this crate was built in; it may be gone.
fn source_tree() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap_or(Path::new(".")).to_path_buf()
}

/// Other programs have folders called `assets` too.
fn is_models_folder(folder: &Path) -> bool {
    Gender::ALL.iter().any(|gender| folder.join(format!("body-{}.safetensors", gender.name())).is_file())
}

#[cfg(test)]
mod tests {
    use super::Assets;
    use modiste_body::Gender;

    #[test]
    fn garments_are_listed_and_an_unknown_one_names_them() {
        let folder = tempfile::tempdir().unwrap();
        for name in
            ["body-female.safetensors", "female-tshirt.safetensors", "female-shorts.safetensors", "female-x.txt"]
        {
            modiste_io::write_bytes(folder.path().join(name), b"").unwrap();
        }
        let assets = Assets::at(folder.path()).unwrap();
        assert_eq!(assets.garments(Gender::Female).unwrap(), ["shorts", "tshirt"]);
        assert!(assets.garment(Gender::Female, "shorts").unwrap().is_file());
        let error = assets.garment(Gender::Female, "cape").unwrap_err().to_string();
        assert_eq!(error, "there is no garment `cape` for a female body; known: shorts, tshirt");
        assert!(assets.garment(Gender::Male, "shorts").is_err());
        assert_eq!(
            assets.garment(Gender::Male, "./cape.safetensors").unwrap(),
            std::path::Path::new("./cape.safetensors")
        );
    }

    #[test]
    fn a_folder_that_is_not_there_is_named() {
        let error = Assets::at("no/such/folder").unwrap_err().to_string();
        assert!(error.contains("no/such/folder") && error.contains("MODISTE_ASSETS"), "{error}");
    }
}
