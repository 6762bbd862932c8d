//! The three ways in which the files are packed, told by their first bytes, under one set of names.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use zip::ZipArchive;

use crate::error::quote;
use crate::file::read_bounded;
use crate::{IoError, list_folder, read_bytes, unpacked};

/// The most that a `.tar.xz` or one packed file may unpack to (bytes); the real subset has 90 MB.
const MAX_UNPACKED: u64 = 1 << 30;

/// Files by their canonical name.
pub(crate) struct Archive {
    entries: BTreeMap<String, Entry>,
    zip: Option<Mutex<ZipArchive<BufReader<File>>>>,
}

enum Entry {
    Bytes(Vec<u8>),
    InZip(usize),
    OnDisk(PathBuf),
}

impl std::fmt::Debug for Archive {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Archive").field("entries", &self.entries.len()).finish_non_exhaustive()
    }
}

impl Archive {
    pub(crate) fn open(path: &Path) -> Result<Self, IoError> {
        let failed = |source| IoError::file("read", path, source);
        let file_name = path.display().to_string();
        if path.is_dir() {
            return Self::new(folder_entries(path)?, None, &file_name);
        }
        let mut file = File::open(path).map_err(failed)?;
        let mut magic = Vec::new();
        Read::by_ref(&mut file).take(6).read_to_end(&mut magic).map_err(failed)?;
        let mut file = BufReader::new(file);
        io::Seek::rewind(&mut file).map_err(failed)?;
        let damaged =
            |error: &dyn std::fmt::Display| IoError::field(&file_name, "the archive", "intact packed files", error);
        if magic.starts_with(b"PK") {
            let zip = ZipArchive::new(file).map_err(|error| damaged(&error))?;
            let entries = (0..zip.len())
                .filter_map(|index| Some((zip.name_for_index(index)?.ok()?.into_owned(), Entry::InZip(index))))
                .collect();
            Self::new(entries, Some(Mutex::new(zip)), &file_name)
        } else if magic.starts_with(b"\xfd7zXZ\0") {
            let mut tar = Bounded(Vec::new());
            lzma_rs::xz_decompress(&mut file, &mut tar).map_err(|error| damaged(&error))?;
            Self::new(tar_entries(&tar.0).map_err(|error| damaged(&error))?, None, &file_name)
        } else {
            let found = format!("first bytes {}", quote(&String::from_utf8_lossy(&magic)));
            Err(IoError::field(&file_name, "the archive", "a tar.xz, a wheel (zip) or a folder", found))
        }
    }

    fn new(
        packed: Vec<(String, Entry)>,
        zip: Option<Mutex<ZipArchive<BufReader<File>>>>,
        file: &str,
    ) -> Result<Self, IoError> {
        // The folder that holds base.obj, or 3dobjs/base.obj, is the root of the rest.
        let base = packed
            .iter()
            .map(|(name, _)| name.as_str())
            .filter(|name| *name == "base.obj" || name.ends_with("/base.obj"))
            .min_by_key(|name| name.len())
            .ok_or_else(|| IoError::field(file, "base.obj", "it to be there", "other files only"))?;
        let root = base.strip_suffix("base.obj").unwrap_or_default();
        let root = root.strip_suffix("3dobjs/").unwrap_or(root).to_owned();
        let entries = packed
            .into_iter()
            .filter_map(|(name, entry)| Some((canonical_name(name.strip_prefix(&root)?), entry)))
            .collect();
        Ok(Self { entries, zip })
    }

    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.entries.keys().map(String::as_str)
    }

    pub(crate) fn contains(&self, name: &str) -> bool {
        self.entries.contains_key(name)
    }

    pub(crate) fn get(&self, name: &str, file: &str) -> Result<Vec<u8>, IoError> {
        let missing = || IoError::field(file, name, "it to be there", "other files only");
        match self.entries.get(name).ok_or_else(missing)? {
            Entry::OnDisk(path) => read_bytes(path),
            Entry::Bytes(bytes) => unpacked(bytes.clone(), file),
            Entry::InZip(index) => {
                let zip = self.zip.as_ref().ok_or_else(missing)?;
                let mut zip = zip.lock().unwrap_or_else(PoisonError::into_inner);
                let damaged = |error: &dyn std::fmt::Display| IoError::field(file, name, "intact packed bytes", error);
                let entry = zip.by_index(*index).map_err(|error| damaged(&error))?;
                unpacked(read_bounded(entry, MAX_UNPACKED).map_err(|error| damaged(&error))?, file)
            }
        }
    }
}

/// Makes the layouts of the subset and of MPFB2 one.
fn canonical_name(name: &str) -> String {
    let name = name.strip_suffix(".gz").unwrap_or(name);
    let name = ["3dobjs/", "targets/", "local/"].iter().find_map(|folder| name.strip_prefix(folder)).unwrap_or(name);
    name.strip_prefix("rigs/standard/").map_or_else(|| name.to_owned(), |rest| format!("rigs/{rest}"))
}

/// All files below a folder, to a depth that no link can exceed.
fn folder_entries(root: &Path) -> Result<Vec<(String, Entry)>, IoError> {
    const DEEPEST: usize = 8;
    let mut entries = Vec::new();
    let mut folders = vec![(root.to_owned(), 0)];
    while let Some((folder, depth)) = folders.pop() {
        for path in list_folder(folder)? {
            if path.is_dir() {
                if depth < DEEPEST {
                    folders.push((path, depth + 1));
                }
            } else if let Ok(relative) = path.strip_prefix(root) {
                let words: Vec<_> = relative.iter().map(|word| word.to_string_lossy()).collect();
                entries.push((words.join("/"), Entry::OnDisk(path)));
            }
        }
    }
    Ok(entries)
}

fn tar_entries(tar: &[u8]) -> io::Result<Vec<(String, Entry)>> {
    let mut entries = Vec::new();
    for file in tar::Archive::new(tar).entries()? {
        let file = file?;
        if file.header().entry_type().is_file() {
            let name = String::from_utf8_lossy(&file.path_bytes()).trim_start_matches("./").to_owned();
            entries.push((name, Entry::Bytes(read_bounded(file, MAX_UNPACKED)?)));
        }
    }
    Ok(entries)
}

/// Collects what is written, up to [`MAX_UNPACKED`].
struct Bounded(Vec<u8>);

impl Write for Bounded {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.0.len() as u64 + bytes.len() as u64 > MAX_UNPACKED {
            return Err(io::Error::new(io::ErrorKind::FileTooLarge, format!("more than {MAX_UNPACKED} bytes")));
        }
        self.0.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
