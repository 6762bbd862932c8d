//! The bodies and motions that garments are tried on: none of them was trained on.

use anyhow::{Context, Result};
use modiste::{Action, Assets, Length, MotionChoice, Sources};
use modiste_body::{Body, Gender, Motion, ScapeModel};
use modiste_cloth::training_set::HELD_OUT_CLIPS;
use modiste_core::{Progress, normal, seeded_rng};
use modiste_garment::DrapeModel;
use modiste_scene::Person;
use std::sync::Arc;

/// Length of a trial (s).
const SECONDS: f64 = 3.0;
/// Seed of the bodies.
const SEED: u64 = 35;
/// The coefficient that is drawn out to the rim in each trial, and its value (standard deviations).
const EXTREMES: [(usize, f64); 6] = [(0, 3.0), (1, -3.0), (0, -3.0), (1, 3.0), (2, 3.0), (3, -3.0)];

/// One person about to move.
pub(crate) struct Trial {
    /// What the tables call it.
    pub(crate) name: String,
    pub(crate) person: Person,
    pub(crate) motion: Motion,
}

/// Six motions on six bodies of each gender, with one leading coefficient at ±3 and the others as in the population.
pub(crate) fn trials(progress: &dyn Progress) -> Result<Vec<Trial>> {
    let mut all = Vec::new();
    for gender in Gender::ALL {
        let (model, garments) = wardrobe(gender)?;
        for (index, clip) in HELD_OUT_CLIPS.iter().map(|window| window.clip).enumerate() {
            let (coefficient, value) = EXTREMES[index];
            let shape = shape(&model, gender, index, coefficient, value);
            let body = model.body(&shape)?;
            let motion = motion(clip, &body, progress)?;
            let name = format!("{} {clip}, β{} = {value:+}", gender.name(), coefficient + 1);
            all.push(Trial { name, person: Person::new(body, garments.clone())?, motion });
        }
    }
    Ok(all)
}

/// The body model of a gender and its garments.
pub(crate) fn wardrobe(gender: Gender) -> Result<(Arc<ScapeModel>, Vec<Arc<DrapeModel>>)> {
    let assets = Assets::find()?;
    let model = ScapeModel::load(assets.body(gender))?;
    let garments = ["shorts", "tshirt"]
        .into_iter()
        .map(|name| Ok(Arc::new(DrapeModel::load(assets.garment(gender, name)?)?)))
        .collect::<Result<Vec<_>>>()?;
    Ok((model, garments))
}

fn shape(model: &ScapeModel, gender: Gender, index: usize, coefficient: usize, value: f64) -> Vec<f64> {
    let mut rng = seeded_rng(SEED + 100 * index as u64 + gender as u64);
    let mut shape: Vec<f64> = (0..model.shape_count()).map(|_| normal(&mut rng).clamp(-3.0, 3.0)).collect();
    shape[coefficient] = value;
    shape
}

/// A captured motion where the data are, otherwise an action of the same kind that the program makes itself.
fn motion(clip: &str, body: &Body, progress: &dyn Progress) -> Result<Motion> {
    let file = Sources::default().mocap().map(|folder| folder.join(format!("{clip}.bvh.gz")));
    let choice = match file.filter(|file| modiste_io::exists(file)) {
        Some(file) => MotionChoice::File(file),
        None => MotionChoice::Action(substitute(clip)),
    };
    let length = Some(Length::Seconds(SECONDS));
    choice.motion(body, length, 30.0, progress).with_context(|| format!("motion {clip}"))
}

fn substitute(clip: &str) -> Action {
    match clip.split('_').next() {
        Some("kick") => Action::Kick,
        Some("jump") => Action::Jump,
        Some("squat") => Action::Squat,
        Some("stretcharms") => Action::RaiseArms,
        _ => Action::Walk,
    }
}
