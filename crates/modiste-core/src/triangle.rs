//! Queries on one triangle.

use crate::Vec3;

/// The point of a triangle that is nearest to `p`, and its barycentric coordinates.
///
/// By Voronoi regions of corners and edges (Ericson, Real-Time Collision Detection, 2005, §5.1.5). Exact at corners and
/// edges; a triangle without area counts as its edges.
#[inline]
pub fn closest_point_on_triangle(p: Vec3, [a, b, c]: [Vec3; 3]) -> (Vec3, [f64; 3]) {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (a, [1.0, 0.0, 0.0]);
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return (b, [0.0, 1.0, 0.0]);
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 && d1 > d3 {
        let t = d1 / (d1 - d3);
        return (a + t * ab, [1.0 - t, t, 0.0]);
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return (c, [0.0, 0.0, 1.0]);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 && d2 > d6 {
        let t = d2 / (d2 - d6);
        return (a + t * ac, [1.0 - t, 0.0, t]);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 && (d4 > d3 || d5 > d6) {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return (b + t * (c - b), [0.0, 1.0 - t, t]);
    }
    let sum = va + vb + vc;
    // The sum is the square of twice the area. Of a triangle without area it holds only rounding.
    if sum > THIN * ab.length_squared() * ac.length_squared() {
        let (v, w) = (vb / sum, vc / sum);
        (a + v * ab + w * ac, [1.0 - v - w, v, w])
    } else {
        closest_point_on_edges(p, [a, b, c])
    }
}

/// Square of the sine of a corner below which a triangle counts as its edges.
const THIN: f64 = 1e-20;

/// For triangles without area.
#[cold]
fn closest_point_on_edges(p: Vec3, corners: [Vec3; 3]) -> (Vec3, [f64; 3]) {
    let mut best = (f64::INFINITY, corners[0], [1.0, 0.0, 0.0]);
    for start in 0..3 {
        let end = (start + 1) % 3;
        let (point, t) = closest_point_on_segment(p, corners[start], corners[end]);
        let distance = point.distance_squared(p);
        if distance < best.0 {
            let mut barycentric = [0.0; 3];
            (barycentric[start], barycentric[end]) = (1.0 - t, t);
            best = (distance, point, barycentric);
        }
    }
    (best.1, best.2)
}

/// The point of the segment from `a` to `b` that is nearest to `p`, and its parameter in [0, 1].
pub fn closest_point_on_segment(p: Vec3, a: Vec3, b: Vec3) -> (Vec3, f64) {
    let along = b - a;
    let length_squared = along.length_squared();
    let t = if length_squared > 0.0 { ((p - a).dot(along) / length_squared).clamp(0.0, 1.0) } else { 0.0 };
    (a + t * along, t)
}

/// The nearest points of two segments `a0 a1` and `b0 b1`: their parameters in [0, 1] and their distance.
///
/// Ericson 2005, §5.1.9. Of parallel segments one of many nearest pairs is returned.
pub fn closest_points_of_segments([a0, a1]: [Vec3; 2], [b0, b1]: [Vec3; 2]) -> ([f64; 2], f64) {
    let (da, db, r) = (a1 - a0, b1 - b0, a0 - b0);
    let (aa, bb, ab) = (da.length_squared(), db.length_squared(), da.dot(db));
    let (ar, br) = (da.dot(r), db.dot(r));
    let denominator = aa * bb - ab * ab;
    let mut s = if denominator > 0.0 { ((ab * br - ar * bb) / denominator).clamp(0.0, 1.0) } else { 0.0 };
    let mut t = if bb > 0.0 { (ab * s + br) / bb } else { 0.0 };
    if !(0.0..=1.0).contains(&t) {
        t = t.clamp(0.0, 1.0);
        s = if aa > 0.0 { ((ab * t - ar) / aa).clamp(0.0, 1.0) } else { 0.0 };
    } else if bb == 0.0 && aa > 0.0 {
        s = (-ar / aa).clamp(0.0, 1.0);
    }
    ([s, t], (a0 + s * da).distance(b0 + t * db))
}

/// Where the line `origin + t direction` crosses a triangle: `t` and the barycentric coordinates.
///
/// Möller and Trumbore 1997, both sides. `None` for a line in the triangle's plane.
pub fn line_triangle(origin: Vec3, direction: Vec3, [a, b, c]: [Vec3; 3]) -> Option<(f64, [f64; 3])> {
    let (ab, ac) = (b - a, c - a);
    let across = direction.cross(ac);
    let determinant = ab.dot(across);
    if determinant == 0.0 {
        return None;
    }
    let to_origin = origin - a;
    let v = to_origin.dot(across) / determinant;
    let turned = to_origin.cross(ab);
    let w = direction.dot(turned) / determinant;
    let inside = v >= 0.0 && w >= 0.0 && v + w <= 1.0;
    inside.then(|| (ac.dot(turned) / determinant, [1.0 - v - w, v, w]))
}

/// Whether the segment from `from` to `to` crosses a triangle. Segments in its plane do not.
pub fn segment_crosses_triangle(from: Vec3, to: Vec3, triangle: [Vec3; 3]) -> bool {
    line_triangle(from, to - from, triangle).is_some_and(|(t, _)| (0.0..=1.0).contains(&t))
}

/// Signed solid angle (sr) under which a triangle is seen from `p`, divided by 4π: its part of the winding number.
///
/// van Oosterom and Strackee 1983. Positive when `p` lies behind the face (inside); zero in its plane outside it.
pub fn solid_angle_fraction(p: Vec3, triangle: [Vec3; 3]) -> f64 {
    let [a, b, c] = triangle.map(|corner| corner - p);
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let numerator = a.dot(b.cross(c));
    let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    numerator.atan2(denominator) / std::f64::consts::TAU
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{
        closest_point_on_segment, closest_point_on_triangle, closest_points_of_segments, line_triangle,
        segment_crosses_triangle, solid_angle_fraction,
    };
    use crate::Vec3;

    fn point() -> impl Strategy<Value = Vec3> {
        // Small whole numbers hit corners, edges and triangles without area often.
        prop_oneof![
            prop::array::uniform3(-2i32..3).prop_map(|p| Vec3::from_array(p.map(f64::from))),
            prop::array::uniform3(-2.0f64..2.0).prop_map(Vec3::from_array),
        ]
    }

    proptest! {
        #[test]
        fn no_point_of_the_triangle_is_nearer(p in point(), triangle in [point(), point(), point()]) {
            let (closest, barycentric) = closest_point_on_triangle(p, triangle);
            prop_assert!(barycentric.iter().all(|&coordinate| (-1e-9..=1.0 + 1e-9).contains(&coordinate)));
            prop_assert!((barycentric.iter().sum::<f64>() - 1.0).abs() < 1e-9);
            let rebuilt: Vec3 = (0..3).map(|i| barycentric[i] * triangle[i]).sum();
            prop_assert!(rebuilt.distance(closest) < 1e-9);
            for i in 0..=20 {
                for j in 0..=20 - i {
                    let (v, w) = (f64::from(i) / 20.0, f64::from(j) / 20.0);
                    let other = (1.0 - v - w) * triangle[0] + v * triangle[1] + w * triangle[2];
                    prop_assert!(closest.distance(p) <= other.distance(p) + 1e-7);
                }
            }
        }

        #[test]
        fn no_points_of_the_segments_are_nearer(a in [point(), point()], b in [point(), point()]) {
            let ([s, t], distance) = closest_points_of_segments(a, b);
            prop_assert!((0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t));
            prop_assert!((a[0].lerp(a[1], s).distance(b[0].lerp(b[1], t)) - distance).abs() < 1e-9);
            for i in 0..=40 {
                let on_a = a[0].lerp(a[1], f64::from(i) / 40.0);
                prop_assert!(distance <= closest_point_on_segment(on_a, b[0], b[1]).0.distance(on_a) + 1e-7);
            }
        }

        #[test]
        fn lines_meet_triangles_at_the_point_they_say(
            origin in point(), direction in point(), triangle in [point(), point(), point()]
        ) {
            if let Some((t, barycentric)) = line_triangle(origin, direction, triangle) {
                let normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
                // Almost parallel lines have no sharp crossing.
                prop_assume!(normal.dot(direction).abs() > 1e-3);
                let on_triangle: Vec3 = (0..3).map(|i| barycentric[i] * triangle[i]).sum();
                prop_assert!(on_triangle.distance(origin + t * direction) < 1e-7);
            }
        }
    }

    #[test]
    fn a_triangle_without_area_is_its_edges() {
        let line = [Vec3::ZERO, Vec3::X, 3.0 * Vec3::X];
        let (closest, barycentric) = closest_point_on_triangle(Vec3::new(2.0, 1.0, 0.0), line);
        assert!(closest.distance(2.0 * Vec3::X) < 1e-12);
        assert!((barycentric.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        let point = [Vec3::ONE; 3];
        assert_eq!(closest_point_on_triangle(Vec3::ZERO, point).0, Vec3::ONE);
    }

    #[test]
    fn segments_cross_only_where_they_pass_through() {
        let triangle = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let at = |z: f64| Vec3::new(0.2, 0.2, z);
        assert!(segment_crosses_triangle(at(-1.0), at(1.0), triangle));
        assert!(!segment_crosses_triangle(at(0.5), at(1.0), triangle));
        assert!(!segment_crosses_triangle(at(-1.0) + Vec3::X, at(1.0) + Vec3::X, triangle));
        assert!(!segment_crosses_triangle(Vec3::new(0.1, 0.1, 0.0), Vec3::new(0.3, 0.1, 0.0), triangle));
    }

    #[test]
    fn an_octant_is_an_eighth_of_the_sphere() {
        let octant = [Vec3::X, Vec3::Y, Vec3::Z];
        assert!((solid_angle_fraction(Vec3::ZERO, octant) - 0.125).abs() < 1e-15);
        assert!(solid_angle_fraction(Vec3::new(1.0, 1.0, -1.0), octant).abs() < 1e-15);
        let mirrored = [Vec3::X, Vec3::Z, Vec3::Y];
        assert!((solid_angle_fraction(Vec3::ZERO, mirrored) + 0.125).abs() < 1e-15);
    }
}
