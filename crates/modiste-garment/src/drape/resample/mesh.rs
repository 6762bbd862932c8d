//! A garment's mesh with more or fewer vertices, and where each of them comes from.

use std::collections::{BTreeMap, BinaryHeap};

use modiste_core::{Vec3, corners};

/// Where a vertex comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Origin {
    /// It is this vertex of the mesh that was resampled.
    Vertex(u32),
    /// It lies in the middle between two vertices of the new mesh, both of which come before it.
    Between([u32; 2]),
}

/// A mesh made from another.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Resampled {
    pub(super) origins: Vec<Origin>,
    pub(super) faces: Vec<[u32; 3]>,
    /// The old face that each face lies on, or took the place of.
    pub(super) face_origins: Vec<u32>,
    /// Texture coordinates of the corners of each face.
    pub(super) uv: Vec<[[f32; 2]; 3]>,
}

impl Resampled {
    /// The mesh as it is.
    pub(super) fn same(vertex_count: usize, faces: &[[u32; 3]], uv: &[[[f32; 2]; 3]]) -> Self {
        Self {
            origins: (0..vertex_count as u32).map(Origin::Vertex).collect(),
            faces: faces.to_vec(),
            face_origins: (0..faces.len() as u32).collect(),
            uv: uv.to_vec(),
        }
    }

    /// Numbers of all vertices, three each, from those of the old mesh: the mean where a vertex lies between two others.
    pub(super) fn carry(&self, old: &[f32]) -> Vec<f32> {
        let old = old.as_chunks::<3>().0;
        let mut new: Vec<[f32; 3]> = Vec::with_capacity(self.origins.len());
        for origin in &self.origins {
            new.push(match *origin {
                Origin::Vertex(vertex) => old[vertex as usize],
                Origin::Between(ends) => {
                    let [a, b] = ends.map(|end| new[end as usize]);
                    std::array::from_fn(|axis| 0.5 * (a[axis] + b[axis]))
                }
            });
        }
        new.into_flattened()
    }

    /// The same for points.
    pub(super) fn carry_points(&self, old: &[Vec3]) -> Vec<Vec3> {
        let mut new: Vec<Vec3> = Vec::with_capacity(self.origins.len());
        for origin in &self.origins {
            new.push(match *origin {
                Origin::Vertex(vertex) => old[vertex as usize],
                Origin::Between([a, b]) => 0.5 * (new[a as usize] + new[b as usize]),
            });
        }
        new
    }

    /// Halves the longest edge, with the faces at it, until there are `vertex_count` vertices. The longest edge of a mesh is
    /// the longest of both its faces, so that no angle becomes less than half of the smallest (Rivara 1984).
    pub(super) fn subdivide(mut self, template: &[Vec3], vertex_count: usize) -> Self {
        let mut places = self.carry_points(template);
        let mut at_edge: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
        for (index, face) in (0u32..).zip(&self.faces) {
            edges(*face).into_iter().for_each(|edge| at_edge.entry(edge).or_default().push(index));
        }
        let length = |places: &[Vec3], [a, b]: [u32; 2]| places[a as usize].distance_squared(places[b as usize]);
        // Lengths are not negative, so their bits are in their order.
        let mut queue: BinaryHeap<(u64, [u32; 2])> =
            at_edge.keys().map(|&edge| (length(&places, edge).to_bits(), edge)).collect();
        while self.origins.len() < vertex_count {
            let Some((_, edge)) = queue.pop() else { break };
            let Some(around) = at_edge.remove(&edge) else { continue };
            let middle = self.origins.len() as u32;
            self.origins.push(Origin::Between(edge));
            places.push(0.5 * (places[edge[0] as usize] + places[edge[1] as usize]));
            for face in around {
                let (old, new) = (face as usize, self.faces.len() as u32);
                let corners = self.faces[old];
                // Turned so that the edge goes from the first corner to the second.
                let turn = (0..3).find(|&turn| !edge.contains(&corners[(turn + 2) % 3])).unwrap_or(0);
                let [a, b, c] = [0, 1, 2].map(|corner| corners[(corner + turn) % 3]);
                let [uv_a, uv_b, uv_c] = [0, 1, 2].map(|corner| self.uv[old][(corner + turn) % 3]);
                let uv_middle = [0, 1].map(|axis| 0.5 * (uv_a[axis] + uv_b[axis]));
                self.faces[old] = [a, middle, c];
                self.uv[old] = [uv_a, uv_middle, uv_c];
                self.faces.push([middle, b, c]);
                self.uv.push([uv_middle, uv_b, uv_c]);
                self.face_origins.push(self.face_origins[old]);
                for edge in [[a, middle], [middle, c], [middle, b]] {
                    let edge = ascending(edge);
                    at_edge.entry(edge).or_insert_with(|| {
                        queue.push((length(&places, edge).to_bits(), edge));
                        Vec::new()
                    });
                }
                let mut put = |edge: [u32; 2], face: u32| at_edge.entry(ascending(edge)).or_default().push(face);
                put([a, middle], face);
                put([middle, c], face);
                put([middle, b], new);
                put([middle, c], new);
                if let Some(faces) = at_edge.get_mut(&ascending([b, c])) {
                    faces.iter_mut().filter(|other| **other == face).for_each(|other| *other = new);
                }
            }
        }
        self
    }

    /// Draws vertices onto a neighbour, the shortest edge first, until there are `vertex_count`, or none is left that can go
    /// without turning a face over or tying the mesh into a knot. Vertices that are `kept` stay, and so does the boundary.
    pub(super) fn coarsen(mut self, template: &[Vec3], vertex_count: usize, kept: &[bool]) -> Self {
        let places = self.carry_points(template);
        let mut alive = vec![true; places.len()];
        let mut left = places.len();
        let mut is_there = vec![true; self.faces.len()];
        let mut around: Vec<Vec<u32>> = vec![Vec::new(); places.len()];
        for (index, face) in (0u32..).zip(&self.faces) {
            face.iter().for_each(|&vertex| around[vertex as usize].push(index));
        }
        let mut stays = kept.to_vec();
        let mut counts: BTreeMap<[u32; 2], usize> = BTreeMap::new();
        self.faces.iter().flat_map(|face| edges(*face)).for_each(|edge| *counts.entry(edge).or_default() += 1);
        for (edge, _) in counts.iter().filter(|(_, count)| **count != 2) {
            edge.iter().for_each(|&vertex| stays[vertex as usize] = true);
        }
        let key = |[a, b]: [u32; 2]| {
            (std::cmp::Reverse(places[a as usize].distance_squared(places[b as usize]).to_bits()), [a, b])
        };
        let mut queue: BinaryHeap<_> = counts.keys().map(|&edge| key(edge)).collect();
        while left > vertex_count {
            let Some((_, edge)) = queue.pop() else { break };
            if !edge.iter().all(|&vertex| alive[vertex as usize]) {
                continue;
            }
            let ways = [edge, [edge[1], edge[0]]];
            let way = ways.into_iter().find(|&[gone, _]| !stays[gone as usize]);
            let Some([gone, to]) = way.filter(|&way| self.may_collapse(way, &around, &places)) else { continue };
            for face in std::mem::take(&mut around[gone as usize]) {
                let corners = &mut self.faces[face as usize];
                if corners.contains(&to) {
                    is_there[face as usize] = false;
                    corners.iter().for_each(|&other| around[other as usize].retain(|&at| at != face));
                } else {
                    corners.iter_mut().filter(|corner| **corner == gone).for_each(|corner| *corner = to);
                    around[to as usize].push(face);
                    queue
                        .extend(corners.iter().filter(|&&other| other != to).map(|&other| key(ascending([to, other]))));
                }
            }
            alive[gone as usize] = false;
            left -= 1;
        }
        self.without(&alive, &is_there)
    }

    /// Whether the first vertex can be drawn onto the second.
    fn may_collapse(&self, [gone, to]: [u32; 2], around: &[Vec<u32>], places: &[Vec3]) -> bool {
        let ring = |vertex: u32| {
            let faces = around[vertex as usize].iter().flat_map(|&face| self.faces[face as usize]);
            let mut ring: Vec<u32> = faces.filter(|&other| other != vertex).collect();
            ring.sort_unstable();
            ring.dedup();
            ring
        };
        let (own, other) = (ring(gone), ring(to));
        if own.binary_search(&to).is_err()
            || own.iter().filter(|&vertex| other.binary_search(vertex).is_ok()).count() != 2
        {
            return false;
        }
        around[gone as usize].iter().map(|&face| self.faces[face as usize]).filter(|face| !face.contains(&to)).all(
            |face| {
                let normal = |face: [u32; 3]| {
                    let [a, b, c] = corners(face, places);
                    (b - a).cross(c - a).normalize_or_zero()
                };
                normal(face).dot(normal(face.map(|vertex| if vertex == gone { to } else { vertex }))) > 0.3
            },
        )
    }

    /// Without the vertices and faces that are gone.
    fn without(&self, alive: &[bool], is_there: &[bool]) -> Self {
        let mut places = vec![0u32; alive.len()];
        let mut origins = Vec::new();
        for (vertex, _) in alive.iter().enumerate().filter(|(_, alive)| **alive) {
            places[vertex] = origins.len() as u32;
            origins.push(self.origins[vertex]);
        }
        let faces: Vec<usize> = (0..self.faces.len()).filter(|&face| is_there[face]).collect();
        Self {
            origins,
            faces: faces.iter().map(|&face| self.faces[face].map(|vertex| places[vertex as usize])).collect(),
            face_origins: faces.iter().map(|&face| self.face_origins[face]).collect(),
            uv: faces.iter().map(|&face| self.uv[face]).collect(),
        }
    }
}

fn ascending([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

fn edges([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]].map(ascending)
}

#[cfg(test)]
mod tests {
    use super::{Origin, Resampled};
    use modiste_core::shapes::icosphere;
    use modiste_core::{Mesh, Topology, surface_area};

    fn ball() -> (Mesh, Resampled) {
        let ball = icosphere(3);
        let uv = vec![[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]; ball.topology.face_count()];
        let same = Resampled::same(ball.vertices.len(), ball.topology.faces(), &uv);
        (ball, same)
    }

    #[test]
    fn subdividing_gives_as_many_vertices_as_wanted_on_the_same_surface() {
        let (ball, same) = ball();
        let fine = same.subdivide(&ball.vertices, 2000);
        let places = fine.carry_points(&ball.vertices);
        assert_eq!(places.len(), 2000);
        let topology = Topology::new(2000, fine.faces.clone()).unwrap();
        assert_eq!(topology.edges().len() + 2, 2000 + topology.face_count(), "still a closed ball");
        assert!(topology.edges().iter().all(|edge| edge.faces[1].is_some()));
        let area = |topology: &Topology, x: &[modiste_core::Vec3]| surface_area(topology, x);
        assert!((area(&topology, &places) - area(&ball.topology, &ball.vertices)).abs() < 1e-9);
        // Every face faces the way of the one that it lies on.
        for (face, &from) in fine.faces.iter().zip(&fine.face_origins) {
            let normal = |face: [u32; 3], x: &[modiste_core::Vec3]| {
                let [a, b, c] = modiste_core::corners(face, x);
                (b - a).cross(c - a).normalize()
            };
            let (new, old) = (normal(*face, &places), normal(ball.topology.faces()[from as usize], &ball.vertices));
            assert!(new.dot(old) > 1.0 - 1e-9);
        }
    }

    #[test]
    fn coarsening_keeps_what_it_must() {
        let (ball, same) = ball();
        let mut kept = vec![false; ball.vertices.len()];
        kept[5] = true;
        let coarse = same.coarsen(&ball.vertices, 200, &kept);
        assert_eq!(coarse.origins.len(), 200);
        assert!(coarse.origins.contains(&Origin::Vertex(5)));
        let topology = Topology::new(200, coarse.faces.clone()).unwrap();
        assert_eq!(topology.edges().len() + 2, 200 + topology.face_count(), "still a closed ball");
        assert!(coarse.carry_points(&ball.vertices).iter().all(|v| (v.length() - 1.0).abs() < 1e-9));
    }
}
