//! What the paper leaves: pushing every vertex out of the triangles of the body, and the body's vertices out of the cloth.

use std::sync::Arc;

use modiste_core::{Topology, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::band::Band;
use super::contact::Contact;
use super::contacts::{MOST, Site, wanted_distance};
use super::cover::Ground;
use super::crossings::{Crossing, Crossings, find_crossings};
use super::folds::Folds;
use super::home::Home;
use super::obstacle::Obstacle;
use super::paper::PaperOptions;
use super::shows::{Lift, Lifts, SHOW_CLEARANCE, Show, find_lifts};
use super::tears::Tears;
use super::warp::{Pull, Push, Stiffness, Warp, WarpOptions};

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
    /// Most rounds of drawing out folds that have gone through each other; 0 does not look for them.
    pub fold_rounds: usize,
    /// Most rounds of smoothly moving triangles that cross a surface; 0 does not look for them. One round takes as long as all
    /// the rest.
    pub crossing_rounds: usize,
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
            rounds: 3,
            final_rounds: 3,
            fold_rounds: 2,
            crossing_rounds: 0,
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
    /// Triangles that could not be moved out of what they cross.
    pub left: Left,
}

/// Triangles that were found to cross when all was done that is done.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Left {
    /// Triangles that cross a surface below by more than half a millimetre.
    pub crossings: usize,
    /// Pairs of triangles of the garment that are deep in each other.
    pub folds: usize,
}

/// Vertices that one thread takes at a time.
const VERTICES_AT_ONCE: usize = 64;

/// A triangle that crosses deeper than it did by more than this (m) goes back.
const DEEPER: f64 = 0.0005;

/// Triangles that cross less deep than this (m) are as they should be.
const STOOD_FOR: f64 = 0.0005;

/// Pushes one garment out of surfaces.
#[derive(Debug, Clone)]
pub(crate) struct ExactPush {
    topology: Arc<Topology>,
    options: ExactOptions,
    sites: Vec<Site>,
    /// Where each vertex is worn; empty where that is not known.
    homes: Vec<Home>,
    /// What garments worn above need (m).
    above: f64,
    pushes: Vec<Push>,
    pulls: Vec<Pull>,
    lifts: Lifts,
    crossings: Crossings,
    /// Triangles that crossed at first, in order, and how deep (m).
    first: Vec<([u32; 3], f64)>,
    folds: Folds,
    /// The garment before what crosses was moved, and before the last round of that (m).
    before: Vec<Vec3>,
    last: Vec<Vec3>,
    /// What the last round has moved.
    moved: Vec<bool>,
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
            homes: Vec::new(),
            above: 0.0,
            pushes: Vec::new(),
            pulls: Vec::new(),
            lifts: Lifts::default(),
            crossings: Crossings::default(),
            first: Vec::new(),
            folds: Folds::new(topology),
            before: Vec::new(),
            last: Vec::new(),
            moved: Vec::new(),
            warp: vec![Vec3::ZERO; n],
            tears: Tears::default(),
        }
    }

    /// Takes where each vertex is worn, and how thick the garments above are (m).
    pub(crate) fn wear(&mut self, homes: Vec<Home>, above: f64) {
        (self.homes, self.above) = (homes, above);
    }

    /// Finds how the garment (m) lies to the body, apart from other garments.
    pub(crate) fn approach(&mut self, body: &Obstacle, garment: &[Vec3]) {
        for site in &mut self.sites {
            (site.exit, site.stale, site.bare) = (None, true, false);
        }
        let grounds = [Ground { obstacle: body, cover: None }];
        self.look(&grounds, garment);
        self.find_exits(&grounds, garment);
    }

    /// Moves the vertices (m) out, after [`Self::approach`]; `predicted` is the garment as it was before any fit. `paper` and
    /// `band` come first, where they are given.
    pub(crate) fn run(
        &mut self,
        solver: &mut Warp,
        grounds: &[Ground<'_>],
        (paper, band): (Option<&PaperOptions>, &mut Band),
        predicted: &[Vec3],
        garment: &mut [Vec3],
    ) -> ExactReport {
        let grounds = &grounds[..grounds.len().min(MOST)];
        self.raise(grounds);
        let mut report = ExactReport::default();
        (report.inside_before, report.depth_before) = self.inside();
        if let Some(paper) = paper {
            self.iterate(solver, paper, band, predicted, garment);
        }
        if let Some(body) = grounds.first() {
            for vertex in band.draw_in(body.obstacle, garment) {
                self.sites[vertex as usize].stale = true;
            }
        }
        if grounds.len() > 1 {
            let near = self.sites.iter_mut().filter(|site| site.exit.is_none() && site.may_touch_garments(grounds));
            near.for_each(|site| if site.moved { site.stale = true } else { site.bare = true });
        }
        self.look(grounds, garment);
        while report.rounds < self.options.rounds {
            let shortfall = self.collect_pushes(grounds, garment);
            let shows = self.collect_shows(grounds, garment);
            if !shows && shortfall <= 0.5 * self.options.trigger {
                break;
            }
            report.rounds += 1;
            solver.solve(self.options.stiffness, &self.pushes, &self.pulls, self.options.warp, &mut self.warp);
            self.advance(solver.region(), garment);
            self.look(grounds, garment);
        }
        self.settle(grounds, garment);
        for _ in 0..self.options.mending_rounds {
            if !self.tears.mend(&self.topology, |vertex| self.sites[vertex as usize].exit.is_some(), predicted, garment)
            {
                break;
            }
            self.tears.region().iter().for_each(|&vertex| self.sites[vertex as usize].stale = true);
            self.settle(grounds, garment);
        }
        let folds = self.unfold(grounds, garment);
        self.lift_single_faces(grounds, garment);
        self.settle(grounds, garment);
        report.left = Left { folds, crossings: self.uncross(solver, grounds, garment) };
        (report.inside_after, report.depth_after) = self.inside();
        report.pinched = self.sites.iter().filter(|site| site.exit.is_some()).count();
        report
    }

    /// Lets the garments below raise the body in the contacts that are known.
    fn raise(&mut self, grounds: &[Ground<'_>]) {
        if grounds[0].cover.is_some() {
            self.sites.par_iter_mut().with_min_len(VERTICES_AT_ONCE).for_each(|site| site.raise(&grounds[0]));
        }
    }

    /// How the garment, where it was left, lies to the body.
    pub(crate) fn body_contacts(&self) -> impl Iterator<Item = &Contact> {
        self.sites.iter().filter(|site| site.exit.is_none()).filter_map(|site| site.contacts.of(0))
    }

    /// The direction away from the body at every vertex, zero where it is not known.
    pub(crate) fn outward(&self) -> impl Iterator<Item = Vec3> {
        let is_free = |site: &Site| site.exit.is_none();
        self.sites
            .iter()
            .map(move |site| site.contacts.of(0).filter(|_| is_free(site)).map_or(Vec3::ZERO, |contact| contact.normal))
    }

    /// The paper's iterations with the nearest points of triangles for correspondences, which stay as they were found.
    fn iterate(
        &mut self,
        solver: &mut Warp,
        paper: &PaperOptions,
        band: &Band,
        predicted: &[Vec3],
        garment: &mut [Vec3],
    ) {
        for &stiffness in &paper.iterations {
            self.pushes.clear();
            self.pulls.clear();
            let vertices = (0u32..).zip(&self.sites).zip(garment.iter().zip(predicted));
            for ((vertex, site), (&at, &from)) in vertices {
                if let Some(exit) = site.exit {
                    self.pulls.push(Pull { vertex, offset: exit - at, weight: 1.0 });
                } else if let Some((_, contact)) = site.contacts.nearest() {
                    let height = contact.distance + contact.normal.dot(at - from);
                    if height < 0.0 {
                        let gap = paper.clearance - height;
                        self.pushes.push(Push { vertex, normal: contact.normal, gap, weight: 1.0 });
                    }
                }
            }
            for vertex in band.edge() {
                let (site, at) = (&self.sites[vertex as usize], garment[vertex as usize]);
                if let Some(contact) = site.contacts.of(0) {
                    let foot = predicted[vertex as usize] - contact.distance * contact.normal;
                    self.pulls.push(Pull { vertex, offset: foot - at, weight: paper.tightness });
                }
            }
            if self.pushes.is_empty() && self.pulls.is_empty() {
                return;
            }
            solver.solve(stiffness, &self.pushes, &self.pulls, self.options.warp, &mut self.warp);
            self.advance(solver.region(), garment);
        }
    }

    /// Moves the vertices that a warp moves.
    fn advance(&mut self, region: &[u32], garment: &mut [Vec3]) {
        for &vertex in region {
            let (step, site) = (self.warp[vertex as usize], &mut self.sites[vertex as usize]);
            garment[vertex as usize] += step;
            site.slack -= step.length();
            site.moved = true;
            site.stale |= site.exit.is_none() && site.slack < self.options.trigger;
        }
    }

    /// Finds the ways out of parts that pass through each other.
    fn find_exits(&mut self, grounds: &[Ground<'_>], garment: &[Vec3]) {
        let clearance = 2.0 * self.options.least;
        let sites = self.sites.par_iter_mut().zip(garment).enumerate().with_min_len(VERTICES_AT_ONCE);
        let homes = &self.homes;
        sites.for_each(|(vertex, (site, &at))| site.find_exit(grounds, at, clearance, homes.get(vertex)));
    }

    /// Finds the contacts of all vertices that have moved.
    fn look(&mut self, grounds: &[Ground<'_>], garment: &[Vec3]) {
        let (reach, homes) = (self.options.reach, &self.homes);
        let sites = self.sites.par_iter_mut().zip(garment).enumerate().with_min_len(VERTICES_AT_ONCE);
        sites
            .filter(|(_, (site, _))| site.stale || site.bare)
            .for_each(|(vertex, (site, &at))| site.look(grounds, at, reach, homes.get(vertex)));
    }

    /// Moves by itself every vertex that is still too near.
    fn settle(&mut self, grounds: &[Ground<'_>], garment: &mut [Vec3]) {
        let ExactOptions { least, reach, final_rounds, .. } = self.options;
        let homes = &self.homes;
        let sites = self.sites.par_iter_mut().zip(garment).enumerate().with_min_len(VERTICES_AT_ONCE);
        sites.for_each(|(vertex, (site, at))| {
            site.settle(grounds, at, (least, reach), final_rounds, homes.get(vertex));
        });
    }

    /// Number of vertices inside and the depth of the deepest (m). Those with a way out are not asked about: where parts of the
    /// body are in each other, one part says inside of what lies outside at its rim.
    fn inside(&self) -> (usize, f64) {
        let free = self.sites.iter().filter(|site| site.exit.is_none());
        let inside = free.map(|site| site.contacts.depth()).filter(|&least| least < 0.0);
        (inside.clone().count(), -inside.fold(0.0, f64::min))
    }

    /// Pushes for vertices that are too near, and pulls for those that go to their exits; returns by how much at most (m)
    /// the former are.
    fn collect_pushes(&mut self, grounds: &[Ground<'_>], garment: &[Vec3]) -> f64 {
        self.pushes.clear();
        self.pulls.clear();
        let mut shortfall: f64 = 0.0;
        for (vertex, site) in self.sites.iter().enumerate() {
            if let Some(exit) = site.exit {
                let offset = exit - garment[vertex];
                self.pulls.push(Pull { vertex: vertex as u32, offset, weight: self.options.weight });
                continue;
            }
            let extra = self.room_above(grounds, vertex);
            if site.contacts.least() >= self.options.trigger + extra {
                continue;
            }
            let contacts = site.contacts.as_slice();
            if contacts.iter().any(|contact| contact.pinched) {
                continue;
            }
            for contact in contacts {
                let wanted = wanted_distance(contact, contacts, self.options.clearance + extra);
                let trigger = wanted.min(self.options.trigger + extra);
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

    /// What a vertex leaves (m), besides its clearance, between itself and a limb that it is not worn on, for the garments worn
    /// above: an arm that lies against the hip presses on all of them.
    fn room_above(&self, grounds: &[Ground<'_>], vertex: usize) -> f64 {
        let presses = |home: &Home| {
            let contact = self.sites[vertex].contacts.of(0);
            contact.is_some_and(|contact| grounds[0].obstacle.is_foreign(contact.face, home))
        };
        let is_pressed = self.above > 0.0 && self.homes.get(vertex).is_some_and(presses);
        if is_pressed { self.above } else { 0.0 }
    }

    /// Pushes for cloth that body vertices show through: each triangle is lifted off the body vertices above it. Returns
    /// whether there are any.
    fn collect_shows(&mut self, grounds: &[Ground<'_>], garment: &[Vec3]) -> bool {
        find_lifts(&self.topology, &mut self.sites, grounds, (garment, Show::Vertices), &mut self.lifts);
        for &Lift { face, normal, height } in self.lifts.iter() {
            let gap = height + SHOW_CLEARANCE;
            self.pushes.extend(face.map(|vertex| Push { vertex, normal, gap, weight: self.options.weight }));
        }
        self.lifts.iter().next().is_some()
    }

    /// Draws out folds that have gone through each other; returns how many pairs of triangles are left deep in each other.
    fn unfold(&mut self, grounds: &[Ground<'_>], garment: &mut [Vec3]) -> usize {
        let mut rounds = self.options.fold_rounds;
        if rounds == 0 {
            return 0;
        }
        self.folds.survey(&self.topology, garment);
        loop {
            let held = |vertex: u32| self.sites[vertex as usize].exit.is_some();
            let count = self.folds.find(&self.topology, held, garment);
            if count == 0 || rounds == 0 {
                return count;
            }
            rounds -= 1;
            for &vertex in self.folds.draw_out(&self.topology, held, garment) {
                self.sites[vertex as usize].stale = true;
            }
            self.settle(grounds, garment);
        }
    }

    /// Moves triangles that cross a surface though none of their corners is inside: smoothly, at last by themselves. No vertex
    /// gets inside the body by it. Returns how many are left.
    fn uncross(&mut self, solver: &mut Warp, grounds: &[Ground<'_>], garment: &mut [Vec3]) -> usize {
        let rounds = self.options.crossing_rounds;
        if rounds == 0 {
            return 0;
        }
        self.before.clear();
        self.before.extend_from_slice(garment);
        self.moved.clear();
        self.moved.resize(garment.len(), true);
        for round in 0..=rounds {
            find_crossings(&self.topology, &self.sites, grounds, (garment, &self.moved), &mut self.crossings);
            if round == 0 {
                self.first.clear();
                self.first.extend(self.crossings.iter().map(|crossing| (crossing.face(), crossing.depth())));
                self.first.sort_unstable_by_key(|(face, _)| *face);
            }
            self.last.clear();
            self.last.extend_from_slice(garment);
            if self.crossings.iter().next().is_none() {
                break;
            }
            if round < rounds {
                self.pushes.clear();
                let weight = self.options.weight;
                self.pushes.extend(self.crossings.iter().flat_map(|crossing| crossing.pushes(weight)));
                solver.solve(self.options.stiffness, &self.pushes, &[], self.options.warp, &mut self.warp);
                self.advance(solver.region(), garment);
            } else {
                for crossing in self.crossings.iter() {
                    for (vertex, step) in crossing.steps() {
                        garment[vertex as usize] += step;
                        self.sites[vertex as usize].stale = true;
                    }
                }
            }
            self.settle(grounds, garment);
            let moves = garment.iter().zip(&self.last).map(|(at, last)| at != last);
            self.moved.iter_mut().zip(moves).for_each(|(moved, moves)| *moved = moves);
        }
        let left = self.take_back(grounds, garment);
        self.keep_out(grounds, garment);
        left
    }

    /// Takes back the moves since [`Self::before`] of triangles that cross a surface deeper for it: between two walls there is
    /// no room for what leads out of either. Returns how many triangles cross deeper than the fit stands for.
    fn take_back(&mut self, grounds: &[Ground<'_>], garment: &mut [Vec3]) -> usize {
        let moves = garment.iter().zip(&self.before).map(|(at, before)| at != before);
        self.moved.iter_mut().zip(moves).for_each(|(moved, moves)| *moved = moves);
        self.look(grounds, garment);
        find_crossings(&self.topology, &self.sites, grounds, (garment, &self.moved), &mut self.crossings);
        for crossing in self.crossings.iter() {
            let first = self.first.binary_search_by_key(&crossing.face(), |(face, _)| *face);
            if crossing.depth() > first.map_or(0.0, |index| self.first[index].1) + DEEPER {
                for vertex in crossing.face() {
                    garment[vertex as usize] = self.before[vertex as usize];
                    self.sites[vertex as usize].stale = true;
                }
            }
        }
        let stayed = |face: &[u32; 3]| face.iter().all(|&vertex| !self.moved[vertex as usize]);
        let depths = self.crossings.iter().map(Crossing::depth);
        let depths = depths.chain(self.first.iter().filter(|(face, _)| stayed(face)).map(|(_, depth)| *depth));
        depths.filter(|&depth| depth > STOOD_FOR).count()
    }

    /// Takes back the moves since [`Self::before`] that led into the body. Between parts that are in each other what is known
    /// about a vertex may say otherwise.
    fn keep_out(&mut self, grounds: &[Ground<'_>], garment: &mut [Vec3]) {
        let vertices = self.sites.par_iter_mut().zip(garment.par_iter_mut()).zip(&self.before);
        vertices.with_min_len(VERTICES_AT_ONCE).for_each(|((site, at), before)| {
            if *at != *before && site.is_doubtful() && grounds[0].obstacle.is_inside(*at) {
                *at = *before;
                site.stale = true;
            }
        });
        self.look(grounds, garment);
    }

    /// Lifts by themselves the triangles that body vertices still show through.
    fn lift_single_faces(&mut self, grounds: &[Ground<'_>], garment: &mut [Vec3]) {
        find_lifts(&self.topology, &mut self.sites, grounds, (garment, Show::Ridges), &mut self.lifts);
        for &Lift { face, normal, height } in self.lifts.iter() {
            for vertex in face {
                garment[vertex as usize] += (height + 0.5 * SHOW_CLEARANCE) * normal;
                self.sites[vertex as usize].stale = true;
            }
        }
    }
}
