//! JSON of any shape that serde describes; errors name the line.

use std::io::Write;
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::{IoError, read_bytes, write_atomically};

/// Reads a value.
///
/// # Errors
/// [`IoError`] naming the file, the line and what was wrong.
pub fn read<T: DeserializeOwned>(path: impl AsRef<Path>) -> Result<T, IoError> {
    let path = path.as_ref();
    parse(&read_bytes(path)?, &path.display().to_string())
}

/// Reads from bytes; `name` stands for the file in errors.
///
/// # Errors
/// [`IoError`] naming the line and what was wrong.
pub fn parse<T: DeserializeOwned>(bytes: &[u8], name: &str) -> Result<T, IoError> {
    serde_json::from_slice(bytes)
        .map_err(|error| IoError::line(name, error.line().max(1), "valid JSON of its kind", error))
}

/// Writes a value, indented, ending with a newline.
///
/// # Errors
/// [`IoError`] naming the file.
pub fn write<T: Serialize + ?Sized>(path: impl AsRef<Path>, value: &T) -> Result<(), IoError> {
    write_atomically(path, |file| {
        serde_json::to_writer_pretty(&mut *file, value)?;
        file.write_all(b"\n")
    })
}

#[cfg(test)]
mod tests {
    use super::{parse, read, write};
    use std::collections::BTreeMap;

    #[test]
    fn round_trip_and_errors() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        let value = BTreeMap::from([("x".to_owned(), vec![0.1, -3.5e-9])]);
        write(&path, &value).unwrap();
        assert_eq!(read::<BTreeMap<String, Vec<f64>>>(&path).unwrap(), value);
        let message = parse::<Vec<u8>>(b"[1,\n2,\n-3]", "a.json").unwrap_err().to_string();
        assert!(message.starts_with("a.json, line 3: wanted valid JSON of its kind, found invalid value"), "{message}");
        assert!(parse::<u8>(b"", "a.json").is_err());
        let deep = "[".repeat(100_000);
        assert!(parse::<serde_json::Value>(deep.as_bytes(), "deep.json").is_err());
    }
}
