//! Polygons in the plane: convex hull, perimeter, area.

use crate::Vec2;

/// Corners of the convex hull, counter-clockwise, starting at the leftmost (lowest of these); collinear points left out.
///
/// Andrew's monotone chain (1979). Points with a coordinate that is not finite are ignored.
pub fn convex_hull_2d(points: &[Vec2]) -> Vec<Vec2> {
    let mut sorted: Vec<Vec2> = points.iter().copied().filter(|p| p.is_finite()).collect();
    sorted.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    sorted.dedup();
    if sorted.len() < 3 {
        return sorted;
    }
    let chain = |points: &mut dyn Iterator<Item = Vec2>| {
        let mut chain: Vec<Vec2> = Vec::new();
        for p in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp_dot(p - b) <= 0.0
            {
                chain.pop();
            }
            chain.push(p);
        }
        // Its last point begins the other chain.
        chain.pop();
        chain
    };
    let mut hull = chain(&mut sorted.iter().copied());
    hull.extend(chain(&mut sorted.iter().rev().copied()));
    hull
}

/// Length around a closed polygon.
pub fn polygon_perimeter(corners: &[Vec2]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).map(|(a, b)| a.distance(*b)).sum()
}

/// Area of a closed polygon without crossings; positive if counter-clockwise.
pub fn polygon_area(corners: &[Vec2]) -> f64 {
    let Some(&origin) = corners.first() else { return 0.0 };
    let next = corners.iter().cycle().skip(1);
    0.5 * corners.iter().zip(next).map(|(&a, &b)| (a - origin).perp_dot(b - origin)).sum::<f64>()
}

/// Whether a point lies inside a closed polygon: the number of its crossings with a ray from the point is odd.
pub fn polygon_contains(corners: &[Vec2], p: Vec2) -> bool {
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).fold(false, |inside, (a, b)| {
        let crosses = (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x);
        inside != crosses
    })
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use proptest::prelude::*;

    use super::{convex_hull_2d, polygon_area, polygon_contains, polygon_perimeter};
    use crate::Vec2;

    #[test]
    fn a_regular_polygon_has_the_known_perimeter_and_area() {
        for n in [3usize, 4, 17, 100] {
            let corner = |i: usize| Vec2::from_angle(TAU * i as f64 / n as f64) + Vec2::new(5.0, -3.0);
            let corners: Vec<Vec2> = (0..n).map(corner).collect();
            let half = TAU / (2 * n) as f64;
            assert!((polygon_perimeter(&corners) - 2.0 * n as f64 * half.sin()).abs() < 1e-12);
            assert!((polygon_area(&corners) - n as f64 * half.sin() * half.cos()).abs() < 1e-12);
            assert_eq!(convex_hull_2d(&corners).len(), n);
        }
    }

    #[test]
    fn the_hull_leaves_out_inner_and_collinear_points() {
        let points = [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (2.0, 2.0), (1.0, 1.0), (0.0, 2.0), (0.0, 1.0), (0.0, 0.0)];
        let points: Vec<Vec2> = points.iter().map(|&(x, y)| Vec2::new(x, y)).collect();
        let hull = convex_hull_2d(&points);
        assert_eq!(hull, [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)].map(|(x, y)| Vec2::new(x, y)));
        assert_eq!(convex_hull_2d(&points[..2]), points[..2]);
        assert_eq!(convex_hull_2d(&[Vec2::NAN, points[0]]), [points[0]]);
    }

    proptest! {
        #[test]
        fn every_point_lies_left_of_every_edge_of_the_hull(
            points in prop::collection::vec((-10i32..10, -10i32..10), 3..60)
        ) {
            let points: Vec<Vec2> = points.iter().map(|&(x, y)| Vec2::new(f64::from(x), f64::from(y))).collect();
            let hull = convex_hull_2d(&points);
            prop_assert!(hull.iter().all(|corner| points.contains(corner)));
            for (i, &a) in hull.iter().enumerate() {
                let b = hull[(i + 1) % hull.len()];
                for &p in &points {
                    prop_assert!((b - a).perp_dot(p - a) >= 0.0);
                }
            }
        }
    }

    #[test]
    fn points_inside_are_told_from_points_outside() {
        let arrow = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (2.0, 1.0)].map(|(x, y)| Vec2::new(x, y));
        assert!(polygon_contains(&arrow, Vec2::new(3.5, 1.0)));
        assert!(!polygon_contains(&arrow, Vec2::new(2.0, 2.0)));
        assert!(!polygon_contains(&arrow, Vec2::new(-1.0, 0.5)));
    }
}
