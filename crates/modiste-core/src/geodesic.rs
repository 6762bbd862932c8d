//! Distances along the surface.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

use crate::{Topology, Vec3};

/// A vertex waiting at a distance; ordered by distance, then by vertex.
#[derive(PartialEq)]
struct Waiting(f64, u32);

impl Eq for Waiting {}

impl Ord for Waiting {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.total_cmp(&other.0).then(self.1.cmp(&other.1))
    }
}

impl PartialOrd for Waiting {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Length of the shortest path along edges from the nearest source (m), per vertex; infinite where none leads.
///
/// Dijkstra's algorithm. Never below the true geodesic distance; above it by up to about a fifth on good triangles.
pub fn geodesic_distances(topology: &Topology, x: &[Vec3], sources: &[u32]) -> Vec<f64> {
    let mut distances = vec![f64::INFINITY; topology.vertex_count()];
    let mut heap = BinaryHeap::new();
    for &source in sources {
        distances[source as usize] = 0.0;
        heap.push(Reverse(Waiting(0.0, source)));
    }
    while let Some(Reverse(Waiting(distance, vertex))) = heap.pop() {
        if distance > distances[vertex as usize] {
            continue;
        }
        for &neighbour in topology.neighbours(vertex as usize) {
            let through = distance + x[vertex as usize].distance(x[neighbour as usize]);
            if through < distances[neighbour as usize] {
                distances[neighbour as usize] = through;
                heap.push(Reverse(Waiting(through, neighbour)));
            }
        }
    }
    distances
}

#[cfg(test)]
mod tests {
    use super::geodesic_distances;
    use crate::shapes::{grid, icosphere};
    use crate::{Topology, Vec3};

    #[test]
    fn agrees_with_relaxation_to_a_fixed_point() {
        let mesh = icosphere(2);
        let sources = [3u32, 40];
        let mut expected = vec![f64::INFINITY; mesh.vertices.len()];
        sources.iter().for_each(|&source| expected[source as usize] = 0.0);
        for _ in 0..mesh.vertices.len() {
            for edge in mesh.topology.edges() {
                let [a, b] = edge.vertices.map(|vertex| vertex as usize);
                let length = mesh.vertices[a].distance(mesh.vertices[b]);
                expected[a] = expected[a].min(expected[b] + length);
                expected[b] = expected[b].min(expected[a] + length);
            }
        }
        let found = geodesic_distances(&mesh.topology, &mesh.vertices, &sources);
        assert!(found.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-12));
    }

    #[test]
    fn along_rows_and_diagonals_of_a_grid_it_is_exact() {
        let mesh = grid(6, 6);
        let distances = geodesic_distances(&mesh.topology, &mesh.vertices, &[0]);
        assert!((distances[6] - 1.0).abs() < 1e-12);
        assert!((distances[48] - 2.0f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn on_a_sphere_it_is_at_least_the_chord_and_near_the_arc() {
        let mesh = icosphere(4);
        let distances = geodesic_distances(&mesh.topology, &mesh.vertices, &[0]);
        for (p, distance) in mesh.vertices.iter().zip(distances) {
            let arc = p.angle_between(mesh.vertices[0]);
            assert!(distance >= 0.998 * arc && distance <= 1.25 * arc, "{distance} {arc}");
        }
    }

    #[test]
    fn what_cannot_be_reached_is_infinitely_far() {
        let topology = Topology::new(4, vec![[0, 1, 2]]).unwrap();
        let x = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
        assert_eq!(geodesic_distances(&topology, &x, &[0]), [0.0, 1.0, 1.0, f64::INFINITY]);
        assert!(geodesic_distances(&topology, &x, &[]).iter().all(|distance| distance.is_infinite()));
    }
}
