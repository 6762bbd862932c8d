//! Guides on a moving body.

use modiste_body::Body;
use modiste_core::{Mat3, Vec3, centroid, corners};
use rayon::prelude::*;

use super::block::{Block, Forces, Frame, Make, Plane};
use super::lanes::{LANES, Lane, Lane3};
use super::material::GRAVITY;
use super::{Material, Wind};
use crate::groom::Groom;
use crate::scalp::{Root, nearest_roots};
use crate::surface::{Bust, Surface};
use crate::{HairError, POINTS};

/// Neighbours that a guide rubs against.
const NEIGHBOURS: usize = 6;
/// Hair that is nearer to the skin than this (m) may touch it before it is looked at again.
const NEAR: f64 = 0.04;
/// How far the skin is looked for (m).
const REACH: f64 = 0.08;
/// A point that goes no further along the skin than this (m), or this part of its distance, keeps its nearest place.
const SLACK: [f64; 2] = [0.003, 0.3];
/// Points that come nearer to their plane than this (m) are checked against the skin itself at the end of a frame.
const DOUBTFUL: f64 = 0.0015;
/// A point that went deeper than this into the skin (m) is let out over several steps, so that it does not shoot off.
const DEEPEST: f64 = 0.004;

/// How finely time is cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SimulationOptions {
    /// Frames per second of the motion.
    pub fps: f64,
    /// How often in a frame the nearest skin is found.
    pub looks: usize,
    /// Steps between two of those.
    pub steps: usize,
}

impl Default for SimulationOptions {
    fn default() -> Self {
        Self { fps: 30.0, looks: 2, steps: 6 }
    }
}

/// Guides in motion.
#[derive(Debug)]
pub struct Simulation {
    topology: std::sync::Arc<modiste_core::Topology>,
    bust: Bust,
    surface: Surface,
    roots: Vec<Root>,
    /// Material frame of each guide in the frame of its root's face.
    root_frames: Vec<Mat3>,
    neighbours: Vec<Vec<u32>>,
    slots: Vec<Slot>,
    forces: Forces,
    material: Material,
    options: SimulationOptions,
    /// What the positions are relative to (m): near the head, so that f32 is fine enough.
    origin: Vec3,
    time: f64,
    before: Vec<Vec3>,
}

/// The place on the skin that a point was last found to be nearest to.
#[derive(Debug, Clone, Copy)]
struct Anchor {
    face: u32,
    barycentric: [f32; 3],
    /// From there to the point when it was found (m), in the frame of the face.
    offset: [f32; 3],
    /// The way out, in the frame of the face.
    outwards: [f32; 3],
    /// How far the point may go from there until it is looked for again (m).
    slack: f32,
}

impl Default for Anchor {
    fn default() -> Self {
        Self { face: 0, barycentric: [0.0; 3], offset: [0.0; 3], outwards: [0.0; 3], slack: -1.0 }
    }
}

/// A block of guides with what its contacts need.
#[derive(Debug)]
struct Slot {
    block: Block,
    /// The guides in it; the last block may have fewer than its lanes, which repeat the last guide.
    guides: [usize; LANES],
    clearance: [f64; LANES],
    anchors: [[Anchor; LANES]; POINTS],
    /// The skin is at least so far away (m).
    distance: [[f32; LANES]; POINTS],
    /// Distance of the skin from the origin along the normal of each plane, at the end of the time between two looks (m).
    skin: [Lane; POINTS],
    /// Roots and frames at both ends of the time between two looks.
    roots: [Lane3; 2],
    frames: [Frame; 2],
}

impl Simulation {
    /// Puts a groom on its body; `vertices` are those of the body in its first pose (m). The groom is the shape at rest.
    ///
    /// # Errors
    /// A groom without guides, or a body without a bust.
    pub fn new(
        body: &Body,
        vertices: &[Vec3],
        groom: &Groom,
        material: Material,
        options: SimulationOptions,
    ) -> Result<Self, HairError> {
        let count = groom.guides.count();
        if count == 0 || groom.roots.len() != count || groom.clearances.len() != count {
            return Err(HairError::data("groom", "as many guides as roots, one or more", count));
        }
        let topology = std::sync::Arc::clone(body.model().topology());
        let bust = Bust::new(body.model())?;
        let surface = bust.surface(vertices);
        let steps = (options.looks * options.steps) as f64;
        let forces = Forces {
            step: (1.0 / (options.fps * steps)) as f32,
            drag: material.drag as f32,
            friction: material.friction as f32,
            gravity: Lane3::splat(GRAVITY * Vec3::NEG_Y),
        };
        let make = Make {
            bending: material.bending(),
            twist_ratio: material.twist_ratio,
            root_stiffness: material.root_stiffness,
            held_tip: false,
        };
        let origin = centroid(surface.vertices());
        let rest = body.rest_vertices();
        let mut root_frames = Vec::with_capacity(count);
        // The groom is carried from the template pose to the first one, each guide rigidly with the skin at its root.
        let mut placed = Vec::with_capacity(count * POINTS);
        for (root, guide) in groom.roots.iter().zip(groom.guides.iter()) {
            let (skin, now) = (root.frame(&topology, rest), root.frame(&topology, vertices));
            root_frames.push(skin.transpose() * frame_along((guide[1] - guide[0]).normalize_or(skin.z_axis)));
            let at = root.position(&topology, vertices);
            placed.extend(guide.iter().map(|&p| at + now * (skin.transpose() * (p - guide[0])) - origin));
        }
        let positions: Vec<Vec3> = groom.roots.iter().map(|root| root.position(&topology, rest)).collect();
        let mut simulation = Self {
            neighbours: nearest_roots(&positions, NEIGHBOURS),
            topology,
            bust,
            surface,
            roots: groom.roots.clone(),
            root_frames,
            slots: Vec::new(),
            forces,
            material,
            options,
            origin,
            time: 0.0,
            before: vertices.to_vec(),
        };
        simulation.slots = (0..count)
            .step_by(LANES)
            .map(|first| {
                let guides: [usize; LANES] = std::array::from_fn(|lane| (first + lane).min(count - 1));
                let mut points = [Lane3::default(); POINTS];
                for (lane, &guide) in guides.iter().enumerate() {
                    for (point, lanes) in points.iter_mut().enumerate() {
                        lanes.set(lane, placed[guide * POINTS + point]);
                    }
                }
                let (roots, frame) = simulation.roots_at(&guides, vertices);
                Slot {
                    block: Block::new(points, frame, make, &forces),
                    clearance: guides.map(|guide| groom.clearances[guide]),
                    guides,
                    anchors: [[Anchor::default(); LANES]; POINTS],
                    distance: [[0.0; LANES]; POINTS],
                    skin: [Lane::default(); POINTS],
                    roots: [roots; 2],
                    frames: [frame; 2],
                }
            })
            .collect();
        Ok(simulation)
    }

    /// Number of guides.
    pub fn guide_count(&self) -> usize {
        self.roots.len()
    }

    /// Moves on by one frame: the body goes evenly from where it was to `vertices` (m).
    pub fn step(&mut self, vertices: &[Vec3], wind: &Wind) {
        let looks = self.options.looks;
        let seconds = 1.0 / (self.options.fps * looks as f64);
        let start = self.bust.gather(&self.before);
        let end = self.bust.gather(vertices);
        self.move_origin(centroid(&start));
        for look in 1..=looks {
            let part = look as f64 / looks as f64;
            let at: Vec<Vec3> = start.iter().zip(&end).map(|(a, b)| a.lerp(*b, part) - self.origin).collect();
            let velocities: Vec<Vec3> = start.iter().zip(&end).map(|(a, b)| (*b - *a) * self.options.fps).collect();
            let body: Vec<Vec3> = self.body_at(vertices, part);
            self.rub(seconds);
            self.look(&at, &velocities, seconds);
            self.advance(&body, wind, seconds);
        }
        self.settle_contacts();
        self.before.copy_from_slice(vertices);
    }

    /// Positions of all guides in world (m), `POINTS` each.
    pub fn positions(&self) -> Vec<Vec3> {
        let mut positions = vec![Vec3::ZERO; self.roots.len() * POINTS];
        for slot in &self.slots {
            for (lane, &guide) in slot.guides.iter().enumerate() {
                for point in 0..POINTS {
                    positions[guide * POINTS + point] = slot.block.x[point].get(lane) + self.origin;
                }
            }
        }
        positions
    }

    /// The body's vertices on the scalp part of the way; the others stay where they were.
    fn body_at(&self, vertices: &[Vec3], part: f64) -> Vec<Vec3> {
        let mut body = self.before.clone();
        for root in &self.roots {
            for vertex in self.topology.faces()[root.face as usize] {
                let vertex = vertex as usize;
                body[vertex] = self.before[vertex].lerp(vertices[vertex], part);
            }
        }
        body
    }

    fn roots_at(&self, guides: &[usize; LANES], body: &[Vec3]) -> (Lane3, Frame) {
        let (mut at, mut frame) = (Lane3::default(), Frame::default());
        for (lane, &guide) in guides.iter().enumerate() {
            let root = &self.roots[guide];
            at.set(lane, root.position(&self.topology, body) - self.origin);
            let world = root.frame(&self.topology, body) * self.root_frames[guide];
            frame.first.set(lane, world.x_axis);
            frame.second.set(lane, world.y_axis);
            frame.tangent.set(lane, world.z_axis);
        }
        (at, frame)
    }

    fn move_origin(&mut self, to: Vec3) {
        let shift = Lane3::splat(self.origin - to);
        for slot in &mut self.slots {
            for x in &mut slot.block.x {
                *x += shift;
            }
            slot.roots[1] += shift;
        }
        let shifted: Vec<Vec3> = self.surface.vertices().iter().map(|&x| x + (self.origin - to)).collect();
        self.surface.set(&shifted);
        self.origin = to;
    }

    /// Neighbouring guides take on each other's velocities.
    fn rub(&mut self, seconds: f64) {
        let part = 1.0 - (-self.material.cohesion * seconds).exp();
        if part <= 0.0 {
            return;
        }
        let mut velocities = vec![[0.0f32; 3]; self.roots.len() * POINTS];
        for slot in &self.slots {
            for (lane, &guide) in slot.guides.iter().enumerate() {
                for point in 0..POINTS {
                    let v = &slot.block.v[point];
                    velocities[guide * POINTS + point] = [v.x.0[lane], v.y.0[lane], v.z.0[lane]];
                }
            }
        }
        let neighbours = &self.neighbours;
        self.slots.par_iter_mut().for_each(|slot| {
            for lane in 0..LANES {
                let around = &neighbours[slot.guides[lane]];
                let share = part as f32 / around.len().max(1) as f32;
                for point in 1..POINTS {
                    let v = &mut slot.block.v[point];
                    let own = [v.x.0[lane], v.y.0[lane], v.z.0[lane]];
                    let mut change = [0.0f32; 3];
                    for &other in around {
                        let theirs = velocities[other as usize * POINTS + point];
                        for axis in 0..3 {
                            change[axis] += theirs[axis] - own[axis];
                        }
                    }
                    v.x.0[lane] += share * change[0];
                    v.y.0[lane] += share * change[1];
                    v.z.0[lane] += share * change[2];
                }
            }
        });
    }

    /// Finds the skin near every point, where it will be after `seconds`.
    fn look(&mut self, at: &[Vec3], velocities: &[Vec3], seconds: f64) {
        let drift = centroid(at) - centroid(self.surface.vertices());
        let moved = at
            .iter()
            .zip(self.surface.vertices())
            .map(|(now, before)| now.distance(*before + drift))
            .fold(0.0, f64::max);
        self.surface.set(at);
        let surface = &self.surface;
        self.slots.par_iter_mut().for_each(|slot| slot.look(surface, velocities, moved, drift, seconds));
    }

    /// Steps of the rods up to the next look.
    fn advance(&mut self, body: &[Vec3], wind: &Wind, seconds: f64) {
        let ends: Vec<(Lane3, Frame)> = self.slots.iter().map(|slot| self.roots_at(&slot.guides, body)).collect();
        let (forces, steps, time, origin) = (self.forces, self.options.steps, self.time, self.origin);
        self.slots.par_iter_mut().zip(ends).for_each(|(slot, (root, frame))| {
            slot.roots = [slot.roots[1], root];
            slot.frames = [slot.frames[1], frame];
            let air = Lane3::splat(wind.velocity(time, origin + slot.block.x[POINTS / 2].get(0)));
            for step in 1..=steps {
                slot.step(step as f32 / steps as f32, air, &forces, seconds as f32);
            }
        });
        self.time += seconds;
    }

    /// At the end of a frame no point is in the skin.
    fn settle_contacts(&mut self) {
        let surface = &self.surface;
        self.slots.par_iter_mut().for_each(|slot| {
            for point in 1..POINTS {
                for lane in 0..LANES {
                    let p = slot.block.x[point].get(lane);
                    let above = slot.block.planes[point].normal.get(lane).dot(p) - f64::from(slot.skin[point].0[lane]);
                    if above < DOUBTFUL {
                        let free = surface.pushed_out(p, 0.5 * crate::CLEARANCE, REACH);
                        slot.block.x[point].set(lane, free);
                    }
                }
            }
        });
    }
}

impl Slot {
    fn look(&mut self, surface: &Surface, velocities: &[Vec3], moved: f64, drift: Vec3, seconds: f64) {
        for point in 1..POINTS {
            for lane in 0..LANES {
                let p = self.block.x[point].get(lane);
                let v = self.block.v[point].get(lane);
                // The skin comes nearer by its own motion, and came so by that of the point since the last look.
                let own = (v * seconds - drift).length();
                let bound = f64::from(self.distance[point][lane]) - own - moved;
                self.distance[point][lane] = bound as f32;
                if bound > NEAR {
                    self.clear(point, lane);
                    continue;
                }
                let ahead = p + v * seconds;
                let anchor = &mut self.anchors[point][lane];
                let Some((at, outwards)) = anchor.follow(surface, ahead).or_else(|| anchor.find(surface, ahead)) else {
                    self.distance[point][lane] = REACH as f32;
                    self.clear(point, lane);
                    continue;
                };
                let distance = (ahead - at).dot(outwards);
                self.distance[point][lane] = distance.abs() as f32;
                let face = surface.topology().faces()[anchor.face as usize];
                let velocity: Vec3 =
                    (0..3).map(|i| f64::from(anchor.barycentric[i]) * velocities[face[i] as usize]).sum();
                let plane = &mut self.block.planes[point];
                plane.normal.set(lane, outwards);
                plane.velocity.set(lane, velocity);
                let along = point as f64 / (POINTS - 1) as f64;
                let clearance = self.clearance[lane].min(crate::CLEARANCE + 0.06 * along);
                let skin = outwards.dot(at);
                // No further out than a little beyond where the point is now.
                let reachable = (skin + clearance).min(outwards.dot(ahead) + DEEPEST.max(crate::CLEARANCE - distance));
                plane.offset.0[lane] = reachable as f32;
                plane.rate.0[lane] = outwards.dot(velocity) as f32;
                self.skin[point].0[lane] = skin as f32;
            }
        }
    }

    /// There is nothing near a point.
    fn clear(&mut self, point: usize, lane: usize) {
        self.block.planes[point].normal.set(lane, Vec3::ZERO);
        self.block.planes[point].offset.0[lane] = -1.0;
        self.block.planes[point].rate.0[lane] = 0.0;
        self.anchors[point][lane].slack = -1.0;
        self.skin[point].0[lane] = -1.0;
    }

    fn step(&mut self, part: f32, air: Lane3, forces: &Forces, seconds: f32) {
        let weight = Lane::splat(part);
        let between = |a: Lane3, b: Lane3| a + (b - a) * weight;
        let unit = |v: Lane3| v * v.length().recip();
        let root = between(self.roots[0], self.roots[1]);
        let frame = Frame {
            first: unit(between(self.frames[0].first, self.frames[1].first)),
            second: unit(between(self.frames[0].second, self.frames[1].second)),
            tangent: unit(between(self.frames[0].tangent, self.frames[1].tangent)),
        };
        // Planes are known for the end of the time between two looks and go there evenly.
        let left = Lane::splat((1.0 - part) * seconds);
        let mut planes: [Plane; POINTS] = self.block.planes;
        for plane in &mut planes[1..] {
            plane.offset = plane.offset - plane.rate * left;
        }
        std::mem::swap(&mut self.block.planes, &mut planes);
        self.block.step(root, frame, air, forces);
        self.block.planes = planes;
    }
}

impl Anchor {
    /// The same place where it is now, with the way out, if the point is still near enough to it.
    fn follow(&self, surface: &Surface, p: Vec3) -> Option<(Vec3, Vec3)> {
        if self.slack < 0.0 {
            return None;
        }
        let frame = face_frame(surface, self.face);
        let [a, b, c] = corners(surface.topology().faces()[self.face as usize], surface.vertices());
        let [i, j, k] = self.barycentric.map(f64::from);
        let at = i * a + j * b + k * c;
        let offset = frame.transpose() * (p - at);
        let away = offset.distance(Vec3::from_array(self.offset.map(f64::from)));
        (away <= f64::from(self.slack)).then(|| (at, frame * Vec3::from_array(self.outwards.map(f64::from))))
    }

    /// The nearest place of all.
    fn find(&mut self, surface: &Surface, p: Vec3) -> Option<(Vec3, Vec3)> {
        let contact = surface.contact(p, REACH, Some(self.face))?;
        let into_face = face_frame(surface, contact.at.face).transpose();
        let [least, part] = SLACK;
        *self = Self {
            face: contact.at.face,
            barycentric: contact.at.barycentric.map(|x| x as f32),
            offset: (into_face * (p - contact.at.point)).to_array().map(|x| x as f32),
            outwards: (into_face * contact.outwards).to_array().map(|x| x as f32),
            slack: least.max(part * contact.distance) as f32,
        };
        Some((contact.at.point, contact.outwards))
    }
}

/// A right-handed frame that moves with a face.
fn face_frame(surface: &Surface, face: u32) -> Mat3 {
    let [a, b, c] = corners(surface.topology().faces()[face as usize], surface.vertices());
    let along = (b - a).normalize_or(Vec3::X);
    let normal = (b - a).cross(c - a).normalize_or(Vec3::Y);
    Mat3::from_cols(along, normal.cross(along), normal)
}

/// A right-handed frame whose third axis is `tangent`.
fn frame_along(tangent: Vec3) -> Mat3 {
    let first = tangent.any_orthonormal_vector();
    Mat3::from_cols(first, tangent.cross(first), tangent)
}
