//! Which vertices make which triangles: the constant half of a mesh.

use std::collections::HashMap;

/// The triangles of a mesh and what follows from them alone: edges and neighbourhoods.
///
/// Constant; positions live beside it as a slice with one point per vertex. Share it by `Arc`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Topology {
    vertex_count: usize,
    faces: Vec<[u32; 3]>,
    edges: Vec<Edge>,
    neighbours: Adjacency,
    vertex_faces: Adjacency,
}

/// An undirected edge with the one or two faces at it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Edge {
    /// The two vertices, smaller index first.
    pub vertices: [u32; 2],
    /// The faces at the edge; the second is `None` on a boundary. Further faces of a non-manifold edge are not listed.
    pub faces: [Option<u32>; 2],
}

/// Variable-length lists of indices stored in one run (compressed rows).
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Adjacency {
    starts: Vec<u32>,
    items: Vec<u32>,
}

/// Why a list of faces is not a mesh.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
pub enum TopologyError {
    /// A face names a vertex that does not exist.
    #[error("face {face} names vertex {vertex}, but there are only {vertex_count} vertices")]
    VertexOutOfRange {
        /// The face at fault.
        face: usize,
        /// The vertex it names.
        vertex: u32,
        /// How many vertices there are.
        vertex_count: usize,
    },
    /// A face names the same vertex twice.
    #[error("face {face} names vertex {vertex} twice")]
    RepeatedVertex {
        /// The face at fault.
        face: usize,
        /// The vertex it repeats.
        vertex: u32,
    },
}

impl Adjacency {
    /// Builds rows from `(row, item)` pairs; within a row the order of the pairs is kept.
    pub fn from_pairs(row_count: usize, pairs: &[(u32, u32)]) -> Self {
        let mut starts = vec![0u32; row_count + 1];
        for &(row, _) in pairs {
            starts[row as usize + 1] += 1;
        }
        for row in 0..row_count {
            starts[row + 1] += starts[row];
        }
        let mut fill = starts.clone();
        let mut items = vec![0u32; pairs.len()];
        for &(row, item) in pairs {
            items[fill[row as usize] as usize] = item;
            fill[row as usize] += 1;
        }
        Self { starts, items }
    }

    /// The items of one row.
    #[inline]
    pub fn row(&self, row: usize) -> &[u32] {
        &self.items[self.starts[row] as usize..self.starts[row + 1] as usize]
    }

    /// Number of rows.
    pub fn row_count(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }
}

impl Topology {
    /// Checks the faces and derives edges and neighbourhoods.
    ///
    /// # Errors
    /// [`TopologyError`] names the first face with an index out of range or a repeated vertex.
    pub fn new(vertex_count: usize, faces: Vec<[u32; 3]>) -> Result<Self, TopologyError> {
        for (face, corners) in faces.iter().enumerate() {
            for (corner, &vertex) in corners.iter().enumerate() {
                if vertex as usize >= vertex_count {
                    return Err(TopologyError::VertexOutOfRange { face, vertex, vertex_count });
                }
                if corners[..corner].contains(&vertex) {
                    return Err(TopologyError::RepeatedVertex { face, vertex });
                }
            }
        }
        let mut edges: Vec<Edge> = Vec::with_capacity(faces.len() * 3 / 2);
        let mut edge_of: HashMap<[u32; 2], usize> = HashMap::with_capacity(faces.len() * 3 / 2);
        let mut vertex_face_pairs = Vec::with_capacity(faces.len() * 3);
        for (face, corners) in (0u32..).zip(&faces) {
            for corner in 0..3 {
                let (a, b) = (corners[corner], corners[(corner + 1) % 3]);
                let key = [a.min(b), a.max(b)];
                let index = *edge_of.entry(key).or_insert_with(|| {
                    edges.push(Edge { vertices: key, faces: [None, None] });
                    edges.len() - 1
                });
                if let Some(free) = edges[index].faces.iter_mut().find(|slot| slot.is_none()) {
                    *free = Some(face);
                }
                vertex_face_pairs.push((corners[corner], face));
            }
        }
        let mut neighbour_pairs = Vec::with_capacity(edges.len() * 2);
        for edge in &edges {
            let [a, b] = edge.vertices;
            neighbour_pairs.push((a, b));
            neighbour_pairs.push((b, a));
        }
        Ok(Self {
            vertex_count,
            neighbours: Adjacency::from_pairs(vertex_count, &neighbour_pairs),
            vertex_faces: Adjacency::from_pairs(vertex_count, &vertex_face_pairs),
            faces,
            edges,
        })
    }

    /// Number of vertices.
    #[inline]
    pub fn vertex_count(&self) -> usize {
        self.vertex_count
    }

    /// Number of triangles.
    #[inline]
    pub fn face_count(&self) -> usize {
        self.faces.len()
    }

    /// The triangles, counter-clockwise seen from outside.
    #[inline]
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// The undirected edges, in order of first appearance.
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// Vertices joined to `vertex` by an edge.
    #[inline]
    pub fn neighbours(&self, vertex: usize) -> &[u32] {
        self.neighbours.row(vertex)
    }

    /// Faces that touch `vertex`.
    #[inline]
    pub fn vertex_faces(&self, vertex: usize) -> &[u32] {
        self.vertex_faces.row(vertex)
    }
}

#[cfg(test)]
mod tests {
    use super::{Topology, TopologyError};

    #[test]
    fn two_triangles_share_one_edge() {
        let topology = Topology::new(4, vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        assert_eq!(topology.edges().len(), 5);
        let inner: Vec<_> = topology.edges().iter().filter(|e| e.faces[1].is_some()).collect();
        assert_eq!(inner.len(), 1);
        assert_eq!(inner[0].vertices, [0, 2]);
        let mut around = topology.neighbours(0).to_vec();
        around.sort_unstable();
        assert_eq!(around, [1, 2, 3]);
        assert_eq!(topology.vertex_faces(1), [0]);
    }

    #[test]
    fn bad_faces_are_named() {
        let out_of_range = Topology::new(3, vec![[0, 1, 3]]).unwrap_err();
        assert_eq!(out_of_range, TopologyError::VertexOutOfRange { face: 0, vertex: 3, vertex_count: 3 });
        let repeated = Topology::new(3, vec![[0, 1, 2], [0, 1, 1]]).unwrap_err();
        assert_eq!(repeated, TopologyError::RepeatedVertex { face: 1, vertex: 1 });
    }
}
