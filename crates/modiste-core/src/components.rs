//! Connected components and boundary loops of a mesh.

use crate::{Topology, Vec3, mesh::centroid};

/// The vertices of each connected component, ascending; components in the order of their first vertex.
///
/// A vertex without faces is a component of its own.
pub fn connected_components(topology: &Topology) -> Vec<Vec<u32>> {
    let mut seen = vec![false; topology.vertex_count()];
    let mut components = Vec::new();
    for first in 0..topology.vertex_count() {
        if seen[first] {
            continue;
        }
        seen[first] = true;
        let mut component = vec![first as u32];
        let mut next = 0;
        while let Some(&vertex) = component.get(next) {
            next += 1;
            for &neighbour in topology.neighbours(vertex as usize) {
                if !std::mem::replace(&mut seen[neighbour as usize], true) {
                    component.push(neighbour);
                }
            }
        }
        component.sort_unstable();
        components.push(component);
    }
    components
}

/// The boundary as closed loops of vertices, each in the direction in which its faces run along it.
///
/// Where boundaries touch at a vertex the loop continues with the edge that comes first. A boundary that does not close,
/// which only a non-manifold mesh has, ends where it stops.
pub fn boundary_loops(topology: &Topology) -> Vec<Vec<u32>> {
    let mut outgoing: Vec<Vec<u32>> = vec![Vec::new(); topology.vertex_count()];
    for edge in topology.edges() {
        let [Some(face), None] = edge.faces else { continue };
        let corners = topology.faces()[face as usize];
        let [a, b] = edge.vertices;
        let forward = (0..3).any(|corner| corners[corner] == a && corners[(corner + 1) % 3] == b);
        let (from, to) = if forward { (a, b) } else { (b, a) };
        outgoing[from as usize].push(to);
    }
    for targets in &mut outgoing {
        targets.reverse();
    }
    let mut loops = Vec::new();
    for start in 0..topology.vertex_count() {
        while let Some(mut vertex) = outgoing[start].pop() {
            let mut boundary = vec![start as u32];
            while vertex as usize != start {
                boundary.push(vertex);
                let Some(next) = outgoing[vertex as usize].pop() else { break };
                vertex = next;
            }
            loops.push(boundary);
        }
    }
    loops
}

/// A vertex of `main` and one of `other` that lie near each other: found from the centroid of `other`, in linear time.
pub(crate) fn nearest_link(main: &[u32], other: &[u32], x: &[Vec3]) -> [u32; 2] {
    let nearest = |candidates: &[u32], to: Vec3| {
        let distance = |&&vertex: &&u32| x[vertex as usize].distance_squared(to);
        *candidates.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).expect("a component has a vertex")
    };
    let points: Vec<Vec3> = other.iter().map(|&vertex| x[vertex as usize]).collect();
    let on_main = nearest(main, centroid(&points));
    [on_main, nearest(other, x[on_main as usize])]
}

#[cfg(test)]
mod tests {
    use super::{boundary_loops, connected_components};
    use crate::Topology;

    #[test]
    fn components_are_told_apart() {
        let topology = Topology::new(7, vec![[0, 1, 2], [4, 5, 6], [1, 2, 3]]).unwrap();
        assert_eq!(connected_components(&topology), [vec![0, 1, 2, 3], vec![4, 5, 6]]);
        let lonely = Topology::new(2, Vec::new()).unwrap();
        assert_eq!(connected_components(&lonely), [vec![0], vec![1]]);
    }

    #[test]
    fn a_square_with_a_hole_has_two_loops() {
        // Outer ring 0..4, inner ring 4..8.
        let mut faces = Vec::new();
        for i in 0..4u32 {
            let next = (i + 1) % 4;
            faces.push([i, next, 4 + i]);
            faces.push([next, 4 + next, 4 + i]);
        }
        let topology = Topology::new(8, faces).unwrap();
        let loops = boundary_loops(&topology);
        assert_eq!(loops, [vec![0, 1, 2, 3], vec![4, 7, 6, 5]]);
    }
}
