//! A body with its garments.

use std::path::Path;
use std::sync::Arc;

use modiste_body::{Body, Motion, Part, Pose};
use modiste_core::{Progress, Topology, TriangleBvh, Vec3};
use modiste_garment::refine::penetration::measure_with;
use modiste_garment::refine::{FitOptions, Penetration as FramePenetration};
use modiste_garment::{DrapeModel, LayerReport};

use crate::animation::{GarmentFit, Penetration, Store, Track};
use crate::hair::HairRecorder;
use crate::{Animation, Dresser, SceneError, Timing, WornStyle};

/// Colour of the body in pictures (sRGB).
const SKIN: [f32; 3] = [0.80, 0.63, 0.54];
/// Colours of the garments, from the innermost outwards, over and over (sRGB).
const CLOTH: [[f32; 3]; 4] = [[0.22, 0.27, 0.38], [0.75, 0.30, 0.26], [0.33, 0.52, 0.42], [0.80, 0.68, 0.36]];
/// Name of the body's track.
const BODY: &str = "body";

/// A body with its garments.
#[derive(Debug, Clone)]
pub struct Person {
    body: Body,
    garments: Vec<Arc<DrapeModel>>,
    hair: Option<WornStyle>,
}

impl Person {
    /// Dresses a body. Garments with a waist band are worn below those without; otherwise the order is kept, the innermost
    /// first.
    ///
    /// # Errors
    /// A garment that is worn twice, or was learned for bodies of the other gender.
    pub fn new(body: Body, mut garments: Vec<Arc<DrapeModel>>) -> Result<Self, SceneError> {
        for (index, model) in garments.iter().enumerate() {
            let garment = model.garment();
            if garments[..index].iter().any(|other| other.garment().name == garment.name) {
                return Err(SceneError::WornTwice { garment: garment.name.clone() });
            }
            if garment.gender != body.model().gender() {
                return Err(SceneError::OtherBody {
                    garment: garment.name.clone(),
                    garment_gender: garment.gender.name(),
                    body_gender: body.model().gender().name(),
                });
            }
        }
        garments.sort_by_key(|model| model.garment().waist_band.is_empty());
        Ok(Self { body, garments, hair: None })
    }

    /// The same person with hair.
    #[must_use]
    pub fn with_hair(self, hair: WornStyle) -> Self {
        Self { hair: Some(hair), ..self }
    }

    /// The body.
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// The garments, from the innermost outwards.
    pub fn garments(&self) -> &[Arc<DrapeModel>] {
        &self.garments
    }

    /// Frames a second at which the garments were learned, and at which motions must come; 30 without garments.
    pub fn fps(&self) -> f64 {
        self.garments.first().map_or(30.0, |model| model.fps())
    }

    /// Lets the person move, dressed; all frames are held in memory.
    ///
    /// # Errors
    /// A motion without frames or at another rate than [`Self::fps`], or a garment that does not go with the body.
    pub fn animate(
        &self,
        motion: &Motion,
        options: &FitOptions,
        progress: &dyn Progress,
    ) -> Result<Animation, SceneError> {
        self.perform(motion, options, None, progress)
    }

    /// [`Self::animate`] with the frames on disk, in files without a name in `folder`: one frame is held in memory.
    ///
    /// # Errors
    /// As [`Self::animate`], or a folder that cannot be written.
    pub fn animate_on_disk(
        &self,
        motion: &Motion,
        options: &FitOptions,
        folder: &Path,
        progress: &dyn Progress,
    ) -> Result<Animation, SceneError> {
        self.perform(motion, options, Some(folder), progress)
    }

    fn perform(
        &self,
        motion: &Motion,
        options: &FitOptions,
        folder: Option<&Path>,
        progress: &dyn Progress,
    ) -> Result<Animation, SceneError> {
        const STAGE: &str = "dress";
        if motion.frames.is_empty() {
            return Err(SceneError::NoFrames);
        }
        if (motion.fps - self.fps()).abs() > 1e-6 {
            return Err(SceneError::OtherRate { wanted: self.fps(), found: motion.fps });
        }
        let mut dresser = Dresser::new(self, options)?;
        // For the measurement of penetration, which is apart from the fit.
        let topology = self.body.model().topology();
        let mut tree = TriangleBvh::new(topology, dresser.body_vertices());
        let sizes = std::iter::once(topology.vertex_count())
            .chain(self.garments.iter().map(|model| model.garment().template.len()));
        let mut stores = sizes.map(|size| Store::new(folder, size)).collect::<Result<Vec<_>, _>>()?;
        let mut timing = Timing::default();
        let mut flags = Vec::with_capacity(motion.frames.len());
        let mut before = vec![Vec::new(); self.garments.len()];
        let mut after = before.clone();
        let hair =
            self.hair.as_ref().map(|hair| HairRecorder::new(hair, &self.body, &self.garments, motion.frames.len()));
        let mut hair = hair.transpose()?;
        progress.start(STAGE, motion.frames.len());
        for (frame, pose) in motion.frames.iter().enumerate() {
            flags.push(dresser.step(pose).layers.iter().map(LayerReport::flags).collect());
            timing.push(dresser.times());
            let body = dresser.body_vertices();
            if let Some(hair) = &mut hair {
                let layers: Vec<&[Vec3]> = (0..dresser.garment_count()).map(|layer| dresser.vertices(layer)).collect();
                hair.step(frame, pose, body, &layers)?;
            }
            tree.refit(body);
            stores[0].push(body)?;
            for (layer, store) in stores[1..].iter_mut().enumerate() {
                before[layer].push(measure_with(topology, &tree, body, dresser.predicted(layer)));
                after[layer].push(measure_with(topology, &tree, body, dresser.vertices(layer)));
                store.push(dresser.vertices(layer))?;
            }
            progress.advance(STAGE, frame + 1);
        }
        progress.finish(STAGE);
        let fits = self.fits(&before, &after);
        let (tracks, hair) = (self.tracks(stores)?, hair.and_then(HairRecorder::finish));
        Ok(Animation { fps: motion.fps, tracks, hair, headings: headings(motion), timing, fits, flags })
    }

    fn tracks(&self, stores: Vec<Store>) -> Result<Vec<Track>, SceneError> {
        let body = (BODY, self.body.model().topology(), SKIN, Vec::new());
        let garments = self.garments.iter().map(|model| model.garment()).zip(CLOTH.iter().cycle());
        let looks = std::iter::once(body).chain(
            garments.map(|(garment, &colour)| (garment.name.as_str(), &garment.topology, colour, garment.uv.clone())),
        );
        let track = |((name, topology, colour, uv), store): ((&str, &Arc<Topology>, _, _), Store)| {
            let frames = store.finish()?;
            Ok(Track { name: name.to_owned(), topology: Arc::clone(topology), frames, colour, uv })
        };
        looks.zip(stores).map(track).collect()
    }

    fn fits(&self, before: &[Vec<FramePenetration>], after: &[Vec<FramePenetration>]) -> Vec<GarmentFit> {
        let garments = self.garments.iter().map(|model| model.garment());
        garments
            .zip(before.iter().zip(after))
            .map(|(garment, (before, after))| GarmentFit {
                garment: garment.name.clone(),
                vertices: garment.template.len(),
                before: Penetration::over_frames(before),
                after: Penetration::over_frames(after),
            })
            .collect()
    }
}

/// Heading of the pelvis in every frame (rad), about Y from +Z.
fn headings(motion: &Motion) -> Vec<f64> {
    let ahead = |pose: &Pose| pose.rotation(Part::Pelvis) * Vec3::Z;
    motion.frames.iter().map(ahead).map(|ahead| ahead.x.atan2(ahead.z)).collect()
}
