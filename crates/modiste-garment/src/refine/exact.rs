//! What the paper leaves: pushing every vertex out of the triangles of the body, and the body's vertices out of the cloth.

use std::sync::Arc;

use modiste_core::{Topology, Vec3};

use super::obstacle::{Contact, NO_HINT, Obstacle};
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
    /// Deepest penetration that is looked for (m).
    pub reach: f64,
    /// Most rounds of smooth pushing.
    pub rounds: usize,
    /// Most rounds of moving single vertices, for what smooth pushing leaves.
    pub final_rounds: usize,
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
            final_rounds: 16,
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

/// Between opposite contacts whose normals have a product below this, a vertex has two walls to stay away from.
const OPPOSITE: f64 = -0.3;
/// Longest step of a single vertex between two walls in one final round (m).
const LONGEST_STEP: f64 = 0.015;
/// Body vertices may show through cloth whose corners are at most this far from the body (m).
const SHOW_REACH: f64 = 0.012;
/// Product of the normals at two corners of a triangle below which the body is curved there.
const CURVED: f64 = 0.97;
/// Depth below the cloth that body vertices are sent to (m).
const SHOW_CLEARANCE: f64 = 0.001;

/// The contacts of a vertex, one of each obstacle at most.
#[derive(Debug, Clone, Copy)]
struct Contacts {
    items: [Contact; Self::MOST],
    owners: [u8; Self::MOST],
    count: usize,
}

impl Contacts {
    /// Body and the garments below; those beyond are left out.
    const MOST: usize = 4;

    const EMPTY: Self = Self {
        items: [Contact { distance: 0.0, normal: Vec3::ZERO, face: 0, pinched: false }; Self::MOST],
        owners: [0; Self::MOST],
        count: 0,
    };

    fn as_slice(&self) -> &[Contact] {
        &self.items[..self.count]
    }

    fn push(&mut self, owner: usize, contact: Contact) {
        if self.count < Self::MOST {
            self.items[self.count] = contact;
            self.owners[self.count] = owner as u8;
            self.count += 1;
        }
    }

    /// The least distance (m); infinite without contacts.
    fn least(&self) -> f64 {
        self.as_slice().iter().fold(f64::INFINITY, |least, contact| least.min(contact.distance))
    }

    /// The nearest contact and the obstacle it is with.
    fn nearest(&self) -> Option<(usize, &Contact)> {
        let owned = self.owners.iter().map(|&owner| usize::from(owner)).zip(self.as_slice());
        owned.min_by(|(_, a), (_, b)| a.distance.total_cmp(&b.distance))
    }
}

/// Pushes one garment out of surfaces. Keeps the nearest faces of the last frame, which most often are the next ones.
#[derive(Debug, Clone)]
pub(crate) struct ExactPush {
    topology: Arc<Topology>,
    options: ExactOptions,
    /// Nearest faces, per obstacle and vertex.
    hints: Vec<Vec<u32>>,
    contacts: Vec<Contacts>,
    /// How far each vertex may move before its contacts must be found again (m).
    slack: Vec<f64>,
    pinched: Vec<bool>,
    pushes: Vec<Push>,
    warp: Vec<Vec3>,
    /// Vertices that are moved by themselves, with the wall that they were pushed off last.
    waiting: Vec<(u32, Option<Wall>)>,
}

impl ExactPush {
    pub(crate) fn new(topology: &Arc<Topology>, options: ExactOptions) -> Self {
        let n = topology.vertex_count();
        Self {
            topology: topology.clone(),
            options,
            hints: Vec::new(),
            contacts: vec![Contacts::EMPTY; n],
            slack: vec![0.0; n],
            pinched: vec![false; n],
            pushes: Vec::new(),
            warp: vec![Vec3::ZERO; n],
            waiting: Vec::new(),
        }
    }

    pub(crate) fn run(&mut self, solver: &mut Warp, obstacles: &[&Obstacle], garment: &mut [Vec3]) -> ExactReport {
        self.hints.resize_with(obstacles.len(), || vec![NO_HINT; garment.len()]);
        self.pinched.fill(false);
        for vertex in 0..garment.len() {
            self.find_contacts(vertex, obstacles, garment, false);
        }
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
                let vertex = vertex as usize;
                garment[vertex] += self.warp[vertex];
                self.slack[vertex] -= self.warp[vertex].length();
                // What is pinched is moved by itself afterwards.
                if self.slack[vertex] < self.options.trigger && !self.pinched[vertex] {
                    self.find_contacts(vertex, obstacles, garment, false);
                }
            }
        }
        self.move_single_vertices(obstacles, garment);
        self.lift_single_faces(obstacles, garment);
        (report.inside_after, report.depth_after) = self.inside();
        report.pinched = self.pinched.iter().filter(|&&pinched| pinched).count();
        report
    }

    fn find_contacts(&mut self, vertex: usize, obstacles: &[&Obstacle], garment: &[Vec3], precise: bool) {
        let mut contacts = Contacts::EMPTY;
        for (index, (obstacle, hints)) in obstacles.iter().zip(&mut self.hints).enumerate() {
            if let Some(contact) = obstacle.contact(garment[vertex], self.options.reach, &mut hints[vertex], precise) {
                contacts.push(index, contact);
            }
        }
        self.pinched[vertex] |= contacts.as_slice().iter().any(|contact| contact.pinched);
        self.slack[vertex] = contacts.least().min(self.options.reach);
        self.contacts[vertex] = contacts;
    }

    /// Number of vertices inside and the depth of the deepest (m).
    fn inside(&self) -> (usize, f64) {
        let inside = self.contacts.iter().map(Contacts::least).filter(|&least| least < 0.0);
        (inside.clone().count(), -inside.fold(0.0, f64::min))
    }

    /// Pushes for vertices that are too near; returns by how much at most (m).
    fn collect_pushes(&mut self) -> f64 {
        self.pushes.clear();
        let mut shortfall: f64 = 0.0;
        for (vertex, contacts) in self.contacts.iter().enumerate() {
            if contacts.least() >= self.options.trigger {
                continue;
            }
            let contacts = contacts.as_slice();
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
        let before = self.pushes.len();
        for face in self.topology.faces() {
            let Some((normal, lift)) = self.lift(*face, obstacles, garment) else { continue };
            for &vertex in face {
                let gap = lift + SHOW_CLEARANCE;
                self.pushes.push(Push { vertex, normal, gap, weight: self.options.weight });
            }
        }
        self.pushes.len() > before
    }

    /// Lifts by themselves the triangles that body vertices still show through.
    fn lift_single_faces(&mut self, obstacles: &[&Obstacle], garment: &mut [Vec3]) {
        for face in self.topology.clone().faces() {
            if let Some((normal, lift)) = self.lift(*face, obstacles, garment) {
                face.iter().for_each(|&vertex| garment[vertex as usize] += (lift + 0.5 * SHOW_CLEARANCE) * normal);
            }
        }
    }

    /// The normal of a triangle of cloth and how far (m) the highest body vertex is above it, if any is.
    ///
    /// The vertices tried are those of the nearest body faces of its corners, and where the body is curved there those
    /// around them.
    fn lift(&self, face: [u32; 3], obstacles: &[&Obstacle], garment: &[Vec3]) -> Option<(Vec3, f64)> {
        let contacts = face.map(|vertex| self.contacts[vertex as usize].nearest());
        let [Some(a), Some(b), Some(c)] = contacts else { return None };
        let nearest = [a, b, c];
        if nearest.iter().any(|(_, contact)| contact.distance >= SHOW_REACH || contact.pinched) {
            return None;
        }
        let corners = face.map(|vertex| garment[vertex as usize]);
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
        let product = |i: usize, j: usize| nearest[i].1.normal.dot(nearest[j].1.normal);
        let is_curved = product(0, 1).min(product(1, 2)).min(product(2, 0)) < CURVED;
        let mut lift: f64 = 0.0;
        for (owner, contact) in nearest {
            let obstacle = obstacles[owner];
            let mut try_vertex = |vertex: u32| {
                if obstacle.vertex_normals()[vertex as usize].dot(normal) > 0.2 {
                    lift = lift.max(height_above(corners, normal, obstacle.vertices()[vertex as usize]));
                }
            };
            for vertex in obstacle.topology().faces()[contact.face as usize] {
                try_vertex(vertex);
                if is_curved {
                    obstacle.topology().neighbours(vertex as usize).iter().for_each(|&around| try_vertex(around));
                }
            }
        }
        // Centimetres above the cloth are no show-through, but another limb.
        (lift > 0.0 && lift < SHOW_REACH).then_some((normal, lift))
    }

    /// Moves what is still too near by itself.
    fn move_single_vertices(&mut self, obstacles: &[&Obstacle], garment: &mut [Vec3]) {
        let least = self.options.least;
        let mut waiting = std::mem::take(&mut self.waiting);
        waiting.clear();
        let too_near = (0u32..).zip(&self.contacts).filter(|(_, contacts)| contacts.least() < least);
        waiting.extend(too_near.map(|(vertex, _)| (vertex, None)));
        for &(vertex, _) in &waiting {
            let vertex = vertex as usize;
            if self.pinched[vertex] {
                self.find_contacts(vertex, obstacles, garment, false);
            }
        }
        for round in 0..self.options.final_rounds {
            if waiting.is_empty() {
                break;
            }
            waiting.retain_mut(|(vertex, last_wall)| {
                let vertex = *vertex as usize;
                let wall = self.nearest_wall(vertex, obstacles, garment[vertex]);
                garment[vertex] += match (wall, *last_wall) {
                    (Some(wall), Some(last)) if wall.normal.dot(last.normal) < SAME_WALL => {
                        step_off_both(garment[vertex], [wall, last], 2.0 * least)
                    }
                    _ => least_step(self.contacts[vertex].as_slice(), 2.0 * least),
                };
                *last_wall = wall;
                // The first steps lead near the way out, the others find it exactly.
                self.find_contacts(vertex, obstacles, garment, round > 0);
                self.contacts[vertex].least() < least
            });
        }
        self.waiting = waiting;
    }

    /// The plane of the nearest face.
    fn nearest_wall(&self, vertex: usize, obstacles: &[&Obstacle], at: Vec3) -> Option<Wall> {
        let (owner, contact) = self.contacts[vertex].nearest()?;
        let point = at - contact.distance * contact.normal;
        Some(Wall { point, normal: obstacles[owner].face_normal(contact.face) })
    }
}

/// The tangent plane of a surface that a vertex was pushed out of.
#[derive(Debug, Clone, Copy)]
struct Wall {
    point: Vec3,
    normal: Vec3,
}

/// Normals with a product above this are of one wall, seen twice.
const SAME_WALL: f64 = 0.9;

/// The shortest step (m) to `wanted` distance from two walls at once, bounded.
///
/// In the crease where two limbs cross, stepping off one wall leads through the other, back and forth.
fn step_off_both(at: Vec3, walls: [Wall; 2], wanted: f64) -> Vec3 {
    let gap = |wall: Wall| wanted - wall.normal.dot(at - wall.point);
    let [a, b] = if gap(walls[0]) >= gap(walls[1]) { walls } else { [walls[1], walls[0]] };
    let (gap_a, gap_b) = (gap(a), gap(b));
    let cosine = a.normal.dot(b.normal);
    // The other wall may be met by stepping off the first.
    if gap_b <= cosine * gap_a {
        return gap_a.max(0.0) * a.normal;
    }
    let determinant = (1.0 - cosine * cosine).max(0.02);
    let (along_a, along_b) = ((gap_a - cosine * gap_b) / determinant, (gap_b - cosine * gap_a) / determinant);
    (along_a * a.normal + along_b * b.normal).clamp_length_max(LONGEST_STEP)
}

/// The distance that a vertex is to keep from a contact (m): less than the clearance between two walls that are close.
fn wanted_distance(contact: &Contact, contacts: &[Contact], clearance: f64) -> f64 {
    let facing = contacts.iter().filter(|other| other.normal.dot(contact.normal) < OPPOSITE);
    let room = facing.map(|other| 0.5 * (contact.distance + other.distance)).fold(clearance, f64::min);
    room.max(0.0)
}

/// The shortest step (m) to `wanted` distance from the nearest two contacts.
fn least_step(contacts: &[Contact], wanted: f64) -> Vec3 {
    let gap = |contact: &Contact| wanted_distance(contact, contacts, wanted).max(1e-5) - contact.distance;
    let mut sorted = [None; 2];
    for contact in contacts {
        if sorted[0].is_none_or(|first: &Contact| gap(contact) > gap(first)) {
            sorted = [Some(contact), sorted[0]];
        } else if sorted[1].is_none_or(|second: &Contact| gap(contact) > gap(second)) {
            sorted[1] = Some(contact);
        }
    }
    let Some(first) = sorted[0].filter(|first| gap(first) > 0.0) else { return Vec3::ZERO };
    let single = gap(first) * first.normal;
    match sorted[1] {
        // The single step would get too near to the second contact, so both are met at once.
        Some(second) if single.dot(second.normal) < gap(second) => {
            let cosine = first.normal.dot(second.normal);
            let determinant = (1.0 - cosine * cosine).max(0.02);
            let along_first = (gap(first) - cosine * gap(second)) / determinant;
            let along_second = (gap(second) - cosine * gap(first)) / determinant;
            (along_first * first.normal + along_second * second.normal).clamp_length_max(LONGEST_STEP)
        }
        _ => single,
    }
}

/// Height (m) of a point above a triangle, or minus infinity where it is not above it.
fn height_above(corners: [Vec3; 3], normal: Vec3, point: Vec3) -> f64 {
    let height = normal.dot(point - corners[0]);
    let inside = (0..3).all(|corner| {
        let (from, to) = (corners[corner], corners[(corner + 1) % 3]);
        normal.dot((to - from).cross(point - from)) >= 0.0
    });
    if inside { height } else { f64::NEG_INFINITY }
}

#[cfg(test)]
mod tests {
    use super::{Wall, step_off_both};
    use modiste_core::Vec3;

    #[test]
    fn one_step_leads_out_of_a_sharp_crease() {
        // Two walls that meet along the Z axis and open towards +X, 20° apart.
        let half = 10.0f64.to_radians();
        let wall = |side: f64| Wall { point: Vec3::ZERO, normal: Vec3::new(half.sin(), side * half.cos(), 0.0) };
        let walls = [wall(1.0), wall(-1.0)];
        for start in [Vec3::new(-0.002, 0.0005, 0.0), Vec3::new(0.001, -0.001, 3.0)] {
            let end = start + step_off_both(start, walls, 0.0006);
            for wall in walls {
                assert!(wall.normal.dot(end - wall.point) > 0.0006 - 1e-12, "{end}");
            }
            assert!((end - start).z.abs() < 1e-15);
        }
        // Far from the crease one wall is enough.
        let step = step_off_both(Vec3::new(0.1, 0.0172, 0.0), walls, 0.0006);
        assert!(step.length() < 1e-3 && step.dot(walls[1].normal) > 0.0);
    }
}
