//! SCAPE models on disk: one safetensors file per gender.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use modiste_core::{QuantisedBasis, Vec3};
use modiste_io::model::{Header, ModelFile, Writer};

use super::ScapeModel;
use super::blend::{BLEND_COUNT, RotationBlend};
use super::model::ModelData;
use super::pose_deformation::{BLOCK, FEATURES, PoseDeformation};
use crate::{BodyError, Gender, Part};

/// What the header of a body model says it is.
const KIND: &str = "scape-body";

/// Where a model came from, for its file's header.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Provenance {
    /// Seed of the training.
    pub seed: u64,
    /// Hash of each file that it was learned from.
    pub sources: BTreeMap<String, String>,
    /// Licence of the model.
    pub licence: String,
    /// The command that makes it again.
    pub command: String,
}

impl ScapeModel {
    /// Reads a model.
    ///
    /// # Errors
    /// A file that cannot be read, is no body model of this version, or contradicts itself.
    pub fn load(path: impl AsRef<Path>) -> Result<Arc<Self>, BodyError> {
        Self::from_file(&ModelFile::read(path, KIND)?)
    }

    /// Reads a model from the bytes of a file; `name` stands for it in errors.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn from_bytes(bytes: Vec<u8>, name: &str) -> Result<Arc<Self>, BodyError> {
        Self::from_file(&ModelFile::parse(bytes, KIND, name)?)
    }

    /// Writes the model.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn save(&self, path: impl AsRef<Path>, provenance: &Provenance) -> Result<(), BodyError> {
        Ok(self.writer(provenance).save(path)?)
    }

    fn from_file(file: &ModelFile) -> Result<Arc<Self>, BodyError> {
        let gender = file.attribute("gender")?;
        let gender = Gender::from_name(gender).ok_or_else(|| BodyError::Model(format!("unknown gender `{gender}`")))?;
        if file.dimension("pose_features")? != FEATURES {
            return Err(BodyError::Model(format!("wanted {FEATURES} numbers per joint, found another count")));
        }
        let (vertices, faces) = (file.dimension("vertices")?, file.dimension("faces")?);
        let (shapes, blocks) = (file.dimension("shapes")?, file.dimension("pose_blocks")?);
        let blend = RotationBlend {
            parts: arrays(&file.u8("blend_parts", &[faces, BLEND_COUNT])?),
            weights: arrays(&file.f32("blend_weights", &[faces, BLEND_COUNT])?),
        };
        let shape_basis = QuantisedBasis::from_parts(
            file.f32("shape_scales", &[shapes])?,
            file.i16("shape_basis", &[shapes, 9 * faces])?,
            9 * faces,
        )?;
        let pose_deformation = PoseDeformation {
            starts: file.u32("pose_starts", &[faces + 1])?,
            joints: file.u8("pose_joints", &[blocks])?,
            coefficients: file.i16("pose_coefficients", &[blocks, BLOCK])?,
            scale: file.f32("pose_scale", &[1])?[0],
        };
        Self::new(ModelData {
            gender,
            faces: arrays(&file.u32("faces", &[faces, 3])?),
            template: arrays(&file.f64("template", &[vertices, 3])?).into_iter().map(Vec3::from_array).collect(),
            face_parts: parts(&file.u8("face_parts", &[faces])?)?,
            vertex_parts: parts(&file.u8("vertex_parts", &[vertices])?)?,
            blend,
            shape_mean: file.f32("shape_mean", &[9 * faces])?,
            shape_basis,
            pose_deformation,
            joints: read_lists(file, "joint")?,
            cores: read_lists(file, "core")?,
            vertex_blend: RotationBlend {
                parts: arrays(&file.u8("vertex_blend_parts", &[vertices, BLEND_COUNT])?),
                weights: arrays(&file.f32("vertex_blend_weights", &[vertices, BLEND_COUNT])?),
            },
        })
    }

    fn writer(&self, provenance: &Provenance) -> Writer<'_> {
        let data = &self.data;
        let (vertices, faces) = (data.template.len(), data.faces.len());
        let (shapes, blocks) = (data.shape_basis.count(), data.pose_deformation.joints.len());
        let total = |lists: &[Vec<(u32, f32)>]| lists.iter().map(Vec::len).sum::<usize>();
        let dimensions = [
            ("vertices", vertices),
            ("faces", faces),
            ("shapes", shapes),
            ("pose_blocks", blocks),
            ("pose_features", FEATURES),
            ("joint_entries", total(&data.joints)),
            ("core_entries", total(&data.cores)),
        ];
        let mut writer = Writer::new(Header {
            schema: modiste_io::model::SCHEMA,
            kind: KIND.to_owned(),
            units: "m; shape coefficients in standard deviations".to_owned(),
            dimensions: dimensions.map(|(name, size)| (name.to_owned(), size)).into(),
            seed: provenance.seed,
            sources: provenance.sources.clone(),
            licence: provenance.licence.clone(),
            command: provenance.command.clone(),
            attributes: [("gender".to_owned(), data.gender.name().to_owned())].into(),
        });
        let indices = |parts: &[Part]| parts.iter().map(|part| part.index() as u8).collect::<Vec<u8>>();
        writer.add_u32("faces", &[faces, 3], data.faces.as_flattened());
        writer.add_f64("template", &[vertices, 3], data.template.iter().flat_map(Vec3::to_array).collect::<Vec<f64>>());
        writer.add_u8("face_parts", &[faces], indices(&data.face_parts));
        writer.add_u8("vertex_parts", &[vertices], indices(&data.vertex_parts));
        writer.add_u8("blend_parts", &[faces, BLEND_COUNT], data.blend.parts.as_flattened());
        writer.add_f32("blend_weights", &[faces, BLEND_COUNT], data.blend.weights.as_flattened());
        writer.add_f32("shape_mean", &[9 * faces], data.shape_mean.as_slice());
        writer.add_f32("shape_scales", &[shapes], data.shape_basis.scales());
        writer.add_i16("shape_basis", &[shapes, 9 * faces], data.shape_basis.values());
        writer.add_u32("pose_starts", &[faces + 1], data.pose_deformation.starts.as_slice());
        writer.add_u8("pose_joints", &[blocks], data.pose_deformation.joints.as_slice());
        writer.add_i16("pose_coefficients", &[blocks, BLOCK], data.pose_deformation.coefficients.as_slice());
        writer.add_f32("pose_scale", &[1], vec![data.pose_deformation.scale]);
        writer.add_u8("vertex_blend_parts", &[vertices, BLEND_COUNT], data.vertex_blend.parts.as_flattened());
        writer.add_f32("vertex_blend_weights", &[vertices, BLEND_COUNT], data.vertex_blend.weights.as_flattened());
        add_lists(&mut writer, "joint", &data.joints);
        add_lists(&mut writer, "core", &data.cores);
        writer
    }
}

/// Consecutive runs of `N` numbers; the reader has checked that the count divides.
fn arrays<T: Copy, const N: usize>(flat: &[T]) -> Vec<[T; N]> {
    flat.as_chunks().0.to_vec()
}

fn parts(indices: &[u8]) -> Result<Vec<Part>, BodyError> {
    let part = |&index: &u8| {
        Part::from_index(index.into()).ok_or_else(|| BodyError::Model(format!("there is no part {index}")))
    };
    indices.iter().map(part).collect()
}

/// One list of weighted vertices per part.
fn add_lists(writer: &mut Writer<'_>, name: &str, lists: &[Vec<(u32, f32)>]) {
    let counts: Vec<u32> = lists.iter().map(|list| list.len() as u32).collect();
    let (vertices, values): (Vec<u32>, Vec<f32>) = lists.iter().flatten().copied().unzip();
    writer.add_u32(&format!("{name}_counts"), &[Part::COUNT], counts);
    writer.add_u32(&format!("{name}_vertices"), &[vertices.len()], vertices);
    writer.add_f32(&format!("{name}_weights"), &[values.len()], values);
}

fn read_lists(file: &ModelFile, name: &str) -> Result<Vec<Vec<(u32, f32)>>, BodyError> {
    let count = file.dimension(&format!("{name}_entries"))?;
    let counts = file.u32(&format!("{name}_counts"), &[Part::COUNT])?;
    let vertices = file.u32(&format!("{name}_vertices"), &[count])?;
    let weights = file.f32(&format!("{name}_weights"), &[count])?;
    if counts.iter().map(|&count| u64::from(count)).sum::<u64>() != count as u64 {
        return Err(BodyError::Model(format!("the vertices of the {name} lists do not add up")));
    }
    let mut rest = vertices.into_iter().zip(weights);
    Ok(counts.iter().map(|&count| rest.by_ref().take(count as usize).collect()).collect())
}

#[cfg(test)]
mod tests {
    use super::Provenance;
    use crate::scape::synthetic;
    use crate::{BodyError, ScapeModel};

    #[test]
    fn a_model_survives_its_file() {
        let model = synthetic::model();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("body.safetensors");
        let provenance = Provenance { seed: 3, licence: "CC0-1.0".to_owned(), ..Provenance::default() };
        model.save(&path, &provenance).unwrap();
        assert_eq!(ScapeModel::load(&path).unwrap().data, model.data);
    }

    #[test]
    fn damaged_files_are_refused() {
        let bytes = synthetic::model().writer(&Provenance::default()).to_bytes("body").unwrap();
        assert!(matches!(ScapeModel::from_bytes(bytes[..bytes.len() / 2].to_vec(), "half"), Err(BodyError::Io(_))));
        assert!(ScapeModel::from_bytes(Vec::new(), "empty").is_err());
        assert!(ScapeModel::load("no such file").is_err());
        let mut data = synthetic::model().data.clone();
        data.cores[0][0].0 = 1 << 30;
        assert!(matches!(ScapeModel::new(data.clone()), Err(BodyError::Model(_))));
        data.face_parts.pop();
        assert!(matches!(ScapeModel::new(data), Err(BodyError::Size { .. })));
    }
}
