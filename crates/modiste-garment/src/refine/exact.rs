//! What the paper leaves: pushing every vertex out of the triangles of the body, and the body's vertices out of the cloth.

use std::sync::Arc;

use modiste_core::{Topology, Vec3};
use rayon::prelude::*;

use super::contacts::{MOST, Site, wanted_distance};
use super::obstacle::Obstacle;
use super::shows::{Lift, SHOW_CLEARANCE, find_lifts};
use super::tears::Tears;
use super::warp::{Push, Stiffness, Warp, WarpOptions};

/// How cloth is pushed out exactly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExactOptions {
    /// Distance from the surface that pushed vertices are sent to (m).
    pub clearance: f64,
    /// Vertices nearer than this (m) are pushed.
    pub trigger: f64,
    /// Distance that no vertex is left below, where there is room (m).
    pub least: f64,
    /// How far garments below are looked for (m). Bodies are found at any distance.
    pub reach: f64,
    /// Most rounds of smooth pushing.
    pub rounds: usize,
    /// Most steps of a single vertex, for what smooth pushing leaves.
    pub final_rounds: usize,
    /// Most rounds of mending torn edges.
    pub mending_rounds: usize,
    /// What holds the warp back; little, so that it spreads.
    pub stiffness: Stiffness,
    /// Weight of a push.
    pub weight: f64,
    /// How each round is solved.
    pub warp: WarpOptions,
}

impl Default for ExactOptions {
    fn default() -> Self {
        Self {
            clearance: 0.0025,
            trigger: 0.0015,
            least: 0.0003,
            reach: 0.06,
            rounds: 4,
            final_rounds: 3,
            mending_rounds: 6,
            stiffness: Stiffness { smooth: 1.0, damping: 0.05 },
            weight: 10.0,
            warp: WarpOptions { rings: 6, accuracy: 1e-2 },
        }
    }
}

/// What the exact push-out found and left.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ExactReport {
    /// Vertices that were inside when it began.
    pub inside_before: usize,
    /// Depth of the deepest of them (m).
    pub depth_before: f64,
    /// Vertices that are left inside.
    pub inside_after: usize,
    /// Depth of the deepest of them (m).
    pub depth_after: f64,
    /// Vertices between two surfaces that pass through each other: there is no outside for them where they are, and they
    /// were moved to the rim of the crossing.
    pub pinched: usize,
    /// Rounds of smooth pushing.
    pub rounds: usize,
}

/// Vertices that one thread takes at a time.
const VERTICES_AT_ONCE: usize = 64;

/// Pushes one garment out of surfaces.
#[derive(Debug, Clone)]
pub(crate) struct ExactPush {
    topology: Arc<Topology>,
    options: ExactOptions,
    sites: Vec<Site>,
    pushes: Vec<Push>,
    lifts: Vec<Lift>,
    warp: Vec<Vec3>,
    tears: Tears,
}

impl ExactPush {
    pub(crate) fn new(topology: &Arc<Topology>, options: ExactOptions) -> Self {
        let n = topology.vertex_count();
        Self {
            topology: topology.clone(),
            options,
            sites: vec![Site::NEW; n],
            pushes: Vec::new(),
            lifts: Vec::new(),
            warp: vec![Vec3::ZERO; n],
            tears: Tears::default(),
        }
    }

    /// Moves the vertices (m) out; `predicted` is the garment as it was before any fit.
    pub(crate) fn run(
        &mut self,
        solver: &mut Warp,
        obstacles: &[&Obstacle],
        predicted: &[Vec3],
        garment: &mut [Vec3],
    ) -> ExactReport {
        let obstacles = &obstacles[..obstacles.len().min(MOST)];
        for site in &mut self.sites {
            (site.pinched, site.stale) = (false, true);
        }
        self.look(obstacles, garment);
        let mut report = ExactReport::default();
        (report.inside_before, report.depth_before) = self.inside();
        while report.rounds < self.options.rounds {
            let shortfall = self.collect_pushes();
            let shows = self.collect_shows(obstacles, garment);
            if !shows && shortfall <= 0.5 * self.options.trigger {
                break;
            }
            report.rounds += 1;
            solver.solve(self.options.stiffness, &self.pushes, &[], self.options.warp, &mut self.warp);
            for &vertex in solver.region() {
                let (step, site) = (self.warp[vertex as usize], &mut self.sites[vertex as usize]);
                garment[vertex as usize] += step;
                site.slack -= step.length();
                site.stale |= site.slack < self.options.trigger;
            }
            self.look(obstacles, garment);
        }
        self.settle(obstacles, garment);
        for _ in 0..self.options.mending_rounds {
            if !self.tears.mend(&self.topology, predicted, garment) {
                break;
            }
            self.tears.region().iter().for_each(|&vertex| self.sites[vertex as usize].stale = true);
            self.settle(obstacles, garment);
        }
        self.lift_single_faces(obstacles, garment);
        self.settle(obstacles, garment);
        (report.inside_after, report.depth_after) = self.inside();
        report.pinched = self.sites.iter().filter(|site| site.pinched).count();
        report
    }

    /// Finds the contacts of all vertices that have moved.
    fn look(&mut self, obstacles: &[&Obstacle], garment: &[Vec3]) {
        let reach = self.options.reach;
        let sites = self.sites.par_iter_mut().zip(garment).with_min_len(VERTICES_AT_ONCE);
        sites.filter(|(site, _)| site.stale).for_each(|(site, &at)| site.look(obstacles, at, reach));
    }

    /// Moves by itself every vertex that is still too near.
    fn settle(&mut self, obstacles: &[&Obstacle], garment: &mut [Vec3]) {
        let ExactOptions { least, reach, final_rounds, .. } = self.options;
        let sites = self.sites.par_iter_mut().zip(garment).with_min_len(VERTICES_AT_ONCE);
        sites.for_each(|(site, at)| site.settle(obstacles, at, least, reach, final_rounds));
    }

    /// Number of vertices inside and the depth of the deepest (m).
    fn inside(&self) -> (usize, f64) {
        let inside = self.sites.iter().map(|site| site.contacts.least()).filter(|&least| least < 0.0);
        (inside.clone().count(), -inside.fold(0.0, f64::min))
    }

    /// Pushes for vertices that are too near; returns by how much at most (m).
    fn collect_pushes(&mut self) -> f64 {
        self.pushes.clear();
        let mut shortfall: f64 = 0.0;
        for (vertex, site) in self.sites.iter().enumerate() {
            if site.contacts.least() >= self.options.trigger {
                continue;
            }
            let contacts = site.contacts.as_slice();
            // A push towards the rim of a crossing would drag the neighbours along.
            if contacts.iter().any(|contact| contact.pinched) {
                continue;
            }
            for contact in contacts {
                let wanted = wanted_distance(contact, contacts, self.options.clearance);
                let trigger = wanted.min(self.options.trigger);
                if contact.distance < trigger {
                    shortfall = shortfall.max(trigger - contact.distance);
                    let gap = wanted - contact.distance;
                    self.pushes.push(Push {
                        vertex: vertex as u32,
                        normal: contact.normal,
                        gap,
                        weight: self.options.weight,
                    });
                }
            }
        }
        shortfall
    }

    /// Pushes for cloth that body vertices show through: each triangle is lifted off the body vertices above it. Returns
    /// whether there are any.
    fn collect_shows(&mut self, obstacles: &[&Obstacle], garment: &[Vec3]) -> bool {
        find_lifts(&self.topology, &self.sites, obstacles, garment, &mut self.lifts);
        for &Lift { face, normal, height } in &self.lifts {
            let gap = height + SHOW_CLEARANCE;
            self.pushes.extend(face.map(|vertex| Push { vertex, normal, gap, weight: self.options.weight }));
        }
        !self.lifts.is_empty()
    }

    /// Lifts by themselves the triangles that body vertices still show through.
    fn lift_single_faces(&mut self, obstacles: &[&Obstacle], garment: &mut [Vec3]) {
        find_lifts(&self.topology, &self.sites, obstacles, garment, &mut self.lifts);
        for &Lift { face, normal, height } in &self.lifts {
            for vertex in face {
                garment[vertex as usize] += (height + 0.5 * SHOW_CLEARANCE) * normal;
                self.sites[vertex as usize].stale = true;
            }
        }
    }
}
