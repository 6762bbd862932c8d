//! A training set on disk: one file per sequence for the body, one per sequence and cell for the hair, resumable.

use std::path::{Path, PathBuf};

use modiste_body::Body;
use modiste_core::{Progress, Vec3};
use modiste_io::model::{Header, ModelFile, Writer};
use serde::{Deserialize, Serialize};

use super::cells::Cell;
use super::sequences::Sequence;
use crate::canonical::{BustTrack, Frame};
use crate::groom::{Groom, Style};
use crate::rod::{FULL_WIND, Material, Simulation, SimulationOptions, Wind};
use crate::{HairError, POINTS};

/// Kinds of the files.
const BODY_KIND: &str = "hair-training-body";
const HAIR_KIND: &str = "hair-training";
/// Positions are stored as multiples of this (m).
const STEP: f64 = 5e-5;
/// Time (s) that hair hangs in the first pose until it is at rest, before a sequence is recorded.
const SETTLING: f64 = 1.6;
/// By how much longer (s) hair hangs that is simulated again, to see how far that leads.
const LONGER: f64 = 0.5;
/// Gusts relative to the mean wind.
const GUSTS: f64 = 0.35;

/// What a training set is made of.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Recipe {
    /// The style that is grown; of no account where there is a `source`.
    pub style: Style,
    /// Number of guides, N_g.
    pub guides: usize,
    /// Seed of roots, scatter, made motions and gusts.
    pub seed: u64,
    /// The combinations that are simulated.
    pub cells: Vec<Cell>,
    /// Name of the file that the guides were read from, without its ending, if they were not grown.
    pub source: Option<String>,
}

/// One sequence of a training set.
#[derive(Debug, Clone, PartialEq)]
pub struct Recorded {
    /// Name of the sequence.
    pub name: String,
    /// Whether nothing is learned from it.
    pub held_out: bool,
    /// Where the bust is in each frame.
    pub frames: Vec<Frame>,
    /// Tracked vertices of the bust in canonical space, one run of numbers per frame (m).
    pub bust: Vec<f32>,
}

impl Recorded {
    /// Where the bust is and its tracked vertices in canonical space (m), frame by frame.
    pub fn busts(&self) -> impl Iterator<Item = (Frame, Vec<Vec3>)> {
        let numbers = self.bust.chunks_exact((self.bust.len() / self.frames.len().max(1)).max(1));
        let points =
            |bust: &[f32]| bust.as_chunks::<3>().0.iter().map(|p| Vec3::from_array(p.map(f64::from))).collect();
        self.frames.iter().zip(numbers).map(move |(frame, bust)| (*frame, points(bust)))
    }
}

/// A folder of sequences.
#[derive(Debug, Clone)]
pub struct TrainingFolder {
    root: PathBuf,
    recipe: Recipe,
}

impl TrainingFolder {
    /// Opens the folder or starts it.
    ///
    /// # Errors
    /// A folder that holds a training set of another recipe.
    pub fn open(root: impl Into<PathBuf>, recipe: Recipe) -> Result<Self, HairError> {
        let root = root.into();
        let manifest = root.join("manifest.json");
        if modiste_io::exists(&manifest) {
            let found: Recipe = modiste_io::json::read(&manifest)?;
            if found != recipe {
                return Err(HairError::data(
                    manifest.display(),
                    "the training set that is asked for",
                    "another; name another folder or remove this one",
                ));
            }
        } else {
            modiste_io::create_folder(&root)?;
            modiste_io::json::write(&manifest, &recipe)?;
        }
        Ok(Self { root, recipe })
    }

    /// What it is made of.
    pub fn recipe(&self) -> &Recipe {
        &self.recipe
    }

    /// Simulates what is not there yet; `grooms` are those of the cells.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn simulate(
        &self,
        body: &Body,
        grooms: &[Groom],
        sequences: &[Sequence],
        progress: &dyn Progress,
    ) -> Result<(), HairError> {
        const STAGE: &str = "simulate";
        let track = BustTrack::reference(body)?;
        progress.start(STAGE, sequences.len() * self.recipe.cells.len());
        let mut done = 0;
        // Hair in still air first: a run that is stopped early leaves a set that can be used without its winds.
        for (windy, sequence) in
            [false, true].into_iter().flat_map(|windy| sequences.iter().map(move |each| (windy, each)))
        {
            let wanted = (0..self.recipe.cells.len()).filter(|&cell| self.recipe.cells[cell].wind.is_some() == windy);
            let (there, missing): (Vec<usize>, Vec<usize>) =
                wanted.partition(|&cell| modiste_io::exists(self.hair_file(&sequence.name, cell)));
            done += there.len();
            if !missing.is_empty() || !modiste_io::exists(self.body_file(&sequence.name)) {
                let poses = pose_all(body, sequence);
                let frames = self.write_body(&track, sequence, &poses)?;
                for cell in missing {
                    let moved = (poses.as_slice(), frames.as_slice());
                    let hair = self.simulate_cell(body, (cell, &grooms[cell]), moved, &sequence.name, SETTLING)?;
                    let shape = [poses.len(), grooms[cell].guides.points.len() * 3];
                    let mut writer = Writer::new(Header { kind: HAIR_KIND.to_owned(), ..Header::default() });
                    writer.add_i16("hair", &shape, hair);
                    writer.save(self.hair_file(&sequence.name, cell))?;
                    done += 1;
                    progress.advance(STAGE, done);
                }
            }
        }
        progress.finish(STAGE);
        Ok(())
    }

    /// Mean distance (m) of points between hair simulated through a sequence and the same hair that had hung a little longer
    /// before it began: what the simulation itself leaves open. One number for each frame.
    ///
    /// # Errors
    /// A cell that the recipe does not have, or a groom that cannot be simulated.
    pub fn repeat(
        &self,
        body: &Body,
        (cell, groom): (usize, &Groom),
        sequence: &Sequence,
    ) -> Result<Vec<f64>, HairError> {
        if cell >= self.recipe.cells.len() {
            let wanted = format!("one of {}, counted from 0", self.recipe.cells.len());
            return Err(HairError::data("cell of the training set", wanted, cell));
        }
        let poses = pose_all(body, sequence);
        let track = BustTrack::reference(body)?;
        let frames = sequence.motion.frames.iter().zip(&poses);
        let frames: Vec<Frame> = frames.map(|(pose, vertices)| track.canonical(vertices, pose).0).collect();
        let hair = |settling: f64| self.simulate_cell(body, (cell, groom), (&poses, &frames), &sequence.name, settling);
        let (first, second) = (hair(SETTLING)?, hair(SETTLING + LONGER)?);
        let per_frame = 3 * groom.guides.points.len();
        let distance = |(a, b): (&[i16], &[i16])| {
            let squares = |(a, b): (&[i16], &[i16])| {
                a.iter().zip(b).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum::<f64>()
            };
            let sum: f64 = a.chunks_exact(3).zip(b.chunks_exact(3)).map(|pair| squares(pair).sqrt()).sum();
            STEP * sum / groom.guides.points.len() as f64
        };
        Ok(first.chunks_exact(per_frame).zip(second.chunks_exact(per_frame)).map(distance).collect())
    }

    fn simulate_cell(
        &self,
        body: &Body,
        (cell, groom): (usize, &Groom),
        (poses, frames): (&[Vec<Vec3>], &[Frame]),
        sequence: &str,
        settling: f64,
    ) -> Result<Vec<i16>, HairError> {
        let cell = &self.recipe.cells[cell];
        let material = Material::of_softness(cell.softness)?;
        let mut simulation = Simulation::new(body, &poses[0], groom, material, SimulationOptions::default())?;
        // Other gusts in each sequence, the same whichever others there are.
        let gusts =
            sequence.bytes().fold(self.recipe.seed, |seed, byte| seed.wrapping_mul(7919).wrapping_add(byte.into()));
        // The wind blows from the same side of the person however they turn, as the model sees the world (eq. 15).
        let wind = |frame: &Frame| match cell.wind {
            Some(wind) => Wind::new(frame.rotation() * (FULL_WIND * wind.vector()), GUSTS, gusts),
            None => Wind::still(),
        };
        for _ in 0..(settling * SimulationOptions::default().fps) as usize {
            simulation.step(&poses[0], &wind(&frames[0]));
        }
        let mut hair = Vec::with_capacity(poses.len() * groom.guides.points.len() * 3);
        for (vertices, frame) in poses.iter().zip(frames) {
            simulation.step(vertices, &wind(frame));
            for point in simulation.positions() {
                let canonical = frame.to_canonical(point) / STEP;
                hair.extend(canonical.to_array().map(|x| x.round().clamp(-32767.0, 32767.0) as i16));
            }
        }
        Ok(hair)
    }

    fn write_body(&self, track: &BustTrack, sequence: &Sequence, poses: &[Vec<Vec3>]) -> Result<Vec<Frame>, HairError> {
        let mut frames = Vec::with_capacity(poses.len());
        let mut bust: Vec<f32> = Vec::new();
        for (vertices, pose) in poses.iter().zip(&sequence.motion.frames) {
            let (frame, points) = track.canonical(vertices, pose);
            frames.push(frame);
            bust.extend(points.iter().flat_map(|point| point.to_array()).map(|x| x as f32));
        }
        let numbers: Vec<f64> =
            frames.iter().flat_map(|f| [f.position.x, f.position.y, f.position.z, f.heading]).collect();
        let mut header = Header { kind: BODY_KIND.to_owned(), ..Header::default() };
        header.dimensions.insert("frames".to_owned(), frames.len());
        header.dimensions.insert("bust".to_owned(), track.vertices().len());
        header.dimensions.insert("held_out".to_owned(), usize::from(sequence.held_out));
        let mut writer = Writer::new(header);
        writer.add_f64("frames", &[frames.len(), 4], numbers);
        writer.add_f32("bust", &[frames.len(), 3 * track.vertices().len()], bust);
        writer.save(self.body_file(&sequence.name))?;
        Ok(frames)
    }

    /// The bust of a sequence.
    ///
    /// # Errors
    /// A file that is absent or damaged.
    pub fn body(&self, name: &str) -> Result<Recorded, HairError> {
        let file = ModelFile::read(self.body_file(name), BODY_KIND)?;
        let (count, bust) = (file.dimension("frames")?, file.dimension("bust")?);
        let numbers = file.f64("frames", &[count, 4])?;
        let frames =
            numbers.chunks_exact(4).map(|f| Frame { position: Vec3::new(f[0], f[1], f[2]), heading: f[3] }).collect();
        let bust = file.f32("bust", &[count, 3 * bust])?;
        Ok(Recorded { name: name.to_owned(), held_out: file.dimension("held_out")? > 0, frames, bust })
    }

    /// The hair of a sequence in canonical space: one run of `3 * POINTS * guides` numbers per frame (m).
    ///
    /// # Errors
    /// A file that is absent or damaged.
    pub fn hair(&self, name: &str, cell: usize, frames: usize) -> Result<Vec<f32>, HairError> {
        let file = ModelFile::read(self.hair_file(name, cell), HAIR_KIND)?;
        let steps = file.i16("hair", &[frames, 3 * POINTS * self.recipe.guides])?;
        Ok(steps.into_iter().map(|value| f32::from(value) * STEP as f32).collect())
    }

    fn body_file(&self, name: &str) -> PathBuf {
        self.root.join(format!("{name}.body.safetensors"))
    }

    fn hair_file(&self, name: &str, cell: usize) -> PathBuf {
        self.root.join(format!("{name}.{}.safetensors", self.recipe.cells[cell].name()))
    }

    /// The folder.
    pub fn root(&self) -> &Path {
        &self.root
    }
}

fn pose_all(body: &Body, sequence: &Sequence) -> Vec<Vec<Vec3>> {
    let mut vertices = Vec::new();
    let frames = sequence.motion.frames.iter();
    frames
        .map(|pose| {
            body.pose(pose, &mut vertices);
            vertices.clone()
        })
        .collect()
}
