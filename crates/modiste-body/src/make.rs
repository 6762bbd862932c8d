//! A body from measurements: `body make`.
//!
//! The shape coefficients β that give the wished measurements, and otherwise the most usual body that has them: Gauss-Newton
//! on the residuals, in units of their tolerances, with the Mahalanobis prior `λ |β|²` whose weight falls until it yields.

use std::sync::Arc;

use modiste_core::{Matrix, Vec3, solve_spd};

use crate::{Body, BodyError, MeasureTemplate, Measurements, Quantity, ScapeModel};

/// What is good enough: 5 mm for lengths, 0.5 kg for the mass.
const LENGTH_TOLERANCE: f64 = 0.005;
const MASS_TOLERANCE: f64 = 0.5;

/// Weight of the prior at the start and at the end; it falls by the same factor in every iteration between.
const FIRST_PRIOR: f64 = 1.0;
const LAST_PRIOR: f64 = 1e-3;
const ITERATIONS: usize = 25;

/// Longest step of a coefficient in one iteration: girths are only piecewise smooth.
const LONGEST_STEP: f64 = 1.5;

/// Coefficients beyond this many standard deviations are worth a warning.
const UNUSUAL: f64 = 3.0;

/// A wish missed by more than this many tolerances cannot be met; missed by more than one, it is worth a warning.
const IMPOSSIBLE: f64 = 6.0;

/// A wished measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wish {
    /// What is measured.
    pub quantity: Quantity,
    /// What it should be (m or kg).
    pub value: f64,
}

/// A wish and what became of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// The wish.
    pub wish: Wish,
    /// What the body measures (m or kg).
    pub found: f64,
}

/// A body made to measure.
#[derive(Debug, Clone)]
pub struct Made {
    /// The body.
    pub body: Body,
    /// All that it measures.
    pub measurements: Measurements,
    /// Each wish with what became of it.
    pub outcomes: Vec<Outcome>,
    /// What is unusual about the body, in sentences.
    pub warnings: Vec<String>,
}

impl Outcome {
    /// How far off it is, in tolerances (5 mm or 0.5 kg).
    pub fn misfit(&self) -> f64 {
        (self.found - self.wish.value).abs() / tolerance(self.wish.quantity)
    }
}

impl ScapeModel {
    /// What measuring the bodies of this model needs to know.
    ///
    /// # Errors
    /// A model of another topology than the project's.
    pub fn measure_template(&self) -> Result<MeasureTemplate, BodyError> {
        Ok(MeasureTemplate::new(self.topology(), self.face_parts())?)
    }
}

impl Body {
    /// All measurements of the body in the template pose (m and kg).
    ///
    /// # Errors
    /// A body of another topology than the project's.
    pub fn measurements(&self) -> Result<Measurements, BodyError> {
        Ok(self.model().measure_template()?.measure(self.rest_vertices())?)
    }
}

/// The most usual body with the wished measurements.
///
/// # Errors
/// A wish that no body can meet, alone or together with the others, or that is given twice.
pub fn make_body(model: &Arc<ScapeModel>, wishes: &[Wish]) -> Result<Made, BodyError> {
    let template = model.measure_template()?;
    let average = template.measure(model.template())?;
    check_wishes(wishes, &average)?;
    let measure = |shape: &[f64], quantity: Quantity| {
        let (value, gradient) = template.quantity_with_gradient(quantity, &vertices(model, shape));
        let along = |direction: &Vec<Vec3>| gradient.iter().map(|(vertex, g)| g.dot(direction[*vertex as usize])).sum();
        (value, model.shape_directions().iter().map(along).collect())
    };
    let shape = fit_shape(model.shape_count(), wishes, &measure)?;
    let body = model.body(&shape)?;
    let measurements = template.measure(body.rest_vertices())?;
    let outcomes: Vec<Outcome> =
        wishes.iter().map(|&wish| Outcome { wish, found: measurements.get(wish.quantity) }).collect();
    let warnings = judge(&outcomes, &shape)?;
    Ok(Made { body, measurements, outcomes, warnings })
}

/// The template pose's vertices (m) for a shape: linear in β.
fn vertices(model: &ScapeModel, shape: &[f64]) -> Vec<Vec3> {
    let mut vertices = model.template().to_vec();
    for (direction, coefficient) in model.shape_directions().iter().zip(shape) {
        for (x, d) in vertices.iter_mut().zip(direction) {
            *x += *d * *coefficient;
        }
    }
    vertices
}

fn is_mass(quantity: Quantity) -> bool {
    quantity == Quantity::BodyMass
}

fn tolerance(quantity: Quantity) -> f64 {
    if is_mass(quantity) { MASS_TOLERANCE } else { LENGTH_TOLERANCE }
}

/// Refuses numbers that no adult's body can have, by the average one.
fn check_wishes(wishes: &[Wish], average: &Measurements) -> Result<(), BodyError> {
    for (index, wish) in wishes.iter().enumerate() {
        let name = wish.quantity.name();
        let [low, high] = if is_mass(wish.quantity) { [0.45, 3.5] } else { [0.6, 1.9] };
        // Stature varies much less than girths do.
        let high = if wish.quantity == Quantity::Stature { 1.4 } else { high };
        let usual = average.get(wish.quantity);
        if !(low * usual..=high * usual).contains(&wish.value) {
            return Err(BodyError::Value {
                what: name.to_owned(),
                wanted: format!("{:.2} to {:.2} {}", low * usual, high * usual, wish.quantity.unit()),
                found: wish.value,
            });
        }
        if wishes[..index].iter().any(|other| other.quantity == wish.quantity) {
            return Err(BodyError::Wish(format!("{name} is wished twice")));
        }
    }
    Ok(())
}

/// Gauss-Newton with a falling prior. `measure` gives a quantity for a shape and its derivatives by the coefficients.
fn fit_shape(
    count: usize,
    wishes: &[Wish],
    measure: &dyn Fn(&[f64], Quantity) -> (f64, Vec<f64>),
) -> Result<Vec<f64>, BodyError> {
    let mut shape = vec![0.0; count];
    if wishes.is_empty() || count == 0 {
        return Ok(shape);
    }
    let fall = (LAST_PRIOR / FIRST_PRIOR).powf(1.0 / (ITERATIONS - 8) as f64);
    for iteration in 0..ITERATIONS {
        let prior = (FIRST_PRIOR * fall.powi(iteration as i32)).max(LAST_PRIOR);
        let mut normal = Matrix::from_fn(count, count, |i, j| if i == j { prior } else { 0.0 });
        let mut right = Matrix::from_fn(count, 1, |i, _| -prior * shape[i]);
        for wish in wishes {
            let scale = 1.0 / tolerance(wish.quantity);
            let (value, slopes) = measure(&shape, wish.quantity);
            let residual = scale * (value - wish.value);
            for i in 0..count {
                right[(i, 0)] -= scale * slopes[i] * residual;
                for j in 0..count {
                    normal[(i, j)] += scale * scale * slopes[i] * slopes[j];
                }
            }
        }
        let step = solve_spd(&normal, &right)?;
        let largest = (0..count).map(|i| step[(i, 0)].abs()).fold(0.0, f64::max);
        let share = (LONGEST_STEP / largest).min(1.0);
        for (i, coefficient) in shape.iter_mut().enumerate() {
            *coefficient += share * step[(i, 0)];
        }
    }
    Ok(shape)
}

/// Warns of what is unusual, refuses what is impossible.
fn judge(outcomes: &[Outcome], shape: &[f64]) -> Result<Vec<String>, BodyError> {
    let tell = |outcome: &Outcome| {
        let unit = outcome.wish.quantity.unit();
        format!(
            "{} {:.3} {unit} (wished {:.3} {unit})",
            outcome.wish.quantity.name(),
            outcome.found,
            outcome.wish.value
        )
    };
    if outcomes.iter().any(|outcome| !(outcome.misfit() <= IMPOSSIBLE)) {
        let all: Vec<String> = outcomes.iter().map(tell).collect();
        return Err(BodyError::Wish(format!(
            "no body has these measurements together; the nearest has {}",
            all.join(", ")
        )));
    }
    let missed: Vec<String> = outcomes.iter().filter(|outcome| outcome.misfit() > 1.0).map(tell).collect();
    let mut warnings = Vec::new();
    if !missed.is_empty() {
        warnings.push(format!("the nearest body has {}", missed.join(", ")));
    }
    if let Some((index, largest)) = shape.iter().enumerate().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
        && largest.abs() > UNUSUAL
    {
        warnings.push(format!("the body is unusual: shape coefficient {index} is {largest:.1} standard deviations"));
    }
    Ok(warnings)
}

#[cfg(test)]
mod tests {
    use super::{Outcome, Wish, check_wishes, fit_shape, judge};
    use crate::{BodyError, Measurements, Quantity};

    /// A made-up person: stature linear in two coefficients, mass a product of powers, as volumes are.
    fn measure(shape: &[f64], quantity: Quantity) -> (f64, Vec<f64>) {
        match quantity {
            Quantity::Stature => (1.7 + 0.07 * shape[0] + 0.02 * shape[1], vec![0.07, 0.02, 0.0]),
            _ => {
                let mass = 70.0 * (0.12 * shape[0] + 0.2 * shape[2]).exp();
                (mass, vec![0.12 * mass, 0.0, 0.2 * mass])
            }
        }
    }

    #[test]
    fn wishes_are_met_by_the_most_usual_body() {
        let wishes =
            [Wish { quantity: Quantity::Stature, value: 1.82 }, Wish { quantity: Quantity::BodyMass, value: 95.0 }];
        let shape = fit_shape(3, &wishes, &measure).unwrap();
        for wish in wishes {
            let outcome = Outcome { wish, found: measure(&shape, wish.quantity).0 };
            assert!(outcome.misfit() < 0.05, "{outcome:?}");
        }
        // Nearest to the average on the line of solutions: moving along it does not shorten β.
        let along = [0.02, -0.07, -0.12 * 0.02 / 0.2];
        let slope: f64 = shape.iter().zip(along).map(|(b, d)| b * d).sum();
        assert!(slope.abs() < 1e-3, "{slope}");
    }

    #[test]
    fn no_wish_is_the_average_body() {
        assert_eq!(fit_shape(3, &[], &measure).unwrap(), [0.0; 3]);
    }

    #[test]
    fn impossible_wishes_are_refused_with_their_range() {
        let mut average = Measurements::default();
        average.set(Quantity::Stature, 1.7);
        average.set(Quantity::BodyMass, 70.0);
        let wish = |quantity, value| check_wishes(&[Wish { quantity, value }], &average);
        assert!(wish(Quantity::Stature, 1.95).is_ok());
        for (quantity, value) in [
            (Quantity::Stature, 5.0),
            (Quantity::Stature, -1.7),
            (Quantity::Stature, f64::NAN),
            (Quantity::BodyMass, 5.0),
        ] {
            let Err(BodyError::Value { what, .. }) = wish(quantity, value) else { panic!("{value} passed") };
            assert_eq!(what, quantity.name());
        }
        let twice = [Wish { quantity: Quantity::Stature, value: 1.7 }; 2];
        assert!(matches!(check_wishes(&twice, &average), Err(BodyError::Wish(_))));
    }

    #[test]
    fn misses_are_told() {
        let outcome = |found| Outcome { wish: Wish { quantity: Quantity::Stature, value: 1.8 }, found };
        assert_eq!(judge(&[outcome(1.803)], &[1.0]).unwrap().len(), 0);
        assert_eq!(judge(&[outcome(1.81)], &[1.0, -4.0]).unwrap().len(), 2);
        let Err(BodyError::Wish(message)) = judge(&[outcome(1.7)], &[1.0]) else { panic!("passed") };
        assert!(message.contains("stature 1.700 m (wished 1.800 m)"), "{message}");
    }
}
