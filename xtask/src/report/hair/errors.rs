//! Table 6.1 and figure 6.4: error on motions held out, row by row beside the thesis, and stability.

use std::sync::Arc;

use anyhow::Result;
use modiste::HairStyle;
use modiste_core::Silent;
use modiste_hair::model::{HairModel, LearnOptions, learn};
use modiste_hair::training::{Factors, Recipe, TrainingFolder, WindDirection};
use modiste_hair::{CellError, Groom, evaluate};

use super::super::page::{Page, rounded};
use super::super::plot::{Series, lines};
use super::{Scene, scene, training_set};
use crate::assets::hair_folder;

/// Intervals of the grid of figure 6.4.
const GRID: usize = 10;

/// A set of table 6.1: errors (cm) learned from and held out, and λ_max.
struct Set {
    name: &'static str,
    guides: usize,
    rows: &'static [(&'static str, [f64; 2])],
    lambda: Option<f64>,
    wind: bool,
}

/// The table. It has no wind from the front; of the dense set our copy of the text has no more than the error learned from,
/// and the goal of the project is 2.8 cm.
const TABLE: [Set; 4] = [
    Set {
        name: "sparse",
        guides: 198,
        rows: &[
            ("l1.0-s1.0", [3.39, 3.61]),
            ("l1.0-s0.0", [2.09, 1.93]),
            ("l0.0-s1.0", [1.73, 1.91]),
            ("l0.0-s0.0", [1.23, 1.14]),
        ],
        lambda: Some(0.9792),
        wind: false,
    },
    Set {
        name: "main",
        guides: 962,
        rows: &[
            ("l1.0-s1.0", [2.85, 2.93]),
            ("l1.0-s0.0", [1.66, 1.57]),
            ("l0.0-s1.0", [1.20, 1.22]),
            ("l0.0-s0.0", [0.84, 0.78]),
        ],
        lambda: Some(0.9646),
        wind: false,
    },
    Set {
        name: "main, in wind",
        guides: 962,
        rows: &[
            ("l1.0-s1.0", [2.97, 3.12]),
            ("l1.0-s1.0+z", [4.23, 4.27]),
            ("l1.0-s1.0+x", [4.50, 4.47]),
            ("l1.0-s1.0-x", [4.32, 4.21]),
            ("l1.0-s1.0-z", [f64::NAN, f64::NAN]),
        ],
        lambda: Some(0.9663),
        wind: true,
    },
    Set { name: "dense", guides: 3980, rows: &[("l1.0-s1.0", [2.76, 2.8])], lambda: None, wind: false },
];

/// A model and how near it comes.
struct Measured {
    scene: Scene,
    errors: Vec<CellError>,
}

impl Measured {
    fn of(scene: Scene) -> Result<Self> {
        let names: Vec<String> = scene.sequences.iter().map(|sequence| sequence.name.clone()).collect();
        let errors = evaluate(&scene.model, &training_set(&scene)?, &names, &Silent)?;
        Ok(Self { scene, errors })
    }
}

pub(in crate::report) fn errors() -> Result<Page> {
    let mut page = Page::new("Error and stability (table 6.1, figure 6.4)");
    let mut measured = vec![Measured::of(scene()?)?];
    // Sets that do not ship, as far as they have been learned here.
    for guides in [962, 3980] {
        let file = hair_folder(HairStyle::Long, guides).with_extension("safetensors");
        if modiste_io::exists(&file) {
            let model = HairModel::load(file)?.shared();
            measured.push(Measured::of(Scene { model, ..scene()? })?);
        }
    }
    let shipped = &measured[0];
    let dimensions = shipped.scene.model.layout().hair;
    page.paragraph(format!(
        "Mean distance of guide points from our simulation (cm), the model running freely from the bust alone, without \
         collision handling. Each row of the thesis stands beside the model with as many guides where one has been learned with \
         such hair, and beside the one that ships otherwise. {} frames of each sort of hair were learned from, and {} held out.",
        shipped.scene.frames(false),
        shipped.scene.frames(true),
    ));
    rows(&mut page, &measured)?;
    plain(&mut page, shipped, dimensions)?;
    let grid = shipped.scene.model.stability(GRID)?;
    page.figures("lambda", &grid)?;
    let series: Vec<Series> = [0.0, 0.5, 1.0]
        .into_iter()
        .map(|softness| {
            let row = grid.iter().filter(|(_, s, _)| (s - softness).abs() < 1e-9).map(|&(length, _, l)| (length, l));
            Series::new(format!("softness {softness}"), row.collect())
        })
        .filter(|series| !series.points.is_empty())
        .collect();
    page.plot("hair-lambda", "λ_max against length", lines(["length factor", "λ_max"], &series, Some(1.0))?);
    Ok(page)
}

fn rows(page: &mut Page, measured: &[Measured]) -> Result<()> {
    let mut table = Vec::new();
    for set in &TABLE {
        let holds = |found: &&Measured| {
            found.scene.model.guide_count() == set.guides
                && set.rows.iter().all(|(cell, _)| found.errors.iter().any(|error| error.cell == *cell))
        };
        let found = measured.iter().find(holds).unwrap_or(&measured[0]);
        let guides = found.scene.model.guide_count();
        let lambda = largest(&found.scene.model, set.wind)?;
        page.claim(
            &format!("λ_max, {} set, {guides} guides", set.name),
            "below 1".to_owned(),
            format!("{lambda:.4}"),
            lambda < 1.0,
        );
        for (cell, [learned, held_out]) in set.rows {
            let Some(error) = found.errors.iter().find(|error| error.cell == *cell) else { continue };
            let number = |value: f64| if value.is_nan() { String::new() } else { rounded(value) };
            table.push([
                set.name.to_owned(),
                (*cell).to_owned(),
                guides.to_string(),
                rounded(error.training_cm),
                rounded(error.test_cm),
                format!("{lambda:.4}"),
                number(*learned),
                number(*held_out),
                set.lambda.map_or(String::new(), |lambda| lambda.to_string()),
            ]);
            if !held_out.is_nan() {
                page.at_most(
                    &format!("error of {cell} held out, {} set, {guides} guides", set.name),
                    error.test_cm,
                    *held_out,
                    "cm",
                );
            }
        }
    }
    let header = [
        "set of the thesis",
        "hair",
        "our guides",
        "learned from",
        "held out",
        "λ_max",
        "thesis, learned from",
        "thesis, held out",
        "thesis, λ_max",
    ];
    page.table(&header, table);
    Ok(())
}

/// λ_max over length and softness, or over strength and direction of the wind.
fn largest(model: &Arc<HairModel>, wind: bool) -> Result<f64> {
    if !wind {
        return Ok(model.stability(GRID)?.into_iter().map(|(_, _, lambda)| lambda).fold(0.0, f64::max));
    }
    let mut largest = 0.0f64;
    for direction in WindDirection::ALL {
        for aside in [0.0, std::f64::consts::FRAC_PI_4] {
            for strength in [0.25, 0.5, 0.75, 1.0] {
                let factors = Factors { wind: [strength, direction.angle() + aside], ..Factors::default() };
                largest = largest.max(model.style(&factors)?.largest_eigenvalue()?);
            }
        }
    }
    Ok(largest)
}

/// What the thesis's model alone does, learned from the same simulation.
fn plain(page: &mut Page, shipped: &Measured, dimensions: usize) -> Result<()> {
    let scene = &shipped.scene;
    let folder = training_set(scene)?;
    let names: Vec<String> = scene.sequences.iter().map(|sequence| sequence.name.clone()).collect();
    let options = LearnOptions { hair_dimensions: dimensions, ..LearnOptions::plain() };
    let plain = learn(&folder, &names, &scene.body, scene.model.roots(), &options, &Silent)?.model;
    let plainly = evaluate(&plain, &folder, &names, &Silent)?;
    page.paragraph(format!(
        "What ships, beside the model of the thesis alone (plain), which is learned from the same simulation with as many \
         coefficients, {dimensions}: hair in a space that turns with the heading, driven by the bust coefficients. Ours takes hair \
         in the space of the head, and the head's motion, means of the past, products and squares as further inputs. Hair that \
         keeps its mean shape is the error of no model at all. Simulated again is how far hair is from itself that had hung half a \
         second longer before each held-out motion began: no model that sees the motion alone can tell the two apart. The plain model's λ_max over length and softness is {:.4}.",
        largest(&plain.shared(), false)?,
    ));
    let again = simulated_again(scene, &folder)?;
    let table = shipped.errors.iter().zip(&plainly).zip(&again).map(|((error, plain), again)| {
        let numbers = [
            error.training_cm,
            error.test_cm,
            plain.training_cm,
            plain.test_cm,
            error.projection_cm,
            *again,
            error.still_cm,
        ];
        std::iter::once(error.cell.clone()).chain(numbers.map(rounded)).collect::<Vec<_>>()
    });
    let header = [
        "hair",
        "learned from",
        "held out",
        "plain, learned from",
        "plain, held out",
        "components alone",
        "simulated again",
        "mean shape",
    ];
    page.table(&header, table);
    page.figures("errors", &shipped.errors)?;
    page.figures("errors_plain", &plainly)?;
    page.figures("simulated_again_cm", &again)?;
    Ok(())
}

/// For each cell how far (cm) its hair in the held-out motions is from itself, simulated again.
fn simulated_again(scene: &Scene, folder: &TrainingFolder) -> Result<Vec<f64>> {
    let Recipe { style, guides, seed, cells, .. } = folder.recipe();
    let mut means = Vec::with_capacity(cells.len());
    for (index, cell) in cells.iter().enumerate() {
        let groom = Groom::grow(&scene.body, *style, cell.length, *guides, *seed)?;
        let mut distances = Vec::new();
        for sequence in scene.sequences.iter().filter(|sequence| sequence.held_out) {
            distances.extend(folder.repeat(&scene.body, (index, &groom), sequence)?);
        }
        means.push(100.0 * distances.iter().sum::<f64>() / distances.len().max(1) as f64);
    }
    Ok(means)
}
