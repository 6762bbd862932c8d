//! The one error of this crate: which file, which place in it, what was wanted and what was found.

use std::fmt::Display;
use std::path::Path;

/// Why a file could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum IoError {
    /// The operating system refused.
    #[error("cannot {action} {path}: {source}")]
    File {
        /// What was tried, such as "read".
        action: &'static str,
        /// The file or folder.
        path: String,
        /// The reason it gave.
        source: std::io::Error,
    },
    /// A line of a text file is not what the format asks for.
    #[error("{file}, line {line}: wanted {wanted}, found {found}")]
    Line {
        /// The file.
        file: String,
        /// The line, counted from 1.
        line: usize,
        /// What the format asks for.
        wanted: String,
        /// What stands there.
        found: String,
    },
    /// A named part of a file (array, tensor, field, column) is missing or not what was asked for.
    #[error("{file}, {field}: wanted {wanted}, found {found}")]
    Field {
        /// The file.
        file: String,
        /// The array, tensor, field or column.
        field: String,
        /// What was asked for.
        wanted: String,
        /// What stands there.
        found: String,
    },
}

impl IoError {
    /// An operating-system error while doing `action` ("read", "write", …) on `path`.
    pub fn file(action: &'static str, path: &Path, source: std::io::Error) -> Self {
        Self::File { action, path: path.display().to_string(), source }
    }

    /// A bad line; lines count from 1.
    pub fn line(file: &str, line: usize, wanted: impl Display, found: impl Display) -> Self {
        Self::Line { file: file.to_owned(), line, wanted: wanted.to_string(), found: found.to_string() }
    }

    /// A bad or missing named part.
    pub fn field(file: &str, field: impl Display, wanted: impl Display, found: impl Display) -> Self {
        Self::Field {
            file: file.to_owned(),
            field: field.to_string(),
            wanted: wanted.to_string(),
            found: found.to_string(),
        }
    }
}

/// Shortens text that goes into an error message, so that a damaged file cannot make an endless one.
pub(crate) fn quote(text: &str) -> String {
    const LONGEST: usize = 60;
    let mut short: String = text.chars().take(LONGEST).collect();
    if short.len() < text.len() {
        short.push('…');
    }
    format!("\"{}\"", short.escape_debug())
}
