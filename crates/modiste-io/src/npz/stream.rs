//! Reading arrays row by row, several of one file in step: for results longer than memory.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use zip::ZipArchive;

use crate::IoError;
use crate::npy::{self, Header, Kind};

/// Calls `visit` with row after row along the first axis of several arrays of floats, which must have equally many.
///
/// One row of each is held. What `visit` refuses ends the reading.
///
/// # Errors
/// [`IoError`] when an array is missing, of another kind, of another length, truncated or not finite; else that of `visit`.
pub fn for_each_row<E: From<IoError>>(
    path: impl AsRef<Path>,
    names: &[&str],
    mut visit: impl FnMut(usize, &[Vec<f32>]) -> Result<(), E>,
) -> Result<(), E> {
    let path = path.as_ref();
    let file = path.display().to_string();
    // An archive hands out one entry at a time, so each array gets an archive of its own.
    let open = |_: &&str| {
        let source = File::open(path).map_err(|source| IoError::file("read", path, source))?;
        ZipArchive::new(BufReader::new(source))
            .map_err(|error| IoError::field(&file, "the archive", "a numpy npz (zip)", error))
    };
    let mut archives = names.iter().map(open).collect::<Result<Vec<_>, IoError>>()?;
    let mut arrays = Vec::with_capacity(names.len());
    for (archive, name) in archives.iter_mut().zip(names) {
        let entry = archive
            .by_name(&format!("{name}.npy"))
            .map_err(|error| IoError::field(&file, format!("array \"{name}\""), "it to be there", error))?;
        arrays.push(Rows::new(BufReader::with_capacity(1 << 16, entry), &file, name)?);
    }
    let count = arrays.first().map_or(0, |array| array.header.shape[0]);
    for array in &arrays {
        if array.header.shape[0] != count {
            return Err(array.wrong(&format!("{count} rows"), array.header.shape[0].to_string()).into());
        }
    }
    let mut rows = vec![Vec::new(); arrays.len()];
    for index in 0..count {
        for (array, row) in arrays.iter_mut().zip(&mut rows) {
            array.read(index, row)?;
        }
        visit(index, &rows)?;
    }
    Ok(())
}

/// An array that is read from its start.
struct Rows<'a, R> {
    reader: R,
    header: Header,
    bytes: Vec<u8>,
    file: &'a str,
    name: &'a str,
}

impl<'a, R: Read> Rows<'a, R> {
    fn new(mut reader: R, file: &'a str, name: &'a str) -> Result<Self, IoError> {
        let header = npy::read_header(&mut reader, file, name)?;
        let rows = Self { bytes: Vec::new(), reader, header, file, name };
        let header = &rows.header;
        if header.big_endian || header.column_major || !matches!(header.kind, Kind::Float(_)) {
            return Err(rows.wrong("f32 or f64, row by row, little-endian", header.spelling.clone()));
        }
        if header.shape.is_empty() || header.shape[1..].contains(&0) {
            return Err(rows.wrong("an array of rows", format!("shape {:?}", header.shape)));
        }
        Ok(rows)
    }

    fn wrong(&self, wanted: &str, found: String) -> IoError {
        IoError::field(self.file, format!("array \"{}\"", self.name), wanted, found)
    }

    fn read(&mut self, index: usize, row: &mut Vec<f32>) -> Result<(), IoError> {
        let size = self.header.kind.size();
        let length = self.header.shape[1..].iter().try_fold(size, |product, &extent| product.checked_mul(extent));
        let length = length.ok_or_else(|| self.wrong("rows that fit memory", format!("{:?}", self.header.shape)))?;
        self.bytes.clear();
        // By `take`, memory grows with what is really there.
        let read = self.reader.by_ref().take(length as u64).read_to_end(&mut self.bytes);
        read.map_err(|error| self.wrong("intact packed bytes", error.to_string()))?;
        if self.bytes.len() != length {
            return Err(self.wrong(&format!("{length} bytes in row {index}"), self.bytes.len().to_string()));
        }
        row.clear();
        if size == 4 {
            row.extend(self.bytes.as_chunks().0.iter().map(|&bytes| f32::from_le_bytes(bytes)));
        } else {
            row.extend(self.bytes.as_chunks().0.iter().map(|&bytes| f64::from_le_bytes(bytes) as f32));
        }
        match row.iter().position(|value| !value.is_finite()) {
            Some(at) => Err(self.wrong("finite numbers", format!("{} at element {at} of row {index}", row[at]))),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::for_each_row;
    use crate::IoError;
    use crate::npz::Writer;

    #[test]
    fn rows_come_in_step_and_damage_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npz");
        let mut writer = Writer::new();
        writer.add_f32("a", &[3, 2, 1], &[1.0f32, 2.0, 3.0, 4.0, 5.0, 6.0]).add_f64("b", &[3], vec![7.0, 8.0, 9.0]);
        writer.add_f32("short", &[2], &[1.0f32, 2.0]).add_f32("nan", &[3], &[1.0, f32::NAN, 1.0]);
        writer.add_u32("whole", &[3], vec![1, 2, 3]).save(&path).unwrap();
        let mut seen = Vec::new();
        for_each_row(&path, &["b", "a"], |index, rows| {
            seen.push((index, rows.to_vec()));
            Ok::<(), IoError>(())
        })
        .unwrap();
        assert_eq!(seen[2], (2, vec![vec![9.0], vec![5.0, 6.0]]));
        assert_eq!(seen.len(), 3);
        let refused =
            |names: &[&str]| for_each_row(&path, names, |_, _| Ok::<(), IoError>(())).unwrap_err().to_string();
        assert!(refused(&["a", "short"]).contains("array \"short\": wanted 3 rows, found 2"));
        assert!(refused(&["nan"]).contains("NaN at element 0 of row 1"));
        assert!(refused(&["whole"]).contains("found <u4"));
        assert!(refused(&["absent"]).contains("array \"absent\""));
        let stop = for_each_row(&path, &["a"], |_, _| Err(IoError::field("x", "y", "z", "w"))).unwrap_err();
        assert!(stop.to_string().starts_with("x, y"));
    }

    #[test]
    fn damage_never_panics() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npz");
        let mut writer = Writer::new();
        writer.add_f32("a", &[3, 2], &[1.0f32, 2.0, 3.0, 4.0, 5.0, 6.0]).save(&path).unwrap();
        let intact = crate::read_bytes(&path).unwrap();
        crate::fuzz::survives_damage(&intact, |bytes| {
            crate::write_bytes(&path, bytes).unwrap();
            let mut count = 0;
            let read = for_each_row(&path, &["a"], |_, rows| {
                count += rows[0].len();
                Ok::<(), IoError>(())
            });
            assert!(read.is_err() || count <= 6 * 2);
        });
    }
}
