//! Sharp points of the body under the cloth: where the body is finer than the cloth, its vertices push the cloth's faces.

use super::collider::BodyCollider;
use super::groups::CollisionGroups;
use super::tree::FaceTree;
use modiste_core::{Topology, Vec3};

/// Radius of curvature (m) below which a vertex of the body counts as a bump: rounder places are covered by the contact
/// of the cloth's own vertices.
const BUMP_RADIUS: f64 = 0.03;

/// Distance (m) within which the cloth over a bump is looked for at the start of a frame.
const REACH: f64 = 0.012;

/// Share of the thickness that cloth keeps from a bump.
const CLEARANCE_SHARE: f64 = 0.5;

/// Faces that the cloth may slide over a bump in one substep.
const HOPS: usize = 3;

/// Least cosine between a bump's normal and the face that covers it.
const MIN_COSINE: f64 = 0.3;

/// The bumps that cloth lies over, kept from step to step.
#[derive(Debug, Clone)]
pub(crate) struct BumpContacts {
    neighbours: Vec<[Option<u32>; 3]>,
    /// Body vertex and cloth face.
    covered: Vec<(u32, u32)>,
}

/// A push of a bump against a face of the cloth.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BumpForce {
    pub(crate) vertices: [u32; 3],
    pub(crate) weights: [f64; 3],
    /// Outward normal of the body.
    pub(crate) normal: Vec3,
    /// How much nearer than its clearance the face is (m).
    pub(crate) depth: f64,
}

impl BumpContacts {
    pub(crate) fn new(cloth: &Topology) -> Self {
        let across = |face: u32, [a, b]: [u32; 2]| {
            let around = cloth.vertex_faces(a as usize).iter().copied();
            around.filter(|&other| other != face).find(|&other| cloth.faces()[other as usize].contains(&b))
        };
        let neighbours = (0u32..)
            .zip(cloth.faces())
            .map(|(face, &[a, b, c])| [[a, b], [b, c], [c, a]].map(|edge| across(face, edge)))
            .collect();
        Self { neighbours, covered: Vec::new() }
    }

    /// Finds the faces of the cloth that lie over bumps of their own limbs, at the start of a frame. `tree` fits the cloth at `x`.
    pub(crate) fn search(
        &mut self,
        body: &BodyCollider,
        groups: Option<&CollisionGroups>,
        cloth: &Topology,
        (tree, x): (&FaceTree, &[Vec3]),
    ) {
        self.covered.clear();
        for &(bump, limb) in body.bumps() {
            let mut range = REACH;
            let Some((face, _)) = tree.closest(cloth.faces(), x, body.vertex(bump), None, &mut range) else { continue };
            // Fingers at the seam of the trousers must not hook into them.
            let covers = |vertex: &u32| groups.is_none_or(|groups| groups.home(*vertex as usize) & limb != 0);
            if cloth.faces()[face as usize].iter().all(covers) {
                self.covered.push((bump, face));
            }
        }
    }

    /// Calls `push` for every bump that is nearer to its face at `x` than the clearance.
    pub(crate) fn forces(
        &mut self,
        body: &BodyCollider,
        cloth: &Topology,
        thickness: f64,
        x: &[Vec3],
        mut push: impl FnMut(BumpForce),
    ) {
        for (bump, face) in &mut self.covered {
            let (place, normal) = (body.vertex(*bump), body.vertex_normal(*bump));
            for _ in 0..=HOPS {
                let vertices = cloth.faces()[*face as usize];
                let Some((weights, gap)) = along(place, normal, vertices.map(|v| x[v as usize])) else { break };
                // Outside the face: go on over the edge opposite to the most negative weight.
                let lowest = (0..3).min_by(|&i, &j| weights[i].total_cmp(&weights[j])).unwrap_or(0);
                let next = self.neighbours[*face as usize][(lowest + 1) % 3];
                if weights[lowest] < -1e-3 {
                    let Some(next) = next else { break };
                    *face = next;
                    continue;
                }
                let depth = CLEARANCE_SHARE * thickness - gap;
                if depth > 0.0 && gap > -REACH {
                    push(BumpForce { vertices, weights, normal, depth });
                }
                break;
            }
        }
    }
}

/// Vertices of a closed surface whose convex curvature is sharper than [`BUMP_RADIUS`].
pub(super) fn find_bumps(topology: &Topology, x: &[Vec3]) -> Vec<u32> {
    let normals = modiste_core::vertex_normals(topology, x);
    let curvature = |vertex: usize| {
        let ring = topology.neighbours(vertex);
        let bend = |&n: &u32| {
            let step = x[vertex] - x[n as usize];
            2.0 * normals[vertex].dot(step) / step.length_squared().max(f64::MIN_POSITIVE)
        };
        ring.iter().map(bend).sum::<f64>() / ring.len().max(1) as f64
    };
    (0u32..).take(x.len()).filter(|&vertex| curvature(vertex as usize) > 1.0 / BUMP_RADIUS).collect()
}

/// Where the line from `p` along `normal` meets the plane of a triangle: barycentric coordinates and signed distance.
fn along(p: Vec3, normal: Vec3, [a, b, c]: [Vec3; 3]) -> Option<([f64; 3], f64)> {
    let area = (b - a).cross(c - a);
    let facing = normal.dot(area);
    if facing.abs() < MIN_COSINE * area.length() {
        return None;
    }
    let gap = (a - p).dot(area) / facing;
    let q = p + normal * gap;
    let square = area.length_squared();
    let v = (q - a).cross(c - a).dot(area) / square;
    let w = (b - a).cross(q - a).dot(area) / square;
    Some(([1.0 - v - w, v, w], gap))
}

#[cfg(test)]
mod tests {
    use super::{BumpContacts, along, find_bumps};
    use crate::contact::collider::BodyCollider;
    use crate::contact::groups::CollisionGroups;
    use crate::contact::tree::FaceTree;
    use modiste_body::Part;
    use modiste_core::{Topology, Vec3, shapes};
    use std::sync::Arc;

    #[test]
    fn a_line_meets_a_triangle_where_it_should() {
        let triangle = [Vec3::ZERO, Vec3::X, Vec3::Z];
        let (weights, gap) = along(Vec3::new(0.2, -0.5, 0.3), Vec3::Y, triangle).unwrap();
        assert!((gap - 0.5).abs() < 1e-12);
        for (got, want) in weights.into_iter().zip([0.5, 0.2, 0.3]) {
            assert!((got - want).abs() < 1e-12);
        }
        assert!(along(Vec3::Y, Vec3::X, triangle).is_none());
    }

    #[test]
    fn small_spheres_are_bumps_and_large_ones_are_not() {
        let sphere = shapes::icosphere(3);
        let scaled = |radius: f64| sphere.vertices.iter().map(|x| *x * radius).collect::<Vec<_>>();
        assert_eq!(find_bumps(&sphere.topology, &scaled(0.02)).len(), sphere.vertices.len());
        assert!(find_bumps(&sphere.topology, &scaled(0.04)).is_empty());
    }

    #[test]
    fn a_finger_does_not_hook_into_cloth_of_another_limb() {
        let finger = shapes::icosphere(2);
        let x: Vec<Vec3> = finger.vertices.iter().map(|x| *x * 0.008).collect();
        let mut body = BodyCollider::new(Arc::clone(&finger.topology), &x).unwrap();
        body.set_face_parts(&vec![Part::LeftHand; finger.topology.face_count()]).unwrap();
        let cloth = Topology::new(3, vec![[0, 1, 2]]).unwrap();
        let x = [Vec3::new(-0.02, 0.009, -0.02), Vec3::new(0.02, 0.009, -0.02), Vec3::new(0.0, 0.009, 0.03)];
        let tree = FaceTree::new(cloth.faces(), vec![0], &x);
        let covered = |part: Part| {
            let groups = CollisionGroups::from_face_parts(&cloth, &[part]);
            let mut bumps = BumpContacts::new(&cloth);
            bumps.search(&body, Some(&groups), &cloth, (&tree, &x));
            bumps.covered.len()
        };
        assert!(covered(Part::LeftForearm) > 0);
        assert_eq!(covered(Part::Pelvis), 0);
    }
}
