//! Writing arrays: collected and saved at once, or streamed one after the other.

use std::borrow::Cow;
use std::io::{self, Seek, SeekFrom, Write};
use std::marker::PhantomData;
use std::path::Path;

use modiste_core::Vec3;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use crate::{IoError, npy, write_atomically};

/// Element kinds that can be written.
pub trait Element: bytemuck::NoUninit {
    /// Numpy's spelling of the kind, little-endian.
    const SPELLING: &'static str;
}

impl Element for f32 {
    const SPELLING: &'static str = "<f4";
}
impl Element for f64 {
    const SPELLING: &'static str = "<f8";
}
impl Element for i32 {
    const SPELLING: &'static str = "<i4";
}
impl Element for u32 {
    const SPELLING: &'static str = "<u4";
}
impl Element for u8 {
    const SPELLING: &'static str = "|u1";
}

enum Data<'a> {
    F32(Cow<'a, [f32]>),
    F64(Cow<'a, [f64]>),
    I32(Cow<'a, [i32]>),
    U32(Cow<'a, [u32]>),
    U8(Cow<'a, [u8]>),
}

/// Collects named arrays, borrowed or owned, and saves them as one npz, stored without compression.
#[derive(Default)]
pub struct Writer<'a> {
    arrays: Vec<(String, Vec<usize>, Data<'a>)>,
}

impl std::fmt::Debug for Writer<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_list().entries(self.arrays.iter().map(|(name, shape, _)| (name, shape))).finish()
    }
}

impl<'a> Writer<'a> {
    /// Without arrays.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds an array of `f32`; `shape` has the slowest axis first and is checked when saving.
    pub fn add_f32(&mut self, name: &str, shape: &[usize], data: impl Into<Cow<'a, [f32]>>) -> &mut Self {
        self.add(name, shape, Data::F32(data.into()))
    }

    /// Adds an array of `f64`.
    pub fn add_f64(&mut self, name: &str, shape: &[usize], data: impl Into<Cow<'a, [f64]>>) -> &mut Self {
        self.add(name, shape, Data::F64(data.into()))
    }

    /// Adds an array of `i32`.
    pub fn add_i32(&mut self, name: &str, shape: &[usize], data: impl Into<Cow<'a, [i32]>>) -> &mut Self {
        self.add(name, shape, Data::I32(data.into()))
    }

    /// Adds an array of `u32`.
    pub fn add_u32(&mut self, name: &str, shape: &[usize], data: impl Into<Cow<'a, [u32]>>) -> &mut Self {
        self.add(name, shape, Data::U32(data.into()))
    }

    /// Adds an array of `u8`.
    pub fn add_u8(&mut self, name: &str, shape: &[usize], data: impl Into<Cow<'a, [u8]>>) -> &mut Self {
        self.add(name, shape, Data::U8(data.into()))
    }

    /// Adds points as an array of `f32` of shape (N, 3).
    pub fn add_points(&mut self, name: &str, points: &[Vec3]) -> &mut Self {
        let data: Vec<f32> = points.iter().flat_map(|point| point.as_vec3().to_array()).collect();
        self.add_f32(name, &[points.len(), 3], data)
    }

    /// Adds triangles as an array of `u32` of shape (N, 3).
    pub fn add_triangles(&mut self, name: &str, triangles: &'a [[u32; 3]]) -> &mut Self {
        self.add_u32(name, &[triangles.len(), 3], triangles.as_flattened())
    }

    fn add(&mut self, name: &str, shape: &[usize], data: Data<'a>) -> &mut Self {
        self.arrays.push((name.to_owned(), shape.to_vec(), data));
        self
    }

    /// Writes the file, whole or not at all.
    ///
    /// # Errors
    /// [`IoError`] with the reason, also when a shape does not fit its data or a name comes twice.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), IoError> {
        write_atomically(path, |file| {
            let mut archive = ArchiveWriter::new(file);
            for (name, shape, data) in &self.arrays {
                match data {
                    Data::F32(data) => archive.add(name, shape, [data.as_ref()])?,
                    Data::F64(data) => archive.add(name, shape, [data.as_ref()])?,
                    Data::I32(data) => archive.add(name, shape, [data.as_ref()])?,
                    Data::U32(data) => archive.add(name, shape, [data.as_ref()])?,
                    Data::U8(data) => archive.add(name, shape, [data.as_ref()])?,
                }
            }
            archive.finish()
        })
    }
}

/// Writes arrays one after the other into an npz without holding them: for results longer than memory.
pub struct ArchiveWriter<W: Write + Seek> {
    archive: ZipWriter<Latched<W>>,
}

impl<W: Write + Seek> std::fmt::Debug for ArchiveWriter<W> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ArchiveWriter").finish_non_exhaustive()
    }
}

impl<W: Write + Seek> ArchiveWriter<W> {
    /// Starts an archive.
    pub fn new(writer: W) -> Self {
        Self { archive: ZipWriter::new(Latched { writer, position: 0, failed: false }) }
    }

    /// Adds an array whose elements come in pieces, in order.
    ///
    /// # Errors
    /// Why it could not be written, or that the pieces do not add up to the shape.
    pub fn add<'d, T: Element>(
        &mut self,
        name: &str,
        shape: &[usize],
        pieces: impl IntoIterator<Item = &'d [T]>,
    ) -> io::Result<()> {
        let mut array = self.start(name, shape)?;
        for piece in pieces {
            array.push(piece)?;
        }
        array.finish()
    }

    /// Starts an array whose elements are pushed piece by piece.
    ///
    /// # Errors
    /// Why it could not be written.
    pub fn start<T: Element>(&mut self, name: &str, shape: &[usize]) -> io::Result<ArrayWriter<'_, W, T>> {
        let wanted = shape.iter().try_fold(1usize, |product, &extent| product.checked_mul(extent));
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .large_file(wanted.is_none_or(|count| count.saturating_mul(size_of::<T>()) > 0xf000_0000));
        self.archive.start_file(format!("{name}.npy"), options)?;
        npy::write_header(&mut self.archive, T::SPELLING, shape)?;
        let described = format!("array \"{name}\" of shape {shape:?}");
        Ok(ArrayWriter { archive: &mut self.archive, wanted, count: 0, described, element: PhantomData })
    }

    /// Writes the directory of the archive.
    ///
    /// # Errors
    /// Why it could not be written.
    pub fn finish(self) -> io::Result<()> {
        let mut latched = self.archive.finish()?;
        latched.flush()?;
        if latched.failed {
            return Err(io::Error::other("an earlier part of the archive could not be written"));
        }
        Ok(())
    }
}

/// An array that is being written into an archive.
pub struct ArrayWriter<'a, W: Write + Seek, T> {
    archive: &'a mut ZipWriter<Latched<W>>,
    wanted: Option<usize>,
    count: usize,
    described: String,
    element: PhantomData<T>,
}

impl<W: Write + Seek, T> std::fmt::Debug for ArrayWriter<'_, W, T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ArrayWriter").field("array", &self.described).field("count", &self.count).finish()
    }
}

impl<W: Write + Seek, T: Element> ArrayWriter<'_, W, T> {
    /// Adds the next elements.
    ///
    /// # Errors
    /// Why they could not be written.
    pub fn push(&mut self, piece: &[T]) -> io::Result<()> {
        self.count += piece.len();
        self.archive.write_all(bytemuck::cast_slice(piece))
    }

    /// Ends the array.
    ///
    /// # Errors
    /// That the pieces do not add up to the shape.
    pub fn finish(self) -> io::Result<()> {
        if self.wanted == Some(self.count) {
            return Ok(());
        }
        let reason = format!("{} got {} elements", self.described, self.count);
        Err(io::Error::new(io::ErrorKind::InvalidInput, reason))
    }
}

/// Swallows what comes after the first error, which the caller has been given: `ZipWriter` tries once more to complete
/// the archive when it is dropped and would print the second failure.
struct Latched<W> {
    writer: W,
    /// Where the writer is, or would be.
    position: u64,
    failed: bool,
}

impl<W> Latched<W> {
    fn guard<T>(&mut self, swallowed: T, act: impl FnOnce(&mut W) -> io::Result<T>) -> io::Result<T> {
        if self.failed {
            return Ok(swallowed);
        }
        let outcome = act(&mut self.writer);
        self.failed = outcome.as_ref().is_err_and(|error| error.kind() != io::ErrorKind::Interrupted);
        outcome
    }
}

impl<W: Write> Write for Latched<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = self.guard(bytes.len(), |writer| writer.write(bytes))?;
        self.position += count as u64;
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.guard((), Write::flush)
    }
}

impl<W: Seek> Seek for Latched<W> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let swallowed = match to {
            SeekFrom::Start(position) => position,
            SeekFrom::Current(by) | SeekFrom::End(by) => self.position.saturating_add_signed(by),
        };
        self.position = self.guard(swallowed, |writer| writer.seek(to))?;
        Ok(self.position)
    }
}
