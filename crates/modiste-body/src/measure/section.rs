//! Plane sections of a part of the body: girth by convex hull, breadth and depth, with gradients.

use modiste_core::Vec3;

use super::SparseGradient;

/// A point where an edge crosses the plane: `(1 - t) a + t b`.
#[derive(Debug, Clone, Copy)]
struct Crossing {
    a: u32,
    b: u32,
    t: f64,
    /// Signed distance of `a` minus that of `b` (m); not zero.
    drop: f64,
    point: Vec3,
}

/// The points where edges cross the plane `normal · x = offset`.
#[derive(Debug)]
pub(super) struct Section {
    normal: Vec3,
    crossings: Vec<Crossing>,
}

/// The derivative of a functional of a section: by vertices, and by the plane's offset.
#[derive(Debug, Default)]
pub(super) struct SectionGradient {
    pub(super) vertices: SparseGradient,
    pub(super) offset: f64,
}

impl Section {
    /// Cuts the edges by a plane with unit `normal`.
    pub(super) fn new(edges: &[[u32; 2]], vertices: &[Vec3], normal: Vec3, offset: f64) -> Self {
        let mut crossings = Vec::new();
        for &[a, b] in edges {
            let (pa, pb) = (vertices[a as usize], vertices[b as usize]);
            let (sa, sb) = (normal.dot(pa) - offset, normal.dot(pb) - offset);
            if (sa > 0.0) != (sb > 0.0) {
                let drop = sa - sb;
                let t = sa / drop;
                crossings.push(Crossing { a, b, t, drop, point: pa + t * (pb - pa) });
            }
        }
        Self { normal, crossings }
    }

    /// Keeps the points where `keep` holds.
    pub(super) fn retain(&mut self, keep: impl Fn(Vec3) -> bool) {
        self.crossings.retain(|crossing| keep(crossing.point));
    }

    /// Length of the convex hull (m), as a tape measures; zero of an empty section.
    pub(super) fn girth(&self, vertices: &[Vec3], gradient: Option<&mut SectionGradient>) -> f64 {
        let hull = self.hull();
        let count = hull.len();
        if count < 3 {
            return 0.0;
        }
        let point = |index: usize| self.crossings[hull[index % count]].point;
        let length = (0..count).map(|i| (point(i + 1) - point(i)).length()).sum();
        if let Some(gradient) = gradient {
            for i in 0..count {
                let arriving = (point(i) - point(i + count - 1)).normalize_or_zero();
                let leaving = (point(i + 1) - point(i)).normalize_or_zero();
                self.pull_back(hull[i], arriving - leaving, vertices, gradient);
            }
        }
        length
    }

    /// Extent along a unit direction (m); zero of an empty section.
    pub(super) fn extent(&self, direction: Vec3, vertices: &[Vec3], gradient: Option<&mut SectionGradient>) -> f64 {
        let along = |index: &usize| self.crossings[*index].point.dot(direction);
        let order = |i: &usize, j: &usize| along(i).total_cmp(&along(j));
        let Some(least) = (0..self.crossings.len()).min_by(order) else { return 0.0 };
        let Some(most) = (0..self.crossings.len()).max_by(order) else { return 0.0 };
        if let Some(gradient) = gradient {
            self.pull_back(most, direction, vertices, gradient);
            self.pull_back(least, -direction, vertices, gradient);
        }
        along(&most) - along(&least)
    }

    /// Carries the gradient by a crossing point to the two ends of its edge and the plane's offset.
    ///
    /// With signed distances `s`, `D = s_a - s_b`: `∂t/∂s_a = -s_b/D²`, `∂t/∂s_b = s_a/D²`, `∂t/∂offset = -1/D`.
    fn pull_back(&self, index: usize, g: Vec3, vertices: &[Vec3], gradient: &mut SectionGradient) {
        let Crossing { a, b, t, drop, .. } = self.crossings[index];
        let slide = g.dot(vertices[b as usize] - vertices[a as usize]) / drop;
        // s_a = t D and s_b = (t - 1) D.
        gradient.vertices.push((a, (1.0 - t) * (g + slide * self.normal)));
        gradient.vertices.push((b, t * (g + slide * self.normal)));
        gradient.offset -= slide;
    }

    /// Indices of the crossings on the convex hull, in order around it (Andrew's monotone chain).
    fn hull(&self) -> Vec<usize> {
        let (e1, e2) = self.normal.any_orthonormal_pair();
        let flat: Vec<(f64, f64)> = self.crossings.iter().map(|c| (c.point.dot(e1), c.point.dot(e2))).collect();
        let mut order: Vec<usize> = (0..flat.len()).collect();
        order.sort_by(|&i, &j| flat[i].0.total_cmp(&flat[j].0).then(flat[i].1.total_cmp(&flat[j].1)));
        let turns_left = |o: usize, p: usize, q: usize| {
            let ((ox, oy), (px, py), (qx, qy)) = (flat[o], flat[p], flat[q]);
            (px - ox) * (qy - oy) - (py - oy) * (qx - ox) > 0.0
        };
        let half = |order: &mut dyn Iterator<Item = usize>| {
            let mut chain: Vec<usize> = Vec::new();
            for next in order {
                while let [.., o, p] = chain[..] {
                    if turns_left(o, p, next) {
                        break;
                    }
                    chain.pop();
                }
                chain.push(next);
            }
            chain.pop();
            chain
        };
        let mut hull = half(&mut order.iter().copied());
        hull.extend(half(&mut order.iter().rev().copied()));
        hull
    }
}

#[cfg(test)]
mod tests {
    use modiste_core::Vec3;

    use super::{Section, SectionGradient};

    /// Edges up a cone of `count` sides whose radius grows from 1 at `y = 0` to 2 at `y = 1`.
    fn cone(count: u32) -> (Vec<[u32; 2]>, Vec<Vec3>) {
        let around = |radius: f64, y: f64| {
            (0..count).map(move |i| {
                let angle = std::f64::consts::TAU * f64::from(i) / f64::from(count);
                Vec3::new(radius * angle.cos(), y, radius * angle.sin())
            })
        };
        let vertices = around(1.0, 0.0).chain(around(2.0, 1.0)).collect();
        ((0..count).map(|i| [i, i + count]).collect(), vertices)
    }

    #[test]
    fn a_cone_has_the_girth_of_its_polygon() {
        let (edges, vertices) = cone(64);
        for height in [0.1, 0.5, 0.9] {
            let section = Section::new(&edges, &vertices, Vec3::Y, height);
            let polygon = 2.0 * 64.0 * (std::f64::consts::PI / 64.0).sin() * (1.0 + height);
            assert!((section.girth(&vertices, None) - polygon).abs() < 1e-12);
            assert!((section.extent(Vec3::X, &vertices, None) - 2.0 * (1.0 + height)).abs() < 1e-12);
        }
        assert!(Section::new(&edges, &vertices, Vec3::Y, 2.0).girth(&vertices, None).abs() < 1e-15);
    }

    #[test]
    fn gradients_agree_with_finite_differences() {
        // 13 sides: no two points tie for the extreme, and all lie strictly on the hull.
        let (edges, mut vertices) = cone(13);
        let (normal, offset) = (Vec3::new(0.1, 1.0, 0.2).normalize(), 0.4);
        let evaluate = |vertices: &[Vec3], offset: f64| {
            let section = Section::new(&edges, vertices, normal, offset);
            section.girth(vertices, None) + section.extent(Vec3::Z, vertices, None)
        };
        let mut gradient = SectionGradient::default();
        let section = Section::new(&edges, &vertices, normal, offset);
        section.girth(&vertices, Some(&mut gradient));
        section.extent(Vec3::Z, &vertices, Some(&mut gradient));
        let step = 1e-6;
        let by_offset = (evaluate(&vertices, offset + step) - evaluate(&vertices, offset - step)) / (2.0 * step);
        assert!((gradient.offset - by_offset).abs() < 1e-7);
        for vertex in 0..vertices.len() {
            let analytic: Vec3 =
                gradient.vertices.iter().filter(|entry| entry.0 as usize == vertex).map(|entry| entry.1).sum();
            for axis in 0..3 {
                let original = vertices[vertex];
                vertices[vertex][axis] += step;
                let above = evaluate(&vertices, offset);
                vertices[vertex][axis] -= 2.0 * step;
                let below = evaluate(&vertices, offset);
                vertices[vertex] = original;
                assert!((analytic[axis] - (above - below) / (2.0 * step)).abs() < 1e-7);
            }
        }
    }
}
