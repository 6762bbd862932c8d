//! Numbered lines of a text file and the numbers in them.

use std::borrow::Cow;
use std::str::FromStr;

use modiste_core::Vec3;

use crate::IoError;
use crate::error::quote;

/// One line with the words the errors need.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Line<'a> {
    pub(crate) file: &'a str,
    /// Counted from 1.
    pub(crate) number: usize,
    pub(crate) text: &'a str,
}

impl<'a> Line<'a> {
    pub(crate) fn error(&self, wanted: &str, found: &str) -> IoError {
        IoError::line(self.file, self.number, wanted, quote(found))
    }

    /// A whole number.
    pub(crate) fn whole<T: FromStr>(&self, word: &str, wanted: &str) -> Result<T, IoError> {
        word.parse().map_err(|_unparsed| self.error(wanted, word))
    }

    /// A finite number.
    pub(crate) fn finite(&self, word: &str, wanted: &str) -> Result<f64, IoError> {
        word.parse().ok().filter(|value: &f64| value.is_finite()).ok_or_else(|| self.error(wanted, word))
    }

    /// The next three finite numbers.
    pub(crate) fn point(&self, words: &mut impl Iterator<Item = &'a str>, wanted: &str) -> Result<Vec3, IoError> {
        let mut next = || self.finite(words.next().ok_or_else(|| self.error(wanted, self.text))?, wanted);
        Ok(Vec3::new(next()?, next()?, next()?))
    }
}

/// The lines of a text, trimmed; `\n`, `\r\n` and lone `\r` all end one.
pub(crate) fn lines<'a>(text: &'a str, file: &'a str) -> impl Iterator<Item = Line<'a>> {
    text.split('\n')
        .flat_map(|line| line.strip_suffix('\r').unwrap_or(line).split('\r'))
        .zip(1..)
        .map(move |(text, number)| Line { file, number, text: text.trim() })
}

/// Bytes as text; stray bytes of other encodings (names, comments) are replaced, and a byte order mark is dropped.
pub(crate) fn lossy(bytes: &[u8]) -> Cow<'_, str> {
    String::from_utf8_lossy(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes))
}
