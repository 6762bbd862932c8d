//! The part of the body that hair can touch, as an exact surface.

use std::sync::Arc;

use modiste_body::{Part, ScapeModel};
use modiste_core::{SurfacePoint, Topology, TriangleBvh, Vec3, corners, signed_distance};

use crate::HairError;

/// Parts of the body that hair can lie against; hands and forearms pass through it, as in the thesis (§2.1).
const TOUCHED: [Part; 8] = [
    Part::Head,
    Part::Neck,
    Part::Chest,
    Part::Abdomen,
    Part::LeftShoulder,
    Part::RightShoulder,
    Part::LeftUpperArm,
    Part::RightUpperArm,
];

/// Head, neck, shoulders, upper arms and trunk of a body: their faces, and which vertices of the body they are made of.
#[derive(Debug, Clone)]
pub struct Bust {
    topology: Arc<Topology>,
    /// Vertex of the body per vertex of the bust.
    vertices: Vec<u32>,
    /// Whether a face may be crossed by another part: arms, and what they lie against.
    crossed: Arc<[bool]>,
}

/// Faces of the trunk nearer to an upper arm than this in the template pose (m) may be crossed by it.
const ARM_REACH: f64 = 0.10;
/// How far below cloth hair can come (m): what is further behind is on its other side, past a hem or a sleeve.
pub(crate) const CLOTH_DEPTH: f64 = 0.03;
/// Places of a surface whose distances from a point differ by less than this (m) are as near.
const AS_NEAR: f64 = 1e-5;
/// Where a point of the surface is asked whether it can be seen from outside (m above it).
const JUST_OUTSIDE: f64 = 1e-4;

/// A bust in one pose, ready for questions.
#[derive(Debug, Clone)]
pub struct Surface {
    topology: Arc<Topology>,
    x: Vec<Vec3>,
    tree: TriangleBvh,
    /// Whether each vertex lies on the rim of the surface.
    rim: Arc<[bool]>,
    /// Deeper than this behind it (m), a point is taken to look past the surface: infinite for skin.
    deepest: f64,
    /// Whether each face may be crossed by others of the surface; none where that is ruled out.
    crossed: Arc<[bool]>,
}

/// Where a point is with regard to a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Nearest point of the surface.
    pub at: SurfacePoint,
    /// Distance (m), negative inside.
    pub distance: f64,
    /// Unit vector along which the distance grows.
    pub outwards: Vec3,
}

impl Bust {
    /// The bust of a body model.
    ///
    /// # Errors
    /// A model without the parts.
    pub fn new(model: &ScapeModel) -> Result<Self, HairError> {
        let parts = model.vertex_parts();
        let body = model.topology();
        let kept: Vec<[u32; 3]> = body
            .faces()
            .iter()
            .filter(|face| face.iter().all(|&vertex| TOUCHED.contains(&parts[vertex as usize])))
            .copied()
            .collect();
        let mut index = vec![u32::MAX; body.vertex_count()];
        let mut vertices = Vec::new();
        for &vertex in kept.as_flattened() {
            if index[vertex as usize] == u32::MAX {
                index[vertex as usize] = vertices.len() as u32;
                vertices.push(vertex);
            }
        }
        let faces = kept.into_iter().map(|face| face.map(|vertex| index[vertex as usize])).collect();
        let topology =
            Topology::new(vertices.len(), faces).map_err(|error| HairError::data("bust", "a mesh", error))?;
        if topology.face_count() == 0 {
            return Err(HairError::data("bust", "faces of head, neck and shoulders", "none"));
        }
        let rest = model.template();
        let arm = |vertex: u32| matches!(parts[vertex as usize], Part::LeftUpperArm | Part::RightUpperArm);
        let arms: Vec<Vec3> = vertices.iter().filter(|&&v| arm(v)).map(|&v| rest[v as usize]).collect();
        let crossed = topology
            .faces()
            .iter()
            .map(|face| {
                let vertex = vertices[face[0] as usize];
                let at = rest[vertex as usize];
                parts[vertex as usize] != Part::Head
                    && arms.iter().any(|arm| arm.distance_squared(at) < ARM_REACH * ARM_REACH)
            })
            .collect();
        Ok(Self { topology: Arc::new(topology), vertices, crossed })
    }

    /// Vertex of the body per vertex of the bust.
    pub fn vertices(&self) -> &[u32] {
        &self.vertices
    }

    /// Its faces.
    pub fn topology(&self) -> &Arc<Topology> {
        &self.topology
    }

    /// Positions (m) of its vertices, taken from those of the body.
    pub fn gather(&self, body: &[Vec3]) -> Vec<Vec3> {
        self.vertices.iter().map(|&vertex| body[vertex as usize]).collect()
    }

    /// The bust of a posed body.
    pub fn surface(&self, body: &[Vec3]) -> Surface {
        Surface { crossed: Arc::clone(&self.crossed), ..Surface::new(&self.topology, self.gather(body)) }
    }
}

impl Surface {
    /// A surface with these positions (m).
    pub fn new(topology: &Arc<Topology>, x: Vec<Vec3>) -> Self {
        let tree = TriangleBvh::new(topology, &x);
        let mut rim = vec![false; topology.vertex_count()];
        for edge in topology.edges().iter().filter(|edge| edge.faces[1].is_none()) {
            for vertex in edge.vertices {
                rim[vertex as usize] = true;
            }
        }
        Self {
            topology: Arc::clone(topology),
            x,
            tree,
            rim: rim.into(),
            crossed: Arc::from([]),
            deepest: f64::INFINITY,
        }
    }

    /// A surface of cloth: open, so that only just behind it a point is below it.
    pub fn sheet(topology: &Arc<Topology>, x: Vec<Vec3>) -> Self {
        Self { deepest: CLOTH_DEPTH, ..Self::new(topology, x) }
    }

    /// Moves it.
    ///
    /// # Panics
    /// If the number of vertices changes.
    pub fn set(&mut self, x: &[Vec3]) {
        self.x.copy_from_slice(x);
        self.tree.refit(&self.x);
    }

    /// Positions of its vertices (m).
    pub fn vertices(&self) -> &[Vec3] {
        &self.x
    }

    /// Its faces.
    pub fn topology(&self) -> &Arc<Topology> {
        &self.topology
    }

    /// The tree over its faces.
    pub fn tree(&self) -> &TriangleBvh {
        &self.tree
    }

    /// The nearest point of the surface if it is no further than `reach` (m); `likely` is a face to try first.
    ///
    /// A point whose nearest is on the rim (a collar, the cut through the waist) looks past the surface and is outside.
    pub fn contact(&self, p: Vec3, reach: f64, likely: Option<u32>) -> Option<Contact> {
        let at = self.tree.closest_point_near(&self.x, p, reach, likely)?;
        let past = self.is_on_rim(&at);
        let distance = if past { at.distance } else { signed_distance(&self.topology, &self.x, p, &at) };
        let distance = if distance < -self.deepest { at.distance } else { distance };
        if self.may_be_crossed(at.face) {
            return Some(self.contact_among_folds(p, at, distance, past));
        }
        Some(self.towards(p, at, distance))
    }

    /// The vertex nearest to a point, as the nearest corner of the nearest face, with its unit normal, if the surface is no
    /// further than `reach` (m) and the point does not look past its rim. `likely` is a face to try first.
    pub fn nearest_vertex(&self, p: Vec3, reach: f64, likely: u32) -> Option<(u32, Vec3)> {
        let at = self.tree.closest_point_near(&self.x, p, reach, Some(likely))?;
        let face = self.topology.faces()[at.face as usize];
        let away = |vertex: u32| self.x[vertex as usize].distance_squared(p);
        let vertex = face.into_iter().min_by(|&a, &b| away(a).total_cmp(&away(b)))?;
        if self.rim[vertex as usize] {
            return None;
        }
        let around = self.topology.vertex_faces(vertex as usize).iter();
        let normal: Vec3 = around
            .map(|&face| corners(self.topology.faces()[face as usize], &self.x))
            .map(|[a, b, c]| (b - a).cross(c - a))
            .sum();
        Some((vertex, normal.normalize_or_zero()))
    }

    /// Whether a point is behind a sheet, by no more than it can be. A point in the cloth, and where cloth is bunched up one
    /// that is before one fold and as far behind another, counts as behind, or the rounding of a stored frame would decide.
    pub(crate) fn is_behind(&self, p: Vec3) -> bool {
        let Some(contact) = self.contact(p, self.deepest, None) else { return false };
        let seen_from_behind = |face: u32, _| {
            let [a, b, c] = corners(self.topology.faces()[face as usize], &self.x);
            (b - a).cross(c - a).dot(p - a) < 0.0
        };
        let as_near = contact.at.distance + AS_NEAR;
        contact.distance < AS_NEAR
            || self
                .tree
                .closest_point_where(&self.x, p, as_near, None, seen_from_behind)
                .is_some_and(|at| !self.is_on_rim(&at) && signed_distance(&self.topology, &self.x, p, &at) < 0.0)
    }

    fn is_on_rim(&self, at: &SurfacePoint) -> bool {
        let face = self.topology.faces()[at.face as usize];
        (0..3).all(|i| at.barycentric[i] <= 0.0 || self.rim[face[i] as usize])
            && at.barycentric.iter().any(|&part| part <= 0.0)
    }

    /// Whether a face may be crossed by others, so that distances to it say little of the next place.
    pub fn may_be_crossed(&self, face: u32) -> bool {
        self.crossed.get(face as usize).copied().unwrap_or(false)
    }

    /// Where an arm has sunk into the chest, the nearest face does not tell inside from outside: the winding number does, and
    /// the way out leads to the nearest place that can be seen.
    fn contact_among_folds(&self, p: Vec3, at: SurfacePoint, distance: f64, past: bool) -> Contact {
        let inside = |p: Vec3| self.tree.winding_number(&self.x, p) > 0.5;
        if past || !inside(p) {
            return self.towards(p, at, at.distance);
        }
        let visible = |face: u32, at: Vec3| {
            let [a, b, c] = corners(self.topology.faces()[face as usize], &self.x);
            !inside(at + JUST_OUTSIDE * (b - a).cross(c - a).normalize_or_zero())
        };
        if distance < 0.0 && visible(at.face, at.point) {
            return self.towards(p, at, distance);
        }
        let out = self.tree.closest_point_where(&self.x, p, f64::INFINITY, None, visible).unwrap_or(at);
        self.towards(p, out, -out.distance)
    }

    fn towards(&self, p: Vec3, at: SurfacePoint, distance: f64) -> Contact {
        let away = if distance < 0.0 { at.point - p } else { p - at.point };
        let outwards = if at.distance > 1e-7 {
            away / at.distance
        } else {
            modiste_core::pseudonormal(&self.topology, &self.x, &at).normalize_or(Vec3::Y)
        };
        Contact { at, distance, outwards }
    }

    /// The point itself, or the nearest one that is `clearance` (m) above the surface when it is below that.
    pub fn pushed_out(&self, p: Vec3, clearance: f64, reach: f64) -> Vec3 {
        let mut p = p;
        // In a fold, the way out of one face leads into another; a few rounds settle it.
        for _ in 0..4 {
            match self.contact(p, reach, None) {
                Some(contact) if contact.distance < clearance => {
                    p = contact.at.point + (clearance + 1e-5) * contact.outwards;
                }
                _ => break,
            }
        }
        p
    }
}
