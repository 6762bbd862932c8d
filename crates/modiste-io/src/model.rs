//! Trained models: one `safetensors` file of named tensors with a JSON header that says what it is and where it is from.

use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap};
use std::ops::Range;
use std::path::Path;

use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use serde::{Deserialize, Serialize};

use crate::error::quote;
use crate::{IoError, read_bytes, write_bytes};

/// The version of the layout that this code writes and reads.
pub const SCHEMA: u32 = 1;

/// The one entry in the metadata of the safetensors file.
const METADATA_KEY: &str = "modiste";

/// What a model file says about itself.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Header {
    /// Version of the layout; [`Writer`] sets it to [`SCHEMA`].
    pub schema: u32,
    /// What it is a model of, such as "scape-body" or "drape-garment".
    pub kind: String,
    /// Units of the tensors, such as "m, kg, s, rad".
    pub units: String,
    /// Sizes that the tensors share, by name.
    pub dimensions: BTreeMap<String, usize>,
    /// Seed of all random choices in training.
    pub seed: u64,
    /// SHA-256 of every file it was trained from, by file name.
    pub sources: BTreeMap<String, String>,
    /// Licence of the model and of what it was trained from.
    pub licence: String,
    /// The command that made it.
    pub command: String,
    /// Further facts by name, such as the garment's name.
    #[serde(default)]
    pub attributes: BTreeMap<String, String>,
}

/// A model read and checked as a whole; tensors are handed out by name.
#[derive(Debug)]
pub struct ModelFile {
    header: Header,
    tensors: BTreeMap<String, Stored>,
    bytes: Vec<u8>,
    file: String,
}

#[derive(Debug)]
struct Stored {
    dtype: Dtype,
    shape: Vec<usize>,
    bytes: Range<usize>,
}

impl ModelFile {
    /// Reads a model of the wanted kind.
    ///
    /// # Errors
    /// [`IoError`] naming the file and the reason: no model, other schema, other kind, truncated.
    pub fn read(path: impl AsRef<Path>, kind: &str) -> Result<Self, IoError> {
        let path = path.as_ref();
        Self::parse(read_bytes(path)?, kind, &path.display().to_string())
    }

    /// Reads from bytes; `name` stands for the file in errors.
    ///
    /// # Errors
    /// [`IoError`] as [`ModelFile::read`].
    pub fn parse(bytes: Vec<u8>, kind: &str, name: &str) -> Result<Self, IoError> {
        let (header, tensors) = {
            let (_, metadata) = SafeTensors::read_metadata(&bytes)
                .map_err(|error| IoError::field(name, "header", "a whole safetensors file", error))?;
            let header = metadata.metadata().as_ref().and_then(|entries| entries.get(METADATA_KEY));
            let header = header.ok_or_else(|| {
                IoError::field(name, "header", "the description of a Modiste model", "a safetensors file without one")
            })?;
            let header = checked_header(header, kind, name)?;
            let views = SafeTensors::deserialize(&bytes)
                .map_err(|error| IoError::field(name, "tensors", "a whole safetensors file", error))?;
            let start = bytes.as_ptr().addr();
            let stored = |view: &TensorView<'_>| {
                let from = view.data().as_ptr().addr() - start;
                let bytes = from..from + view.data().len();
                Stored { dtype: view.dtype(), shape: view.shape().to_vec(), bytes }
            };
            let tensors = views.iter().map(|(tensor, view)| (tensor.to_owned(), stored(&view))).collect();
            (header, tensors)
        };
        Ok(Self { header, tensors, bytes, file: name.to_owned() })
    }

    /// What the file says about itself.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// A size by name.
    ///
    /// # Errors
    /// [`IoError`] when the header has none of that name.
    pub fn dimension(&self, name: &str) -> Result<usize, IoError> {
        let missing = || IoError::field(&self.file, format!("dimension \"{name}\""), "it to be there", "none");
        self.header.dimensions.get(name).copied().ok_or_else(missing)
    }

    /// A fact by name.
    ///
    /// # Errors
    /// [`IoError`] when the header has none of that name.
    pub fn attribute(&self, name: &str) -> Result<&str, IoError> {
        let missing = || IoError::field(&self.file, format!("attribute \"{name}\""), "it to be there", "none");
        self.header.attributes.get(name).map(String::as_str).ok_or_else(missing)
    }

    /// Names of the tensors, sorted.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.tensors.keys().map(String::as_str)
    }

    /// Whether there is a tensor of that name.
    pub fn contains(&self, name: &str) -> bool {
        self.tensors.contains_key(name)
    }

    /// A tensor of `f32`, refused unless it has that shape and is finite.
    ///
    /// # Errors
    /// [`IoError`] naming the tensor, the wanted and the found.
    pub fn f32(&self, name: &str, shape: &[usize]) -> Result<Vec<f32>, IoError> {
        let data = self.tensor(name, shape, Dtype::F32, f32::from_le_bytes)?;
        self.finite(name, data.iter().map(|&value| f64::from(value)))?;
        Ok(data)
    }

    /// A tensor of `f64`, refused unless it has that shape and is finite.
    ///
    /// # Errors
    /// [`IoError`] naming the tensor, the wanted and the found.
    pub fn f64(&self, name: &str, shape: &[usize]) -> Result<Vec<f64>, IoError> {
        let data = self.tensor(name, shape, Dtype::F64, f64::from_le_bytes)?;
        self.finite(name, data.iter().copied())?;
        Ok(data)
    }

    /// A tensor of `i16`.
    ///
    /// # Errors
    /// [`IoError`] naming the tensor, the wanted and the found.
    pub fn i16(&self, name: &str, shape: &[usize]) -> Result<Vec<i16>, IoError> {
        self.tensor(name, shape, Dtype::I16, i16::from_le_bytes)
    }

    /// A tensor of `i8`.
    ///
    /// # Errors
    /// [`IoError`] naming the tensor, the wanted and the found.
    pub fn i8(&self, name: &str, shape: &[usize]) -> Result<Vec<i8>, IoError> {
        self.tensor(name, shape, Dtype::I8, i8::from_le_bytes)
    }

    /// A tensor of `u32`.
    ///
    /// # Errors
    /// [`IoError`] naming the tensor, the wanted and the found.
    pub fn u32(&self, name: &str, shape: &[usize]) -> Result<Vec<u32>, IoError> {
        self.tensor(name, shape, Dtype::U32, u32::from_le_bytes)
    }

    /// A tensor of `u8`.
    ///
    /// # Errors
    /// [`IoError`] naming the tensor, the wanted and the found.
    pub fn u8(&self, name: &str, shape: &[usize]) -> Result<Vec<u8>, IoError> {
        self.tensor(name, shape, Dtype::U8, u8::from_le_bytes)
    }

    fn tensor<const N: usize, T>(
        &self,
        name: &str,
        shape: &[usize],
        dtype: Dtype,
        convert: impl Fn([u8; N]) -> T,
    ) -> Result<Vec<T>, IoError> {
        let wrong = |found: String| {
            IoError::field(&self.file, format!("tensor \"{name}\""), format!("{dtype:?} of shape {shape:?}"), found)
        };
        let stored = self.tensors.get(name).ok_or_else(|| wrong("none of that name".to_owned()))?;
        if stored.dtype != dtype || stored.shape != shape {
            return Err(wrong(format!("{:?} of shape {:?}", stored.dtype, stored.shape)));
        }
        let (elements, rest) = self.bytes[stored.bytes.clone()].as_chunks::<N>();
        if rest.is_empty() {
            Ok(elements.iter().map(|&bytes| convert(bytes)).collect())
        } else {
            Err(wrong("a part of it".to_owned()))
        }
    }

    fn finite(&self, name: &str, mut values: impl Iterator<Item = f64>) -> Result<(), IoError> {
        match values.position(|value| !value.is_finite()) {
            Some(at) => {
                let found = format!("one that is not at element {at}");
                Err(IoError::field(&self.file, format!("tensor \"{name}\""), "finite numbers", found))
            }
            None => Ok(()),
        }
    }
}

fn checked_header(text: &str, kind: &str, name: &str) -> Result<Header, IoError> {
    #[derive(Deserialize)]
    struct Version {
        schema: u32,
    }
    let broken = |error: serde_json::Error| IoError::field(name, "header", "the description of a Modiste model", error);
    let Version { schema } = serde_json::from_str(text).map_err(broken)?;
    if schema != SCHEMA {
        return Err(IoError::field(name, "schema", format!("version {SCHEMA}"), format!("version {schema}")));
    }
    let header: Header = serde_json::from_str(text).map_err(broken)?;
    if header.kind != kind {
        return Err(IoError::field(name, "kind", quote(kind), quote(&header.kind)));
    }
    Ok(header)
}

/// Collects named tensors and saves them as one model file; the same tensors give the same bytes.
#[derive(Debug)]
pub struct Writer<'a> {
    header: Header,
    tensors: BTreeMap<String, Tensor<'a>>,
}

#[derive(Debug)]
struct Tensor<'a> {
    dtype: Dtype,
    shape: Vec<usize>,
    bytes: Cow<'a, [u8]>,
}

impl<'a> Writer<'a> {
    /// Without tensors; `header.schema` is set to [`SCHEMA`].
    pub fn new(header: Header) -> Self {
        Self { header: Header { schema: SCHEMA, ..header }, tensors: BTreeMap::new() }
    }

    /// Adds a tensor of `f32`; its shape (slowest axis first) is checked when saving.
    pub fn add_f32(&mut self, name: &str, shape: &[usize], data: impl Into<Cow<'a, [f32]>>) -> &mut Self {
        self.add(name, shape, Dtype::F32, data.into())
    }

    /// Adds a tensor of `f64`.
    pub fn add_f64(&mut self, name: &str, shape: &[usize], data: impl Into<Cow<'a, [f64]>>) -> &mut Self {
        self.add(name, shape, Dtype::F64, data.into())
    }

    /// Adds a tensor of `i16`.
    pub fn add_i16(&mut self, name: &str, shape: &[usize], data: impl Into<Cow<'a, [i16]>>) -> &mut Self {
        self.add(name, shape, Dtype::I16, data.into())
    }

    /// Adds a tensor of `i8`.
    pub fn add_i8(&mut self, name: &str, shape: &[usize], data: impl Into<Cow<'a, [i8]>>) -> &mut Self {
        self.add(name, shape, Dtype::I8, data.into())
    }

    /// Adds a tensor of `u32`.
    pub fn add_u32(&mut self, name: &str, shape: &[usize], data: impl Into<Cow<'a, [u32]>>) -> &mut Self {
        self.add(name, shape, Dtype::U32, data.into())
    }

    /// Adds a tensor of `u8`.
    pub fn add_u8(&mut self, name: &str, shape: &[usize], data: impl Into<Cow<'a, [u8]>>) -> &mut Self {
        self.add(name, shape, Dtype::U8, data.into())
    }

    fn add<T: bytemuck::NoUninit>(
        &mut self,
        name: &str,
        shape: &[usize],
        dtype: Dtype,
        data: Cow<'a, [T]>,
    ) -> &mut Self {
        let bytes = match data {
            Cow::Borrowed(data) => Cow::Borrowed(bytemuck::cast_slice(data)),
            Cow::Owned(data) => Cow::Owned(bytemuck::cast_slice(&data).to_vec()),
        };
        self.tensors.insert(name.to_owned(), Tensor { dtype, shape: shape.to_vec(), bytes });
        self
    }

    /// The whole file as bytes.
    ///
    /// # Errors
    /// [`IoError`] when a shape does not fit its data; `name` stands for the file.
    pub fn to_bytes(&self, name: &str) -> Result<Vec<u8>, IoError> {
        let views = self.tensors.iter().map(|(tensor, Tensor { dtype, shape, bytes })| {
            let view = TensorView::new(*dtype, shape.clone(), bytes).map_err(|_mismatch| {
                let wanted = format!("the elements of shape {shape:?} ({dtype:?})");
                IoError::field(name, format!("tensor \"{tensor}\""), wanted, format!("{} bytes", bytes.len()))
            })?;
            Ok((tensor.as_str(), view))
        });
        let views = views.collect::<Result<Vec<_>, IoError>>()?;
        let header =
            serde_json::to_string(&self.header).map_err(|error| IoError::field(name, "header", "JSON", error))?;
        let metadata = HashMap::from([(METADATA_KEY.to_owned(), header)]);
        safetensors::serialize(views, Some(metadata)).map_err(|error| IoError::field(name, "tensors", "a model", error))
    }

    /// Writes the file, whole or not at all.
    ///
    /// # Errors
    /// [`IoError`] with the path and the reason.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), IoError> {
        let path = path.as_ref();
        write_bytes(path, &self.to_bytes(&path.display().to_string())?)
    }
}

#[cfg(test)]
mod tests {
    use super::{Header, ModelFile, Writer};
    use crate::fuzz::survives_damage;
    use std::collections::BTreeMap;

    fn header() -> Header {
        Header {
            kind: "scape-body".to_owned(),
            dimensions: BTreeMap::from([("vertices".to_owned(), 2)]),
            seed: 7,
            sources: BTreeMap::from([("base.obj".to_owned(), crate::hash(b"x"))]),
            attributes: BTreeMap::from([("gender".to_owned(), "female".to_owned())]),
            ..Header::default()
        }
    }

    fn bytes() -> Vec<u8> {
        let mut writer = Writer::new(header());
        writer.add_f32("template", &[2, 3], vec![0.0, 1.0, 2.0, 3.0, 4.0, -5.5]).add_i16(
            "basis",
            &[1, 2],
            vec![-300, 9],
        );
        writer.add_i8("a", &[1], vec![-1]).add_u8("b", &[2], vec![1, 255]).add_u32("c", &[0, 3], vec![]);
        writer.add_f64("d", &[1], vec![1e-300]);
        writer.to_bytes("m").unwrap()
    }

    #[test]
    fn what_is_written_reads_back_and_is_reproducible() {
        assert_eq!(bytes(), bytes());
        let model = ModelFile::parse(bytes(), "scape-body", "m").unwrap();
        assert_eq!(model.header(), &Header { schema: super::SCHEMA, ..header() });
        let vertices = model.dimension("vertices").unwrap();
        assert_eq!(model.f32("template", &[vertices, 3]).unwrap(), [0.0, 1.0, 2.0, 3.0, 4.0, -5.5]);
        assert_eq!(model.i16("basis", &[1, 2]).unwrap(), [-300, 9]);
        assert_eq!(model.i8("a", &[1]).unwrap(), [-1]);
        assert_eq!(model.u8("b", &[2]).unwrap(), [1, 255]);
        assert_eq!(model.u32("c", &[0, 3]).unwrap(), [0u32; 0]);
        assert_eq!(model.f64("d", &[1]).unwrap(), [1e-300]);
        assert_eq!(model.attribute("gender").unwrap(), "female");
        assert_eq!(model.names().count(), 6);
    }

    #[test]
    fn refusals_say_why() {
        let model = ModelFile::parse(bytes(), "scape-body", "m").unwrap();
        let message = model.f32("template", &[3, 3]).unwrap_err().to_string();
        assert_eq!(message, "m, tensor \"template\": wanted F32 of shape [3, 3], found F32 of shape [2, 3]");
        assert!(model.f64("template", &[2, 3]).unwrap_err().to_string().contains("found F32"));
        assert!(model.u8("none", &[2]).unwrap_err().to_string().contains("none of that name"));
        assert!(model.dimension("faces").unwrap_err().to_string().contains("dimension \"faces\""));
        let other = ModelFile::parse(bytes(), "drape-garment", "m").unwrap_err().to_string();
        assert_eq!(other, "m, kind: wanted \"drape-garment\", found \"scape-body\"");
        let mut newer = bytes();
        let at = newer.windows(10).position(|window| window == br#"schema\":1"#).unwrap();
        newer[at + 9] = b'2';
        let newer = ModelFile::parse(newer, "scape-body", "m");
        assert_eq!(newer.unwrap_err().to_string(), "m, schema: wanted version 1, found version 2");
        let mut cut = bytes();
        cut.truncate(cut.len() - 1);
        assert!(ModelFile::parse(cut, "scape-body", "m").unwrap_err().to_string().contains("whole safetensors"));
        let foreign = safetensors::serialize(Vec::<(&str, safetensors::tensor::TensorView<'_>)>::new(), None).unwrap();
        assert!(ModelFile::parse(foreign, "scape-body", "m").unwrap_err().to_string().contains("without one"));
        let mut nan = Writer::new(header());
        nan.add_f32("x", &[2], vec![0.0, f32::NAN]);
        let nan = ModelFile::parse(nan.to_bytes("m").unwrap(), "scape-body", "m").unwrap();
        assert!(nan.f32("x", &[2]).unwrap_err().to_string().contains("element 1"));
        let misfit = Writer::new(header()).add_f32("x", &[3], vec![0.0]).to_bytes("m").unwrap_err().to_string();
        assert_eq!(misfit, "m, tensor \"x\": wanted the elements of shape [3] (F32), found 4 bytes");
    }

    #[test]
    fn damage_never_panics() {
        survives_damage(&bytes(), |bytes| {
            if let Ok(model) = ModelFile::parse(bytes.to_vec(), "scape-body", "damaged") {
                drop(model.f32("template", &[2, 3]));
                drop(model.u32("c", &[0, 3]));
            }
        });
    }
}
