//! Bending across one inner edge.

use crate::material::Bend;
use modiste_core::{Edge, Topology, Vec2, Vec3};

/// Hinges on equilateral triangles resist a bend of `κ` along with a free bend across it by 8/9 of what they resist the bend
/// alone (they act as a plate with a Poisson ratio of -1/3). Rigidity is measured on strips, which are free across.
const STRIP_SHARE: f64 = 9.0 / 8.0;

/// The bending element of one inner edge: quadratic in the positions (Bergou et al. 2006), so its stiffness is constant.
///
/// `κ = Σ c_i x_i` is the jump of slope across the edge (a vector along the normal whose length is `2 sin(θ/2)` for a fold by
/// `θ`), the energy is `½ k |κ - rest n|²` with `k = 9/8 B l²/(A_0 + A_1)`; it is zero for every affine image of the flat rest shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hinge {
    /// The two ends of the edge in the order of its first face, then the opposite corners of its first and second face.
    pub vertices: [u32; 4],
    /// `c_i` (1/m).
    pub weights: [f64; 4],
    /// `k` (N·m³/m² = N·m).
    pub stiffness: f64,
    /// Slope jump at rest, positive where the faces fold towards their normals' side: `2 sin(θ_rest/2)`.
    pub rest: f64,
}

impl Hinge {
    /// Prepares the element of `edge`, or `None` on a boundary. `rest_faces` are the corners of every face in panel space (m).
    pub fn new(topology: &Topology, rest_faces: &[[Vec2; 3]], edge: &Edge, bend: &Bend) -> Option<Self> {
        let [Some(first), Some(second)] = edge.faces else { return None };
        let corners = topology.faces()[first as usize];
        let forward = (0..3).any(|i| [corners[i], corners[(i + 1) % 3]] == edge.vertices);
        let [a, b] = if forward { edge.vertices } else { [edge.vertices[1], edge.vertices[0]] };
        let sides = [first, second].map(|face| Side::new(topology, rest_faces, face as usize, [a, b]));
        let opposite = sides.map(|side| side.opposite);
        let length = 0.5 * (sides[0].along.length() + sides[1].along.length());
        let area = sides[0].area + sides[1].area;
        let rigidity = 0.5 * (bend.along(sides[0].along) + bend.along(sides[1].along));
        let foot = |end: usize| -sides.iter().map(|side| side.foot[end] / side.height).sum::<f64>();
        Some(Self {
            vertices: [a, b, opposite[0], opposite[1]],
            weights: [foot(0), foot(1), 1.0 / sides[0].height, 1.0 / sides[1].height],
            stiffness: STRIP_SHARE * rigidity * length * length / area,
            rest: 0.0,
        })
    }

    /// The slope jump `κ = Σ c_i x_i`.
    #[inline]
    pub fn slope_jump(&self, x: &[Vec3]) -> Vec3 {
        self.vertices.iter().zip(self.weights).map(|(&v, c)| x[v as usize] * c).sum()
    }

    /// Mean of the unit normals of the two faces, unit (zero for a fold by 180 degrees).
    #[inline]
    pub fn normal(&self, x: &[Vec3]) -> Vec3 {
        let [a, b, c, d] = self.vertices.map(|v| x[v as usize]);
        let edge = b - a;
        let [m, n] = [edge.cross(c - a), (d - a).cross(edge)];
        (m.normalize_or_zero() + n.normalize_or_zero()).normalize_or_zero()
    }

    /// Energy (J) with the rest slope along `normal`.
    pub fn energy(&self, x: &[Vec3], normal: Vec3) -> f64 {
        0.5 * self.stiffness * (self.slope_jump(x) - normal * self.rest).length_squared()
    }

    /// Forces on the four vertices (N) with the rest slope along `normal`, held constant.
    #[inline]
    pub fn forces(&self, x: &[Vec3], normal: Vec3) -> [Vec3; 4] {
        let moment = (self.slope_jump(x) - normal * self.rest) * -self.stiffness;
        self.weights.map(|c| moment * c)
    }
}

/// One of the two triangles of a hinge, in panel space.
#[derive(Debug, Clone, Copy)]
struct Side {
    opposite: u32,
    along: Vec2,
    area: f64,
    height: f64,
    /// Weights of the edge's ends at the foot of the height.
    foot: [f64; 2],
}

impl Side {
    fn new(topology: &Topology, rest_faces: &[[Vec2; 3]], face: usize, ends: [u32; 2]) -> Self {
        let corners = topology.faces()[face];
        let rest = &rest_faces[face];
        let place = |vertex: u32| corners.iter().position(|&corner| corner == vertex).map_or(Vec2::ZERO, |c| rest[c]);
        let opposite = corners.into_iter().find(|corner| !ends.contains(corner)).unwrap_or(corners[0]);
        let [a, b, c] = [place(ends[0]), place(ends[1]), place(opposite)];
        let along = b - a;
        let double_area = along.perp_dot(c - a).abs();
        let share = (c - a).dot(along) / along.length_squared();
        Self {
            opposite,
            along,
            area: 0.5 * double_area,
            height: double_area / along.length(),
            foot: [1.0 - share, share],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Hinge;
    use crate::material::Bend;
    use modiste_core::{Quat, Topology, Vec2, Vec3};

    fn square() -> (Topology, Vec<[Vec2; 3]>, [Vec2; 4]) {
        let flat = [Vec2::new(0.0, 0.0), Vec2::new(0.012, 0.001), Vec2::new(0.013, 0.011), Vec2::new(-0.001, 0.01)];
        let topology = Topology::new(4, vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        let rest = topology.faces().iter().map(|f| f.map(|v| flat[v as usize])).collect();
        (topology, rest, flat)
    }

    fn hinge() -> (Hinge, [Vec2; 4]) {
        let (topology, rest, flat) = square();
        let edge = topology.edges().iter().find(|e| e.vertices == [0, 2]).unwrap();
        (Hinge::new(&topology, &rest, edge, &Bend::isotropic(2e-5)).unwrap(), flat)
    }

    /// The rest shape folded by `angle` about its diagonal.
    fn folded(flat: &[Vec2; 4], angle: f64) -> Vec<Vec3> {
        let axis = flat[2].extend(0.0).normalize();
        let turn = Quat::from_axis_angle(axis, angle);
        (0..4).map(|v| if v == 3 { turn * flat[v].extend(0.0) } else { flat[v].extend(0.0) }).collect()
    }

    #[test]
    fn flat_images_hold_no_energy_and_folds_hold_the_closed_form() {
        let (hinge, flat) = hinge();
        let affine: Vec<Vec3> = flat.iter().map(|p| Vec3::new(p.x * 1.1 + p.y * 0.2, p.y * 0.8, p.x * 0.5)).collect();
        assert!(hinge.energy(&affine, Vec3::ZERO) < 1e-30);
        for angle in [0.05, 0.4, 1.5] {
            let got = hinge.slope_jump(&folded(&flat, angle)).length();
            assert!((got - 2.0 * (angle / 2.0f64).sin()).abs() < 1e-12, "{got}");
        }
    }

    #[test]
    fn forces_are_minus_the_gradient_and_balanced() {
        let (mut hinge, flat) = hinge();
        hinge.rest = 0.3;
        let mut x = folded(&flat, 0.8);
        x[1] += Vec3::new(0.001, -0.0005, 0.002);
        let normal = hinge.normal(&x);
        let forces = hinge.forces(&x, normal);
        let step = 1e-7;
        for (corner, &vertex) in hinge.vertices.iter().enumerate() {
            for axis in 0..3 {
                let mut up = x.clone();
                let mut down = x.clone();
                up[vertex as usize][axis] += step;
                down[vertex as usize][axis] -= step;
                let slope = (hinge.energy(&up, normal) - hinge.energy(&down, normal)) / (2.0 * step);
                assert!((slope + forces[corner][axis]).abs() < 1e-8 * (1.0 + slope.abs()));
            }
        }
        assert!(forces.iter().sum::<Vec3>().length() < 1e-15);
    }

    #[test]
    fn the_rest_angle_points_along_the_normal() {
        let (mut hinge, flat) = hinge();
        let x = folded(&flat, 0.6);
        let jump = hinge.slope_jump(&x);
        let normal = hinge.normal(&x);
        assert!((jump.dot(normal) - 2.0 * 0.3f64.sin()).abs() < 1e-12);
        hinge.rest = jump.dot(normal);
        assert!(hinge.energy(&x, normal) < 1e-20);
    }
}
