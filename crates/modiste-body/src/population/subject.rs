//! Who the bodies are solved for: ANSUR II subjects, or people drawn from the survey's means and covariances.

use modiste_core::{Matrix, Rng, SolveError, below, normal, seeded_rng, shuffle, symmetric_eigen};
use serde::{Deserialize, Serialize};

use crate::{Gender, Quantity};

/// A quantity as ANSUR II measured it.
#[derive(Debug, Clone, Copy)]
pub struct AnsurQuantity {
    /// The quantity here.
    pub quantity: Quantity,
    /// The survey's column.
    pub column: &'static str,
    /// What is added to the survey's value (m or kg) because the definitions differ.
    pub offset: f64,
    /// Standard deviation with which a body should match (m or kg).
    pub tolerance: f64,
}

/// What each body is solved for.
///
/// The survey's biceps is flexed; the relaxed arm is taken as 1.5 cm less, loosely. The offsets of height, breadths and
/// depths of waist and hip are the mean misfit of average bodies whose girths fit (feet apart, outline of the artist's
/// body, pressed callipers), so that these quantities shape a body by how a person differs from the mean.
pub const ANSUR_QUANTITIES: [AnsurQuantity; 24] = [
    ansur(Quantity::Stature, "stature", 0.0, 0.001),
    ansur(Quantity::BodyMass, "weightkg", 0.0, 0.15),
    ansur(Quantity::ChestGirth, "chestcircumference", 0.0, 0.001),
    ansur(Quantity::WaistGirth, "waistcircumference", 0.0, 0.001),
    ansur(Quantity::HipGirth, "buttockcircumference", 0.0, 0.001),
    ansur(Quantity::NeckGirth, "neckcircumference", 0.0, 0.004),
    ansur(Quantity::ThighGirth, "thighcircumference", 0.0, 0.008),
    ansur(Quantity::CalfGirth, "calfcircumference", 0.0, 0.004),
    ansur(Quantity::UpperArmGirth, "bicepscircumferenceflexed", -0.015, 0.012),
    ansur(Quantity::WristGirth, "wristcircumference", 0.0, 0.005),
    ansur(Quantity::ShoulderBreadth, "biacromialbreadth", 0.0, 0.005),
    ansur(Quantity::UpperArmLength, "acromionradialelength", 0.0, 0.005),
    ansur(Quantity::LowerArmLength, "radialestylionlength", 0.0, 0.005),
    ansur(Quantity::InsideLegLength, "crotchheight", 0.0, 0.004),
    ansur(Quantity::KneeHeight, "kneeheightmidpatella", 0.0, 0.006),
    ansur(Quantity::HipHeight, "buttockheight", 0.022, 0.008),
    ansur(Quantity::WaistHeight, "waistheightomphalion", 0.0, 0.006),
    ansur(Quantity::BustHeight, "chestheight", 0.0, 0.006),
    ansur(Quantity::BackNeckHeight, "cervicaleheight", 0.0, 0.006),
    ansur(Quantity::ChestDepth, "chestdepth", 0.004, 0.008),
    ansur(Quantity::WaistBreadth, "waistbreadth", 0.009, 0.006),
    ansur(Quantity::WaistDepth, "waistdepth", 0.016, 0.006),
    ansur(Quantity::HipBreadth, "hipbreadth", 0.022, 0.006),
    ansur(Quantity::HipDepth, "buttockdepth", 0.016, 0.008),
];

const fn ansur(quantity: Quantity, column: &'static str, offset: f64, tolerance: f64) -> AnsurQuantity {
    AnsurQuantity { quantity, column, offset, tolerance }
}

/// A person to solve a body for.
#[derive(Debug, Clone, PartialEq)]
pub struct Subject {
    /// Number in the survey, or the number of the draw.
    pub id: u32,
    /// Age (years).
    pub age: f64,
    /// Measurements in the order of [`ANSUR_QUANTITIES`] (m or kg), offsets added.
    pub measurements: [f64; ANSUR_QUANTITIES.len()],
}

/// Why subjects cannot be had.
#[derive(Debug, thiserror::Error)]
pub enum SubjectError {
    /// The survey lacks a column.
    #[error("ANSUR II subject {id}: no column {column:?}")]
    Column {
        /// The subject.
        id: u32,
        /// The column.
        column: &'static str,
    },
    /// There are fewer subjects than wanted.
    #[error("wanted {wanted} subjects, found {found}")]
    TooFew {
        /// How many are wanted.
        wanted: usize,
        /// How many there are.
        found: usize,
    },
    /// The committed statistics are damaged.
    #[error("ansur2_statistics.json: {0}")]
    Statistics(#[from] serde_json::Error),
    /// The committed covariance has another size than the quantities.
    #[error("ansur2_statistics.json: wanted {wanted} numbers, found {found}")]
    Size {
        /// How many numbers are wanted.
        wanted: usize,
        /// How many there are.
        found: usize,
    },
    /// The committed covariance could not be decomposed.
    #[error("ansur2_statistics.json: {0}")]
    Solve(#[from] SolveError),
}

/// The survey's subjects, in its order.
///
/// # Errors
/// When a column is missing.
pub fn ansur_subjects(table: &[modiste_io::ansur::Subject]) -> Result<Vec<Subject>, SubjectError> {
    let convert = |row: &modiste_io::ansur::Subject| {
        let mut measurements = [0.0; ANSUR_QUANTITIES.len()];
        for (slot, quantity) in measurements.iter_mut().zip(ANSUR_QUANTITIES) {
            let missing = SubjectError::Column { id: row.id, column: quantity.column };
            *slot = row.measurements.get(quantity.column).ok_or(missing)? + quantity.offset;
        }
        Ok(Subject { id: row.id, age: f64::from(row.age), measurements })
    };
    table.iter().map(convert).collect()
}

/// A random choice of `count` subjects, in the order of their numbers.
///
/// # Errors
/// When there are fewer.
pub fn choose(mut subjects: Vec<Subject>, count: usize, seed: u64) -> Result<Vec<Subject>, SubjectError> {
    if subjects.len() < count {
        return Err(SubjectError::TooFew { wanted: count, found: subjects.len() });
    }
    shuffle(&mut seeded_rng(seed), &mut subjects);
    subjects.truncate(count);
    subjects.sort_by_key(|subject| subject.id);
    Ok(subjects)
}

/// Means and covariances of one gender: of [`ANSUR_QUANTITIES`] (m, kg; the survey's own definitions) and then age.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AnsurStatistics {
    /// Names of the survey's columns, in order.
    pub columns: Vec<String>,
    /// How many people were measured.
    pub count: usize,
    /// Means (m, kg, years).
    pub means: Vec<f64>,
    /// Covariance, row by row.
    pub covariance: Vec<f64>,
}

/// The committed figures of both genders with where they come from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct CommittedStatistics {
    source: String,
    command: String,
    female: AnsurStatistics,
    male: AnsurStatistics,
}

const SOURCE: &str = "ANSUR II, 2012 Anthropometric Survey of U.S. Army Personnel: Methods and Summary Statistics (Gordon et al. 2014, NATICK/TR-15/007); computed from the public CSV files; metres, kilograms, years";
const COMMAND: &str =
    "cargo run --release -p modiste-body --example ansur_statistics > crates/modiste-body/data/ansur2_statistics.json";

impl AnsurStatistics {
    /// The figures that are committed with this crate, computed from the public ANSUR II files.
    ///
    /// # Errors
    /// When they are damaged.
    pub fn committed(gender: Gender) -> Result<Self, SubjectError> {
        let all: CommittedStatistics = serde_json::from_str(include_str!("../../data/ansur2_statistics.json"))?;
        let own = match gender {
            Gender::Female => all.female,
            Gender::Male => all.male,
        };
        let size = ANSUR_QUANTITIES.len() + 1;
        if own.means.len() != size || own.covariance.len() != size * size {
            return Err(SubjectError::Size { wanted: size * size, found: own.covariance.len() });
        }
        Ok(own)
    }

    /// The text of the committed file: these figures (six digits) with where they come from.
    ///
    /// # Errors
    /// When a figure is not a number.
    pub fn committed_text(female: &Self, male: &Self) -> Result<String, SubjectError> {
        let rounded = |values: &[f64]| -> Vec<f64> {
            values.iter().map(|value| format!("{value:.5e}").parse().unwrap_or(*value)).collect()
        };
        let short =
            |own: &Self| Self { means: rounded(&own.means), covariance: rounded(&own.covariance), ..own.clone() };
        let all = CommittedStatistics {
            source: SOURCE.to_owned(),
            command: COMMAND.to_owned(),
            female: short(female),
            male: short(male),
        };
        Ok(serde_json::to_string(&all)?)
    }

    /// Computes the figures from the survey.
    ///
    /// # Errors
    /// When a column is missing or there is nobody.
    pub fn of(table: &[modiste_io::ansur::Subject]) -> Result<Self, SubjectError> {
        let subjects = ansur_subjects(table)?;
        if subjects.len() < 2 {
            return Err(SubjectError::TooFew { wanted: 2, found: subjects.len() });
        }
        let rows: Vec<Vec<f64>> = subjects
            .iter()
            .map(|subject| {
                let own = subject.measurements.iter().zip(ANSUR_QUANTITIES).map(|(value, q)| value - q.offset);
                own.chain([subject.age]).collect()
            })
            .collect();
        let size = ANSUR_QUANTITIES.len() + 1;
        let means: Vec<f64> =
            (0..size).map(|j| rows.iter().map(|row| row[j]).sum::<f64>() / rows.len() as f64).collect();
        let mut covariance = vec![0.0; size * size];
        for row in &rows {
            for i in 0..size {
                for j in 0..size {
                    covariance[i * size + j] += (row[i] - means[i]) * (row[j] - means[j]) / (rows.len() - 1) as f64;
                }
            }
        }
        let columns = ANSUR_QUANTITIES.iter().map(|q| q.column.to_owned()).chain(["age".to_owned()]).collect();
        Ok(Self { columns, count: rows.len(), means, covariance })
    }

    /// Draws `count` people from the normal distribution with these figures, within 3.5 standard deviations.
    ///
    /// # Errors
    /// When the covariance cannot be decomposed.
    pub fn draw(&self, count: usize, seed: u64) -> Result<Vec<Subject>, SubjectError> {
        let size = self.means.len();
        let covariance = Matrix::from_rows(&self.covariance.chunks(size).map(<[f64]>::to_vec).collect::<Vec<_>>());
        let (values, vectors) = symmetric_eigen(&covariance)?;
        let mut rng = seeded_rng(seed);
        let mut one = |id: u32| {
            let draws: Vec<f64> = values.iter().map(|value| value.max(0.0).sqrt() * bounded_normal(&mut rng)).collect();
            let value = |i: usize| self.means[i] + (0..size).map(|j| vectors[(i, j)] * draws[j]).sum::<f64>();
            let mut measurements = [0.0; ANSUR_QUANTITIES.len()];
            for (i, quantity) in ANSUR_QUANTITIES.iter().enumerate() {
                measurements[i] = value(i) + quantity.offset;
            }
            Subject { id, age: value(size - 1).clamp(17.0, 65.0), measurements }
        };
        Ok((0..count as u32).map(&mut one).collect())
    }
}

/// A standard normal number within ±3.5.
pub(super) fn bounded_normal(rng: &mut Rng) -> f64 {
    loop {
        let draw = normal(rng);
        if draw.abs() <= 3.5 {
            return draw;
        }
    }
}

/// Marks a share of `count` subjects as held out, at random.
pub(super) fn held_out(count: usize, share: f64, seed: u64) -> Vec<bool> {
    let mut rng = seeded_rng(seed ^ 0x4845_4c44);
    let mut held = vec![false; count];
    let wanted = (share * count as f64).round() as usize;
    let mut done = 0;
    while done < wanted.min(count) {
        let index = below(&mut rng, count);
        if !held[index] {
            held[index] = true;
            done += 1;
        }
    }
    held
}

#[cfg(test)]
mod tests {
    use super::{ANSUR_QUANTITIES, AnsurStatistics, held_out};
    use crate::Gender;

    #[test]
    fn drawn_people_have_the_committed_means_and_correlations() {
        for gender in Gender::ALL {
            let statistics = AnsurStatistics::committed(gender).expect("committed figures");
            let people = statistics.draw(4000, 7).expect("covariance");
            let size = statistics.means.len();
            for (i, quantity) in ANSUR_QUANTITIES.iter().enumerate() {
                let mean = people.iter().map(|p| p.measurements[i] - quantity.offset).sum::<f64>() / 4000.0;
                let std_dev = statistics.covariance[i * size + i].sqrt();
                // Five standard errors of the mean of 4,000.
                assert!((mean - statistics.means[i]).abs() < 5.0 * std_dev / 4000_f64.sqrt(), "{}", quantity.column);
            }
            assert_eq!(people, statistics.draw(4000, 7).expect("covariance"));
        }
    }

    #[test]
    fn committed_figures_are_those_of_the_survey() {
        let folder = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/bodies"));
        if !folder.exists() {
            eprintln!("skipped: {} is absent", folder.display());
            return;
        }
        for gender in Gender::ALL {
            let table =
                modiste_io::ansur::read(folder.join(format!("ansur2_{}.csv.gz", gender.name()))).expect("survey");
            let (computed, committed) =
                (AnsurStatistics::of(&table).expect("columns"), AnsurStatistics::committed(gender).expect("figures"));
            assert_eq!((computed.count, &computed.columns), (committed.count, &committed.columns));
            let pairs = computed
                .means
                .iter()
                .zip(&committed.means)
                .chain(computed.covariance.iter().zip(&committed.covariance));
            for (a, b) in pairs {
                assert!((a - b).abs() <= 1e-5 * a.abs(), "{a} {b}");
            }
        }
    }

    #[test]
    fn a_fifth_is_held_out_the_same_way_each_time() {
        let held = held_out(1000, 0.2, 3);
        assert_eq!(held.iter().filter(|&&held| held).count(), 200);
        assert_eq!(held, held_out(1000, 0.2, 3));
        assert_ne!(held, held_out(1000, 0.2, 4));
    }
}
