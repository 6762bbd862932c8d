//! Learned hair on a body, frame by frame: dynamics, collision, reconstruction and the last exact pass.

use std::sync::Arc;
use std::time::{Duration, Instant};

use modiste_body::{Body, Pose};
use modiste_core::{Topology, Vec3};
use rayon::prelude::*;

use crate::canonical::{BustTrack, Frame};
use crate::collision::{CollisionOptions, Subspace, solve};
use crate::finish::Finish;
use crate::model::{Dynamics, HairModel};
use crate::surface::{Bust, Surface};
use crate::training::Factors;
use crate::{HairError, POINTS};

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
    numbers: Vec<f32>,
    canonical: Vec<Vec3>,
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
    /// Points that the last pass moved.
    pub moved: usize,
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
        Self::with_options(model, body, factors, CollisionOptions::for_guides(model.guide_count()))
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
            numbers: vec![0.0; 3 * model.point_count()],
            points: vec![Vec3::ZERO; model.point_count()],
            canonical: vec![Vec3::ZERO; model.point_count()],
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
        let x: Vec<Vec3> = self.bust.vertices().iter().map(|&v| frame.to_canonical(vertices[v as usize])).collect();
        self.surface.set(&x);
        let roots: Vec<Vec3> = self.model.roots().iter().map(|root| self.root(*root, vertices, &frame)).collect();
        let wanted: Vec<Vec3> = self.subspace.roots().iter().map(|&point| roots[point / POINTS]).collect();
        let pairs = self.subspace.correspondences(&y0, &self.surface);
        let solved = solve(&self.subspace, &y0, &pairs, &wanted, &self.options)?;
        times.inside_before = solved.inside.first().copied().unwrap_or(0);
        let y = solved.rounds.last().unwrap_or(&y0);
        times.collision = start.elapsed();

        let start = Instant::now();
        self.model.expansion().expand(y, &mut self.numbers);
        self.canonical.par_chunks_mut(POINTS).zip(self.numbers.par_chunks(3 * POINTS)).zip(&roots).for_each(
            |((points, numbers), root)| {
                let at =
                    |i: usize| Vec3::new(f64::from(numbers[i]), f64::from(numbers[i + 1]), f64::from(numbers[i + 2]));
                // The components lose a little of the roots, and heads differ: each guide starts where its root is.
                let off = *root - at(0);
                for (index, point) in points.iter_mut().enumerate() {
                    *point = at(3 * index) + off;
                }
            },
        );
        times.reconstruction = start.elapsed();

        let start = Instant::now();
        let clothes: Vec<Surface> = clothes.iter().map(|cloth| in_canonical(cloth, &frame)).collect();
        let surfaces: Vec<&Surface> = std::iter::once(&self.surface).chain(&clothes).collect();
        times.moved = self.finish.apply(&mut self.canonical, &surfaces).moved;
        let canonical = &self.canonical;
        self.points.par_iter_mut().zip(canonical).for_each(|(world, point)| *world = frame.to_world(*point));
        times.collision += start.elapsed();
        Ok(times)
    }

    /// Points of all guides in world (m), `POINTS` each.
    pub fn points(&self) -> &[Vec3] {
        &self.points
    }

    fn root(&self, root: crate::Root, vertices: &[Vec3], frame: &Frame) -> Vec3 {
        frame.to_canonical(root.position(&self.topology, vertices))
    }
}

fn in_canonical(surface: &Surface, frame: &Frame) -> Surface {
    let mut moved = surface.clone();
    let x: Vec<Vec3> = surface.vertices().iter().map(|&p| frame.to_canonical(p)).collect();
    moved.set(&x);
    moved
}
