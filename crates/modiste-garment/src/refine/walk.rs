//! The nearest point of a surface by walking downhill from a face nearby.

use modiste_core::{SurfacePoint, Vec3, closest_point_on_triangle, corners};

use super::contact::{Feature, feature};
use super::obstacle::{NONE, Obstacle};

/// Faces beyond which a walk is given up; from frame to frame it takes one or two.
const MOST_STEPS: usize = 64;

impl Obstacle {
    /// The point that is nearest to `point` among those around it, found from face to face beginning at `from`.
    ///
    /// Much faster than the tree, and right where the surface bends less than the point is far from it. Elsewhere it
    /// may be the nearest point of one side of a crease only.
    pub(crate) fn walk(&self, point: Vec3, from: u32) -> SurfacePoint {
        let mut at = self.nearest_on(point, from);
        for _ in 0..MOST_STEPS {
            let next = match feature(at.barycentric) {
                Feature::Face => break,
                Feature::Edge(corner) => match self.across(at.face, corner) {
                    NONE => break,
                    other => self.nearest_on(point, other),
                },
                Feature::Vertex(corner) => {
                    let vertex = self.topology().faces()[at.face as usize][corner] as usize;
                    let around = self.topology().vertex_faces(vertex).iter().filter(|&&face| face != at.face);
                    let nearest = around.map(|&face| self.nearest_on(point, face));
                    match nearest.min_by(|a, b| a.distance.total_cmp(&b.distance)) {
                        Some(nearest) => nearest,
                        None => break,
                    }
                }
            };
            if next.distance >= at.distance {
                break;
            }
            at = next;
        }
        at
    }

    fn nearest_on(&self, point: Vec3, face: u32) -> SurfacePoint {
        let triangle = corners(self.topology().faces()[face as usize], self.vertices());
        let (nearest, barycentric) = closest_point_on_triangle(point, triangle);
        SurfacePoint { face, barycentric, point: nearest, distance: nearest.distance(point) }
    }
}

#[cfg(test)]
mod tests {
    use crate::refine::obstacle::{NO_HINT, Obstacle};
    use modiste_core::shapes::icosphere;
    use modiste_core::{Vec3, normal, seeded_rng};

    #[test]
    fn on_a_round_surface_the_walk_ends_where_the_tree_does() {
        let sphere = icosphere(4);
        let obstacle = Obstacle::single(sphere.topology.clone(), &sphere.vertices);
        // Seen from within, each of the flat faces may be nearest among its neighbours, but by no more than it is flat.
        let flatness = sphere.topology.edges().iter().map(|edge| {
            let [a, b] = edge.vertices.map(|vertex| sphere.vertices[vertex as usize]);
            0.25 * a.distance_squared(b)
        });
        let flatness = flatness.fold(0.0, f64::max);
        let mut rng = seeded_rng(5);
        let mut face = 0;
        for _ in 0..500 {
            let direction = Vec3::new(normal(&mut rng), normal(&mut rng), normal(&mut rng)).normalize();
            let height = 0.2 * normal(&mut rng);
            let point = (1.0 + height) * direction;
            // A quarter of the way around the sphere is more than the walk ever has to go.
            let near = obstacle.walk(point, face);
            let at = obstacle.walk(point, near.face);
            let exact = obstacle.nearest_where((point, f64::INFINITY), &mut NO_HINT.clone(), |_, _| true).unwrap();
            let tolerance = if height > 0.0 { 1e-12 } else { flatness };
            assert!(at.distance - exact.distance < tolerance, "{point} {} {}", at.distance, exact.distance);
            face = at.face;
        }
    }
}
