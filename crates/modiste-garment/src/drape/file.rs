//! The model file of a garment.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use modiste_body::{Gender, Part};
use modiste_core::{Matrix, QuantisedBasis, Topology, Vec3};
use modiste_io::IoError;
use modiste_io::model::{Header, ModelFile, Writer};

use super::basis::GradientBasis;
use super::blend::blend_parts;
use super::coarse::{CoarseModel, KernelRegression, Learned, MotionInputs};
use super::dynamics::Dynamics;
use super::features::{InputOptions, PoseInputs};
use super::gradient::{PER_FACE, TangentFrames};
use super::model::{DrapeModel, Provenance};
use super::pose_kernel::PoseKernel;
use super::shape::ShapeModel;
use super::training_set::Garment;
use super::wrinkle::WrinkleModel;
use crate::GarmentError;

/// Kind of the model file.
pub const KIND: &str = "garment";

/// Version of what a garment's file holds, in the attribute of this name; files of before have none.
const VERSION: &str = "garment_version";
const CURRENT: &str = "3";

/// Name of the attribute with the number of vertices that were asked for.
const VERTEX_COUNT: &str = "vertex_count";

/// Name of the attribute with the figures of the model.
const EVALUATION: &str = "evaluation";

/// Names of the blocks of eq. 5 in the file.
const BLOCKS: [&str; 7] = ["m", "M1", "M2", "M3", "M4", "M5", "M6"];

impl DrapeModel {
    /// Writes the model, whole or not at all.
    ///
    /// # Errors
    /// [`GarmentError::Io`] with the path and the reason.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), GarmentError> {
        let name = path.as_ref().display().to_string();
        Ok(modiste_io::write_bytes(path.as_ref(), &self.to_bytes(&name)?)?)
    }

    /// The model file as bytes; `name` stands for it in errors.
    ///
    /// # Errors
    /// [`GarmentError::Io`] with the reason.
    pub fn to_bytes(&self, name: &str) -> Result<Vec<u8>, GarmentError> {
        let Self { garment, shape, wrinkle, dynamics, .. } = self;
        let (vertices, faces) = (garment.topology.vertex_count(), garment.topology.face_count());
        let mut writer = Writer::new(self.header());
        let corners: Vec<u32> = garment.topology.faces().as_flattened().to_vec();
        let uv: Vec<f32> = garment.uv.as_flattened().as_flattened().to_vec();
        let template: Vec<f64> = garment.template.iter().flat_map(|vertex| vertex.to_array()).collect();
        writer.add_u32("faces", &[faces, 3], corners);
        writer.add_u8("face_parts", &[faces], part_bytes(&garment.face_parts));
        writer.add_f64("template", &[vertices, 3], template);
        writer.add_u32("waist_band", &[garment.waist_band.len()], garment.waist_band.clone());
        writer.add_u32("anchors", &[garment.anchors.len(), 2], garment.anchors.as_flattened().to_vec());
        writer.add_f32("uv", &[faces, 3, 2], uv);
        writer.add_u8("pattern", &[garment.pattern.len()], garment.pattern.clone().into_bytes());
        add_space(&mut writer, "shape", (&shape.mean, &shape.basis), &shape.std_devs, shape.total_variance);
        writer.add_f64("W", &[shape.regression.rows, shape.regression.cols], shape.regression.data.clone());
        let offsets = &shape.offset_regression;
        writer.add_f64("anchor_offset", &[offsets.rows, offsets.cols], offsets.data.clone());
        add_space(&mut writer, "wrinkle", (&wrinkle.mean, &wrinkle.basis), &wrinkle.std_devs, wrinkle.total_variance);
        if let Some(coarse) = &self.coarse {
            add_coarse(&mut writer, &coarse.learned);
        }
        writer.add_f64("wrinkle_held_out_loss", &[1], vec![wrinkle.held_out_loss]);
        writer.add_u8("pose_parts", &[dynamics.inputs.parts().len()], part_bytes(dynamics.inputs.parts()));
        if let Some(kernel) = dynamics.inputs.kernel() {
            let centres = kernel.centres();
            writer.add_f64("pose_centres", &[centres.rows, centres.cols], centres.data.clone());
            writer.add_f64("pose_reach", &[1], vec![kernel.reach()]);
        }
        for (block, matrix) in BLOCKS.into_iter().zip(dynamics.matrices()) {
            writer.add_f32(block, &[matrix.rows, matrix.cols], single(&matrix));
        }
        let fixed = &dynamics.static_coefficients;
        writer.add_f32("static", &[fixed.rows, fixed.cols], single(fixed));
        writer.add_f64("amplitudes", &[dynamics.amplitudes().len()], dynamics.amplitudes().to_vec());
        Ok(writer.to_bytes(name)?)
    }

    fn header(&self) -> Header {
        let Self { garment, shape, wrinkle, dynamics, provenance, .. } = self;
        let options = dynamics.inputs.options();
        let dimensions = [
            ("vertices", garment.topology.vertex_count()),
            ("faces", garment.topology.face_count()),
            ("waist_band", garment.waist_band.len()),
            ("anchors", garment.anchors.len()),
            ("pattern", garment.pattern.len()),
            ("body_shape", shape.body_count()),
            ("ease", usize::from(shape.has_ease())),
            ("garment_shape", shape.count()),
            ("wrinkles", wrinkle.count()),
            ("patterns", wrinkle.basis.rest().count()),
            ("pose_parts", dynamics.inputs.parts().len()),
            ("pose_centres", dynamics.inputs.kernel().map_or(0, PoseKernel::count)),
            ("coarse", self.coarse.as_ref().map_or(0, CoarseModel::count)),
            ("coarse_parts", self.coarse.as_ref().map_or(0, |coarse| coarse.learned.inputs.parts().len())),
            ("coarse_centres", self.coarse.as_ref().map_or(0, |coarse| coarse.learned.dynamic.centres.rows)),
            ("coarse_static_centres", self.coarse.as_ref().map_or(0, |coarse| coarse.learned.fixed.centres.rows)),
        ];
        let attributes = [
            (VERSION, CURRENT.to_owned()),
            ("garment", garment.name.clone()),
            ("gender", garment.gender.name().to_owned()),
            ("fps", self.fps.to_string()),
            ("blend_width", wrinkle.blend_width.to_string()),
            ("input_matrices", options.matrices.to_string()),
            ("input_gravity", options.gravity.to_string()),
            ("input_pelvis_turn", options.pelvis_turn.to_string()),
            ("input_memory", options.memory.to_string()),
        ];
        let mut attributes: BTreeMap<String, String> = attributes.map(|(name, value)| (name.to_owned(), value)).into();
        if let Some(count) = provenance.vertex_count {
            attributes.insert(VERTEX_COUNT.to_owned(), count.to_string());
        }
        if let Some(evaluation) = &self.evaluation {
            // Plain numbers and names always serialise.
            let text = serde_json::to_string(evaluation).unwrap_or_default();
            attributes.insert(EVALUATION.to_owned(), text);
        }
        Header {
            kind: KIND.to_owned(),
            units: "m, kg, s, rad".to_owned(),
            dimensions: dimensions.map(|(name, size)| (name.to_owned(), size)).into(),
            seed: provenance.seed,
            sources: provenance.sources.iter().cloned().collect::<BTreeMap<_, _>>(),
            licence: provenance.licence.clone(),
            command: provenance.command.clone(),
            attributes,
            ..Header::default()
        }
    }

    /// Reads a model.
    ///
    /// # Errors
    /// [`GarmentError`] naming the file, the tensor or field, what was wanted and what was found.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, GarmentError> {
        let path = path.as_ref();
        Self::from_file(&ModelFile::read(path, KIND)?, &path.display().to_string())
    }

    /// Reads a model from bytes; `name` stands for the file in errors.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn parse(bytes: Vec<u8>, name: &str) -> Result<Self, GarmentError> {
        Self::from_file(&ModelFile::parse(bytes, KIND, name)?, name)
    }

    fn from_file(file: &ModelFile, name: &str) -> Result<Self, GarmentError> {
        let version = file.header().attributes.get(VERSION).map_or("1", String::as_str);
        if version != CURRENT {
            let found = format!("version {version}; the garment has to be learned again");
            return Err(IoError::field(name, "garment model", format!("version {CURRENT}"), found).into());
        }
        let garment = read_garment(file, name)?;
        let (body_shape, garment_shape) = (file.dimension("body_shape")?, file.dimension("garment_shape")?);
        let (mean, basis, std_devs, total_variance) = read_space(file, name, "shape", &garment, [garment_shape, 0])?;
        let predictors = body_shape + file.dimension("ease")?.min(1) + 1;
        let regression = matrix(file, "W", predictors, garment_shape)?;
        let offset_regression = matrix(file, "anchor_offset", predictors, 3)?;
        let frames = TangentFrames::new(&garment.topology, &garment.template);
        let shape = ShapeModel {
            frames: frames.clone(),
            mean,
            basis,
            std_devs,
            body_count: body_shape,
            regression,
            offset_regression,
            total_variance,
        };
        let wrinkles = file.dimension("wrinkles")?;
        let patterns = file.dimension("patterns")?;
        let (mean, basis, std_devs, total_variance) =
            read_space(file, name, "wrinkle", &garment, [wrinkles, patterns])?;
        let is_width = |&width: &f64| width.is_finite() && width >= 0.0;
        let blend_width = parsed(file, name, "blend_width", "a width in metres", is_width)?;
        let blend = blend_parts(&garment, blend_width)?;
        let wrinkle = WrinkleModel {
            held_out_loss: file.f64("wrinkle_held_out_loss", &[1])?[0],
            frames,
            blend_width,
            blend: blend.faces,
            mean,
            basis,
            std_devs,
            total_variance,
        };
        let coarse = read_coarse(file, name, &garment)?
            .map(|learned| CoarseModel::assemble(&garment, blend.vertices, learned))
            .transpose()?;
        let dynamics = read_dynamics(file, name, wrinkles)?;
        let fps = parsed(file, name, "fps", "a positive number", |&fps: &f64| fps.is_finite() && fps > 0.0)?;
        let header = file.header();
        let vertex_count = header.attributes.contains_key(VERTEX_COUNT).then(|| {
            parsed(file, name, VERTEX_COUNT, "a number of vertices", |&count: &usize| (100..1_000_000).contains(&count))
        });
        let provenance = Provenance {
            vertex_count: vertex_count.transpose()?,
            seed: header.seed,
            sources: header.sources.clone().into_iter().collect(),
            licence: header.licence.clone(),
            command: header.command.clone(),
        };
        let mut model = Self::assemble(garment, shape, (wrinkle, coarse), dynamics, fps, provenance)?;
        if let Some(text) = header.attributes.get(EVALUATION) {
            let wrong = |error: serde_json::Error| {
                attribute_error(name, EVALUATION, "the figures of an evaluation", &error.to_string())
            };
            model.evaluation = Some(serde_json::from_str(text).map_err(wrong)?);
        }
        Ok(model)
    }
}

/// Coefficients of regressions are kept in single precision; what they were learned from has no more.
fn single(matrix: &Matrix) -> Vec<f32> {
    matrix.data.iter().map(|&value| value as f32).collect()
}

fn part_bytes(parts: &[Part]) -> Vec<u8> {
    parts.iter().map(|part| part.index() as u8).collect()
}

/// Mean, basis and spread of a space.
fn add_space(
    writer: &mut Writer<'_>,
    name: &str,
    (mean, basis): (&[f32], &GradientBasis),
    std_devs: &[f64],
    total_variance: f64,
) {
    let (moves, mixing, rest) = (basis.moves(), basis.mixing(), basis.rest());
    writer.add_f32(&format!("{name}_mean"), &[mean.len()], mean.to_vec());
    writer.add_f32(&format!("{name}_move_scales"), &[moves.count()], moves.scales().to_vec());
    writer.add_i8(&format!("{name}_moves"), &[moves.count(), moves.dimensions()], moves.values().to_vec());
    writer.add_f64(&format!("{name}_mixing"), &[mixing.rows, mixing.cols], mixing.data.clone());
    writer.add_f32(&format!("{name}_rest_scales"), &[rest.count()], rest.scales().to_vec());
    writer.add_i8(&format!("{name}_rest"), &[rest.count(), mean.len()], rest.values().to_vec());
    writer.add_f64(&format!("{name}_std_devs"), &[std_devs.len()], std_devs.to_vec());
    writer.add_f64(&format!("{name}_total_variance"), &[1], vec![total_variance]);
}

type Space = (Vec<f32>, GradientBasis, Vec<f64>, f64);

/// A space of `count` components, and `patterns` that no move has.
fn read_space(
    file: &ModelFile,
    name: &str,
    space: &str,
    garment: &Garment,
    [count, patterns]: [usize; 2],
) -> Result<Space, GarmentError> {
    let (vertices, faces) = (garment.topology.vertex_count(), garment.topology.face_count());
    let mean = file.f32(&format!("{space}_mean"), &[PER_FACE * faces])?;
    let std_devs = file.f64(&format!("{space}_std_devs"), &[count])?;
    let total_variance = file.f64(&format!("{space}_total_variance"), &[1])?[0];
    let quantised = |tensor: &str, scales: &str, [count, width]: [usize; 2]| {
        let tensor = format!("{space}_{tensor}");
        let values = file.i8(&tensor, &[count, width])?;
        let scales = file.f32(&format!("{space}_{scales}"), &[count])?;
        let basis = QuantisedBasis::from_parts(scales, values, width);
        basis.map_err(|error| IoError::field(name, format!("tensor \"{tensor}\""), "a basis", error))
    };
    let moves = quantised("moves", "move_scales", [count, 3 * vertices])?;
    let rest = quantised("rest", "rest_scales", [patterns, PER_FACE * faces])?;
    let mixing = matrix(file, &format!("{space}_mixing"), count, patterns)?;
    let basis = GradientBasis::from_parts((&garment.topology, &garment.template), moves, mixing, rest);
    Ok((mean, basis, std_devs, total_variance))
}

/// Names of the regressions of the coarse deformation: from all inputs, and from the pose alone.
const REGRESSIONS: [&str; 2] = ["coarse", "coarse_static"];

fn add_coarse(writer: &mut Writer<'_>, coarse: &Learned) {
    let basis = &coarse.basis;
    writer.add_f32("coarse_mean", &[coarse.mean.len()], coarse.mean.clone());
    writer.add_f32("coarse_move_scales", &[basis.count()], basis.scales().to_vec());
    writer.add_i8("coarse_moves", &[basis.count(), basis.dimensions()], basis.values().to_vec());
    writer.add_u8("coarse_parts", &[coarse.inputs.parts().len()], part_bytes(coarse.inputs.parts()));
    writer.add_f64("coarse_length", &[1], vec![coarse.length]);
    writer.add_f64("coarse_held_out_error", &[1], vec![coarse.held_out_error]);
    for (name, regression) in REGRESSIONS.into_iter().zip([&coarse.dynamic, &coarse.fixed]) {
        let KernelRegression { centres, reach, weights, mean } = regression;
        writer.add_f32(&format!("{name}_centres"), &[centres.rows, centres.cols], single(centres));
        writer.add_f64(&format!("{name}_reach"), &[1], vec![*reach]);
        writer.add_f32(&format!("{name}_weights"), &[weights.rows, weights.cols], single(weights));
        writer.add_f64(&format!("{name}_offset"), &[mean.len()], mean.clone());
    }
}

/// `None` for the model of the paper.
fn read_coarse(file: &ModelFile, name: &str, garment: &Garment) -> Result<Option<Learned>, GarmentError> {
    let count = file.dimension("coarse")?;
    if count == 0 {
        return Ok(None);
    }
    let width = 3 * garment.topology.vertex_count();
    let scales = file.f32("coarse_move_scales", &[count])?;
    let basis = QuantisedBasis::from_parts(scales, file.i8("coarse_moves", &[count, width])?, width)
        .map_err(|error| IoError::field(name, "tensor \"coarse_moves\"", "a basis", error))?;
    let inputs = MotionInputs::of(read_parts(file, name, "coarse_parts", file.dimension("coarse_parts")?)?);
    let length = positive(file, name, "coarse_length")?;
    let regression = |prefix: &str, input_count: usize| {
        let centre_count = file.dimension(&format!("{prefix}_centres"))?;
        let matrix = |tensor: &str, rows, cols| single_matrix(file, &format!("{prefix}_{tensor}"), rows, cols);
        let reach = positive(file, name, &format!("{prefix}_reach"))?;
        Ok::<_, GarmentError>(KernelRegression {
            centres: matrix("centres", centre_count, input_count)?,
            weights: matrix("weights", centre_count, count)?,
            mean: file.f64(&format!("{prefix}_offset"), &[count])?,
            reach,
        })
    };
    Ok(Some(Learned {
        mean: file.f32("coarse_mean", &[width])?,
        basis,
        dynamic: regression(REGRESSIONS[0], inputs.count())?,
        fixed: regression(REGRESSIONS[1], inputs.pose_count())?,
        inputs,
        length,
        held_out_error: file.f64("coarse_held_out_error", &[1])?[0],
    }))
}

/// A tensor of one positive number.
fn positive(file: &ModelFile, name: &str, tensor: &str) -> Result<f64, GarmentError> {
    let value = file.f64(tensor, &[1])?[0];
    if value.is_finite() && value > 0.0 {
        return Ok(value);
    }
    Err(IoError::field(name, format!("tensor \"{tensor}\""), "a positive number", value).into())
}

fn read_garment(file: &ModelFile, name: &str) -> Result<Garment, GarmentError> {
    let (vertices, faces) = (file.dimension("vertices")?, file.dimension("faces")?);
    let corners = file.u32("faces", &[faces, 3])?;
    let garment = file.attribute("garment")?.to_owned();
    let topology = Topology::new(vertices, corners.as_chunks::<3>().0.to_vec())
        .map_err(|source| GarmentError::Topology { garment: format!("{name}, {garment}"), source })?;
    let gender = file.attribute("gender")?;
    let gender = Gender::from_name(gender).ok_or_else(|| attribute_error(name, "gender", "female or male", gender))?;
    let template = file.f64("template", &[vertices, 3])?;
    let anchors = file.u32("anchors", &[file.dimension("anchors")?, 2])?;
    let uv = file.f32("uv", &[faces, 3, 2])?;
    let pattern = file.u8("pattern", &[file.dimension("pattern")?])?;
    let corner_uv: Vec<[f32; 2]> = uv.as_chunks::<2>().0.to_vec();
    Ok(Garment {
        gender,
        topology: Arc::new(topology),
        face_parts: read_parts(file, name, "face_parts", faces)?,
        template: template.as_chunks::<3>().0.iter().map(|&vertex| Vec3::from_array(vertex)).collect(),
        waist_band: file.u32("waist_band", &[file.dimension("waist_band")?])?,
        anchors: anchors.as_chunks::<2>().0.to_vec(),
        uv: corner_uv.as_chunks::<3>().0.to_vec(),
        pattern: String::from_utf8(pattern)
            .map_err(|error| IoError::field(name, "tensor \"pattern\"", "UTF-8", error))?,
        name: garment,
    })
}

fn read_parts(file: &ModelFile, name: &str, tensor: &str, count: usize) -> Result<Vec<Part>, GarmentError> {
    let bytes = file.u8(tensor, &[count])?;
    let part = |&index: &u8| {
        Part::from_index(usize::from(index)).ok_or_else(|| {
            let wanted = format!("parts below {}", Part::COUNT);
            IoError::field(name, format!("tensor \"{tensor}\""), wanted, index).into()
        })
    };
    bytes.iter().map(part).collect()
}

fn read_dynamics(file: &ModelFile, name: &str, wrinkles: usize) -> Result<Dynamics, GarmentError> {
    let parts = read_parts(file, name, "pose_parts", file.dimension("pose_parts")?)?;
    let anything = |_: &bool| true;
    let options = InputOptions {
        gravity: parsed(file, name, "input_gravity", "true or false", anything)?,
        pelvis_turn: parsed(file, name, "input_pelvis_turn", "true or false", anything)?,
        matrices: parsed(file, name, "input_matrices", "true or false", anything)?,
        memory: parsed(file, name, "input_memory", "true or false", anything)?,
        // Which parts it chose is in the list of parts.
        neighbours: false,
        centres: file.dimension("pose_centres")?,
    };
    let plain = PoseInputs::from_parts(parts, options, None);
    let kernel = match options.centres {
        0 => None,
        centres => {
            let centres = matrix(file, "pose_centres", centres, plain.plain_count())?;
            Some(PoseKernel::new(centres, positive(file, name, "pose_reach")?)?)
        }
    };
    let inputs = PoseInputs::from_parts(plain.parts().to_vec(), options, kernel);
    let (pose, change) = (inputs.pose_count(), inputs.change_count());
    let mut rows = Vec::new();
    let counts = [1, pose, wrinkles, wrinkles, change, change, inputs.memory_count()];
    for (block, count) in BLOCKS.into_iter().zip(counts) {
        rows.extend(file.f32(block, &[count, wrinkles])?.into_iter().map(f64::from));
    }
    let coefficients = Matrix { rows: rows.len() / wrinkles.max(1), cols: wrinkles, data: rows };
    let static_coefficients = single_matrix(file, "static", 1 + pose, wrinkles)?;
    let amplitudes = file.f64("amplitudes", &[wrinkles])?;
    Ok(Dynamics::new(inputs, coefficients, static_coefficients).with_amplitudes(amplitudes))
}

fn single_matrix(file: &ModelFile, name: &str, rows: usize, cols: usize) -> Result<Matrix, GarmentError> {
    Ok(Matrix { rows, cols, data: file.f32(name, &[rows, cols])?.into_iter().map(f64::from).collect() })
}

fn matrix(file: &ModelFile, name: &str, rows: usize, cols: usize) -> Result<Matrix, GarmentError> {
    Ok(Matrix { rows, cols, data: file.f64(name, &[rows, cols])? })
}

fn parsed<T: std::str::FromStr>(
    file: &ModelFile,
    name: &str,
    attribute: &str,
    wanted: &str,
    allowed: impl Fn(&T) -> bool,
) -> Result<T, GarmentError> {
    let text = file.attribute(attribute)?;
    text.parse().ok().filter(allowed).ok_or_else(|| attribute_error(name, attribute, wanted, text))
}

fn attribute_error(name: &str, attribute: &str, wanted: &str, found: &str) -> GarmentError {
    IoError::field(name, format!("attribute \"{attribute}\""), wanted, format!("\"{found}\"")).into()
}
