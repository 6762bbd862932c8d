//! Numpy archives (`.npz`): named arrays in a zip, plain or compressed, in both directions.

mod stream;
mod write;

use std::fs::File;
use std::io::{BufReader, Cursor, Read, Seek};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use modiste_core::Vec3;
use zip::ZipArchive;

use crate::IoError;
use crate::error::quote;
use crate::file::{MAX_BYTES, read_bounded};
use crate::npy::{self, Header, Kind};
pub use stream::for_each_row;
pub use write::{ArchiveWriter, ArrayWriter, Element, Writer};

/// An array in row-major order.
#[derive(Debug, Clone, PartialEq)]
pub struct Array<T> {
    /// Extent along each axis, slowest first; empty for a single number.
    pub shape: Vec<usize>,
    /// The elements.
    pub data: Vec<T>,
}

trait Source: Read + Seek + Send {}
impl<T: Read + Seek + Send> Source for T {}

/// Reads arrays out of an npz by name.
///
/// Numbers widen freely and integers convert where the value fits; floats that are not finite are refused.
pub struct Reader {
    archive: Mutex<ZipArchive<Box<dyn Source>>>,
    names: Vec<String>,
    order: Vec<String>,
    file: String,
}

impl std::fmt::Debug for Reader {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Reader").field("file", &self.file).field("names", &self.names).finish_non_exhaustive()
    }
}

impl Reader {
    /// Opens a file; arrays are read when asked for.
    ///
    /// # Errors
    /// [`IoError`] when it cannot be opened or is not a zip.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, IoError> {
        let path = path.as_ref();
        let file = File::open(path).map_err(|source| IoError::file("read", path, source))?;
        Self::new(Box::new(BufReader::new(file)), &path.display().to_string())
    }

    /// Reads from bytes; `name` stands for the file in errors.
    ///
    /// # Errors
    /// [`IoError`] when they are not a zip.
    pub fn parse(bytes: impl Into<Vec<u8>>, name: &str) -> Result<Self, IoError> {
        Self::new(Box::new(Cursor::new(bytes.into())), name)
    }

    fn new(source: Box<dyn Source>, file: &str) -> Result<Self, IoError> {
        let archive =
            ZipArchive::new(source).map_err(|error| IoError::field(file, "the archive", "a numpy npz (zip)", error))?;
        let order: Vec<String> =
            archive.file_names().flatten().map(|name| name.strip_suffix(".npy").unwrap_or(&name).to_owned()).collect();
        let mut names = order.clone();
        names.sort();
        Ok(Self { archive: Mutex::new(archive), names, order, file: file.to_owned() })
    }

    /// The names of the arrays, sorted.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The names of the arrays as they stand in the file.
    pub fn names_in_order(&self) -> &[String] {
        &self.order
    }

    /// The extents of an array, of which nothing but the header is read.
    ///
    /// # Errors
    /// [`IoError`] when it is missing or its header is damaged.
    pub fn shape(&self, name: &str) -> Result<Vec<usize>, IoError> {
        let mut archive = self.archive.lock().unwrap_or_else(PoisonError::into_inner);
        let mut entry = archive
            .by_name(&format!("{name}.npy"))
            .map_err(|error| self.wrong(name, "a readable entry", error.to_string()))?;
        Ok(npy::read_header(&mut entry, &self.file, name)?.shape)
    }

    /// Whether there is an array of that name.
    pub fn contains(&self, name: &str) -> bool {
        self.names.binary_search_by(|have| have.as_str().cmp(name)).is_ok()
    }

    /// An array of `f32` (or of `f64`, rounded).
    ///
    /// # Errors
    /// [`IoError`] when it is missing, of another kind, truncated or not finite.
    pub fn f32(&self, name: &str) -> Result<Array<f32>, IoError> {
        self.array(name, "f32 or f64", |header, bytes| match header.kind {
            Kind::Float(4) => each(header, bytes, f32::from_le_bytes).into(),
            Kind::Float(8) => each(header, bytes, |bytes| f64::from_le_bytes(bytes) as f32).into(),
            _ => None,
        })
        .and_then(|array| self.finite(name, array, |x| x.is_finite()))
    }

    /// An array of `f64` (or of `f32`, widened).
    ///
    /// # Errors
    /// [`IoError`] when it is missing, of another kind, truncated or not finite.
    pub fn f64(&self, name: &str) -> Result<Array<f64>, IoError> {
        self.array(name, "f64 or f32", |header, bytes| match header.kind {
            Kind::Float(4) => each(header, bytes, |bytes| f64::from(f32::from_le_bytes(bytes))).into(),
            Kind::Float(8) => each(header, bytes, f64::from_le_bytes).into(),
            _ => None,
        })
        .and_then(|array| self.finite(name, array, |x| x.is_finite()))
    }

    /// An array of whole numbers that fit `i32`.
    ///
    /// # Errors
    /// [`IoError`] when it is missing, of another kind, truncated or out of range.
    pub fn i32(&self, name: &str) -> Result<Array<i32>, IoError> {
        self.integers(name, "i32")
    }

    /// An array of whole numbers that fit `u32`.
    ///
    /// # Errors
    /// [`IoError`] when it is missing, of another kind, truncated or out of range.
    pub fn u32(&self, name: &str) -> Result<Array<u32>, IoError> {
        self.integers(name, "u32")
    }

    /// An array of whole numbers that fit `u8`.
    ///
    /// # Errors
    /// [`IoError`] when it is missing, of another kind, truncated or out of range.
    pub fn u8(&self, name: &str) -> Result<Array<u8>, IoError> {
        self.integers(name, "u8")
    }

    /// A single number: an array of shape `()` or with one element, float or whole.
    ///
    /// # Errors
    /// [`IoError`] as [`Reader::f64`], or when there is not exactly one element.
    pub fn scalar(&self, name: &str) -> Result<f64, IoError> {
        let (header, _) = self.load(name)?;
        let array = match header.kind {
            Kind::Float(_) => self.f64(name)?,
            Kind::Signed(_) | Kind::Unsigned(_) => {
                let Array { shape, data } = self.i32(name)?;
                Array { shape, data: data.into_iter().map(f64::from).collect() }
            }
        };
        match array.data[..] {
            [value] => Ok(value),
            _ => Err(self.wrong(name, "a single number", format!("shape {:?}", array.shape))),
        }
    }

    /// An array of shape (N, 3) as points.
    ///
    /// # Errors
    /// [`IoError`] as [`Reader::f64`], or for another shape.
    pub fn points(&self, name: &str) -> Result<Vec<Vec3>, IoError> {
        let array = self.f64(name)?;
        self.check_shape(name, &array.shape, &[None, Some(3)])?;
        Ok(array.data.chunks_exact(3).map(Vec3::from_slice).collect())
    }

    /// An array of shape (N, 3) as triangles.
    ///
    /// # Errors
    /// [`IoError`] as [`Reader::u32`], or for another shape.
    pub fn triangles(&self, name: &str) -> Result<Vec<[u32; 3]>, IoError> {
        let array = self.u32(name)?;
        self.check_shape(name, &array.shape, &[None, Some(3)])?;
        Ok(array.data.chunks_exact(3).map(|corner| [corner[0], corner[1], corner[2]]).collect())
    }

    /// Refuses a shape that does not have the wanted extents; `None` allows any.
    ///
    /// # Errors
    /// [`IoError::Field`] naming the array, the wanted and the found shape.
    pub fn check_shape(&self, name: &str, found: &[usize], wanted: &[Option<usize>]) -> Result<(), IoError> {
        let fits = found.len() == wanted.len()
            && wanted.iter().zip(found).all(|(wanted, found)| wanted.is_none_or(|wanted| wanted == *found));
        if fits {
            return Ok(());
        }
        let wanted: Vec<_> = wanted.iter().map(|extent| extent.map_or("any".to_owned(), |n| n.to_string())).collect();
        Err(self.wrong(name, &format!("shape [{}]", wanted.join(", ")), format!("shape {found:?}")))
    }

    fn wrong(&self, name: &str, wanted: &str, found: String) -> IoError {
        IoError::field(&self.file, format!("array \"{name}\""), wanted, found)
    }

    /// The unpacked `.npy` of an array with its checked header.
    fn load(&self, name: &str) -> Result<(Header, Vec<u8>), IoError> {
        if !self.contains(name) {
            return Err(self.wrong(name, "it to be there", format!("only {}", quote(&self.names.join(", ")))));
        }
        let mut archive = self.archive.lock().unwrap_or_else(PoisonError::into_inner);
        let entry_name = format!("{name}.npy");
        let entry_name = if archive.index_for_name(&entry_name).is_some() { &entry_name } else { name };
        let entry =
            archive.by_name(entry_name).map_err(|error| self.wrong(name, "a readable entry", error.to_string()))?;
        let mut bytes = read_bounded(entry, MAX_BYTES)
            .map_err(|error| self.wrong(name, "intact packed bytes", error.to_string()))?;
        let (header, elements) = npy::split(&bytes, &self.file, name)?;
        let start = bytes.len() - elements.len();
        bytes.drain(..start);
        Ok((header, bytes))
    }

    fn array<T: Copy>(
        &self,
        name: &str,
        wanted: &str,
        convert: impl FnOnce(&Header, &[u8]) -> Option<Vec<T>>,
    ) -> Result<Array<T>, IoError> {
        let (header, bytes) = self.load(name)?;
        let data = convert(&header, &bytes).ok_or_else(|| self.wrong(name, wanted, header.spelling.clone()))?;
        let data = if header.column_major { npy::row_major(&data, &header.shape) } else { data };
        Ok(Array { shape: header.shape, data })
    }

    fn integers<T: Copy + TryFrom<i128>>(&self, name: &str, wanted: &str) -> Result<Array<T>, IoError> {
        let wide = self.array(name, wanted, |header, bytes| {
            Some(match header.kind {
                Kind::Signed(1) => each(header, bytes, |bytes| i128::from(i8::from_le_bytes(bytes))),
                Kind::Signed(2) => each(header, bytes, |bytes| i128::from(i16::from_le_bytes(bytes))),
                Kind::Signed(4) => each(header, bytes, |bytes| i128::from(i32::from_le_bytes(bytes))),
                Kind::Signed(_) => each(header, bytes, |bytes| i128::from(i64::from_le_bytes(bytes))),
                Kind::Unsigned(1) => each(header, bytes, |bytes| i128::from(u8::from_le_bytes(bytes))),
                Kind::Unsigned(2) => each(header, bytes, |bytes| i128::from(u16::from_le_bytes(bytes))),
                Kind::Unsigned(4) => each(header, bytes, |bytes| i128::from(u32::from_le_bytes(bytes))),
                Kind::Unsigned(_) => each(header, bytes, |bytes| i128::from(u64::from_le_bytes(bytes))),
                Kind::Float(_) => return None,
            })
        })?;
        let fit = |value: &i128| T::try_from(*value).map_err(|_unfit| self.wrong(name, wanted, value.to_string()));
        Ok(Array { data: wide.data.iter().map(fit).collect::<Result<_, _>>()?, shape: wide.shape })
    }

    fn finite<T: Copy + std::fmt::Display>(
        &self,
        name: &str,
        array: Array<T>,
        is_finite: impl Fn(&T) -> bool,
    ) -> Result<Array<T>, IoError> {
        match array.data.iter().position(|value| !is_finite(value)) {
            Some(at) => Err(self.wrong(name, "finite numbers", format!("{} at element {at}", array.data[at]))),
            None => Ok(array),
        }
    }
}

/// Converts elements of N bytes each, brought to little-endian first.
fn each<const N: usize, T>(header: &Header, bytes: &[u8], convert: impl Fn([u8; N]) -> T) -> Vec<T> {
    let (elements, _) = bytes.as_chunks::<N>();
    elements
        .iter()
        .map(|&element| {
            let mut element = element;
            if header.big_endian {
                element.reverse();
            }
            convert(element)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::{ArchiveWriter, Reader, Writer};
    use modiste_core::Vec3;
    use std::io::{Cursor, Write};

    fn packed(name: &str, npy: &[u8], method: zip::CompressionMethod) -> Vec<u8> {
        let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
        archive.start_file(name, zip::write::SimpleFileOptions::default().compression_method(method)).unwrap();
        archive.write_all(npy).unwrap();
        archive.finish().unwrap().into_inner()
    }

    fn npy(header: &str, elements: &[u8]) -> Vec<u8> {
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend(elements);
        bytes
    }

    #[test]
    fn what_is_written_reads_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("all.npz");
        let mut writer = Writer::new();
        let floats = [1.5f32, -2.0, 0.25, 8.0, 1e-30, 3.0];
        writer.add_f32("a", &[2, 3], &floats).add_f64("b", &[2], vec![0.1, 1e300]);
        writer.add_i32("c", &[1], vec![-7]).add_u32("d", &[0, 3], vec![]).add_u8("e", &[], vec![9]);
        writer.add_points("p", &[Vec3::new(1.0, 2.0, 3.0)]).add_triangles("t", &[[0, 1, 2], [2, 1, 3]]);
        writer.save(&path).unwrap();
        let reader = Reader::open(&path).unwrap();
        assert_eq!(reader.names(), ["a", "b", "c", "d", "e", "p", "t"]);
        let a = reader.f32("a").unwrap();
        assert_eq!((a.shape, a.data), (vec![2, 3], floats.to_vec()));
        assert_eq!(reader.f64("b").unwrap().data, [0.1, 1e300]);
        assert_eq!(reader.i32("c").unwrap().data, [-7]);
        assert_eq!(reader.u32("d").unwrap().shape, [0, 3]);
        assert_eq!(reader.u8("e").unwrap().shape, [0usize; 0]);
        assert_eq!(reader.scalar("e").unwrap().to_bits(), 9f64.to_bits());
        assert_eq!(reader.points("p").unwrap(), [Vec3::new(1.0, 2.0, 3.0)]);
        assert_eq!(reader.triangles("t").unwrap(), [[0, 1, 2], [2, 1, 3]]);
    }

    #[test]
    fn compressed_big_endian_and_column_major_arrays_are_read() {
        let elements: Vec<u8> = [1.0f64, 3.0, 2.0, 4.0].iter().flat_map(|x| x.to_be_bytes()).collect();
        let npy = npy("{'descr': '>f8', 'fortran_order': True, 'shape': (2, 2), }", &elements);
        for method in [zip::CompressionMethod::Deflated, zip::CompressionMethod::Stored] {
            let reader = Reader::parse(packed("x.npy", &npy, method), "x.npz").unwrap();
            assert_eq!(reader.f64("x").unwrap().data, [1.0, 2.0, 3.0, 4.0]);
        }
    }

    #[test]
    fn refusals_name_the_array_and_the_reason() {
        let reader = |npy: &[u8]| Reader::parse(packed("x.npy", npy, zip::CompressionMethod::Stored), "x.npz").unwrap();
        let nan = npy("{'descr': '<f4', 'fortran_order': False, 'shape': (2,), }", &[0, 0, 0, 0, 0, 0, 0xc0, 0x7f]);
        let message = reader(&nan).f32("x").unwrap_err().to_string();
        assert_eq!(message, "x.npz, array \"x\": wanted finite numbers, found NaN at element 1");
        let message = reader(&nan).u32("x").unwrap_err().to_string();
        assert_eq!(message, "x.npz, array \"x\": wanted u32, found <f4");
        let message = reader(&nan).f32("y").unwrap_err().to_string();
        assert_eq!(message, "x.npz, array \"y\": wanted it to be there, found only \"x\"");
        let negative = npy("{'descr': '<i8', 'fortran_order': False, 'shape': (1,), }", &(-1i64).to_le_bytes());
        assert!(reader(&negative).u32("x").unwrap_err().to_string().contains("found -1"));
        let text = npy("{'descr': '<U3', 'fortran_order': False, 'shape': (1,), }", &[0; 12]);
        assert!(reader(&text).f64("x").unwrap_err().to_string().contains("plain numbers"));
        assert!(Reader::parse(Vec::new(), "empty.npz").unwrap_err().to_string().contains("empty.npz"));
        assert!(Reader::open("no/such.npz").unwrap_err().to_string().contains("no/such.npz"));
    }

    #[test]
    fn damage_never_panics() {
        let npy = npy("{'descr': '<f4', 'fortran_order': True, 'shape': (3, 2), }", &[1; 24]);
        for method in [zip::CompressionMethod::Deflated, zip::CompressionMethod::Stored] {
            crate::fuzz::survives_damage(&packed("x.npy", &npy, method), |bytes| {
                if let Ok(reader) = Reader::parse(bytes, "damaged.npz")
                    && let Ok(array) = reader.f32("x")
                {
                    assert_eq!(array.shape.iter().product::<usize>(), array.data.len());
                    assert!(array.data.iter().all(|value| value.is_finite()));
                }
            });
        }
    }

    /// A disk with room for some bytes.
    struct SmallDisk(Cursor<Vec<u8>>, usize);

    impl Write for SmallDisk {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            if self.0.get_ref().len() + bytes.len() > self.1 {
                return Err(std::io::ErrorKind::StorageFull.into());
            }
            self.0.write(bytes)
        }

        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    impl std::io::Seek for SmallDisk {
        fn seek(&mut self, to: std::io::SeekFrom) -> std::io::Result<u64> {
            self.0.seek(to)
        }
    }

    #[test]
    fn a_full_disk_is_an_error_wherever_it_fills_up() {
        let write = |room: usize| {
            let mut archive = ArchiveWriter::new(SmallDisk(Cursor::new(Vec::new()), room));
            archive.add("a", &[50], [&[1.0f32; 50][..]])?;
            archive.add("b", &[50], [&[2.0f32; 50][..]])?;
            archive.finish()
        };
        assert!(write(5000).is_ok());
        for room in (0..800).step_by(50) {
            assert_eq!(write(room).unwrap_err().kind(), std::io::ErrorKind::StorageFull, "room for {room} bytes");
        }
    }

    #[test]
    fn a_shape_that_does_not_fit_is_not_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bad.npz");
        let message = Writer::new().add_f32("a", &[2, 3], vec![1.0]).save(&path).unwrap_err().to_string();
        assert!(message.contains("shape [2, 3] got 1 elements"), "{message}");
        assert!(!path.exists());
        let mut archive = ArchiveWriter::new(Cursor::new(Vec::new()));
        archive.add::<u8>("twice", &[1], [&[1u8][..]]).unwrap();
        assert!(archive.add::<u8>("twice", &[1], [&[1u8][..]]).is_err());
    }
}
