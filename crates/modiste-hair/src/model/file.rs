//! Hair models on disk.

use std::path::Path;

use modiste_core::{Pca, QuantisedBasis, Vec3};
use modiste_io::model::{Header, ModelFile, Writer};

use super::HairModel;
use super::blocks::Blocks;
use super::expansion::Expansion;
use super::inputs::Inputs;
use super::matrix::{Layout, MOVES, Ridge};
use crate::scalp::Root;
use crate::space::HairSpace;
use crate::training::Cell;
use crate::{HairError, POINTS};

/// Kind of the files.
const KIND: &str = "hair";
/// Largest sizes that are read, so that a damaged header asks for no endless memory.
const MOST: usize = 100_000;

/// Where a model comes from.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Provenance {
    /// The command that made it.
    pub command: String,
    /// SHA-256 of what it was made from, by name.
    pub sources: std::collections::BTreeMap<String, String>,
    /// Licence of it and of what it was made from.
    pub licence: String,
}

impl HairModel {
    /// Writes the model.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn save(&self, path: impl AsRef<Path>, provenance: &Provenance) -> Result<(), HairError> {
        let layout = self.layout();
        let mut header = Header {
            kind: KIND.to_owned(),
            units: format!(
                "m, rad; hair in {}",
                if self.plain { "canonical space of the bust" } else { "space of the head" }
            ),
            seed: self.seed,
            sources: provenance.sources.clone(),
            licence: provenance.licence.clone(),
            command: provenance.command.clone(),
            ..Header::default()
        };
        for (name, size) in [
            ("guides", self.roots.len()),
            ("points", POINTS),
            ("hair", layout.hair),
            ("bust", self.bust.count()),
            ("inputs", layout.inputs),
            ("head", self.space.head().len()),
            ("bust_vertices", self.bust_vertices.len()),
            ("cells", self.cells.len()),
        ] {
            header.dimensions.insert(name.to_owned(), size);
        }
        let cells = serde_json::to_string(&self.cells).map_err(|error| HairError::data("cells", "JSON", error))?;
        for (name, value) in [
            ("name", self.name.clone()),
            ("fps", self.fps.to_string()),
            ("plain", self.plain.to_string()),
            ("cells", cells),
        ] {
            header.attributes.insert(name.to_owned(), value);
        }
        let n = self.mean.len();
        let mut writer = Writer::new(header);
        let faces: Vec<u32> = self.roots.iter().map(|root| root.face).collect();
        let places: Vec<f32> = self.roots.iter().flat_map(|root| root.barycentric).map(|x| x as f32).collect();
        let ridges: Vec<f64> = self.ridges.iter().flat_map(|r| [r.independent, r.shared, r.inputs]).collect();
        let rest: Vec<f32> = self.bust_rest.iter().flat_map(|p| p.to_array()).map(|x| x as f32).collect();
        writer
            .add_u32("root_faces", &[faces.len()], faces)
            .add_f32("root_places", &[self.roots.len(), 3], places)
            .add_u32("bust_vertices", &[self.bust_vertices.len()], &self.bust_vertices[..])
            .add_f32("bust_rest", &[self.bust_rest.len(), 3], rest)
            .add_f32("bust_mean", &[self.bust.mean.len()], &self.bust.mean[..])
            .add_f32("bust_basis", &[self.bust.count(), self.bust.mean.len()], &self.bust.basis[..])
            .add_u32("head_vertices", &[self.space.head().len()], self.space.head())
            .add_f64("ridges", &[self.ridges.len(), 3], ridges)
            .add_f64("input_limits", &[self.limits.len()], &self.limits[..])
            .add_f32("hair_mean", &[n], &self.mean[..])
            .add_f32("hair_scales", &[layout.hair], self.basis.scales())
            .add_i8("hair_basis", &[layout.hair, n], self.basis.values())
            .add_f64("hair_std_devs", &[layout.hair], &self.std_devs[..])
            .add_f32("tensor", &[self.blocks.triangle().len()], self.blocks.triangle());
        writer.save(path)?;
        Ok(())
    }

    /// Reads a model.
    ///
    /// # Errors
    /// A file that is no hair model, damaged, or made by another version.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, HairError> {
        let path = path.as_ref();
        Self::from_file(&ModelFile::read(path, KIND)?, &path.display().to_string())
    }

    /// Reads a model from bytes; `name` stands for the file in errors.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn from_bytes(bytes: Vec<u8>, name: &str) -> Result<Self, HairError> {
        Self::from_file(&ModelFile::parse(bytes, KIND, name)?, name)
    }

    fn from_file(file: &ModelFile, name: &str) -> Result<Self, HairError> {
        let size = |what: &str, most: usize| {
            let found = file.dimension(what)?;
            let wrong = || HairError::data(format!("{name}, dimension \"{what}\""), format!("1 to {most}"), found);
            if (1..=most).contains(&found) { Ok(found) } else { Err(wrong()) }
        };
        let (guides, hair, bust) = (size("guides", MOST)?, size("hair", 1000)?, size("bust", 1000)?);
        let (tracked, cells) = (size("bust_vertices", MOST)?, size("cells", 100)?);
        if file.dimension("points")? != POINTS {
            return Err(HairError::data(format!("{name}, points of a guide"), POINTS, file.dimension("points")?));
        }
        let number = |what: &str| {
            let text = file.attribute(what)?;
            let wrong = || HairError::data(format!("{name}, attribute \"{what}\""), "a number of 0 or more", text);
            text.parse().ok().filter(|value: &f64| value.is_finite() && *value >= 0.0).ok_or_else(wrong)
        };
        let list: Vec<Cell> = serde_json::from_str(file.attribute("cells")?)
            .map_err(|error| HairError::data(format!("{name}, attribute \"cells\""), "a list of cells", error))?;
        if list.len() != cells {
            return Err(HairError::data(format!("{name}, attribute \"cells\""), cells, list.len()));
        }
        let n = 3 * POINTS * guides;
        let faces = file.u32("root_faces", &[guides])?;
        let places = file.f32("root_places", &[guides, 3])?;
        let roots = faces.iter().zip(places.chunks_exact(3));
        let rest = file.f32("bust_rest", &[tracked, 3])?;
        let mean = file.f32("hair_mean", &[n])?;
        let basis =
            QuantisedBasis::from_parts(file.f32("hair_scales", &[hair])?, file.i8("hair_basis", &[hair, n])?, n)
                .map_err(HairError::solving("basis of the hair"))?;
        let plain: bool = file
            .attribute("plain")?
            .parse()
            .map_err(|error| HairError::data(format!("{name}, attribute \"plain\""), "true or false", error))?;
        let layout = Layout { inputs: size("inputs", 1000)?, hair };
        if layout.inputs != Inputs::count(plain, bust) {
            let wanted = Inputs::count(plain, bust);
            return Err(HairError::data(format!("{name}, dimension \"inputs\""), wanted, layout.inputs));
        }
        let limits = file.f64("input_limits", &[layout.inputs + MOVES])?;
        if let Some(limit) = limits.iter().find(|limit| !(limit.is_finite() && **limit >= 0.0)) {
            return Err(HairError::data(format!("{name}, limits of the inputs"), "numbers of 0 or more", limit));
        }
        let rest: Vec<Vec3> =
            rest.chunks_exact(3).map(|p| Vec3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2]))).collect();
        let head = file.u32("head_vertices", &[file.dimension("head")?])?;
        if let Some(vertex) = head.iter().find(|&&vertex| vertex as usize >= tracked) {
            return Err(HairError::data(format!("{name}, vertices of the head"), format!("below {tracked}"), vertex));
        }
        let rows = Blocks::stacked(&layout.shared(), cells);
        let triangle = file.f32("tensor", &[rows * (rows + 1) / 2])?;
        Ok(Self {
            name: file.attribute("name")?.to_owned(),
            fps: number("fps")?,
            roots: roots
                .map(|(&face, place)| Root { face, barycentric: std::array::from_fn(|i| f64::from(place[i])) })
                .collect(),
            cells: list,
            bust_vertices: file.u32("bust_vertices", &[tracked])?,
            space: HairSpace::of_head(head, &rest),
            bust_rest: rest,
            plain,
            limits: limits.into(),
            bust: Pca {
                mean: file.f32("bust_mean", &[3 * tracked])?,
                basis: file.f32("bust_basis", &[bust, 3 * tracked])?,
                std_devs: vec![1.0; bust],
                ..Pca::default()
            },
            expansion: Expansion::new(&mean, &basis),
            mean,
            basis,
            std_devs: file.f64("hair_std_devs", &[hair])?,
            blocks: Blocks::from_triangle(triangle, &layout.shared(), cells)?,
            ridges: ridges(file, name, cells)?,
            seed: file.header().seed,
        })
    }
}

fn ridges(file: &ModelFile, name: &str, cells: usize) -> Result<Vec<Ridge>, HairError> {
    let numbers = file.f64("ridges", &[cells, 3])?;
    if let Some(number) = numbers.iter().find(|number| !(number.is_finite() && **number >= 0.0)) {
        return Err(HairError::data(format!("{name}, ridges"), "numbers of 0 or more", number));
    }
    let ridges = numbers.as_chunks::<3>().0.iter();
    Ok(ridges.map(|&[independent, shared, inputs]| Ridge { independent, shared, inputs }).collect())
}
