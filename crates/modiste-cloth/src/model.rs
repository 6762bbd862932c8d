//! What stays constant in a simulation of cloth.

use crate::contact::{BodyPoint, CollisionGroups};
use crate::energy::{Hinge, Membrane};
use crate::error::{ClothError, check_count, check_index, check_positive};
use crate::material::Fabric;
use modiste_body::Part;
use modiste_core::{Topology, Vec2, Vec3};
use std::sync::Arc;

/// A cloth: mesh, rest shape, fabric, and whatever holds it.
///
/// Each face has its own rest shape in panel space, so a welded garment of many panels works. Holds (seams, elastic
/// edges, attachments, pins) are plain lists that may be changed between frames.
#[derive(Debug, Clone)]
pub struct ClothModel {
    topology: Arc<Topology>,
    fabric: Fabric,
    membranes: Vec<Membrane>,
    hinges: Vec<Hinge>,
    masses: Vec<f64>,
    areas: Vec<f64>,
    edge_rest_lengths: Vec<f64>,
    groups: Option<CollisionGroups>,
    /// Pairs of vertices pulled together.
    pub seams: Vec<Seam>,
    /// Edges with a rest length of their own: elastic bands.
    pub elastic_edges: Vec<ElasticEdge>,
    /// Vertices held to points of the body.
    pub attachments: Vec<Attachment>,
    /// Vertices that move by their velocity alone, whatever pulls at them.
    pub pins: Vec<u32>,
}

/// Two vertices pulled together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seam {
    /// The two vertices.
    pub vertices: [u32; 2],
    /// Distance that the seam allows (m); let it shrink to zero over some frames.
    pub rest_length: f64,
    /// Stiffness (N/m).
    pub stiffness: f64,
}

/// An edge, or any pair of vertices, with an elastic thread along it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElasticEdge {
    /// The two vertices.
    pub vertices: [u32; 2],
    /// Rest length of the thread (m): the length in the panel times a scale below one for a gathered waist.
    pub rest_length: f64,
    /// Stiffness (N/m): modulus of the band (N) over the rest length.
    pub stiffness: f64,
}

/// A vertex held to a point that moves with the body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attachment {
    /// The cloth vertex.
    pub vertex: u32,
    /// The point of the body.
    pub point: BodyPoint,
    /// Height of the held place above the body's surface along its face normal (m).
    pub offset: f64,
    /// Stiffness (N/m).
    pub stiffness: f64,
    /// The most that it holds (N): pulled harder, the vertex slips, and comes back when it is let go.
    pub most: f64,
}

impl Seam {
    /// Stiffness (N/m) that closes seams of a garment within a few frames.
    pub const STIFFNESS: f64 = 300.0;

    /// A seam between two vertices that starts at `rest_length` (m).
    pub fn new(vertices: [u32; 2], rest_length: f64) -> Self {
        Self { vertices, rest_length, stiffness: Self::STIFFNESS }
    }
}

impl ClothModel {
    /// A cloth of one fabric.
    ///
    /// `rest_faces` are the corners of each face in panel space (m), counter-clockwise, x along the weft, y along the warp.
    ///
    /// # Errors
    /// A count that does not match, a face without rest area, a fabric out of range.
    pub fn new(topology: Arc<Topology>, rest_faces: Vec<[Vec2; 3]>, fabric: &Fabric) -> Result<Self, ClothError> {
        check_count("rest_faces", topology.face_count(), rest_faces.len())?;
        fabric.check()?;
        let membranes = topology
            .faces()
            .iter()
            .zip(&rest_faces)
            .enumerate()
            .map(|(face, (&corners, rest))| Membrane::new(face, corners, rest))
            .collect::<Result<Vec<_>, _>>()?;
        let mut areas = vec![0.0; topology.vertex_count()];
        for membrane in &membranes {
            for vertex in membrane.vertices {
                areas[vertex as usize] += membrane.area / 3.0;
            }
        }
        if let Some(vertex) = areas.iter().position(|&area| area <= 0.0) {
            return Err(ClothError::Value {
                field: "vertex area",
                want: "positive: a vertex without face",
                found: vertex as f64,
            });
        }
        let hinges =
            topology.edges().iter().filter_map(|e| Hinge::new(&topology, &rest_faces, e, &fabric.bend)).collect();
        let edge_rest_lengths = edge_rest_lengths(&topology, &rest_faces);
        Ok(Self {
            masses: areas.iter().map(|area| area * fabric.density).collect(),
            fabric: fabric.clone(),
            topology,
            membranes,
            hinges,
            areas,
            edge_rest_lengths,
            groups: None,
            seams: Vec::new(),
            elastic_edges: Vec::new(),
            attachments: Vec::new(),
            pins: Vec::new(),
        })
    }

    /// Tells which part of the body each face covers, so that a sleeve pinched between arm and torso stays with the arm.
    ///
    /// # Errors
    /// A count that does not match.
    pub fn set_face_parts(&mut self, face_parts: &[Part]) -> Result<(), ClothError> {
        check_count("face_parts", self.topology.face_count(), face_parts.len())?;
        self.groups = Some(CollisionGroups::from_face_parts(&self.topology, face_parts));
        Ok(())
    }

    /// Restricts contact to the limbs that each vertex covers.
    ///
    /// # Errors
    /// A count that does not match.
    pub fn set_collision_groups(&mut self, groups: CollisionGroups) -> Result<(), ClothError> {
        check_count("collision groups", self.topology.vertex_count(), groups.vertex_count())?;
        self.groups = Some(groups);
        Ok(())
    }

    /// Makes an elastic thread along edges whose rest length is `scale` times that in the panel, of `modulus` (N: force per
    /// relative stretch).
    ///
    /// # Errors
    /// A vertex out of range, a scale or a modulus that is not positive.
    pub fn add_elastic_band(&mut self, pairs: &[[u32; 2]], scale: f64, modulus: f64) -> Result<(), ClothError> {
        check_positive("elastic scale", scale)?;
        check_positive("elastic modulus", modulus)?;
        for &vertices in pairs {
            for vertex in vertices {
                check_index("elastic edges", vertex, self.topology.vertex_count())?;
            }
            let rest_length = scale * self.rest_length(vertices);
            self.elastic_edges.push(ElasticEdge { vertices, rest_length, stiffness: modulus / rest_length });
        }
        Ok(())
    }

    /// The mesh.
    pub fn topology(&self) -> &Arc<Topology> {
        &self.topology
    }

    /// The fabric.
    pub fn fabric(&self) -> &Fabric {
        &self.fabric
    }

    /// Membrane elements, one per face.
    pub fn membranes(&self) -> &[Membrane] {
        &self.membranes
    }

    /// Bending elements, one per inner edge.
    pub fn hinges(&self) -> &[Hinge] {
        &self.hinges
    }

    /// Mass of each vertex (kg).
    pub fn masses(&self) -> &[f64] {
        &self.masses
    }

    /// Rest area that belongs to each vertex (m²).
    pub fn areas(&self) -> &[f64] {
        &self.areas
    }

    /// Rest length of each edge of the topology (m).
    pub fn edge_rest_lengths(&self) -> &[f64] {
        &self.edge_rest_lengths
    }

    /// Which parts of the body each vertex collides with, if it is restricted.
    pub fn collision_groups(&self) -> Option<&CollisionGroups> {
        self.groups.as_ref()
    }

    /// Gives the hinges rest angles (rad) in place of zero, in the order of [`Self::hinges`].
    ///
    /// # Errors
    /// A count that does not match.
    pub fn set_rest_angles(&mut self, angles: &[f64]) -> Result<(), ClothError> {
        check_count("rest angles", self.hinges.len(), angles.len())?;
        for (hinge, angle) in self.hinges.iter_mut().zip(angles) {
            hinge.rest = 2.0 * (0.5 * angle).sin();
        }
        Ok(())
    }

    /// Elastic and gravitational energy (J).
    pub fn energy(&self, positions: &[Vec3], gravity: Vec3) -> f64 {
        let stretch: f64 = self.membranes.iter().map(|m| m.energy(&self.fabric.stretch, positions)).sum();
        let bend: f64 = self.hinges.iter().map(|h| h.energy(positions, h.normal(positions))).sum();
        let weight: f64 = positions.iter().zip(&self.masses).map(|(x, mass)| -mass * gravity.dot(*x)).sum();
        stretch + bend + weight
    }

    fn rest_length(&self, [a, b]: [u32; 2]) -> f64 {
        let key = [a.min(b), a.max(b)];
        let edge = self.topology.edges().iter().position(|edge| edge.vertices == key);
        edge.map_or(0.0, |edge| self.edge_rest_lengths[edge])
    }

    pub(crate) fn check_holds(&self) -> Result<(), ClothError> {
        let count = self.topology.vertex_count();
        let seams = self.seams.iter().flat_map(|seam| seam.vertices);
        let elastic = self.elastic_edges.iter().flat_map(|edge| edge.vertices);
        for (array, vertex) in (seams.map(|v| ("seams", v)))
            .chain(elastic.map(|v| ("elastic_edges", v)))
            .chain(self.attachments.iter().map(|a| ("attachments", a.vertex)))
            .chain(self.pins.iter().map(|&v| ("pins", v)))
        {
            check_index(array, vertex, count)?;
        }
        Ok(())
    }
}

fn edge_rest_lengths(topology: &Topology, rest_faces: &[[Vec2; 3]]) -> Vec<f64> {
    let in_face = |face: u32, [a, b]: [u32; 2]| {
        let corners = topology.faces()[face as usize];
        let place = |vertex| corners.iter().position(|&corner| corner == vertex).map(|c| rest_faces[face as usize][c]);
        match (place(a), place(b)) {
            (Some(a), Some(b)) => a.distance(b),
            _ => 0.0,
        }
    };
    topology
        .edges()
        .iter()
        .map(|edge| {
            let lengths = edge.faces.iter().flatten().map(|&face| in_face(face, edge.vertices));
            let (sum, count) = lengths.fold((0.0, 0.0), |(sum, count), length| (sum + length, count + 1.0));
            if count > 0.0 { sum / count } else { 0.0 }
        })
        .collect()
}
