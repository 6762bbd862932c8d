//! The moving body as an obstacle.

use super::bumps::find_bumps;
use super::closest::{Closest, Feature, closest_on_triangle};
use super::groups::{LIMB_COUNT, limb};
use super::tree::FaceTree;
use crate::error::{ClothError, check_count};
use modiste_body::Part;
use modiste_core::{Topology, Vec3};
use std::sync::Arc;

/// A point of the body's surface that moves with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyPoint {
    /// The face.
    pub face: u32,
    /// Barycentric coordinates in the face.
    pub barycentric: [f64; 3],
}

/// All limbs.
pub(crate) const EVERYWHERE: u8 = u8::MAX;

/// The body as an obstacle: a closed surface whose vertices move in straight lines within a frame.
#[derive(Debug, Clone)]
pub struct BodyCollider {
    topology: Arc<Topology>,
    /// One tree per limb, or a single one where the parts are not known.
    trees: Vec<(u8, FaceTree)>,
    start: Vec<Vec3>,
    end: Vec<Vec3>,
    now: Vec<Vec3>,
    before: Vec<Vec3>,
    frame_motion: f64,
    substep_motion: f64,
    /// Vertices at sharp convex places, with their limbs.
    bumps: Vec<(u32, u8)>,
}

impl BodyCollider {
    /// A body at rest at `start` (m).
    ///
    /// # Errors
    /// A count that does not match the topology.
    pub fn new(topology: Arc<Topology>, start: &[Vec3]) -> Result<Self, ClothError> {
        check_count("body vertices", topology.vertex_count(), start.len())?;
        let all = (0u32..).take(topology.face_count()).collect();
        let tree = FaceTree::new(topology.faces(), all, start);
        let bumps = find_bumps(&topology, start).into_iter().map(|vertex| (vertex, EVERYWHERE)).collect();
        Ok(Self {
            trees: vec![(EVERYWHERE, tree)],
            start: start.to_vec(),
            end: start.to_vec(),
            now: start.to_vec(),
            before: start.to_vec(),
            frame_motion: 0.0,
            substep_motion: 0.0,
            bumps,
            topology,
        })
    }

    /// No body at all.
    pub fn none() -> Self {
        let topology = Topology::new(0, Vec::new());
        let topology = Arc::new(topology.unwrap_or_else(|_| unreachable!("no faces, nothing out of range")));
        Self {
            topology,
            trees: Vec::new(),
            start: Vec::new(),
            end: Vec::new(),
            now: Vec::new(),
            before: Vec::new(),
            frame_motion: 0.0,
            substep_motion: 0.0,
            bumps: Vec::new(),
        }
    }

    /// Tells the part of each face, so that cloth with [`ClothModel::set_face_parts`](crate::ClothModel::set_face_parts)
    /// can tell the limbs apart.
    ///
    /// # Errors
    /// A count that does not match.
    pub fn set_face_parts(&mut self, parts: &[Part]) -> Result<(), ClothError> {
        check_count("body face parts", self.topology.face_count(), parts.len())?;
        let limbs: Vec<u8> = parts.iter().map(|part| 1 << limb(*part)).collect();
        self.trees = (0..LIMB_COUNT)
            .map(|limb| {
                let bit = 1u8 << limb;
                let faces = (0u32..).zip(&limbs).filter(|(_, face_bit)| **face_bit == bit).map(|(f, _)| f);
                (bit, FaceTree::new(self.topology.faces(), faces.collect(), &self.start))
            })
            .collect();
        for (vertex, limb) in &mut self.bumps {
            let around = self.topology.vertex_faces(*vertex as usize);
            *limb = around.iter().fold(0, |mask, face| mask | limbs[*face as usize]);
        }
        Ok(())
    }

    /// Sets where the vertices (m) will be at the end of the next step.
    ///
    /// # Panics
    /// If the number of vertices is not that of the topology.
    pub fn advance_to(&mut self, end: &[Vec3]) {
        assert_eq!(end.len(), self.end.len(), "one position per body vertex");
        self.end.copy_from_slice(end);
    }

    /// The mesh of the body.
    pub fn topology(&self) -> &Arc<Topology> {
        &self.topology
    }

    /// Positions (m) at the end of the frame that was last stepped or set.
    pub fn positions(&self) -> &[Vec3] {
        &self.end
    }

    /// The point of the body closest to `p` at the start of the frame, nearer than `max_distance` (m), and its signed distance,
    /// negative inside.
    pub fn closest(&self, p: Vec3, max_distance: f64) -> Option<(BodyPoint, f64)> {
        let touch = self.search(p, max_distance, EVERYWHERE, None)?;
        Some((touch.point, touch.distance))
    }

    /// How far the fastest vertex goes within the frame (m).
    pub(crate) fn frame_motion(&self) -> f64 {
        self.frame_motion
    }

    /// How far the fastest vertex goes within a substep (m).
    pub(crate) fn substep_motion(&self) -> f64 {
        self.substep_motion
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.topology.face_count() == 0
    }

    /// Starts a frame of so many substeps: boxes fitted to where the body is.
    pub(crate) fn begin_frame(&mut self, substeps: usize) {
        let squared = self.start.iter().zip(&self.end).map(|(a, b)| a.distance_squared(*b)).fold(0.0, f64::max);
        self.frame_motion = squared.sqrt();
        self.substep_motion = self.frame_motion / substeps as f64;
        self.now.copy_from_slice(&self.start);
        self.before.copy_from_slice(&self.start);
        for (_, tree) in &mut self.trees {
            tree.refit(self.topology.faces(), &self.start);
        }
    }

    /// Moves to the share `time` (0..=1) of the frame.
    pub(crate) fn move_to(&mut self, time: f64) {
        std::mem::swap(&mut self.now, &mut self.before);
        for ((now, start), end) in self.now.iter_mut().zip(&self.start).zip(&self.end) {
            *now = start.lerp(*end, time);
        }
    }

    /// Ends a frame: the body has arrived.
    pub(crate) fn end_frame(&mut self) {
        self.start.copy_from_slice(&self.end);
        for (_, tree) in &mut self.trees {
            tree.refit(self.topology.faces(), &self.start);
        }
        self.now.copy_from_slice(&self.start);
    }

    /// Vertices at sharp convex places, with the limbs that they are on.
    pub(crate) fn bumps(&self) -> &[(u32, u8)] {
        &self.bumps
    }

    /// Where a vertex is now (m).
    pub(crate) fn vertex(&self, vertex: u32) -> Vec3 {
        self.now[vertex as usize]
    }

    /// The outward normal at a vertex now, unit.
    pub(crate) fn vertex_normal(&self, vertex: u32) -> Vec3 {
        let around = self.topology.vertex_faces(vertex as usize).iter();
        let area = around.map(|&face| {
            let [a, b, c] = self.corners(face, &self.now);
            (b - a).cross(c - a)
        });
        area.sum::<Vec3>().normalize_or_zero()
    }

    fn corners(&self, face: u32, x: &[Vec3]) -> [Vec3; 3] {
        self.topology.faces()[face as usize].map(|v| x[v as usize])
    }

    /// The place of a surface point now, and where it was one substep before.
    #[inline]
    pub(crate) fn place(&self, point: &BodyPoint) -> (Vec3, Vec3) {
        let [u, v, w] = point.barycentric;
        let [a, b, c] = self.corners(point.face, &self.now);
        let [d, e, f] = self.corners(point.face, &self.before);
        (a * u + b * v + c * w, d * u + e * v + f * w)
    }

    /// A right-handed frame of a face now: first edge, its normal, and across.
    #[inline]
    pub(crate) fn face_frame(&self, face: u32) -> [Vec3; 3] {
        let [a, b, c] = self.corners(face, &self.now);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let along = (b - a).normalize_or_zero();
        [along, normal, normal.cross(along)]
    }

    /// The closest point on the limbs in `mask`, on faces that look against `facing` where it is given. By the trees,
    /// which fit only at the start and the end of a frame.
    pub(crate) fn search(&self, p: Vec3, max_distance: f64, mask: u8, facing: Option<Vec3>) -> Option<Touch> {
        let mut best = max_distance;
        let mut found = None;
        for (bit, tree) in &self.trees {
            if bit & mask != 0 {
                found = tree.closest(self.topology.faces(), &self.now, p, facing, &mut best).or(found);
            }
        }
        found.map(|(face, closest)| self.touch(p, face, &closest))
    }

    /// The closest point near `face` now: walks over the surface as long as it gets closer.
    pub(crate) fn walk(&self, p: Vec3, face: u32) -> Touch {
        let here = closest_on_triangle(p, self.corners(face, &self.now));
        if here.feature == Feature::Inside {
            // Straight above the inside of a face the distance has a minimum.
            return self.touch(p, face, &here);
        }
        let faces = self.topology.faces();
        let distance = |v: u32| self.now[v as usize].distance_squared(p);
        let corners = faces[face as usize];
        let mut vertex = corners[0];
        let mut best = distance(vertex);
        for &other in &corners[1..] {
            let squared = distance(other);
            if squared < best {
                (vertex, best) = (other, squared);
            }
        }
        loop {
            let mut next = vertex;
            for &other in self.topology.neighbours(vertex as usize) {
                let squared = distance(other);
                if squared < best {
                    (next, best) = (other, squared);
                }
            }
            if next == vertex {
                break;
            }
            vertex = next;
        }
        let mut found = (face, here);
        let mut best = found.1.point.distance_squared(p);
        for &candidate in self.topology.vertex_faces(vertex as usize) {
            if candidate == face {
                continue;
            }
            let closest = closest_on_triangle(p, self.corners(candidate, &self.now));
            let squared = closest.point.distance_squared(p);
            if squared < best {
                best = squared;
                found = (candidate, closest);
            }
        }
        self.touch(p, found.0, &found.1)
    }

    /// Turns a closest point into a signed distance with its outward normal.
    fn touch(&self, p: Vec3, face: u32, closest: &Closest) -> Touch {
        let outward = self.pseudo_normal(face, closest.feature);
        let offset = p - closest.point;
        let length = offset.length();
        let inside = offset.dot(outward) < 0.0;
        let normal = if length < 1e-7 {
            outward.normalize_or_zero()
        } else if inside {
            -offset / length
        } else {
            offset / length
        };
        let point = BodyPoint { face, barycentric: closest.barycentric };
        Touch { point, normal, distance: if inside { -length } else { length } }
    }

    /// A normal whose side of the surface is right at the feature (Bærentzen and Aanæs 2005).
    fn pseudo_normal(&self, face: u32, feature: Feature) -> Vec3 {
        let normal = |face: u32| {
            let [a, b, c] = self.corners(face, &self.now);
            (b - a).cross(c - a).normalize_or_zero()
        };
        let corners = self.topology.faces()[face as usize];
        match feature {
            Feature::Inside => normal(face),
            Feature::Edge(i) => {
                let ends = [corners[i], corners[(i + 1) % 3]];
                let around = self.topology.vertex_faces(ends[0] as usize).iter();
                around.filter(|&&f| self.topology.faces()[f as usize].contains(&ends[1])).map(|&f| normal(f)).sum()
            }
            Feature::Corner(i) => {
                let centre = corners[i];
                let weighted = |&f: &u32| {
                    let others = self.topology.faces()[f as usize];
                    let at = others.iter().position(|&v| v == centre).unwrap_or(0);
                    let [a, b, c] = [0, 1, 2].map(|k| self.now[others[(at + k) % 3] as usize]);
                    normal(f) * (b - a).angle_between(c - a)
                };
                self.topology.vertex_faces(centre as usize).iter().map(weighted).sum()
            }
        }
    }
}

/// The body's surface as seen from a point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Touch {
    /// The closest point as a material point.
    pub(crate) point: BodyPoint,
    /// Outward direction of growing distance, unit.
    pub(crate) normal: Vec3,
    /// Signed distance (m), negative inside.
    pub(crate) distance: f64,
}
