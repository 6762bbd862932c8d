//! The words for a body.

use anyhow::{Context, Result};
use clap::Args;
use modiste::{BodyChoice, Quantity};

use super::GenderName;

/// Which body; without measurements and shape it is the average.
#[derive(Debug, Args)]
pub(crate) struct BodyArguments {
    /// Whose body model.
    #[arg(long, value_enum, default_value = "female")]
    pub(crate) gender: GenderName,
    /// Stature (m).
    #[arg(long, value_name = "METRES", help_heading = "Measurements")]
    height: Option<f64>,
    /// Body mass (kg).
    #[arg(long, value_name = "KILOGRAMS", help_heading = "Measurements")]
    weight: Option<f64>,
    /// Chest (bust) girth (m).
    #[arg(long, value_name = "METRES", help_heading = "Measurements")]
    chest: Option<f64>,
    /// Waist girth (m).
    #[arg(long, value_name = "METRES", help_heading = "Measurements")]
    waist: Option<f64>,
    /// Hip girth (m).
    #[arg(long, value_name = "METRES", help_heading = "Measurements")]
    hip: Option<f64>,
    /// Any other measurement, for example `shoulder_breadth=0.37`; `body measure --json` shows the names.
    #[arg(long = "measure", value_name = "NAME=VALUE", value_parser = measurement, help_heading = "Measurements")]
    others: Vec<(Quantity, f64)>,
    /// Body shape coefficients β in standard deviations, with commas between, instead of measurements.
    #[arg(
        long,
        value_name = "NUMBERS",
        value_delimiter = ',',
        allow_hyphen_values = true,
        conflicts_with_all = ["height", "weight", "chest", "waist", "hip", "others"]
    )]
    shape: Vec<f64>,
}

impl BodyArguments {
    pub(crate) fn choice(&self) -> BodyChoice {
        if !self.shape.is_empty() {
            return BodyChoice::Shape(self.shape.clone());
        }
        let named = [
            (Quantity::Stature, self.height),
            (Quantity::BodyMass, self.weight),
            (Quantity::ChestGirth, self.chest),
            (Quantity::WaistGirth, self.waist),
            (Quantity::HipGirth, self.hip),
        ];
        let given = named.into_iter().filter_map(|(quantity, value)| Some((quantity, value?)));
        let measurements: Vec<(Quantity, f64)> = given.chain(self.others.iter().copied()).collect();
        if measurements.is_empty() { BodyChoice::Average } else { BodyChoice::Measurements(measurements) }
    }
}

/// Reads `name=value`.
fn measurement(text: &str) -> Result<(Quantity, f64)> {
    let (name, value) = text.split_once('=').context("wanted NAME=VALUE, such as shoulder_breadth=0.37")?;
    let quantity = Quantity::from_name(name).with_context(|| {
        let known: Vec<&str> = Quantity::ALL.iter().map(|quantity| quantity.name()).collect();
        format!("there is no measurement `{name}`; known: {}", known.join(", "))
    })?;
    let value = value.parse().with_context(|| format!("`{value}` is not a number"))?;
    Ok((quantity, value))
}
