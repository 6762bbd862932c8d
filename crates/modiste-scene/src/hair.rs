//! Hair of a person: which style is worn, its motion, and how it is shown.

use std::sync::Arc;

use modiste_body::{Body, Pose};
use modiste_core::render::{Camera, Canvas, Strands, linear_from_srgb};
use modiste_core::{Topology, Vec3};
use modiste_garment::DrapeModel;
use modiste_hair::collision::{Penetration, penetration_exact};
use modiste_hair::model::HairModel;
use modiste_hair::training::Factors;
use modiste_hair::{Bust, FullHair, HairTimes, POINTS, Region, Surface, WornHair};
use modiste_io::IoError;
use modiste_io::animated::AnimatedMesh;
use serde::{Deserialize, Serialize};

use crate::animation::stored;
use crate::timing::summarise;
use crate::{Animation, SceneError, Summary};

/// Strands of a picture, and strips of a scene file.
const STRANDS: usize = 7000;
const STRIPS: usize = 900;
/// Their widths (m).
const STRAND_WIDTH: f64 = 0.0011;
const STRIP_WIDTH: f64 = 0.004;
/// Colour of the hair (sRGB), and how far strands differ from it.
const BROWN: [f32; 3] = [0.34, 0.20, 0.11];
const SHADES: [f32; 5] = [0.82, 1.0, 0.92, 1.12, 0.88];
/// How matt hair is in scene files.
const ROUGHNESS: f32 = 0.45;
/// Frames at the start that the times leave out.
const WARM_UP: usize = 3;

/// Hair of a style, which may change from the first frame to the last.
#[derive(Debug, Clone)]
pub struct WornStyle {
    /// The model.
    pub model: Arc<HairModel>,
    /// Factors at the first and at the last frame; evenly between.
    pub factors: [Factors; 2],
    /// Length factors of regions of the scalp that have their own.
    pub lengths: Vec<(Region, f64)>,
}

/// What the report says of hair.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HairReport {
    /// Name of the model.
    pub style: String,
    /// Number of guides.
    pub guides: usize,
    /// Time per frame (ms), collision included; absent for very short animations.
    pub milliseconds_per_frame: Option<Summary>,
    /// Points of all frames, roots left out.
    pub points: usize,
    /// Points inside head, neck, trunk or upper arms by their triangles, as stored.
    pub points_inside: usize,
    /// Depth of the deepest (mm).
    pub deepest_mm: f64,
    /// Points just behind clothing by its triangles, as stored.
    #[serde(default)]
    pub points_behind_clothes: usize,
    /// How far the furthest of them is behind (mm).
    #[serde(default)]
    pub deepest_behind_clothes_mm: f64,
}

/// Hair in motion.
#[derive(Debug, Clone)]
pub struct HairTrack {
    /// Points of all guides in world (m), `POINTS` each, in every frame.
    pub frames: Vec<Vec<[f32; 3]>>,
    /// Colour in pictures and scene files (sRGB, 0–1).
    pub colour: [f32; 3],
    /// What was measured.
    pub report: HairReport,
    strands: FullHair,
    strips: FullHair,
}

/// A mesh of thin strips.
#[derive(Debug, Clone)]
pub(crate) struct Strips {
    pub(crate) faces: Vec<[u32; 3]>,
    pub(crate) frames: Vec<Vec<[f32; 3]>>,
}

/// Writes down hair while a person moves.
#[derive(Debug)]
pub(crate) struct HairRecorder {
    worn: WornHair,
    factors: [Factors; 2],
    total: usize,
    body: Body,
    clothes: Vec<Surface>,
    bust: Bust,
    surface: Surface,
    track: Option<HairTrack>,
    times: Vec<HairTimes>,
    inside: Penetration,
    behind: Penetration,
}

impl HairRecorder {
    pub(crate) fn new(
        style: &WornStyle,
        body: &Body,
        garments: &[Arc<DrapeModel>],
        total: usize,
    ) -> Result<Self, SceneError> {
        let clothes = garments.iter().map(|model| {
            let garment = model.garment();
            Surface::sheet(&garment.topology, garment.template.clone())
        });
        let bust = Bust::new(body.model())?;
        Ok(Self {
            worn: WornHair::mixed(&style.model, body, style.factors[0], &style.lengths)?,
            factors: style.factors,
            total,
            body: body.clone(),
            clothes: clothes.collect(),
            surface: bust.surface(body.rest_vertices()),
            bust,
            track: None,
            times: Vec::new(),
            inside: Penetration::default(),
            behind: Penetration::default(),
        })
    }

    /// Hair of the next frame.
    pub(crate) fn step(
        &mut self,
        frame: usize,
        pose: &Pose,
        vertices: &[Vec3],
        garments: &[&[Vec3]],
    ) -> Result<(), SceneError> {
        if self.factors[0] != self.factors[1] {
            let part = frame as f64 / (self.total.max(2) - 1) as f64;
            self.worn.restyle(between(&self.factors, part))?;
        }
        for (cloth, x) in self.clothes.iter_mut().zip(garments) {
            cloth.set(x);
        }
        let clothes: Vec<&Surface> = self.clothes.iter().collect();
        self.times.push(self.worn.step(pose, vertices, &clothes)?);
        self.surface.set(&self.bust.gather(vertices));
        let points = stored(self.worn.points());
        let as_stored: Vec<Vec3> = points.iter().map(|p| Vec3::from_array(p.map(f64::from))).collect();
        self.inside = self.inside.join(penetration_exact(&as_stored, &self.surface));
        self.behind =
            self.clothes.iter().fold(self.behind, |behind, cloth| behind.join(penetration_exact(&as_stored, cloth)));
        match &mut self.track {
            Some(track) => track.frames.push(points),
            None => {
                let model = self.worn.model();
                let full = |count| FullHair::new(&self.body, model.roots(), self.worn.points(), count, model.seed());
                self.track = Some(HairTrack {
                    frames: vec![points],
                    colour: BROWN,
                    report: HairReport {
                        style: model.name().to_owned(),
                        guides: model.guide_count(),
                        milliseconds_per_frame: None,
                        points: 0,
                        points_inside: 0,
                        deepest_mm: 0.0,
                        points_behind_clothes: 0,
                        deepest_behind_clothes_mm: 0.0,
                    },
                    strands: full(STRANDS)?,
                    strips: full(STRIPS)?,
                });
            }
        }
        Ok(())
    }

    /// All of it; `None` when there was no frame.
    pub(crate) fn finish(self) -> Option<HairTrack> {
        let mut track = self.track?;
        track.report.milliseconds_per_frame = summarise(self.times.iter().skip(WARM_UP).map(HairTimes::total));
        track.report.points = self.inside.points;
        track.report.points_inside = self.inside.inside;
        track.report.deepest_mm = 1e3 * self.inside.deepest;
        track.report.points_behind_clothes = self.behind.inside;
        track.report.deepest_behind_clothes_mm = 1e3 * self.behind.deepest;
        Some(track)
    }
}

fn between([first, last]: &[Factors; 2], part: f64) -> Factors {
    let mix = |a: f64, b: f64| a + part * (b - a);
    Factors {
        length: mix(first.length, last.length),
        softness: mix(first.softness, last.softness),
        wind: [mix(first.wind[0], last.wind[0]), mix(first.wind[1], last.wind[1])],
    }
}

impl HairTrack {
    fn guides(&self, frame: usize) -> Vec<Vec3> {
        self.frames[frame].iter().map(|point| Vec3::from_array(point.map(f64::from))).collect()
    }

    /// Draws the full hair of a frame; `body` are the vertices of the body in it.
    pub(crate) fn draw(&self, canvas: &mut Canvas, camera: &Camera, frame: usize, topology: &Topology, body: &[Vec3]) {
        let points = self.strands.points(topology, body, &self.guides(frame));
        let colours: Vec<[f32; 3]> = (0..self.strands.count())
            .map(|strand| self.colour.map(|c| (c * SHADES[strand % SHADES.len()]).min(1.0)))
            .collect();
        let strands = Strands { points: &points, points_per_strand: POINTS, colours: &colours, width: STRAND_WIDTH };
        canvas.draw_strands(camera, &strands);
    }

    /// The hair as strips that lie flat on the head.
    ///
    /// # Errors
    /// Frames of the body that cannot be read.
    pub(crate) fn strips(&self, animation: &Animation) -> Result<Strips, IoError> {
        let each = 2 * POINTS as u32;
        let faces = (0..self.strips.count() as u32)
            .flat_map(|strip| (0..POINTS as u32 - 1).map(move |point| strip * each + 2 * point))
            .flat_map(|corner| [[corner, corner + 1, corner + 2], [corner + 1, corner + 3, corner + 2]])
            .collect();
        let body = &animation.tracks[0];
        let frames = (0..self.frames.len())
            .map(|frame| {
                let points = self.strips.points(&body.topology, &body.points(frame)?, &self.guides(frame));
                let middle = points.iter().step_by(POINTS).sum::<Vec3>() / self.strips.count().max(1) as f64;
                let corners: Vec<Vec3> = points.chunks_exact(POINTS).flat_map(|strip| edges(strip, middle)).collect();
                Ok(stored(&corners))
            })
            .collect::<Result<_, IoError>>()?;
        Ok(Strips { faces, frames })
    }

    /// The strips with their looks for a file.
    pub(crate) fn mesh<'a>(&self, strips: &'a Strips) -> AnimatedMesh<'a> {
        let [red, green, blue] = self.colour.map(|component| linear_from_srgb(component.into()) as f32);
        AnimatedMesh {
            name: "hair",
            faces: &strips.faces,
            frames: &strips.frames,
            uv: None,
            vertex_colours: None,
            colour: [red, green, blue, 1.0],
            roughness: ROUGHNESS,
            double_sided: true,
        }
    }
}

/// Both edges of a strip along a strand, across the way out from the middle of the head.
fn edges(strand: &[Vec3], middle: Vec3) -> impl Iterator<Item = Vec3> {
    let out = (strand[0] - middle).normalize_or(Vec3::Y);
    (0..strand.len()).flat_map(move |index| {
        let next = (index + 1).min(strand.len() - 1);
        let along = strand[next] - strand[next - 1];
        let width = STRIP_WIDTH * (1.0 - 0.6 * index as f64 / (strand.len() - 1) as f64);
        let side = 0.5 * width * along.cross(out).normalize_or(Vec3::X);
        [strand[index] - side, strand[index] + side]
    })
}
