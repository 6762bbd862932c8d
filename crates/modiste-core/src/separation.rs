//! How deep two triangles pass through each other.

use crate::Vec3;
use crate::mesh::double_area_vector;

/// Square of the sine of the angle between two edges below which they count as parallel: their product gives no direction.
const PARALLEL: f64 = 1e-18;

/// The shortest way (m) that `b` can be moved by after which it only touches `a`; `None` where the two are apart or only
/// touch, as they do in one plane. Its length is the depth to which they cross.
///
/// The ways that bring `b` into contact with `a` are the points of `{p - q : p in a, q in b}`, a convex body around the
/// origin. It is bounded by planes along the two triangles and along pairs of edges, one of each, so the nearest of those
/// planes is the answer, exactly.
pub fn triangle_separation(a: [Vec3; 3], b: [Vec3; 3]) -> Option<Vec3> {
    let edges = |[p, q, r]: [Vec3; 3]| [q - p, r - q, p - r];
    let (a_edges, b_edges) = (edges(a), edges(b));
    let mut shortest: Option<Vec3> = None;
    let mut try_axis = |axis: Vec3| {
        let (a_span, b_span) = (span(a, axis), span(b, axis));
        // Up, or down, until the two spans only touch.
        let (up, down) = (a_span.1 - b_span.0, b_span.1 - a_span.0);
        if up <= 0.0 || down <= 0.0 {
            return false;
        }
        let way = if up <= down { up * axis } else { -down * axis };
        if shortest.is_none_or(|found| way.length_squared() < found.length_squared()) {
            shortest = Some(way);
        }
        true
    };
    for normal in [double_area_vector(a), double_area_vector(b)] {
        if let Some(axis) = normal.try_normalize()
            && !try_axis(axis)
        {
            return None;
        }
    }
    for first in a_edges {
        for second in b_edges {
            let across = first.cross(second);
            let parallel = PARALLEL * first.length_squared() * second.length_squared();
            if across.length_squared() > parallel && !try_axis(across.normalize()) {
                return None;
            }
        }
    }
    shortest
}

/// Smallest and largest coordinate along an axis.
fn span(triangle: [Vec3; 3], axis: Vec3) -> (f64, f64) {
    let [a, b, c] = triangle.map(|corner| corner.dot(axis));
    (a.min(b).min(c), a.max(b).max(c))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::triangle_separation;
    use crate::{Vec3, normal, seeded_rng, triangles_cross};

    /// A large triangle in the plane of X and Z.
    const FLOOR: [Vec3; 3] = [Vec3::new(-3.0, 0.0, -3.0), Vec3::new(3.0, 0.0, -3.0), Vec3::new(0.0, 0.0, 5.0)];

    #[test]
    fn a_tip_through_a_floor_is_as_deep_as_it_is_long() {
        for depth in [0.01, 0.2, 0.4] {
            let tip = [Vec3::new(0.0, -depth, 0.0), Vec3::new(0.3, 1.0, 0.1), Vec3::new(-0.3, 1.0, 0.0)];
            let way = triangle_separation(FLOOR, tip).unwrap();
            assert!(way.distance(depth * Vec3::Y) < 1e-12, "{way}");
            let back = triangle_separation(tip, FLOOR).unwrap();
            assert!(back.distance(-way) < 1e-12);
        }
        let above = [Vec3::new(0.0, 0.01, 0.0), Vec3::new(0.3, 1.0, 0.1), Vec3::new(-0.3, 1.0, 0.0)];
        assert_eq!(triangle_separation(FLOOR, above), None);
        assert_eq!(triangle_separation(FLOOR, FLOOR), None, "one plane is touching");
    }

    #[test]
    fn edges_that_hook_into_each_other_part_along_their_common_normal() {
        // Two tall triangles at right angles whose longest edges, level and across each other, pass by 0.1.
        let a = [Vec3::new(-2.0, 0.05, 0.0), Vec3::new(2.0, 0.05, 0.0), Vec3::new(0.0, -3.0, 0.0)];
        let b = [Vec3::new(0.0, -0.05, -2.0), Vec3::new(0.0, -0.05, 2.0), Vec3::new(0.0, 3.0, 0.0)];
        let way = triangle_separation(a, b).unwrap();
        assert!(way.distance(0.1 * Vec3::Y) < 1e-12, "{way}");
    }

    fn triangle() -> impl Strategy<Value = [Vec3; 3]> {
        prop::array::uniform3(prop::array::uniform3(-1.0f64..1.0).prop_map(Vec3::from_array))
    }

    proptest! {
        #[test]
        fn moved_by_it_they_no_longer_cross_and_no_shorter_way_parts_them(a in triangle(), b in triangle(), seed in 0u64..1000) {
            let moved = |way: Vec3| b.map(|corner| corner + way);
            let way = triangle_separation(a, b);
            prop_assert_eq!(way.is_some(), triangles_cross(a, b));
            if let Some(way) = way {
                prop_assert!(!triangles_cross(a, moved(1.0001 * way)));
                let mut rng = seeded_rng(seed);
                for _ in 0..50 {
                    let other = Vec3::new(normal(&mut rng), normal(&mut rng), normal(&mut rng)).normalize();
                    prop_assert!(triangles_cross(a, moved(0.999 * way.length() * other)));
                }
            }
        }
    }
}
