//! Generalised winding numbers: how often a surface, closed or nearly, goes around a point.

use std::sync::{Mutex, OnceLock, PoisonError};

use super::{ChildKind, STACK, TriangleBvh, WIDTH};
use crate::mesh::double_area_vector;
use crate::triangle::solid_angle_fraction;
use crate::{Topology, Vec3};
use glam::Vec3Swizzles as _;

/// A group of faces further away than this many of its radii is not looked at face by face, as Barill et al. propose.
const FAR: f64 = 2.0;

/// A group of faces seen from afar: the first two terms of the expansion of its solid angle about its centre.
///
/// Barill, Dickson, Schmidt, Levin, Jacobson 2018, eq. 13–15: `w = a·r / 4π|r|³ + (tr T / |r|³ - 3 rᵀT r / |r|⁵) / 4π`
/// with `r` from the query point to the centre, `a` the sum of the area vectors, and `T` the sum of
/// `(centroid - centre) area_vectorᵀ`, of which only the symmetric part counts.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Dipole {
    /// Area-weighted mean of the centroids (m).
    centre: Vec3,
    /// Sum of the area vectors (m²).
    area_vector: Vec3,
    /// Diagonal of `T` (m³).
    moment_diagonal: Vec3,
    /// `T_yz + T_zy`, `T_zx + T_xz`, `T_xy + T_yx` (m³).
    moment_mixed: Vec3,
    /// Sum of the areas (m²).
    area: f64,
    /// Distance from the centre within which all corners lie (m).
    radius: f64,
}

impl Dipole {
    pub(super) fn of_triangles(corners: &[[u32; 3]], x: &[Vec3]) -> Self {
        let triangles = corners.iter().map(|face| face.map(|vertex| x[vertex as usize]));
        let single = triangles.map(|triangle| {
            let area_vector = 0.5 * double_area_vector(triangle);
            let centre = triangle.iter().sum::<Vec3>() / 3.0;
            let radius = triangle.iter().map(|corner| corner.distance(centre)).fold(0.0, f64::max);
            Self { centre, area_vector, area: area_vector.length(), radius, ..Self::default() }
        });
        Self::joined(single)
    }

    /// The group of all faces of some groups. Those without area do not count.
    pub(super) fn joined(parts: impl Iterator<Item = Self> + Clone) -> Self {
        let with_area = parts.filter(|part| part.area > 0.0);
        let mut whole = Self::default();
        for part in with_area.clone() {
            whole.area += part.area;
            whole.centre += part.area * part.centre;
            whole.area_vector += part.area_vector;
        }
        if whole.area <= 0.0 {
            return Self::default();
        }
        whole.centre /= whole.area;
        for part in with_area {
            let (arm, n) = (part.centre - whole.centre, part.area_vector);
            whole.radius = whole.radius.max(arm.length() + part.radius);
            whole.moment_diagonal += part.moment_diagonal + arm * n;
            whole.moment_mixed += part.moment_mixed + arm.yzx() * n.zxy() + arm.zxy() * n.yzx();
        }
        whole
    }

    /// Its part of the winding number at `p`, if `p` is far enough away.
    #[inline(always)]
    fn fraction(&self, p: Vec3) -> Option<f64> {
        let r = self.centre - p;
        let squared = r.length_squared();
        (squared > FAR * FAR * self.radius * self.radius && squared > 0.0).then(|| {
            let inverse = squared.recip();
            let along = (self.moment_diagonal * r).dot(r) + (self.moment_mixed * r.yzx()).dot(r.zxy());
            let sum = self.area_vector.dot(r) + self.moment_diagonal.element_sum() - 3.0 * inverse * along;
            sum * inverse * inverse.sqrt() / (2.0 * std::f64::consts::TAU)
        })
    }
}

/// The groups of all children. Nodes come before their children, so from the last to the first.
fn fill(dipoles: &mut Vec<[Dipole; WIDTH]>, tree: &TriangleBvh, x: &[Vec3]) {
    dipoles.resize(tree.nodes.len(), [Dipole::default(); WIDTH]);
    for index in (0..tree.nodes.len()).rev() {
        for slot in 0..WIDTH {
            dipoles[index][slot] = match tree.nodes[index].children[slot].kind() {
                ChildKind::Empty => Dipole::default(),
                ChildKind::Node(child) => Dipole::joined(dipoles[child].iter().copied()),
                ChildKind::Leaf(first, count) => Dipole::of_triangles(&tree.corners[first..first + count], x),
            };
        }
    }
}

/// The groups of all children, made when they are first asked for after a motion, in memory that is kept.
#[derive(Debug, Default)]
pub(super) struct Dipoles {
    made: OnceLock<Vec<[Dipole; WIDTH]>>,
    spare: Mutex<Vec<[Dipole; WIDTH]>>,
}

impl Clone for Dipoles {
    fn clone(&self) -> Self {
        Self { made: self.made.clone(), spare: Mutex::default() }
    }
}

impl Dipoles {
    /// They are made anew when they are next asked for.
    pub(super) fn forget(&mut self) {
        if let Some(made) = self.made.take() {
            *self.spare.get_mut().unwrap_or_else(PoisonError::into_inner) = made;
        }
    }

    fn get(&self, tree: &TriangleBvh, x: &[Vec3]) -> &[[Dipole; WIDTH]] {
        self.made.get_or_init(|| {
            let mut dipoles = std::mem::take(&mut *self.spare.lock().unwrap_or_else(PoisonError::into_inner));
            fill(&mut dipoles, tree, x);
            dipoles
        })
    }
}

impl TriangleBvh {
    /// The generalised winding number of the surface around `p`: 1 inside, 0 outside, a fraction near holes.
    ///
    /// Groups of faces far away are seen as a whole; the error stays below 0.05, which an inside test does not
    /// notice. See [`winding_number_exact`].
    pub fn winding_number(&self, x: &[Vec3], p: Vec3) -> f64 {
        let dipoles = self.dipoles.get(self, x);
        let mut sum = 0.0;
        let mut stack = [0u32; STACK];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let index = stack[depth] as usize;
            for slot in 0..WIDTH {
                let kind = self.nodes[index].children[slot].kind();
                if matches!(kind, ChildKind::Empty) {
                    continue;
                }
                if let Some(fraction) = dipoles[index][slot].fraction(p) {
                    sum += fraction;
                    continue;
                }
                match kind {
                    ChildKind::Empty => {}
                    ChildKind::Node(child) => {
                        stack[depth] = child as u32;
                        depth += 1;
                    }
                    ChildKind::Leaf(first, count) => {
                        for index in first..first + count {
                            sum += solid_angle_fraction(p, self.triangle(index, x));
                        }
                    }
                }
            }
        }
        sum
    }

    /// Whether `p` lies inside the surface: its winding number is above one half.
    pub fn contains(&self, x: &[Vec3], p: Vec3) -> bool {
        self.winding_number(x, p) > 0.5
    }
}

/// The generalised winding number by its definition, the sum of all solid angles over 4π (Jacobson et al. 2013, eq. 5).
pub fn winding_number_exact(topology: &Topology, x: &[Vec3], p: Vec3) -> f64 {
    topology.faces().iter().map(|face| solid_angle_fraction(p, face.map(|vertex| x[vertex as usize]))).sum()
}

#[cfg(test)]
mod tests {
    use super::winding_number_exact;
    use crate::shapes::{grid, icosphere, torus};
    use crate::{TriangleBvh, Vec3, normal, seeded_rng};

    #[test]
    fn tree_and_sum_agree() {
        let mut rng = seeded_rng(4);
        for mesh in [icosphere(4), torus(0.8, 0.3, 60, 30), grid(20, 20)] {
            let tree = TriangleBvh::new(&mesh.topology, &mesh.vertices);
            let mut worst = 0.0f64;
            for _ in 0..500 {
                let p = Vec3::new(normal(&mut rng), normal(&mut rng), normal(&mut rng));
                let exact = winding_number_exact(&mesh.topology, &mesh.vertices, p);
                worst = worst.max((tree.winding_number(&mesh.vertices, p) - exact).abs());
            }
            assert!(worst < 0.05, "{worst}");
        }
    }

    #[test]
    fn a_closed_surface_is_one_inside_and_zero_outside() {
        let mesh = torus(0.8, 0.3, 40, 20);
        let tree = TriangleBvh::new(&mesh.topology, &mesh.vertices);
        let mut rng = seeded_rng(5);
        for _ in 0..1000 {
            let p = 0.7 * Vec3::new(normal(&mut rng), normal(&mut rng), normal(&mut rng));
            let to_tube = (p.x.hypot(p.z) - 0.8).hypot(p.y);
            if (to_tube - 0.3).abs() > 0.01 {
                let exact = winding_number_exact(&mesh.topology, &mesh.vertices, p);
                assert!((exact - f64::from(u8::from(to_tube < 0.3))).abs() < 1e-12);
                assert_eq!(tree.contains(&mesh.vertices, p), to_tube < 0.3);
            }
        }
    }

    #[test]
    fn winding_numbers_follow_the_motion() {
        let mesh = icosphere(3);
        let mut tree = TriangleBvh::new(&mesh.topology, &mesh.vertices);
        assert!(tree.contains(&mesh.vertices, Vec3::ZERO));
        let moved: Vec<Vec3> = mesh.vertices.iter().map(|&p| p + 3.0 * Vec3::X).collect();
        tree.refit(&moved);
        assert!(!tree.contains(&moved, Vec3::ZERO) && tree.contains(&moved, 3.0 * Vec3::X));
    }

    #[test]
    fn a_square_seen_from_above_is_a_known_solid_angle() {
        // A square of side 2h seen from distance h above its centre fills a sixth of the sphere.
        let mesh = grid(4, 4);
        let above = winding_number_exact(&mesh.topology, &mesh.vertices, Vec3::new(0.5, 0.5, 0.5));
        assert!((above + 1.0 / 6.0).abs() < 1e-12);
        let tree = TriangleBvh::new(&mesh.topology, &mesh.vertices);
        assert!((tree.winding_number(&mesh.vertices, Vec3::new(0.5, 0.5, -0.5)) - 1.0 / 6.0).abs() < 0.05);
    }
}
