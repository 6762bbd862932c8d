//! Queries on one triangle.

use crate::Vec3;

/// The point of a triangle that is nearest to `p`, and its barycentric coordinates.
///
/// By Voronoi regions of corners and edges (Ericson, Real-Time Collision Detection, 2005, §5.1.5). Exact at corners and
/// edges; a triangle without area counts as its longest edge.
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
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = d1 / (d1 - d3);
        return (a + t * ab, [1.0 - t, t, 0.0]);
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return (c, [0.0, 0.0, 1.0]);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        return (a + t * ac, [1.0 - t, 0.0, t]);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return (b + t * (c - b), [0.0, 1.0 - t, t]);
    }
    let sum = va + vb + vc;
    let (v, w) = (vb / sum, vc / sum);
    if v.is_finite() && w.is_finite() {
        (a + v * ab + w * ac, [1.0 - v - w, v, w])
    } else {
        closest_point_on_longest_edge(p, [a, b, c])
    }
}

/// For triangles without area, of which every point lies on the longest edge.
#[cold]
fn closest_point_on_longest_edge(p: Vec3, corners: [Vec3; 3]) -> (Vec3, [f64; 3]) {
    let length = |i: usize| corners[i].distance_squared(corners[(i + 1) % 3]);
    let start = (1..3).fold(0, |best, i| if length(i) > length(best) { i } else { best });
    let end = (start + 1) % 3;
    let (point, t) = closest_point_on_segment(p, corners[start], corners[end]);
    let mut barycentric = [0.0; 3];
    barycentric[start] = 1.0 - t;
    barycentric[end] = t;
    (point, barycentric)
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
