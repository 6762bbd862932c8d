//! A folder of results that appears as a whole or not at all.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::{IoError, create_folder, list_folder};

/// A folder for files that are needed for a while; it goes when this is dropped.
#[derive(Debug)]
pub struct TemporaryFolder(tempfile::TempDir);

impl TemporaryFolder {
    /// Makes one where the system keeps such folders.
    ///
    /// # Errors
    /// [`IoError::File`] when it cannot be made.
    pub fn new() -> Result<Self, IoError> {
        let made = tempfile::Builder::new().prefix("modiste-").tempdir();
        made.map(Self).map_err(|source| IoError::file("write the folder", &std::env::temp_dir(), source))
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        self.0.path()
    }
}

/// A hidden folder beside its target, in which results are collected.
///
/// [`StagedFolder::commit`] moves them to the target; dropped before that, it removes them and the target stays as it was.
#[derive(Debug)]
pub struct StagedFolder {
    target: PathBuf,
    parent: PathBuf,
    staging: tempfile::TempDir,
}

impl StagedFolder {
    /// Opens a staging folder beside `target`, or beside its first missing parent.
    ///
    /// # Errors
    /// [`IoError::File`] when `target` is a file, or its parent cannot be written.
    pub fn new(target: impl AsRef<Path>) -> Result<Self, IoError> {
        let target = target.as_ref().to_path_buf();
        let failed = |source| IoError::file("write the folder", &target, source);
        if target.exists() && !target.is_dir() {
            return Err(failed(io::Error::new(io::ErrorKind::NotADirectory, "a file of that name is in the way")));
        }
        if target.is_dir() {
            // Moving files into it needs its permission, which is asked for now rather than when all work is done.
            tempfile::Builder::new().prefix(".modiste-").tempfile_in(&target).map_err(failed)?;
        }
        let beside = |path: &Path| match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent.to_path_buf(),
            Some(_) => PathBuf::from("."),
            None => path.to_path_buf(),
        };
        let parent = beside(&target);
        // Missing parents are made at the end, so that nothing is left of what was refused.
        let mut place = parent.clone();
        while !place.exists() {
            place = beside(&place);
        }
        let mut builder = tempfile::Builder::new();
        builder.prefix(".modiste-").suffix(".partial");
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777)); // the process's umask still applies
        let staging = builder.tempdir_in(&place).map_err(failed)?;
        Ok(Self { target, parent, staging })
    }

    /// Where results are put until they are complete.
    pub fn path(&self) -> &Path {
        self.staging.path()
    }

    /// An error in the staging folder, told of the place in the target that the user knows.
    #[must_use]
    pub fn retold(&self, error: IoError) -> IoError {
        let staging = self.staging.path().display().to_string();
        match error {
            IoError::File { action, path, source } => {
                let target = self.target.display().to_string();
                IoError::File { action, path: path.replace(&staging, &target), source }
            }
            other => other,
        }
    }

    /// Moves everything to the target. Files of the same name there are replaced, others stay, in folders below it too.
    ///
    /// # Errors
    /// [`IoError::File`] with the path and the reason.
    pub fn commit(self) -> Result<PathBuf, IoError> {
        let Self { target, parent, staging } = self;
        let failed = |source| IoError::file("write the folder", &target, source);
        if target.is_dir() {
            merge(staging.path(), &target)?;
            staging.close().map_err(failed)?;
        } else {
            create_folder(&parent)?;
            fs::rename(staging.path(), &target).map_err(failed)?;
            let _moved = staging.keep();
        }
        Ok(target)
    }
}

/// Moves the entries of a folder into another.
fn merge(from: &Path, to: &Path) -> Result<(), IoError> {
    for entry in list_folder(from)? {
        let Some(name) = entry.file_name() else { continue };
        let place = to.join(name);
        if entry.is_dir() && place.is_dir() {
            merge(&entry, &place)?;
        } else {
            fs::rename(&entry, &place).map_err(|source| IoError::file("write", &place, source))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::StagedFolder;
    use crate::{exists, list_folder, read_bytes, write_bytes};

    #[test]
    fn results_appear_together_and_replace_only_their_namesakes() {
        let root = tempfile::tempdir().unwrap();
        let target = root.path().join("deep/out");
        let staged = StagedFolder::new(&target).unwrap();
        write_bytes(staged.path().join("a"), b"1").unwrap();
        assert!(!exists(&target));
        assert_eq!(staged.commit().unwrap(), target);
        assert_eq!(read_bytes(target.join("a")).unwrap(), b"1");

        write_bytes(target.join("other"), b"kept").unwrap();
        let again = StagedFolder::new(&target).unwrap();
        write_bytes(again.path().join("a"), b"2").unwrap();
        write_bytes(target.join("below/old"), b"kept").unwrap();
        write_bytes(again.path().join("below/new"), b"3").unwrap();
        again.commit().unwrap();
        assert_eq!(read_bytes(target.join("below/old")).unwrap(), b"kept");
        assert_eq!(read_bytes(target.join("below/new")).unwrap(), b"3");
        assert_eq!(read_bytes(target.join("a")).unwrap(), b"2");
        assert_eq!(read_bytes(target.join("other")).unwrap(), b"kept");
        assert_eq!(list_folder(root.path().join("deep")).unwrap(), [target]);
    }

    #[test]
    fn nothing_is_left_of_what_was_not_finished() {
        let root = tempfile::tempdir().unwrap();
        let staged = StagedFolder::new(root.path().join("out")).unwrap();
        write_bytes(staged.path().join("half"), b"1").unwrap();
        let error = read_bytes(staged.path().join("absent")).unwrap_err();
        let wanted = format!("cannot read {}", root.path().join("out/absent").display());
        assert!(staged.retold(error).to_string().starts_with(&wanted));
        drop(staged);
        assert!(list_folder(root.path()).unwrap().is_empty());
    }

    #[test]
    fn a_target_that_cannot_be_is_refused_at_once() {
        let root = tempfile::tempdir().unwrap();
        write_bytes(root.path().join("file"), b"").unwrap();
        for target in ["file", "file/below"] {
            let error = StagedFolder::new(root.path().join(target)).unwrap_err().to_string();
            assert!(error.contains("file"), "{error}");
        }
    }
}
