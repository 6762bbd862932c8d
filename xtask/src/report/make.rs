//! Whether a body made from five measurements has them.

use anyhow::Result;
use modiste_body::make::{Wish, make_body};
use modiste_body::{Gender, Quantity, ScapeModel};
use rayon::prelude::*;

use super::page::{Page, rounded};
use super::population;
use crate::assets::body_file;

/// What a user gives.
const WISHED: [Quantity; 5] =
    [Quantity::Stature, Quantity::BodyMass, Quantity::ChestGirth, Quantity::WaistGirth, Quantity::HipGirth];
/// How far a measurement may be off.
const LENGTH_TOLERANCE: f64 = 0.005;
const MASS_TOLERANCE: f64 = 0.5;
/// Share of the subjects whose bodies must be within all tolerances.
const SHARE: f64 = 0.95;

pub(super) fn measure() -> Result<Page> {
    let mut page = Page::new("Bodies from measurements");
    page.paragraph(
        "A body is made from stature, mass, chest, waist and hip of each held-out subject of ANSUR II, and measured; a \
         body that cannot be made counts as missed.",
    );
    let mut rows = Vec::new();
    for gender in Gender::ALL {
        let model = ScapeModel::load(body_file(gender))?;
        let people = population::read(gender)?;
        let errors: Vec<Option<[f64; 5]>> = people
            .persons
            .par_iter()
            .filter(|person| person.held_out)
            .map(|person| {
                let target = |quantity| population::target(person, quantity);
                let wishes = WISHED.map(|quantity| Wish { quantity, value: target(quantity) });
                let made = make_body(&model, &wishes).ok()?;
                Some(wishes.map(|wish| made.measurements.get(wish.quantity) - wish.value))
            })
            .collect();
        let close = |error: &Option<[f64; 5]>| error.is_some_and(|error| WISHED.iter().zip(error).all(within));
        let share = |met: usize| met as f64 / errors.len().max(1) as f64;
        let what = format!("{}: bodies with all five within 5 mm and 0.5 kg", gender.name());
        page.at_least(&what, 100.0 * share(errors.iter().filter(|error| close(error)).count()), 100.0 * SHARE, "%");
        for (index, quantity) in WISHED.into_iter().enumerate() {
            let mut magnitudes: Vec<f64> = errors.iter().flatten().map(|error| error[index].abs()).collect();
            magnitudes.sort_by(f64::total_cmp);
            let at = |part: f64| magnitudes.get((part * magnitudes.len().saturating_sub(1) as f64) as usize).copied();
            let (scale, unit) = if quantity.unit() == "kg" { (1.0, "kg") } else { (1e3, "mm") };
            let met = errors.iter().flatten().filter(|error| within((&quantity, error[index]))).count();
            let what = format!("{}: {} within tolerance", gender.name(), quantity.title());
            page.at_least(&what, 100.0 * share(met), 100.0 * SHARE, "%");
            rows.push([
                gender.name().to_owned(),
                format!("{} ({unit})", quantity.title()),
                rounded(scale * at(0.5).unwrap_or(f64::NAN)),
                rounded(scale * at(0.95).unwrap_or(f64::NAN)),
                rounded(scale * at(1.0).unwrap_or(f64::NAN)),
            ]);
        }
        page.figures(&format!("{}_subjects", gender.name()), &errors.len())?;
        page.figures(&format!("{}_impossible", gender.name()), &errors.iter().filter(|error| error.is_none()).count())?;
    }
    page.table(&["gender", "measurement", "median error", "95%", "largest"], rows);
    Ok(page)
}

fn within((quantity, error): (&Quantity, f64)) -> bool {
    error.abs() <= if quantity.unit() == "kg" { MASS_TOLERANCE } else { LENGTH_TOLERANCE }
}
