//! A drape carried from one body to another: the start of dressing every body alike.

use modiste_core::{Topology, Vec3};

/// How many body vertices move each cloth vertex.
const NEIGHBOURS: usize = 24;

/// Rounds of smoothing the displacement over the cloth.
const SMOOTHING_ROUNDS: usize = 10;

/// The body vertices that carry each cloth vertex, and their weights.
#[derive(Debug, Clone)]
pub struct Carrier {
    neighbours: Vec<[(u32, f64); NEIGHBOURS]>,
}

impl Carrier {
    /// Ties the cloth at `positions` (m) to the body at `body` (m) that it is draped on.
    ///
    /// Weights fall as a Gaussian of the distance, as wide as the distance to the farthest of the neighbours.
    pub fn new(positions: &[Vec3], body: &[Vec3]) -> Self {
        let neighbours = positions
            .iter()
            .map(|x| {
                let mut nearest: Vec<(f64, u32)> =
                    (0u32..).zip(body).map(|(i, v)| (v.distance_squared(*x), i)).collect();
                let count = NEIGHBOURS.min(nearest.len());
                nearest.select_nth_unstable_by(count - 1, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                let first = nearest[..count].iter().map(|n| n.0).fold(f64::INFINITY, f64::min);
                let width = nearest[..count].iter().map(|n| n.0).fold(f64::MIN_POSITIVE, f64::max);
                let mut carried = [(0, 0.0); NEIGHBOURS];
                for (slot, &(squared, vertex)) in carried.iter_mut().zip(&nearest[..count]) {
                    *slot = (vertex, (-2.0 * (squared - first) / width).exp());
                }
                let total: f64 = carried.iter().map(|c| c.1).sum();
                carried.iter_mut().for_each(|c| c.1 /= total);
                carried
            })
            .collect();
        Self { neighbours }
    }

    /// The cloth moved as the body moved from `from` to `to` (m), the displacement smoothed over the cloth.
    pub fn carry(&self, topology: &Topology, positions: &[Vec3], from: &[Vec3], to: &[Vec3]) -> Vec<Vec3> {
        let mut moves: Vec<Vec3> = self
            .neighbours
            .iter()
            .map(|carried| carried.iter().map(|&(v, w)| w * (to[v as usize] - from[v as usize])).sum())
            .collect();
        for _ in 0..SMOOTHING_ROUNDS {
            moves = (0..moves.len())
                .map(|v| {
                    let ring = topology.neighbours(v);
                    let sum: Vec3 = ring.iter().map(|&n| moves[n as usize]).sum();
                    0.5 * moves[v] + 0.5 * sum / ring.len().max(1) as f64
                })
                .collect();
        }
        positions.iter().zip(moves).map(|(x, step)| *x + step).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::Carrier;
    use modiste_core::{Vec3, shapes};

    #[test]
    fn a_translated_and_a_grown_body_take_the_cloth_along() {
        let scaled = |radius: f64, subdivisions| {
            let mut mesh = shapes::icosphere(subdivisions);
            mesh.vertices.iter_mut().for_each(|v| *v *= radius);
            mesh
        };
        let body = scaled(0.2, 4);
        let cloth = scaled(0.22, 3);
        let carrier = Carrier::new(&cloth.vertices, &body.vertices);
        let shift = Vec3::new(0.1, -0.2, 0.3);
        let moved: Vec<Vec3> = body.vertices.iter().map(|v| *v + shift).collect();
        let carried = carrier.carry(&cloth.topology, &cloth.vertices, &body.vertices, &moved);
        assert!(carried.iter().zip(&cloth.vertices).all(|(a, b)| a.distance(*b + shift) < 1e-12));
        let grown: Vec<Vec3> = body.vertices.iter().map(|v| 1.2 * *v).collect();
        let carried = carrier.carry(&cloth.topology, &cloth.vertices, &body.vertices, &grown);
        // Every vertex goes outward by nearly the 4 cm that the surface grew; averaging over a patch loses a little.
        assert!(carried.iter().zip(&cloth.vertices).all(|(a, b)| (a.length() - b.length() - 0.04).abs() < 0.006));
    }
}
