//! Closest point of a triangle, with the feature it lies on.

use modiste_core::Vec3;

/// Where on a triangle a closest point lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Feature {
    /// At this corner.
    Corner(usize),
    /// On the edge from this corner to the next.
    Edge(usize),
    /// Inside.
    Inside,
}

/// A closest point of a triangle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Closest {
    /// Barycentric coordinates.
    pub(crate) barycentric: [f64; 3],
    /// Where it lies.
    pub(crate) feature: Feature,
    /// The point.
    pub(crate) point: Vec3,
}

/// The point of triangle `abc` closest to `p` (by the Voronoi regions of its features).
#[inline]
pub(crate) fn closest_on_triangle(p: Vec3, [a, b, c]: [Vec3; 3]) -> Closest {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    let corner = |i: usize, point: Vec3| {
        let mut barycentric = [0.0; 3];
        barycentric[i] = 1.0;
        Closest { barycentric, feature: Feature::Corner(i), point }
    };
    if d1 <= 0.0 && d2 <= 0.0 {
        return corner(0, a);
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return corner(1, b);
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = d1 / (d1 - d3);
        return Closest { barycentric: [1.0 - t, t, 0.0], feature: Feature::Edge(0), point: a + ab * t };
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return corner(2, c);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        return Closest { barycentric: [1.0 - t, 0.0, t], feature: Feature::Edge(2), point: a + ac * t };
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return Closest { barycentric: [0.0, 1.0 - t, t], feature: Feature::Edge(1), point: b + (c - b) * t };
    }
    let total = va + vb + vc;
    let (v, w) = (vb / total, vc / total);
    Closest { barycentric: [1.0 - v - w, v, w], feature: Feature::Inside, point: a + ab * v + ac * w }
}

#[cfg(test)]
mod tests {
    use super::{Feature, closest_on_triangle};
    use modiste_core::{Vec3, seeded_rng, uniform};

    #[test]
    fn no_sampled_point_is_closer() {
        let mut rng = seeded_rng(3);
        let mut point = |scale: f64| Vec3::from_array(std::array::from_fn(|_| scale * (2.0 * uniform(&mut rng) - 1.0)));
        let mut features = [0; 3];
        for _ in 0..300 {
            let triangle = [point(1.0), point(1.0), point(1.0)];
            let p = point(2.0);
            let closest = closest_on_triangle(p, triangle);
            features[match closest.feature {
                Feature::Corner(_) => 0,
                Feature::Edge(_) => 1,
                Feature::Inside => 2,
            }] += 1;
            let [u, v, w] = closest.barycentric;
            let rebuilt = triangle[0] * u + triangle[1] * v + triangle[2] * w;
            assert!(rebuilt.distance(closest.point) < 1e-12);
            for i in 0..=20 {
                for j in 0..=20 - i {
                    let (s, t) = (f64::from(i) / 20.0, f64::from(j) / 20.0);
                    let sample = triangle[0] * (1.0 - s - t) + triangle[1] * s + triangle[2] * t;
                    assert!(p.distance(sample) >= p.distance(closest.point) - 1e-12);
                }
            }
        }
        assert!(features.iter().all(|&count| count > 10), "{features:?}");
    }
}
