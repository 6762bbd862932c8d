//! Whole files and folders: bounded reading, writing that never leaves half a file.

use std::fs::{self, File};
use std::io::{self, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use crate::IoError;

/// The most bytes one file may unpack to (4 GiB): far above anything real, below what would exhaust a machine silently.
pub(crate) const MAX_BYTES: u64 = 4 << 30;

/// The writer handed out by [`write_atomically`]: buffered, seekable.
pub type FileWriter = BufWriter<File>;

/// Writes a file by way of a temporary one beside it, renamed when complete.
///
/// Missing parent folders are created. If `write` fails, or the disk is full, the temporary file is removed and an
/// earlier file of that name stays as it was.
///
/// # Errors
/// [`IoError::File`] with the path and the reason.
pub fn write_atomically(
    path: impl AsRef<Path>,
    write: impl FnOnce(&mut FileWriter) -> io::Result<()>,
) -> Result<(), IoError> {
    let path = path.as_ref();
    let failed = |source| IoError::file("write", path, source);
    if path.file_name().is_none() {
        return Err(failed(io::Error::new(io::ErrorKind::InvalidInput, "the path names no file")));
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    create_folder(folder)?;
    let (file, temporary) = temporary_beside(folder).map_err(failed)?.into_parts();
    let mut writer = BufWriter::with_capacity(1 << 18, file);
    write(&mut writer).map_err(failed)?;
    let file = writer.into_inner().map_err(|unwritten| failed(unwritten.into_error()))?;
    file.sync_all().map_err(failed)?;
    drop(file);
    temporary.persist(path).map_err(|unmoved| failed(unmoved.error))
}

/// A temporary file's name and permissions: those of an ordinary new file, not the private ones of `tempfile`.
fn temporary_beside(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".modiste-").suffix(".tmp");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666)); // the process's umask still applies
    builder.tempfile_in(folder)
}

/// Writes bytes as a whole file, by [`write_atomically`].
///
/// # Errors
/// [`IoError::File`] with the path and the reason.
pub fn write_bytes(path: impl AsRef<Path>, bytes: &[u8]) -> Result<(), IoError> {
    write_atomically(path, |writer| writer.write_all(bytes))
}

/// Writes into a file that is there, where it stands: for the controls of the system, which cannot be replaced.
///
/// # Errors
/// [`IoError::File`] with the path and the reason.
pub fn write_in_place(path: impl AsRef<Path>, bytes: &[u8]) -> Result<(), IoError> {
    let path = path.as_ref();
    let opened = fs::OpenOptions::new().write(true).open(path);
    opened.and_then(|mut file| file.write_all(bytes)).map_err(|source| IoError::file("write", path, source))
}

/// Reads a whole file; a gzipped one (told by its first bytes, not its name) is unpacked.
///
/// # Errors
/// [`IoError::File`] with the path and the reason.
pub fn read_bytes(path: impl AsRef<Path>) -> Result<Vec<u8>, IoError> {
    let path = path.as_ref();
    let failed = |source| IoError::file("read", path, source);
    let file = File::open(path).map_err(failed)?;
    if file.metadata().map_err(failed)?.is_dir() {
        return Err(failed(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder, not a file")));
    }
    let bytes = read_bounded(BufReader::new(file), MAX_BYTES).map_err(failed)?;
    unpacked(bytes, &path.display().to_string())
}

/// Reads a whole UTF-8 text file (unpacked if gzipped).
///
/// # Errors
/// [`IoError`] with the path and the reason.
pub fn read_text(path: impl AsRef<Path>) -> Result<String, IoError> {
    let path = path.as_ref();
    String::from_utf8(read_bytes(path)?).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        IoError::field(&path.display().to_string(), format!("byte {at}"), "UTF-8 text", "another encoding")
    })
}

/// Creates a folder and those above it; nothing happens where it exists.
///
/// # Errors
/// [`IoError::File`] with the path and the reason.
pub fn create_folder(path: impl AsRef<Path>) -> Result<(), IoError> {
    let path = path.as_ref();
    fs::create_dir_all(path).map_err(|source| IoError::file("create the folder", path, source))
}

/// Asks now whether a file could be written, for work after which it would be too late. Nothing is left behind.
///
/// # Errors
/// [`IoError::File`] with the path and the reason.
pub fn check_writable(path: impl AsRef<Path>) -> Result<(), IoError> {
    let path = path.as_ref();
    let failed = |source| IoError::file("write", path, source);
    if path.is_dir() {
        return Err(failed(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder, not a file")));
    }
    // Missing folders will be made, so the first that is there has to allow it.
    let mut place = path.parent();
    while let Some(folder) = place.filter(|folder| !folder.as_os_str().is_empty() && !folder.exists()) {
        place = folder.parent();
    }
    let place = place.filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    tempfile::Builder::new().prefix(".modiste-").tempfile_in(place).map(drop).map_err(failed)
}

/// The entries of a folder, sorted by name.
///
/// # Errors
/// [`IoError::File`] with the path and the reason.
pub fn list_folder(path: impl AsRef<Path>) -> Result<Vec<PathBuf>, IoError> {
    let path = path.as_ref();
    let failed = |source| IoError::file("list", path, source);
    let mut entries = fs::read_dir(path)
        .map_err(failed)?
        .map(|entry| Ok(entry?.path()))
        .collect::<io::Result<Vec<_>>>()
        .map_err(failed)?;
    entries.sort();
    Ok(entries)
}

/// Whether a file or folder is there.
pub fn exists(path: impl AsRef<Path>) -> bool {
    path.as_ref().exists()
}

/// The size of a file (bytes).
///
/// # Errors
/// [`IoError::File`] with the path and the reason.
pub fn file_size(path: impl AsRef<Path>) -> Result<u64, IoError> {
    let path = path.as_ref();
    Ok(fs::metadata(path).map_err(|source| IoError::file("read", path, source))?.len())
}

/// Removes a file; nothing happens where there is none.
///
/// # Errors
/// [`IoError::File`] with the path and the reason.
pub fn remove_file(path: impl AsRef<Path>) -> Result<(), IoError> {
    let path = path.as_ref();
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(IoError::file("remove", path, error)),
        _ => Ok(()),
    }
}

/// Unpacks gzip, told by its magic bytes; other bytes pass through.
///
/// # Errors
/// [`IoError::Field`] when the packed bytes are damaged or unpack to more than 4 GiB.
pub fn unpacked(bytes: Vec<u8>, name: &str) -> Result<Vec<u8>, IoError> {
    if !bytes.starts_with(&[0x1f, 0x8b]) {
        return Ok(bytes);
    }
    read_bounded(flate2::read::MultiGzDecoder::new(bytes.as_slice()), MAX_BYTES)
        .map_err(|error| IoError::field(name, "gzip", "intact packed bytes", error))
}

/// Reads to the end, but refuses more than `limit` bytes; memory grows with what is really there.
pub(crate) fn read_bounded(mut reader: impl Read, limit: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    reader.by_ref().take(limit).read_to_end(&mut bytes)?;
    if reader.read(&mut [0])? != 0 {
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, format!("more than {limit} bytes")));
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::{check_writable, list_folder, read_bounded, read_bytes, write_atomically, write_bytes};
    use std::io::{self, Write};

    #[test]
    fn failed_write_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deep/er/result.bin");
        write_bytes(&path, b"old").unwrap();
        let error = write_atomically(&path, |writer| {
            writer.write_all(&[7; 1 << 20])?;
            Err(io::Error::new(io::ErrorKind::StorageFull, "no space left on device"))
        })
        .unwrap_err()
        .to_string();
        assert!(error.contains("result.bin") && error.contains("no space"), "{error}");
        assert_eq!(read_bytes(&path).unwrap(), b"old");
        assert_eq!(list_folder(path.parent().unwrap()).unwrap(), [path]);
    }

    #[test]
    fn a_path_that_cannot_be_written_is_named() {
        let folder = tempfile::tempdir().unwrap();
        write_bytes(folder.path().join("plain"), b"").unwrap();
        let error = write_bytes(folder.path().join("plain/below"), b"x").unwrap_err().to_string();
        assert!(error.contains("plain"), "{error}");
        assert!(write_bytes("/", b"x").unwrap_err().to_string().contains("names no file"));
        assert!(read_bytes(folder.path()).unwrap_err().to_string().contains("folder"));
        let refused = |path: &str| check_writable(folder.path().join(path)).unwrap_err().to_string();
        assert!(refused("plain/below").contains("plain"), "{}", refused("plain/below"));
        assert!(refused("").contains("folder"));
        check_writable(folder.path().join("new/deep/file")).unwrap();
        assert_eq!(list_folder(folder.path()).unwrap().len(), 1);
    }

    #[test]
    fn reading_is_bounded() {
        assert_eq!(read_bounded(&[1u8, 2, 3][..], 3).unwrap(), [1, 2, 3]);
        assert_eq!(read_bounded(io::repeat(0), 1000).unwrap_err().kind(), io::ErrorKind::FileTooLarge);
    }

    #[test]
    fn gzip_is_told_by_its_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("no-suffix");
        let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        packer.write_all(b"hello").unwrap();
        let packed = packer.finish().unwrap();
        write_bytes(&path, &packed).unwrap();
        assert_eq!(read_bytes(&path).unwrap(), b"hello");
        write_bytes(&path, &packed[..packed.len() - 3]).unwrap();
        assert!(read_bytes(&path).unwrap_err().to_string().contains("gzip"));
    }
}
