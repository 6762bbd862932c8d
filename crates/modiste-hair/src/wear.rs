//! Learned hair on a body, frame by frame: dynamics, collision, reconstruction and the last exact pass.

use std::sync::Arc;
use std::time::{Duration, Instant};

use modiste_body::{Body, Pose};
use modiste_core::{Affine3, Topology, Vec3, bounds};
use rayon::prelude::*;

use crate::canonical::BustTrack;
use crate::collision::{CollisionOptions, Subspace, solve};
use crate::finish::Finish;
use crate::model::{Dynamics, HairModel};
use crate::scalp::{Region, skull_middle};
use crate::surface::{Bust, Surface};
use crate::training::Factors;
use crate::{HairError, POINTS};

/// Distance from the skin that coefficients are moved to (m), so that the last pass finds less to do.
const MARGIN: f64 = 0.002;

/// Learned hair on one body.
#[derive(Debug)]
pub struct WornHair {
    model: Arc<HairModel>,
    topology: Arc<Topology>,
    track: BustTrack,
    styles: Vec<WornStyle>,
    bust: Bust,
    surface: Surface,
    options: CollisionOptions,
    finish: Finish,
    /// Clothes in the space of the hair.
    clothes: Vec<Surface>,
    numbers: Vec<f32>,
    /// Points in the space of the hair (m).
    still: Vec<Vec3>,
    points: Vec<Vec3>,
}

/// Guides that are worn in one style.
#[derive(Debug)]
struct WornStyle {
    guides: Vec<usize>,
    /// Their length factor, if it is their own.
    length: Option<f64>,
    dynamics: Dynamics,
    subspace: Subspace,
}

/// What a frame took, and did.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct HairTimes {
    /// Hair coefficients from the model.
    pub synthesis: Duration,
    /// Letting hair out in its coefficients, and the last exact pass.
    pub collision: Duration,
    /// Points from coefficients.
    pub reconstruction: Duration,
    /// Points inside the body as the model has them, by the loose test, among those looked at.
    pub inside_before: usize,
    /// Points that the last pass moved, and those among them that found no way out by themselves.
    pub moved: usize,
    /// See [`FinishReport::lost`](crate::FinishReport).
    pub lost: usize,
}

impl HairTimes {
    /// All stages.
    pub fn total(&self) -> Duration {
        self.synthesis + self.collision + self.reconstruction
    }
}

impl WornHair {
    /// Puts hair of a style on a body.
    ///
    /// # Errors
    /// Factors that the model cannot show, or a body that it does not fit.
    pub fn new(model: &Arc<HairModel>, body: &Body, factors: Factors) -> Result<Self, HairError> {
        Self::mixed(model, body, factors, &[])
    }

    /// The same with hair of other lengths in some regions of the scalp (fig. 6.6 e and f): the later counts where a region is
    /// named twice.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn mixed(
        model: &Arc<HairModel>,
        body: &Body,
        factors: Factors,
        lengths: &[(Region, f64)],
    ) -> Result<Self, HairError> {
        let faces = body.model().topology().face_count();
        if let Some(root) = model.roots().iter().find(|root| root.face as usize >= faces) {
            return Err(HairError::data("root of a guide", format!("one of {faces} faces of the body"), root.face));
        }
        let options = CollisionOptions { margin: MARGIN, ..CollisionOptions::for_guides(model.guide_count()) };
        let (topology, middle) = (body.model().topology(), skull_middle(body));
        let length = |guide: usize| {
            let region = Region::of(model.roots()[guide].position(topology, body.rest_vertices()) - middle);
            lengths.iter().rev().find(|(named, _)| *named == region).map(|(_, length)| *length)
        };
        let own: Vec<Option<f64>> = (0..model.guide_count()).map(length).collect();
        let mut styles = Vec::new();
        for length in std::iter::once(None).chain(lengths.iter().map(|(_, length)| Some(*length))) {
            let guides: Vec<usize> = (0..own.len()).filter(|&guide| own[guide] == length).collect();
            if guides.is_empty() || styles.iter().any(|style: &WornStyle| style.length == length) {
                continue;
            }
            let looked_at = || guides.iter().step_by(options.every.max(1)).map(|guide| guide * POINTS);
            let points = looked_at().flat_map(|root| root + 1..root + POINTS).collect();
            styles.push(WornStyle {
                dynamics: Dynamics::new(model, of_length(factors, length))?,
                subspace: Subspace::new(model.mean(), model.basis(), points, looked_at().collect())?,
                guides,
                length,
            });
        }
        let bust = Bust::new(body.model())?;
        Ok(Self {
            topology: Arc::clone(topology),
            track: model.track(body)?,
            styles,
            surface: bust.surface(body.rest_vertices()),
            bust,
            options,
            finish: Finish::new(),
            clothes: Vec::new(),
            numbers: vec![0.0; 3 * model.point_count()],
            points: vec![Vec3::ZERO; model.point_count()],
            still: vec![Vec3::ZERO; model.point_count()],
            model: Arc::clone(model),
        })
    }

    /// The model.
    pub fn model(&self) -> &Arc<HairModel> {
        &self.model
    }

    /// Changes the style from the next frame on; regions keep lengths of their own.
    ///
    /// # Errors
    /// Factors that the model cannot show.
    pub fn restyle(&mut self, factors: Factors) -> Result<(), HairError> {
        for style in &mut self.styles {
            style.dynamics.restyle(&self.model, of_length(factors, style.length))?;
        }
        Ok(())
    }

    /// Hair of the next frame; `vertices` are those of the body in `pose` (m), `clothes` lie in world over it.
    ///
    /// # Errors
    /// Numbers that are not finite.
    pub fn step(&mut self, pose: &Pose, vertices: &[Vec3], clothes: &[&Surface]) -> Result<HairTimes, HairError> {
        let mut times = HairTimes::default();
        let start = Instant::now();
        let (frame, canonical) = self.track.canonical(vertices, pose);
        let bust = self.model.bust_state(frame, canonical);
        let predicted: Vec<Vec<f64>> =
            self.styles.iter_mut().map(|style| style.dynamics.step(&bust).to_vec()).collect();
        times.synthesis = start.elapsed();

        let start = Instant::now();
        let world_from_hair = bust.world_from_hair();
        let hair_from_world = world_from_hair.inverse();
        let into_hair = |p: Vec3| hair_from_world.transform_point3(p);
        let x: Vec<Vec3> = self.bust.vertices().iter().map(|&v| into_hair(vertices[v as usize])).collect();
        self.surface.set(&x);
        let topology = &self.topology;
        let roots: Vec<Vec3> =
            self.model.roots().iter().map(|root| into_hair(root.position(topology, vertices))).collect();
        let looked_at: Vec<Vec<Vec3>> =
            self.styles.iter().zip(&predicted).map(|(style, y0)| style.subspace.positions(y0)).collect();
        self.finish.look_around(&self.surface, bounds(&looked_at.concat()).unwrap_or_default());
        // What lies in free space does not come inside by the little that the rest is moved.
        let cells = self.finish.skin();
        let mut solved = Vec::with_capacity(self.styles.len());
        for ((style, y0), positions) in self.styles.iter().zip(&predicted).zip(&looked_at) {
            let pairs = style.subspace.nearest_vertices(positions, &self.surface, |p| cells.face_near(p));
            let wanted: Vec<Vec3> = style.subspace.roots().iter().map(|&point| roots[point / POINTS]).collect();
            let mut report = solve(&style.subspace, y0, &pairs, &wanted, &self.options)?;
            times.inside_before += report.inside.first().copied().unwrap_or(0);
            solved.push(report.rounds.pop().unwrap_or_else(|| y0.clone()));
        }
        times.collision = start.elapsed();

        let start = Instant::now();
        for (style, y) in self.styles.iter().zip(&solved) {
            self.model.expansion().expand(y, &mut self.numbers);
            place(&mut self.still, &self.numbers, &roots, (self.styles.len() > 1).then_some(&style.guides));
        }
        times.reconstruction = start.elapsed();

        let start = Instant::now();
        self.carry_clothes(clothes, &hair_from_world);
        let clothes: Vec<&Surface> = self.clothes.iter().collect();
        let report = self.finish.apply_there(&mut self.still, &self.surface, &clothes);
        (times.moved, times.lost) = (report.moved, report.lost);
        self.points
            .par_iter_mut()
            .zip(&self.still)
            .with_min_len(1024)
            .for_each(|(world, point)| *world = world_from_hair.transform_point3(*point));
        times.collision += start.elapsed();
        Ok(times)
    }

    /// Points of all guides in world (m), `POINTS` each.
    pub fn points(&self) -> &[Vec3] {
        &self.points
    }

    fn carry_clothes(&mut self, clothes: &[&Surface], hair_from_world: &Affine3) {
        let same = self.clothes.len() == clothes.len()
            && self.clothes.iter().zip(clothes).all(|(a, b)| Arc::ptr_eq(a.topology(), b.topology()));
        if !same {
            self.clothes = clothes.iter().map(|&cloth| cloth.clone()).collect();
        }
        for (own, cloth) in self.clothes.iter_mut().zip(clothes) {
            let x: Vec<Vec3> = cloth.vertices().iter().map(|&p| hair_from_world.transform_point3(p)).collect();
            own.set(&x);
        }
    }
}

fn of_length(factors: Factors, length: Option<f64>) -> Factors {
    Factors { length: length.unwrap_or(factors.length), ..factors }
}

/// Guides from numbers, all or some. The components lose a little of the roots, and heads differ: each guide starts where its
/// root is.
fn place(points: &mut [Vec3], numbers: &[f32], roots: &[Vec3], some: Option<&Vec<usize>>) {
    let one = |points: &mut [Vec3], numbers: &[f32], root: Vec3| {
        let at = |i: usize| Vec3::new(f64::from(numbers[i]), f64::from(numbers[i + 1]), f64::from(numbers[i + 2]));
        let off = root - at(0);
        for (index, point) in points.iter_mut().enumerate() {
            *point = at(3 * index) + off;
        }
    };
    match some {
        None => points
            .par_chunks_mut(POINTS)
            .zip(numbers.par_chunks(3 * POINTS))
            .zip(roots)
            .with_min_len(64)
            .for_each(|((points, numbers), root)| one(points, numbers, *root)),
        Some(guides) => {
            for &guide in guides {
                let first = guide * POINTS;
                one(&mut points[first..first + POINTS], &numbers[3 * first..3 * (first + POINTS)], roots[guide]);
            }
        }
    }
}
