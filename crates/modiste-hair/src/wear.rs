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
    dynamics: Dynamics,
    bust: Bust,
    surface: Surface,
    subspace: Subspace,
    options: CollisionOptions,
    finish: Finish,
    /// Clothes in the space of the hair.
    clothes: Vec<Surface>,
    numbers: Vec<f32>,
    /// Points in the space of the hair (m).
    still: Vec<Vec3>,
    points: Vec<Vec3>,
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
        let options = CollisionOptions { margin: MARGIN, ..CollisionOptions::for_guides(model.guide_count()) };
        Self::with_options(model, body, factors, options)
    }

    /// The same with other weights of collision.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_options(
        model: &Arc<HairModel>,
        body: &Body,
        factors: Factors,
        options: CollisionOptions,
    ) -> Result<Self, HairError> {
        let faces = body.model().topology().face_count();
        if let Some(root) = model.roots().iter().find(|root| root.face as usize >= faces) {
            return Err(HairError::data("root of a guide", format!("one of {faces} faces of the body"), root.face));
        }
        let looked_at: Vec<usize> = (0..model.guide_count())
            .step_by(options.every.max(1))
            .flat_map(|guide| (1..POINTS).map(move |point| guide * POINTS + point))
            .collect();
        let roots = (0..model.guide_count()).step_by(options.every.max(1)).map(|guide| guide * POINTS).collect();
        let bust = Bust::new(body.model())?;
        Ok(Self {
            topology: Arc::clone(body.model().topology()),
            track: model.track(body)?,
            dynamics: Dynamics::new(model, factors)?,
            surface: bust.surface(body.rest_vertices()),
            bust,
            subspace: Subspace::new(model.mean(), model.basis(), looked_at, roots)?,
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

    /// Changes the style from the next frame on.
    ///
    /// # Errors
    /// Factors that the model cannot show.
    pub fn restyle(&mut self, factors: Factors) -> Result<(), HairError> {
        self.dynamics.restyle(&self.model, factors)
    }

    /// Hair of the next frame; `vertices` are those of the body in `pose` (m), `clothes` lie in world over it.
    ///
    /// # Errors
    /// Numbers that are not finite.
    pub fn step(&mut self, pose: &Pose, vertices: &[Vec3], clothes: &[&Surface]) -> Result<HairTimes, HairError> {
        let mut times = HairTimes::default();
        let start = Instant::now();
        let (frame, canonical) = self.track.canonical(vertices, pose);
        let bust = self.model.bust_coefficients(&canonical);
        let y0 = self.dynamics.step(frame, &bust).to_vec();
        times.synthesis = start.elapsed();

        let start = Instant::now();
        let world_from_hair =
            Affine3::from_mat3_translation(frame.rotation(), frame.position) * self.model.space().pose(&canonical);
        let hair_from_world = world_from_hair.inverse();
        let into_hair = |p: Vec3| hair_from_world.transform_point3(p);
        let x: Vec<Vec3> = self.bust.vertices().iter().map(|&v| into_hair(vertices[v as usize])).collect();
        self.surface.set(&x);
        let topology = &self.topology;
        let roots: Vec<Vec3> =
            self.model.roots().iter().map(|root| into_hair(root.position(topology, vertices))).collect();
        let wanted: Vec<Vec3> = self.subspace.roots().iter().map(|&point| roots[point / POINTS]).collect();
        let looked_at = self.subspace.positions(&y0);
        self.finish.look_around(&self.surface, bounds(&looked_at).unwrap_or_default());
        // What lies in free space does not come inside by the little that the rest is moved.
        let cells = self.finish.skin();
        let pairs = self.subspace.nearest_vertices(&looked_at, &self.surface, |p| cells.face_near(p));
        let solved = solve(&self.subspace, &y0, &pairs, &wanted, &self.options)?;
        times.inside_before = solved.inside.first().copied().unwrap_or(0);
        let y = solved.rounds.last().unwrap_or(&y0);
        times.collision = start.elapsed();

        let start = Instant::now();
        self.model.expansion().expand(y, &mut self.numbers);
        self.still
            .par_chunks_mut(POINTS)
            .zip(self.numbers.par_chunks(3 * POINTS))
            .zip(&roots)
            .with_min_len(64)
            .for_each(|((points, numbers), root)| {
                let at =
                    |i: usize| Vec3::new(f64::from(numbers[i]), f64::from(numbers[i + 1]), f64::from(numbers[i + 2]));
                // The components lose a little of the roots, and heads differ: each guide starts where its root is.
                let off = *root - at(0);
                for (index, point) in points.iter_mut().enumerate() {
                    *point = at(3 * index) + off;
                }
            });
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
