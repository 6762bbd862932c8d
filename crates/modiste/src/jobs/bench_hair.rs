//! How long a frame of hair takes, beside our physics.

use std::sync::Arc;
use std::time::Instant;

use modiste_body::{Body, Gender, Motion, ScapeModel};
use modiste_core::{Progress, Vec3};
use modiste_garment::DrapeModel;
use modiste_garment::refine::FitOptions;
use modiste_hair::collision::{Penetration, penetration_exact};
use modiste_hair::model::HairModel;
use modiste_hair::rod::{Material, Simulation, SimulationOptions, Wind};
use modiste_hair::training::Factors;
use modiste_hair::{Bust, Groom, HairTimes, Style, Surface, WornHair};
use modiste_scene::{Machine, Person, Track};
use serde::Serialize;

use crate::event::Reporter;
use crate::{Action, Assets, JobError, Length, MotionChoice};

/// Times learned hair, long and soft, on a walking person, and the simulation of as many guides in the same run.
#[derive(Debug, Clone, PartialEq)]
pub struct BenchHair {
    /// Name of a model in the assets, or a file.
    pub model: String,
    /// Numbers of guides; where the model has others, guides between its own are used.
    pub guides: Vec<usize>,
    /// Numbers of threads, each measured.
    pub threads: Vec<usize>,
    /// Frames that count; a quarter as many go before them to warm up.
    pub frames: usize,
    /// Garments that are worn in rows of their own, from the inside out, beside those of the bare body.
    pub garments: Vec<String>,
}

impl Default for BenchHair {
    /// Table 6.2.
    fn default() -> Self {
        Self {
            model: "long".to_owned(),
            guides: vec![198, 962, 3980],
            threads: vec![1, 2],
            frames: 120,
            garments: ["pants", "longsleeve"].map(str::to_owned).to_vec(),
        }
    }
}

/// What a frame takes at one number of guides.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BenchHairRow {
    /// Guides.
    pub guides: usize,
    /// Points of all guides.
    pub points: usize,
    /// Whether the model was learned with so many guides; otherwise they lie between its own.
    pub learned: bool,
    /// Threads used.
    pub threads: usize,
    /// What is worn, such as `pants+longsleeve`; nothing on a bare body.
    pub garments: String,
    /// Median time to find the coefficients (ms).
    pub synthesis_ms: f64,
    /// Median time of collision, the exact pass included (ms).
    pub collision_ms: f64,
    /// Median time to make the points (ms).
    pub reconstruction_ms: f64,
    /// Median time of a whole frame (ms).
    pub total_ms_p50: f64,
    /// 95% of the frames took less (ms).
    pub total_ms_p95: f64,
    /// Median time of a frame of our physics with as many guides (ms).
    pub physics_ms: f64,
    /// Points inside the body afterwards, by exact test, as a part of all.
    pub inside: f64,
    /// Depth of the deepest (mm).
    pub deepest_mm: f64,
    /// Points behind clothing, as a part of all.
    pub behind: f64,
    /// How far behind it the furthest is (mm).
    pub deepest_behind_mm: f64,
}

/// What benchmarking gives back.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BenchedHair {
    /// The machine.
    pub machine: Machine,
    /// One row for each number of guides and threads.
    pub rows: Vec<BenchHairRow>,
}

/// Frames of physics that count, and those before them.
const PHYSICS: [usize; 2] = [12, 4];

impl BenchHair {
    pub(crate) fn run(&self, reporter: &Reporter<'_>) -> Result<BenchedHair, JobError> {
        const STAGE: &str = "bench";
        let assets = Assets::find()?;
        let file = assets.hair(&self.model)?;
        let model = HairModel::load(&file)?;
        let body = ScapeModel::load(assets.body(Gender::Female))?.body(&[])?;
        let warm_up = self.frames.div_ceil(4);
        let length = Some(Length::Frames(self.frames + warm_up));
        let motion = MotionChoice::Action(Action::Walk).motion(&body, length, model.fps(), reporter)?;
        let clothes = self.clothes(&assets, &body, &motion, reporter)?;
        let outfits: &[&[Track]] = if clothes.is_empty() { &[&[]] } else { &[&[], &clothes] };
        reporter.start(STAGE, self.guides.len() * self.threads.len() * outfits.len());
        let mut rows = Vec::new();
        for &guides in &self.guides {
            let learned = guides == model.guide_count();
            for clothes in outfits {
                for &threads in &self.threads {
                    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
                    let pool =
                        pool.map_err(|error| JobError::Threads { wanted: threads, reason: error.to_string() })?;
                    let hair = if learned { HairModel::load(&file)? } else { model.densified(&body, guides)? };
                    let wearer = Wearer { body: &body, clothes, motion: &motion, warm_up };
                    let row = pool.install(|| wearer.row(hair, learned))?;
                    rows.push(row);
                    reporter.advance(STAGE, rows.len());
                }
            }
        }
        reporter.finish(STAGE);
        Ok(BenchedHair { machine: Machine::this(), rows })
    }

    /// The garments through the motion.
    fn clothes(
        &self,
        assets: &Assets,
        body: &Body,
        motion: &Motion,
        reporter: &Reporter<'_>,
    ) -> Result<Vec<Track>, JobError> {
        if self.garments.is_empty() {
            return Ok(Vec::new());
        }
        let load = |name: &String| Ok(Arc::new(DrapeModel::load(assets.garment(Gender::Female, name)?)?));
        let garments = self.garments.iter().map(load).collect::<Result<Vec<_>, JobError>>()?;
        let dressed = Person::new(body.clone(), garments)?.animate(motion, &FitOptions::default(), reporter)?;
        Ok(dressed.tracks.into_iter().skip(1).collect())
    }
}

/// Who wears the hair, and in what.
struct Wearer<'a> {
    body: &'a Body,
    clothes: &'a [Track],
    motion: &'a Motion,
    warm_up: usize,
}

impl Wearer<'_> {
    fn row(&self, hair: HairModel, learned: bool) -> Result<BenchHairRow, JobError> {
        let Self { body, motion, warm_up, .. } = *self;
        let hair = hair.shared();
        let mut worn = WornHair::new(&hair, body, Factors::default())?;
        let bust = Bust::new(body.model())?;
        let mut surface = bust.surface(body.rest_vertices());
        let mut clothes = self
            .clothes
            .iter()
            .map(|track| Ok(Surface::sheet(&track.topology, track.points(0)?)))
            .collect::<Result<Vec<_>, JobError>>()?;
        let mut vertices: Vec<Vec3> = Vec::new();
        let mut times: Vec<HairTimes> = Vec::new();
        let (mut inside, mut behind) = (Penetration::default(), Penetration::default());
        for (frame, pose) in motion.frames.iter().enumerate() {
            body.pose(pose, &mut vertices);
            for (cloth, track) in clothes.iter_mut().zip(self.clothes) {
                cloth.set(&track.points(frame)?);
            }
            times.push(worn.step(pose, &vertices, &clothes.iter().collect::<Vec<_>>())?);
            surface.set(&bust.gather(&vertices));
            inside = inside.join(penetration_exact(worn.points(), &surface));
            behind = clothes.iter().fold(behind, |behind, cloth| behind.join(penetration_exact(worn.points(), cloth)));
        }
        let counted = &times[warm_up.min(times.len() - 1)..];
        let sorted = |of: fn(&HairTimes) -> f64| {
            let mut values: Vec<f64> = counted.iter().map(of).collect();
            values.sort_by(f64::total_cmp);
            values
        };
        let middle = |of: fn(&HairTimes) -> f64| {
            let values = sorted(of);
            values[values.len() / 2]
        };
        let total = sorted(|t| 1e3 * t.total().as_secs_f64());
        Ok(BenchHairRow {
            guides: hair.guide_count(),
            points: hair.point_count(),
            learned,
            threads: rayon::current_num_threads(),
            garments: self.clothes.iter().map(|track| track.name.as_str()).collect::<Vec<_>>().join("+"),
            synthesis_ms: middle(|t| 1e3 * t.synthesis.as_secs_f64()),
            collision_ms: middle(|t| 1e3 * t.collision.as_secs_f64()),
            reconstruction_ms: middle(|t| 1e3 * t.reconstruction.as_secs_f64()),
            total_ms_p50: total[total.len() / 2],
            total_ms_p95: total[total.len() * 95 / 100],
            physics_ms: physics(body, hair.guide_count(), motion)?,
            inside: inside.rate(),
            deepest_mm: 1e3 * inside.deepest,
            behind: behind.rate(),
            deepest_behind_mm: 1e3 * behind.deepest,
        })
    }
}

/// Median time of a frame of the simulation (ms).
fn physics(body: &Body, guides: usize, motion: &Motion) -> Result<f64, JobError> {
    let groom = Groom::grow(body, Style::Long, 1.0, guides, 1)?;
    let mut vertices = Vec::new();
    body.pose(&motion.frames[0], &mut vertices);
    let material = Material::of_softness(1.0)?;
    let mut simulation = Simulation::new(body, &vertices, &groom, material, SimulationOptions::default())?;
    let mut times = Vec::new();
    for pose in motion.frames.iter().take(PHYSICS[0] + PHYSICS[1]) {
        body.pose(pose, &mut vertices);
        let start = Instant::now();
        simulation.step(&vertices, &Wind::still());
        times.push(1e3 * start.elapsed().as_secs_f64());
    }
    let mut counted = times.split_off(PHYSICS[1].min(times.len() - 1));
    counted.sort_by(f64::total_cmp);
    Ok(counted[counted.len() / 2])
}
