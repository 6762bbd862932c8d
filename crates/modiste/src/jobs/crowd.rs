//! A crowd: random bodies in random clothes with random motions (DRAPE fig. 10).

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use modiste_body::{Gender, ScapeModel};
use modiste_core::{Progress, Rng, below, normal, seeded_rng, uniform};
use modiste_garment::refine::FitOptions;
use modiste_garment::{DrapeModel, Outfit};
use modiste_io::{StagedFolder, create_folder, png, usd};
use modiste_scene::{CrowdPicture, Format, GarmentFit, Machine, Memory, Person, Place, SceneError, scatter};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::motion_choice::{Action, Length};
use crate::event::Reporter;
use crate::limits::check_range;
use crate::{Assets, JobError, MotionChoice};

/// Most people that are made in one go.
const MOST: usize = 10_000;
/// Shape coefficients stay within this many standard deviations.
const FURTHEST: f64 = 2.0;
/// Outfits that are held at once to measure what one takes.
const MEASURED_OUTFITS: usize = 4;
/// Schema of the report.
const SCHEMA: &str = "modiste-crowd-1";
/// Names of files.
const PICTURE: &str = "crowd.png";
const REPORT: &str = "report.json";
const LAYER: &str = "crowd.usda";

/// Colours of cloth (sRGB).
const COLOURS: [[f32; 3]; 10] = [
    [0.22, 0.27, 0.38],
    [0.75, 0.30, 0.26],
    [0.33, 0.52, 0.42],
    [0.80, 0.68, 0.36],
    [0.85, 0.85, 0.82],
    [0.35, 0.35, 0.37],
    [0.45, 0.33, 0.52],
    [0.30, 0.50, 0.66],
    [0.62, 0.47, 0.35],
    [0.80, 0.52, 0.48],
];
/// Colours of skin (sRGB).
const SKINS: [[f32; 3]; 5] =
    [[0.80, 0.63, 0.54], [0.88, 0.72, 0.62], [0.66, 0.47, 0.36], [0.48, 0.33, 0.25], [0.34, 0.24, 0.19]];

/// Makes many people, each in a folder of their own, standing at their place in one scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Crowd {
    /// How many.
    pub count: usize,
    /// Folder of motions (BVH, packed or not); the built-in actions when absent.
    pub motions: Option<PathBuf>,
    /// How much of its motion each shows.
    pub length: Length,
    /// Decides everything that is random.
    pub seed: u64,
    /// The forms in which each person is written.
    pub formats: Vec<Format>,
    /// The folder for the results.
    pub out: PathBuf,
}

/// One of a crowd.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Character {
    /// Their folder.
    pub folder: String,
    /// `female` or `male`.
    pub gender: String,
    /// Body shape in standard deviations, β.
    pub shape: Vec<f64>,
    /// From the innermost outwards.
    pub garments: Vec<String>,
    /// A file or a built-in action.
    pub motion: String,
    /// Where they stand.
    pub place: Place,
    /// Number of frames.
    pub frames: usize,
    /// Time to make, dress and write them (s), on one thread.
    pub seconds: f64,
    /// Vertices inside the body, before and after the fit.
    pub penetration: Vec<GarmentFit>,
}

/// `report.json` of a crowd.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CrowdReport {
    /// Version of this form.
    pub schema: String,
    /// Decides everything that is random.
    pub seed: u64,
    /// Frames per second.
    pub fps: f64,
    /// Time from loaded models to the last file (s).
    pub seconds: f64,
    /// Mean time of a character (s) on one thread: of all, of the first and of the second half, which tell whether time grows
    /// faster than the crowd.
    pub seconds_per_character: [f64; 3],
    /// People that were made at the same time.
    pub threads: usize,
    /// Memory with all models and nobody made (MB).
    pub models_mb: Option<f64>,
    /// Memory that one more person ready to move adds (MB): the state of their body and clothes, without the models.
    pub character_mb: Option<f64>,
    /// The most memory of the whole run (MB), the picture included.
    pub peak_mb: Option<f64>,
    /// The machine that it was measured on.
    pub machine: Machine,
    /// Everybody.
    pub characters: Vec<Character>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// What making a crowd gives back.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MadeCrowd {
    /// What `report.json` says.
    pub report: CrowdReport,
    /// The files and folders.
    pub files: Vec<PathBuf>,
}

impl Default for Crowd {
    /// Twenty people for two seconds.
    fn default() -> Self {
        Self {
            count: 20,
            motions: None,
            length: Length::Seconds(2.0),
            seed: 1,
            formats: vec![Format::Glb],
            out: PathBuf::from("out/crowd"),
        }
    }
}

/// The models of one gender.
struct Wardrobe {
    body: Arc<ScapeModel>,
    lower: Vec<Arc<DrapeModel>>,
    upper: Vec<Arc<DrapeModel>>,
}

/// Somebody before they are made.
struct Draft {
    gender: usize,
    shape: Vec<f64>,
    garments: Vec<Arc<DrapeModel>>,
    colours: Vec<[f32; 3]>,
    /// The motions in the order in which they are tried.
    motion: usize,
    /// Where in the motion it starts, as a share of what is left.
    start: f64,
    place: Place,
}

impl Crowd {
    pub(crate) fn run(&self, reporter: &Reporter<'_>) -> Result<MadeCrowd, JobError> {
        check_range("number of people", self.count as f64, (1.0, MOST as f64), "people")?;
        self.length.check(30.0)?;
        let motions = self.motion_choices()?;
        let wardrobes = load(&Assets::find()?, reporter)?;
        let folder = StagedFolder::new(&self.out)?;
        let drafts = self.draw(&wardrobes, motions.len());
        let models_mb = Memory::now().map(|memory| memory.resident_mb);
        let character_mb = measure_outfits(&drafts, &wardrobes)?;
        let started = Instant::now();
        const STAGE: &str = "crowd";
        reporter.start(STAGE, drafts.len());
        let done = AtomicUsize::new(0);
        let made: Vec<(Character, CrowdPicture)> = drafts
            .par_iter()
            .with_max_len(1)
            .enumerate()
            .map(|(index, draft)| {
                let made = self.make(index, draft, (&wardrobes, &motions), folder.path(), reporter);
                reporter.advance(STAGE, done.fetch_add(1, Ordering::Relaxed) + 1);
                made
            })
            .collect::<Result<_, JobError>>()?;
        reporter.finish(STAGE);
        let seconds = started.elapsed().as_secs_f64();
        let mut picture = CrowdPicture::default();
        let mut characters = Vec::with_capacity(made.len());
        for (character, part) in made {
            characters.push(character);
            picture.append(part);
        }
        let image = picture.draw();
        png::write(folder.path().join(PICTURE), image.width, image.height, &image.rgb)?;
        let fps = wardrobes[0].upper[0].fps();
        let mut files: Vec<String> = characters.iter().map(|character| character.folder.clone()).collect();
        files.push(PICTURE.to_owned());
        if self.formats.contains(&Format::Usd) {
            write_layer(&folder.path().join(LAYER), fps, &characters)?;
            files.push(LAYER.to_owned());
        }
        let report = CrowdReport {
            schema: SCHEMA.to_owned(),
            seed: self.seed,
            fps,
            seconds,
            seconds_per_character: halves(&characters),
            threads: rayon::current_num_threads(),
            models_mb,
            character_mb,
            peak_mb: Memory::now().map(|memory| memory.peak_mb),
            machine: Machine::this(),
            characters,
            warnings: reporter.warnings(),
        };
        modiste_io::json::write(folder.path().join(REPORT), &report)?;
        files.push(REPORT.to_owned());
        let target = folder.commit()?;
        let files: Vec<PathBuf> = files.into_iter().map(|name| target.join(name)).collect();
        files.iter().for_each(|file| reporter.wrote(file));
        Ok(MadeCrowd { report, files })
    }

    /// The motions to draw from.
    fn motion_choices(&self) -> Result<Vec<MotionChoice>, JobError> {
        let Some(folder) = &self.motions else {
            return Ok(Action::ALL.into_iter().map(MotionChoice::Action).collect());
        };
        let is_motion = |path: &PathBuf| {
            let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
            name.ends_with(".bvh") || name.ends_with(".bvh.gz")
        };
        let files: Vec<_> = modiste_io::list_folder(folder)?.into_iter().filter(is_motion).collect();
        if files.is_empty() {
            return Err(JobError::Request(format!("{}: wanted BVH files, found none", folder.display())));
        }
        Ok(files.into_iter().map(MotionChoice::File).collect())
    }

    /// Everybody, drawn one after the other, so that a larger crowd begins with the same people.
    fn draw(&self, wardrobes: &[Wardrobe], motions: usize) -> Vec<Draft> {
        let mut rng = seeded_rng(self.seed);
        let places = scatter(self.count, &mut seeded_rng(self.seed ^ 1));
        places.into_iter().map(|place| draft(&mut rng, wardrobes, motions, place)).collect()
    }

    fn make(
        &self,
        index: usize,
        draft: &Draft,
        (wardrobes, motions): (&[Wardrobe], &[MotionChoice]),
        folder: &Path,
        reporter: &Reporter<'_>,
    ) -> Result<(Character, CrowdPicture), JobError> {
        let started = Instant::now();
        let person = Person::new(wardrobes[draft.gender].body.body(&draft.shape)?, draft.garments.clone())?;
        let (name, motion) = self.motion(&person, draft, motions, reporter)?;
        let own = format!("{:04}", index + 1);
        let own_folder = folder.join(&own);
        create_folder(&own_folder)?;
        let quiet = modiste_core::Silent;
        let mut animation = person.animate_on_disk(&motion, &FitOptions::default(), &own_folder, &quiet)?;
        for (track, colour) in animation.tracks.iter_mut().zip(&draft.colours) {
            track.colour = *colour;
        }
        for &format in &self.formats {
            animation.write(format, &own_folder, &quiet)?;
        }
        let mut picture = CrowdPicture::default();
        picture.add(&animation)?;
        let character = Character {
            folder: own,
            gender: person.body().model().gender().name().to_owned(),
            shape: draft.shape.clone(),
            garments: person.garments().iter().map(|model| model.garment().name.clone()).collect(),
            motion: name,
            place: draft.place,
            frames: animation.frame_count(),
            seconds: started.elapsed().as_secs_f64(),
            penetration: animation.fits,
        };
        Ok((character, picture))
    }

    /// A part of the motion that was drawn, at its place. A file that cannot be used is told, and the next one taken.
    fn motion(
        &self,
        person: &Person,
        draft: &Draft,
        motions: &[MotionChoice],
        reporter: &Reporter<'_>,
    ) -> Result<(String, modiste_body::Motion), JobError> {
        let wanted = self.length.frames(person.fps());
        let mut refused = None;
        for offset in 0..motions.len() {
            let choice = &motions[(draft.motion + offset) % motions.len()];
            let length = matches!(choice, MotionChoice::Action(_)).then_some(Length::Frames(3 * wanted));
            match choice.motion(person.body(), length, person.fps(), &modiste_core::Silent) {
                Ok(whole) => {
                    let start = (draft.start * whole.frames.len().saturating_sub(wanted) as f64) as usize;
                    let mut motion = whole.slice(start..start + wanted);
                    draft.place.bring(&mut motion);
                    return Ok((choice.name(), motion));
                }
                Err(error) => {
                    reporter.warn(&format!("{} is left out: {error}", choice.name()));
                    refused = Some(error);
                }
            }
        }
        Err(refused.unwrap_or_else(|| SceneError::NoFrames.into()))
    }
}

fn draft(rng: &mut Rng, wardrobes: &[Wardrobe], motions: usize, place: Place) -> Draft {
    let gender = below(rng, wardrobes.len());
    let wardrobe = &wardrobes[gender];
    let shape = (0..wardrobe.body.shape_count()).map(|_| normal(rng).clamp(-FURTHEST, FURTHEST)).collect();
    let mut garments = Vec::new();
    for choice in [&wardrobe.lower, &wardrobe.upper] {
        if !choice.is_empty() {
            garments.push(Arc::clone(&choice[below(rng, choice.len())]));
        }
    }
    let mut colours = vec![SKINS[below(rng, SKINS.len())]];
    let first = below(rng, COLOURS.len());
    // Not the same colour twice on one person.
    colours.extend([COLOURS[first], COLOURS[(first + 1 + below(rng, COLOURS.len() - 1)) % COLOURS.len()]]);
    Draft { gender, shape, garments, colours, motion: below(rng, motions), start: uniform(rng), place }
}

/// All models that there are, with what is worn above and what below.
fn load(assets: &Assets, reporter: &Reporter<'_>) -> Result<Vec<Wardrobe>, JobError> {
    const STAGE: &str = "load";
    reporter.start(STAGE, 0);
    let mut wardrobes = Vec::new();
    for gender in Gender::ALL {
        if !modiste_io::exists(assets.body(gender)) {
            continue;
        }
        let mut wardrobe =
            Wardrobe { body: ScapeModel::load(assets.body(gender))?, lower: Vec::new(), upper: Vec::new() };
        for name in assets.garments(gender)? {
            let model = Arc::new(DrapeModel::load(assets.garment(gender, &name)?)?);
            let is_lower = !model.garment().waist_band.is_empty();
            if is_lower { wardrobe.lower.push(model) } else { wardrobe.upper.push(model) }
        }
        if !wardrobe.upper.is_empty() {
            wardrobes.push(wardrobe);
        }
    }
    reporter.finish(STAGE);
    if wardrobes.is_empty() {
        return Err(JobError::Request(format!("{} holds no garments to dress a crowd in", assets.folder().display())));
    }
    Ok(wardrobes)
}

/// Memory (MB) that one person ready to move takes beside the models: some are held at once and the process is looked at.
fn measure_outfits(drafts: &[Draft], wardrobes: &[Wardrobe]) -> Result<Option<f64>, JobError> {
    let Some(before) = Memory::now() else { return Ok(None) };
    let mut held = Vec::new();
    for draft in drafts.iter().take(MEASURED_OUTFITS) {
        let body = wardrobes[draft.gender].body.body(&draft.shape)?;
        let outfit = Outfit::new(&body, &draft.garments, &FitOptions::default())?;
        held.push((body, outfit));
    }
    let after = Memory::now().map_or(before.resident_mb, |memory| memory.resident_mb);
    Ok(Some((after - before.resident_mb) / held.len().max(1) as f64))
}

/// Mean seconds of all, of the first and of the second half.
fn halves(characters: &[Character]) -> [f64; 3] {
    let mean = |part: &[Character]| part.iter().map(|one| one.seconds).sum::<f64>() / part.len().max(1) as f64;
    let (first, second) = characters.split_at(characters.len().div_ceil(2));
    [mean(characters), mean(first), mean(if second.is_empty() { first } else { second })]
}

fn write_layer(path: &Path, fps: f64, characters: &[Character]) -> Result<(), JobError> {
    let frames = characters.iter().map(|character| character.frames).max().unwrap_or(1);
    let layer = |character: &Character| {
        let file = format!("./{}/{}", character.folder, Format::Usd.file_name());
        (format!("Person_{}", character.folder), file)
    };
    Ok(usd::write_references(path, fps, frames, &characters.iter().map(layer).collect::<Vec<_>>())?)
}
