//! One frame of cloth.

use super::conjugate_gradients::ConjugateGradients;
use super::matrix::{Stencil, SystemMatrix};
use super::{SolverOptions, StepReport};
use crate::contact::{BodyCollider, BodyContacts, BumpContacts, ContactLaw, FaceTree, SelfContacts};
use crate::energy::{LaneLaw, MembraneLanes, Spring, spring_force};
use crate::error::{ClothError, check_count};
use crate::model::ClothModel;
use crate::state::ClothState;
use glam::{Mat3A, Vec3A};
use modiste_core::Vec3;

/// Advances a cloth frame by frame.
///
/// Each substep of length `h` is one Newton step of implicit Euler from the place that the vertices would reach by their
/// velocities (so that rest is exact): `(M/h² + K + contact) Δ = M g - ∇E + contact forces`, a definite system solved by conjugate gradients.
/// Holds scratch space and what contact remembers; [`ClothState`] has the rest.
#[derive(Debug, Clone)]
pub struct Solver {
    options: SolverOptions,
    matrix: Option<(f64, SystemMatrix)>,
    solve: ConjugateGradients,
    contacts: BodyContacts,
    bumps: BumpContacts,
    layers: SelfContacts,
    /// Boxes around the cloth's faces, fitted at the start of each frame.
    tree: Option<FaceTree>,
    start: Vec<Vec3>,
    forces: Vec<Vec3>,
    right: Vec<Vec3A>,
    change: Vec<Vec3A>,
    lanes: Vec<MembraneLanes>,
    lagged: Vec<Vec3>,
    free: Vec<bool>,
}

/// A direction and the shares of four vertices in it.
#[derive(Debug, Clone, Copy)]
struct Spread {
    vertices: [u32; 4],
    weights: [f64; 4],
    normal: Vec3,
}

impl Spread {
    /// Pushes with `stiffness` (N/m) over `depth` (m).
    #[expect(clippy::cast_possible_truncation, reason = "the inner solve runs in f32")]
    fn push(&self, stiffness: f64, depth: f64, forces: &mut [Vec3], matrix: &mut SystemMatrix) {
        for (vertex, weight) in self.vertices.into_iter().zip(self.weights) {
            forces[vertex as usize] += self.normal * (stiffness * depth * weight);
        }
        let n = self.normal.as_vec3a();
        let block = Mat3A::from_cols(n * n.x, n * n.y, n * n.z) * stiffness as f32;
        matrix.add_stencil(Stencil { vertices: self.vertices, weights: self.weights.map(|w| w as f32), block });
    }
}

impl Solver {
    /// A solver for this cloth.
    pub fn new(model: &ClothModel, options: SolverOptions) -> Self {
        let count = model.topology().vertex_count();
        Self {
            options,
            matrix: None,
            solve: ConjugateGradients::new(count),
            contacts: BodyContacts::default(),
            bumps: BumpContacts::new(model.topology()),
            layers: SelfContacts::default(),
            tree: None,
            start: vec![Vec3::ZERO; count],
            forces: vec![Vec3::ZERO; count],
            right: vec![Vec3A::ZERO; count],
            change: vec![Vec3A::ZERO; count],
            lanes: MembraneLanes::pack(model.membranes()),
            lagged: vec![Vec3::ZERO; count],
            free: vec![true; count],
        }
    }

    /// The settings.
    pub fn options(&self) -> &SolverOptions {
        &self.options
    }

    /// Changes the settings from the next step on.
    pub fn set_options(&mut self, options: SolverOptions) {
        self.options = options;
    }

    /// Advances `state` by `dt` (s) while `body` moves to the place set by [`BodyCollider::advance_to`].
    ///
    /// # Errors
    /// Options or holds out of range, a state of another size, or positions that are not finite.
    pub fn step(
        &mut self,
        model: &ClothModel,
        state: &mut ClothState,
        body: &mut BodyCollider,
        dt: f64,
    ) -> Result<StepReport, ClothError> {
        self.check(model, state, dt)?;
        let h = dt / self.options.substeps as f64;
        self.prepare(model, h);
        let mut report = StepReport::default();
        body.begin_frame(self.options.substeps);
        self.search_contacts(model, state, body, dt);
        for substep in 1..=self.options.substeps {
            body.move_to(substep as f64 / self.options.substeps as f64);
            self.substep(model, state, body, h, &mut report);
        }
        body.end_frame();
        self.finish(model, state, body, report)
    }

    /// Looks for what may touch within the frame.
    fn search_contacts(&mut self, model: &ClothModel, state: &ClothState, body: &BodyCollider, dt: f64) {
        let moving = (&state.positions[..], &state.velocities[..]);
        self.contacts.search(body, model.collision_groups(), moving, dt);
        self.layers.clear();
        if body.bumps().is_empty() && !self.options.self_contact {
            return;
        }
        let cloth = model.topology();
        let all = || (0u32..).take(cloth.face_count()).collect();
        let tree = self.tree.get_or_insert_with(|| FaceTree::new(cloth.faces(), all(), &state.positions));
        tree.refit(cloth.faces(), &state.positions);
        self.bumps.search(body, model.collision_groups(), cloth, (tree, &state.positions));
        if self.options.self_contact {
            self.layers.search(cloth, tree, moving, self.options.self_thickness, dt);
        }
    }

    fn check(&self, model: &ClothModel, state: &ClothState, dt: f64) -> Result<(), ClothError> {
        self.options.check()?;
        crate::error::check_positive("frame time", dt)?;
        let count = model.topology().vertex_count();
        check_count("solver vertices", count, self.start.len())?;
        check_count("positions", count, state.positions.len())?;
        check_count("velocities", count, state.velocities.len())?;
        model.check_holds()
    }

    fn prepare(&mut self, model: &ClothModel, h: f64) {
        let bend_scale = 1.0 + self.options.damping * model.fabric().bend_damping / h;
        let current = self.matrix.as_ref().is_some_and(|(scale, _)| (scale - bend_scale).abs() < 1e-12 * bend_scale);
        if !current {
            self.matrix = Some((bend_scale, SystemMatrix::new(model.topology(), model.hinges(), bend_scale)));
        }
        self.free.fill(true);
        for &pin in &model.pins {
            self.free[pin as usize] = false;
        }
    }

    fn substep(
        &mut self,
        model: &ClothModel,
        state: &mut ClothState,
        body: &BodyCollider,
        h: f64,
        report: &mut StepReport,
    ) {
        let Some((_, mut matrix)) = self.matrix.take() else { return };
        let bend_scale = 1.0 + self.options.damping * model.fabric().bend_damping / h;
        matrix.clear();
        self.start.copy_from_slice(&state.positions);
        let fall = Vec3::from_array(self.options.gravity) * (h * h);
        for (x, v) in state.positions.iter_mut().zip(&state.velocities) {
            *x += *v * h;
        }
        let predicted = &state.positions;
        self.add_inertia(model, &state.velocities, h, &mut matrix);
        self.add_elasticity(model, predicted, h, &mut matrix);
        self.add_holds(model, predicted, body, &mut matrix);
        self.add_body_contact(model, (predicted, fall), body, h, &mut matrix);
        self.add_self_contact(model, predicted, &mut matrix);
        for ((right, force), free) in self.right.iter_mut().zip(&self.forces).zip(&self.free) {
            *right = if *free { force.as_vec3a() } else { Vec3A::ZERO };
        }
        // The residual as an acceleration: between that of a free vertex and that of one held by its neighbours.
        let acceleration = self.options.tolerance * h;
        let target = acceleration * acceleration * model.masses().iter().sum::<f64>();
        let limits = (target, self.options.max_iterations);
        let outcome = self.solve.solve(&matrix, &self.free, &self.right, &mut self.change, limits);
        report.iterations += outcome.iterations;
        report.unconverged += usize::from(!outcome.converged);
        self.matrix = Some((bend_scale, matrix));
        self.advance(state, h, report);
        let law = self.contact_law(model, h);
        let moving = (&mut state.positions[..], &mut state.velocities[..]);
        self.contacts.finish(body, &law, model.areas(), &self.start, moving, h);
        report.projected += self.contacts.projected;
        report.deepest = report.deepest.max(self.contacts.deepest);
    }

    fn contact_law(&self, model: &ClothModel, h: f64) -> ContactLaw {
        ContactLaw {
            thickness: self.options.thickness,
            stiffness: self.options.contact_stiffness,
            static_friction: self.options.static_friction,
            sliding_friction: self.options.friction,
            mobility: h * h / model.fabric().density,
        }
    }

    /// Mass, weight and drag.
    #[expect(clippy::cast_possible_truncation, reason = "the inner solve runs in f32")]
    fn add_inertia(&mut self, model: &ClothModel, velocities: &[Vec3], h: f64, matrix: &mut SystemMatrix) {
        let drag = self.options.air_drag;
        let gravity = Vec3::from_array(self.options.gravity);
        for (vertex, (&mass, &area)) in model.masses().iter().zip(model.areas()).enumerate() {
            self.forces[vertex] = gravity * mass - velocities[vertex] * (drag * area);
            let diagonal = mass / (h * h) + drag * area / h;
            matrix.add_diagonal(vertex, Mat3A::from_diagonal(glam::Vec3::splat(diagonal as f32)));
        }
    }

    /// Membrane and bending with their damping.
    fn add_elasticity(&mut self, model: &ClothModel, x: &[Vec3], h: f64, matrix: &mut SystemMatrix) {
        let fabric = model.fabric();
        let law = LaneLaw::new(&fabric.stretch, self.options.damping * fabric.stretch_damping / h);
        let mut face = 0;
        for lanes in &self.lanes {
            let result = lanes.force(&law, &self.start, x);
            for (lane, corners) in lanes.vertices().iter().enumerate() {
                for (&vertex, force) in corners.iter().zip(result.corner_forces(lane)) {
                    self.forces[vertex as usize] += force;
                }
                matrix.add_face(face, &result.blocks(lane));
                face += 1;
            }
        }
        // Bending and its damping are linear: K x + ratio K (x - start) = (1 + ratio) K (x - share start).
        let ratio = self.options.damping * fabric.bend_damping / h;
        let share = ratio / (1.0 + ratio);
        for ((lagged, x), start) in self.lagged.iter_mut().zip(x).zip(&self.start) {
            *lagged = *x - *start * share;
        }
        matrix.subtract_bending(&self.lagged, &mut self.forces);
        for hinge in model.hinges().iter().filter(|hinge| hinge.rest.abs() > 0.0) {
            let moment = hinge.normal(x) * (hinge.rest * hinge.stiffness);
            for (vertex, weight) in hinge.vertices.into_iter().zip(hinge.weights) {
                self.forces[vertex as usize] += moment * weight;
            }
        }
    }

    /// Seams, elastic bands and attachments.
    #[expect(clippy::cast_possible_truncation, reason = "the inner solve runs in f32")]
    fn add_holds(&mut self, model: &ClothModel, x: &[Vec3], body: &BodyCollider, matrix: &mut SystemMatrix) {
        let seams = model.seams.iter().map(|s| (s.vertices, s.rest_length, s.stiffness));
        let bands = model.elastic_edges.iter().map(|e| (e.vertices, e.rest_length, e.stiffness));
        for ([a, b], rest_length, stiffness) in seams.chain(bands) {
            let spring = Spring { rest_length, stiffness, tension_only: true };
            let Some((force, block)) = spring_force(&spring, x[a as usize] - x[b as usize]) else { continue };
            self.forces[a as usize] += force;
            self.forces[b as usize] -= force;
            matrix.add_stencil(Stencil { vertices: [a, b, a, b], weights: [1.0, -1.0, 0.0, 0.0], block });
        }
        if body.is_empty() {
            return;
        }
        for hold in &model.attachments {
            let (place, _) = body.place(&hold.point);
            let target = place + body.face_frame(hold.point.face)[1] * hold.offset;
            let vertex = hold.vertex as usize;
            let away = target - x[vertex];
            let stiffness = hold.stiffness.min(hold.most / away.length().max(f64::MIN_POSITIVE));
            self.forces[vertex] += away * stiffness;
            matrix.add_diagonal(vertex, Mat3A::from_diagonal(glam::Vec3::splat(stiffness as f32)));
        }
    }

    fn add_body_contact(
        &mut self,
        model: &ClothModel,
        (x, fall): (&[Vec3], Vec3),
        body: &BodyCollider,
        h: f64,
        matrix: &mut SystemMatrix,
    ) {
        let law = self.contact_law(model, h);
        for vertex in 0..x.len() {
            let path = (self.start[vertex], x[vertex], fall);
            for contact in self.contacts.force(vertex, body, &law, model.areas()[vertex], path).into_iter().flatten() {
                self.forces[vertex] += contact.force;
                matrix.add_diagonal(vertex, contact.block);
            }
        }
        let (forces, areas, stiffness) = (&mut self.forces, model.areas(), law.stiffness);
        self.bumps.forces(body, model.topology(), law.thickness, x, |push| {
            let [a, b, c] = push.vertices;
            let stiffness = stiffness * push.vertices.map(|v| areas[v as usize]).iter().sum::<f64>() / 3.0;
            let [u, v, w] = push.weights;
            let spread = Spread { vertices: [a, b, c, a], weights: [u, v, w, 0.0], normal: push.normal };
            spread.push(stiffness, push.depth, forces, matrix);
        });
    }

    fn add_self_contact(&mut self, model: &ClothModel, x: &[Vec3], matrix: &mut SystemMatrix) {
        let (forces, areas, stiffness) = (&mut self.forces, model.areas(), self.options.contact_stiffness);
        self.layers.forces(model.topology(), self.options.self_thickness, (&self.start, x), |push| {
            let spread = Spread { vertices: push.vertices, weights: push.weights, normal: push.normal };
            spread.push(stiffness * areas[push.vertices[0] as usize], push.depth, forces, matrix);
        });
    }

    /// Adds the solution to the predicted places and takes the new velocities.
    fn advance(&self, state: &mut ClothState, h: f64, report: &mut StepReport) {
        let limit = self.options.max_speed;
        for vertex in 0..state.positions.len() {
            if !self.free[vertex] {
                continue;
            }
            let start = self.start[vertex];
            let end = state.positions[vertex] + self.change[vertex].as_dvec3();
            let mut velocity = (end - start) / h;
            let speed = velocity.length();
            if speed > limit {
                velocity *= limit / speed;
                report.slowed += 1;
            }
            state.velocities[vertex] = velocity;
            state.positions[vertex] = start + velocity * h;
        }
    }

    fn finish(
        &self,
        model: &ClothModel,
        state: &ClothState,
        body: &BodyCollider,
        mut report: StepReport,
    ) -> Result<StepReport, ClothError> {
        if let Some(vertex) = state.positions.iter().position(|x| !x.is_finite()) {
            return Err(ClothError::Diverged { vertex });
        }
        report.contacts = self.contacts.count_within(self.options.thickness);
        report.inside = self.contacts.count_inside(body, &state.positions);
        report.max_speed = state.velocities.iter().map(|v| v.length()).fold(0.0, f64::max);
        report.widest_seam = model
            .seams
            .iter()
            .map(|s| {
                let [a, b] = s.vertices.map(|v| state.positions[v as usize]);
                a.distance(b) - s.rest_length
            })
            .fold(0.0, f64::max);
        report.self_pairs = self.layers.len();
        report.pinched = self.contacts.count_pinched(self.options.thickness);
        if report.inside > 0 {
            report.warnings.push(format!("{} vertices are inside the body", report.inside));
        }
        if report.slowed > 0 {
            report.warnings.push(format!("{} vertices were slowed to {} m/s", report.slowed, self.options.max_speed));
        }
        Ok(report)
    }
}
