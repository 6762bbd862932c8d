//! The deepest point of a triangle below a surface.

use crate::{Vec3, closest_point_on_triangle};

/// What a surface says of a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sounding {
    /// How far (m) the point is below the surface; negative above it.
    pub depth: f64,
    /// The triangle of the surface that is nearest to it.
    pub nearest: [Vec3; 3],
}

/// The greatest depth (m) of any point of `triangle` below a surface, found to within `accuracy` (m), and that point; `None` if
/// none is deeper than `floor`.
///
/// `sound` gives the signed distance from the surface. The triangle is split again and again where a part of it might still
/// hold a deeper point: the depth nowhere exceeds the distance from the face that is nearest to the middle of the part,
/// which is convex and so greatest at a corner of the part.
pub fn deepest_on_triangle(
    triangle: [Vec3; 3],
    floor: f64,
    accuracy: f64,
    mut sound: impl FnMut(Vec3) -> Sounding,
) -> Option<(f64, Vec3)> {
    let mut deepest = (floor, None);
    let mut offer = |depth: f64, point: Vec3| {
        if depth > deepest.0 {
            deepest = (depth, Some(point));
        }
        deepest.0
    };
    for corner in triangle {
        offer(sound(corner).depth, corner);
    }
    let mut parts = vec![triangle];
    while let Some(part @ [a, b, c]) = parts.pop() {
        let middle = (a + b + c) / 3.0;
        let radius = part.iter().map(|corner| corner.distance(middle)).fold(0.0, f64::max);
        let Sounding { depth, nearest } = sound(middle);
        let so_far = offer(depth, middle);
        let mut bound = depth + radius;
        if bound > 0.0 && bound > so_far + accuracy {
            let distance = |corner: Vec3| closest_point_on_triangle(corner, nearest).0.distance(corner);
            bound = bound.min(part.into_iter().map(distance).fold(0.0, f64::max));
        }
        if bound > 0.0 && bound > so_far + accuracy {
            let (ab, bc, ca) = (a.midpoint(b), b.midpoint(c), c.midpoint(a));
            parts.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
    }
    deepest.1.map(|point| (deepest.0, point))
}

#[cfg(test)]
mod tests {
    use super::{Sounding, deepest_on_triangle};
    use crate::shapes::icosphere;
    use crate::{Mesh, TriangleBvh, Vec3, corners, normal, seeded_rng, signed_distance};

    /// The greatest depth, and how many points were looked at.
    fn deepest(mesh: &Mesh, triangle: [Vec3; 3], floor: f64, accuracy: f64) -> (Option<f64>, usize) {
        let tree = TriangleBvh::new(&mesh.topology, &mesh.vertices);
        let mut count = 0;
        let found = deepest_on_triangle(triangle, floor, accuracy, |point| {
            count += 1;
            let at = tree.closest_point(&mesh.vertices, point, f64::INFINITY).unwrap();
            let depth = -signed_distance(&mesh.topology, &mesh.vertices, point, &at);
            Sounding { depth, nearest: corners(mesh.topology.faces()[at.face as usize], &mesh.vertices) }
        });
        (found.map(|(depth, _)| depth), count)
    }

    /// A large level triangle around the axis of Y.
    fn level(height: f64) -> [Vec3; 3] {
        [Vec3::new(-9.0, height, -7.0), Vec3::new(9.0, height, -7.0), Vec3::new(0.0, height, 11.0)]
    }

    #[test]
    fn a_plane_through_a_ball_is_as_deep_as_the_cap_is_high() {
        let ball = icosphere(5);
        for (height, accuracy) in [(0.9, 1e-3), (0.99, 1e-4), (0.5, 1e-3), (0.999, 1e-4)] {
            let (depth, count) = deepest(&ball, level(height), 0.0, accuracy);
            let depth = depth.unwrap();
            // The ball of triangles is up to 0.0006 smaller than the round one.
            assert!((depth - (1.0 - height)).abs() < accuracy + 6e-4, "{depth} at {height}");
            assert!(count < 30_000, "{count} points looked at");
        }
        assert_eq!(deepest(&ball, level(1.01), 0.0, 1e-4).0, None, "above the ball");
        assert_eq!(deepest(&ball, level(0.9), 0.3, 1e-4).0, None, "not as deep as the floor");
        let tree = TriangleBvh::new(&ball.topology, &ball.vertices);
        let sound = |point: Vec3| {
            let at = tree.closest_point(&ball.vertices, point, f64::INFINITY).unwrap();
            Sounding {
                depth: 1.0 - point.length(),
                nearest: corners(ball.topology.faces()[at.face as usize], &ball.vertices),
            }
        };
        let (_, place) = deepest_on_triangle(level(0.9), 0.0, 1e-4, sound).unwrap();
        assert!(place.distance(0.9 * Vec3::Y) < 0.02, "{place}");
    }

    #[test]
    fn no_point_of_a_triangle_is_deeper() {
        let ball = icosphere(3);
        let tree = TriangleBvh::new(&ball.topology, &ball.vertices);
        let mut rng = seeded_rng(6);
        let mut random = || 0.8 * Vec3::new(normal(&mut rng), normal(&mut rng), normal(&mut rng));
        for _ in 0..40 {
            let triangle = [random(), random(), random()];
            let depth = deepest(&ball, triangle, 0.0, 1e-3).0.unwrap_or(0.0);
            let mut sampled = 0.0f64;
            for i in 0..=30 {
                for j in 0..=30 - i {
                    let (v, w) = (f64::from(i) / 30.0, f64::from(j) / 30.0);
                    let point = (1.0 - v - w) * triangle[0] + v * triangle[1] + w * triangle[2];
                    let at = tree.closest_point(&ball.vertices, point, f64::INFINITY).unwrap();
                    sampled = sampled.max(-signed_distance(&ball.topology, &ball.vertices, point, &at));
                }
            }
            assert!(sampled <= depth + 1e-3 && depth <= sampled + 0.06, "{sampled} {depth}");
        }
    }
}
