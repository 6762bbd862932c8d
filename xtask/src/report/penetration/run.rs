//! One person in one outfit through one motion.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::Result;
use modiste::Assets;
use modiste_body::{Gender, ScapeModel};
use modiste_core::{TriangleBvh, normal, seeded_rng};
use modiste_garment::DrapeModel;
use modiste_garment::check::{Checker, Limits};
use modiste_garment::refine::{FitOptions, penetration};
use modiste_scene::{Dresser, Person};
use serde::{Deserialize, Serialize};

use super::JUDGED_EVERY;
use super::motions::Clip;

/// Seed of the bodies.
const SEED: u64 = 60_000;
/// Leading coefficients of which one is drawn out to ±3 standard deviations.
const DRAWN_OUT: usize = 5;

/// Who wears what and does what.
#[derive(Debug, Clone)]
pub(super) struct Who {
    pub(super) clip: Clip,
    pub(super) body: usize,
    pub(super) outfit: [&'static str; 2],
}

/// What was found in the frames of one run.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Run {
    stamp: String,
    /// Hash of the program that made it.
    pub(super) program: String,
    pub(super) motion: String,
    pub(super) body: usize,
    pub(super) outfit: String,
    pub(super) frames: usize,
    /// Vertices inside by the winding number, those pinched left out.
    pub(super) inside_vertices: usize,
    pub(super) inside_frames: usize,
    pub(super) inside_mm: f64,
    /// Those in frames that the fit has not flagged.
    pub(super) unflagged: usize,
    /// Frames in which the fit found vertices pinched.
    pub(super) pinched_frames: usize,
    /// Those and frames in which it left vertices inside.
    pub(super) flagged_frames: usize,
    /// Frames that the judge was asked about, and in how many of them what was too deep.
    pub(super) judged: usize,
    pub(super) crossing_frames: usize,
    pub(super) crossing_mm: f64,
    pub(super) layer_frames: usize,
    pub(super) layer_mm: f64,
    pub(super) itself_frames: usize,
}

impl Who {
    pub(super) fn name(&self) -> String {
        format!("{}-body{:02}-{}", self.clip.name, self.body, self.outfit.join("+"))
    }

    /// Where its result is kept.
    pub(super) fn file(&self, folder: &Path) -> PathBuf {
        folder.join(format!("{}.json", self.name()))
    }

    fn gender(&self) -> Gender {
        Gender::ALL[self.body % Gender::ALL.len()]
    }

    fn shape(&self, count: usize) -> Vec<f64> {
        let mut rng = seeded_rng(SEED + self.body as u64);
        let mut shape: Vec<f64> = (0..count).map(|_| normal(&mut rng).clamp(-3.0, 3.0)).collect();
        let turn = self.body / Gender::ALL.len();
        shape[turn % DRAWN_OUT.min(count)] = if (turn / DRAWN_OUT).is_multiple_of(2) { 3.0 } else { -3.0 };
        shape
    }
}

impl Run {
    /// A result that was kept, if it is of these models.
    pub(super) fn load(file: &Path, stamp: &str) -> Option<Self> {
        let run: Self = modiste_io::exists(file).then(|| modiste_io::json::read(file).ok()).flatten()?;
        (run.stamp == stamp).then_some(run)
    }

    pub(super) fn save(&self, file: &Path) -> Result<()> {
        Ok(modiste_io::json::write(file, self)?)
    }
}

/// Lets somebody move and looks at every frame.
pub(super) fn perform(who: &Who, stamp: &str, program: &str) -> Result<Run> {
    let assets = Assets::find()?;
    let model = ScapeModel::load(assets.body(who.gender()))?;
    let garments = who
        .outfit
        .iter()
        .map(|name| Ok(Arc::new(DrapeModel::load(assets.garment(who.gender(), name)?)?)))
        .collect::<Result<Vec<_>>>()?;
    let person = Person::new(model.body(&who.shape(model.shape_count()))?, garments)?;
    let motion = who.clip.motion(person.body())?;
    let mut dresser = Dresser::new(&person, &FitOptions::default())?;
    let topology = model.topology();
    let mut tree = TriangleBvh::new(topology, dresser.body_vertices());
    let topologies = (0..dresser.garment_count()).map(|layer| dresser.garment(layer).garment().topology.clone());
    let meshes: Vec<_> = std::iter::once(topology.clone()).chain(topologies).collect();
    let limits = Limits::default();
    let mut checker = None;
    let mut run = Run {
        stamp: stamp.to_owned(),
        program: program.to_owned(),
        motion: who.clip.name.clone(),
        body: who.body,
        outfit: who.outfit.join("+"),
        ..Run::default()
    };
    for (index, pose) in motion.frames.iter().enumerate() {
        let report = dresser.step(pose);
        let pinched: usize = report.layers.iter().map(|layer| layer.pinched).sum();
        let flagged = report.layers.iter().any(|layer| layer.pinched > 0 || layer.inside_after > 0);
        let body = dresser.body_vertices();
        tree.refit(body);
        let layers = 0..dresser.garment_count();
        let found = layers
            .clone()
            .map(|layer| penetration::measure_with(topology, &tree, body, dresser.vertices(layer)))
            .fold(penetration::Penetration::default(), penetration::Penetration::join);
        run.frames += 1;
        run.inside_vertices += found.count;
        run.inside_frames += usize::from(found.count > 0);
        run.inside_mm = run.inside_mm.max(1e3 * found.worst_depth);
        run.unflagged += if flagged { 0 } else { found.count };
        run.pinched_frames += usize::from(pinched > 0);
        run.flagged_frames += usize::from(flagged);
        if index % JUDGED_EVERY == JUDGED_EVERY / 2 {
            let frame: Vec<_> =
                std::iter::once(body.to_vec()).chain(layers.map(|layer| dresser.vertices(layer).to_vec())).collect();
            let checker = checker.get_or_insert_with(|| {
                let surfaces: Vec<_> = meshes.iter().cloned().zip(frame.iter().map(Vec::as_slice)).collect();
                Checker::new(&surfaces)
            });
            let found = checker.check(&frame);
            let crossing = found.garments.iter().map(|garment| 1e3 * garment.body.depth).fold(0.0, f64::max);
            let layer = found.layers.iter().map(|layer| 1e3 * layer.crossings.depth).fold(0.0, f64::max);
            let itself = found.garments.iter().map(|garment| 1e3 * garment.itself.depth).fold(0.0, f64::max);
            run.judged += 1;
            run.crossing_frames += usize::from(crossing > limits.crossing_mm);
            run.layer_frames += usize::from(layer > limits.crossing_mm);
            run.itself_frames += usize::from(itself > limits.itself_mm);
            (run.crossing_mm, run.layer_mm) = (run.crossing_mm.max(crossing), run.layer_mm.max(layer));
        }
    }
    Ok(run)
}
