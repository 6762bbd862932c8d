//! What a request may ask for.

use modiste_body::measure::Quantity;

use crate::JobError;

/// The longest animation (s): ten minutes are 18,000 frames, some gigabytes.
pub const LONGEST_SECONDS: f64 = 600.0;

/// Smallest and largest value (m or kg) of a measurement that is accepted: beyond any subject of ANSUR II, within what
/// adults have been measured with.
pub fn limits(quantity: Quantity) -> (f64, f64) {
    match quantity {
        Quantity::Stature => (1.2, 2.3),
        Quantity::BodyMass => (30.0, 250.0),
        Quantity::ChestGirth | Quantity::WaistGirth | Quantity::HipGirth => (0.45, 1.9),
        Quantity::NeckGirth | Quantity::CalfGirth => (0.2, 0.7),
        Quantity::ThighGirth => (0.3, 1.1),
        Quantity::UpperArmGirth => (0.15, 0.7),
        Quantity::WristGirth => (0.1, 0.3),
        Quantity::ShoulderBreadth => (0.25, 0.6),
        Quantity::UpperArmLength | Quantity::LowerArmLength => (0.15, 0.5),
        Quantity::ArmLength => (0.35, 0.95),
        Quantity::InsideLegLength => (0.5, 1.2),
        Quantity::KneeHeight => (0.3, 0.75),
        Quantity::HipHeight | Quantity::WaistHeight => (0.5, 1.5),
        Quantity::BustHeight => (0.7, 1.8),
        Quantity::BackNeckHeight => (0.9, 2.0),
        Quantity::ChestDepth | Quantity::WaistDepth | Quantity::HipDepth => (0.1, 0.7),
        Quantity::WaistBreadth | Quantity::HipBreadth => (0.15, 0.8),
    }
}

/// Refuses measurements that no adult has, and those given twice.
pub(crate) fn check_measurements(measurements: &[(Quantity, f64)]) -> Result<(), JobError> {
    if measurements.is_empty() {
        return Err(JobError::Request("no measurement is given; give at least one, such as the stature".to_owned()));
    }
    for (index, &(quantity, found)) in measurements.iter().enumerate() {
        let (low, high) = limits(quantity);
        check_range(quantity.title(), found, (low, high), quantity.unit())?;
        if measurements[..index].iter().any(|(other, _)| *other == quantity) {
            return Err(JobError::Request(format!("the {} is given twice", quantity.title())));
        }
    }
    Ok(())
}

/// Refuses what is not a number from `low` to `high`.
pub(crate) fn check_range(what: &str, found: f64, (low, high): (f64, f64), unit: &'static str) -> Result<(), JobError> {
    if (low..=high).contains(&found) {
        return Ok(());
    }
    Err(JobError::Range { what: what.to_owned(), low, high, unit, found })
}

#[cfg(test)]
mod tests {
    use super::{check_measurements, check_range, limits};
    use modiste_body::measure::Quantity;

    #[test]
    fn a_giant_and_a_mistaken_unit_are_refused() {
        let error = check_measurements(&[(Quantity::Stature, 5.0)]).unwrap_err().to_string();
        assert_eq!(error, "stature: wanted 1.2 to 2.3 m, found 5");
        assert!(check_measurements(&[(Quantity::Stature, 1.7), (Quantity::ChestGirth, 92.0)]).is_err());
        assert!(check_measurements(&[(Quantity::BodyMass, f64::NAN)]).is_err());
        assert!(check_measurements(&[]).is_err());
        let twice = [(Quantity::Stature, 1.7), (Quantity::Stature, 1.8)];
        assert!(check_measurements(&twice).unwrap_err().to_string().contains("twice"));
        assert!(check_measurements(&twice[..1]).is_ok());
    }

    #[test]
    fn every_quantity_has_a_range() {
        for quantity in Quantity::ALL {
            let (low, high) = limits(quantity);
            assert!(0.0 < low && low < high, "{}", quantity.name());
        }
        assert!(check_range("x", f64::INFINITY, (0.0, 1.0), "m").is_err());
    }
}
