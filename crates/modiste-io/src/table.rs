//! Tables of text cells as CSV.

use std::fmt::Display;
use std::path::Path;

use crate::error::quote;
use crate::{IoError, read_bytes, write_atomically};

/// A table with named columns.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Table {
    /// Column names.
    pub header: Vec<String>,
    /// Rows, as many cells in each as there are columns.
    pub rows: Vec<Vec<String>>,
    file: String,
}

/// Reads a table.
///
/// # Errors
/// [`IoError`] naming the file and the line.
pub fn read(path: impl AsRef<Path>) -> Result<Table, IoError> {
    let path = path.as_ref();
    parse(&read_bytes(path)?, &path.display().to_string())
}

/// Reads from bytes (UTF-8); `name` stands for the file in errors.
///
/// # Errors
/// [`IoError`] naming the line: not UTF-8, or another number of cells than in the header.
pub fn parse(bytes: &[u8], name: &str) -> Result<Table, IoError> {
    let broken = |error: csv::Error| {
        let line = error.position().map_or(1, csv::Position::line) as usize;
        IoError::line(name, line, "as many cells of text as there are columns", error)
    };
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(bytes);
    let header: Vec<String> = reader.headers().map_err(broken)?.iter().map(str::to_owned).collect();
    if header.is_empty() {
        return Err(IoError::line(name, 1, "column names", "none"));
    }
    let rows = reader.records().map(|row| Ok(row.map_err(broken)?.iter().map(str::to_owned).collect()));
    Ok(Table { header, rows: rows.collect::<Result<_, IoError>>()?, file: name.to_owned() })
}

impl Table {
    /// The cells of a column.
    ///
    /// # Errors
    /// [`IoError`] when there is no column of that name.
    pub fn text(&self, column: &str) -> Result<Vec<&str>, IoError> {
        let at = self.header.iter().position(|name| name == column).ok_or_else(|| {
            let found = quote(&self.header.join(", "));
            IoError::field(&self.file, format!("column \"{column}\""), "it to be there", format!("only {found}"))
        })?;
        Ok(self.rows.iter().map(|row| row[at].as_str()).collect())
    }

    /// The finite numbers of a column.
    ///
    /// # Errors
    /// [`IoError`] when there is no column of that name or a cell is not a finite number.
    pub fn numbers(&self, column: &str) -> Result<Vec<f64>, IoError> {
        let number = |(row, cell): (usize, &str)| {
            let value = cell.parse().ok().filter(|value: &f64| value.is_finite());
            value.ok_or_else(|| {
                let field = format!("column \"{column}\", row {}", row + 1);
                IoError::field(&self.file, field, "a finite number", quote(cell))
            })
        };
        self.text(column)?.into_iter().enumerate().map(number).collect()
    }
}

/// Writes a table row by row.
///
/// # Errors
/// [`IoError`] naming the file, also when a row has another number of cells than the header.
pub fn write<R, C>(path: impl AsRef<Path>, header: &[&str], rows: impl IntoIterator<Item = R>) -> Result<(), IoError>
where
    R: IntoIterator<Item = C>,
    C: Display,
{
    write_atomically(path, |file| {
        let mut writer = csv::Writer::from_writer(file);
        writer.write_record(header)?;
        for row in rows {
            writer.write_record(row.into_iter().map(|cell| cell.to_string()))?;
        }
        writer.flush()
    })
}

#[cfg(test)]
mod tests {
    use super::{parse, read, write};
    use crate::fuzz::survives_damage;

    #[test]
    fn round_trip_and_errors() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        write(&path, &["name", "mm"], [["a, \"b\"".to_owned(), "1.5".to_owned()], ["c".to_owned(), "x".to_owned()]])
            .unwrap();
        let table = read(&path).unwrap();
        assert_eq!(table.text("name").unwrap(), ["a, \"b\"", "c"]);
        let message = table.numbers("mm").unwrap_err().to_string();
        assert!(message.ends_with("column \"mm\", row 2: wanted a finite number, found \"x\""), "{message}");
        assert!(table.text("kg").unwrap_err().to_string().contains("only \"name, mm\""));
        assert!(write(&path, &["one"], [["1", "2"]]).unwrap_err().to_string().contains("t.csv"));
        assert_eq!(read(&path).unwrap(), table);
        assert!(parse(b"", "t.csv").unwrap_err().to_string().contains("column names"));
        assert!(parse(b"a,b\n1\n", "t.csv").unwrap_err().to_string().contains("t.csv, line 2"));
        survives_damage(&crate::read_bytes(&path).unwrap(), |bytes| drop(parse(bytes, "damaged.csv")));
    }
}
