//! Skin that meets skin gives way.
//!
//! SCAPE poses every limb as if it were alone: behind a bent knee, in the groin, in the armpit and where thighs meet, skin
//! passes through skin, by up to 45 mm. Flesh does not, and cloth that lies in such a fold would have nowhere to be. So
//! both surfaces give way to the middle of what they share, and a little further, for the cloth between them. Head, hands
//! and feet are bone, touch with little of what cloth covers, and take no part. Limbs that sink deep into the trunk are no
//! matter of skin: [`clear_limbs`](crate::motion::clear_limbs) turns them out of it.

mod find;
mod give;

use modiste_core::{Topology, TriangleBvh, Vec3, vertex_normals};

use crate::Part;
use find::{Surface, Touch};
use give::Giving;

/// Room (m) that is left between two surfaces: for two layers of cloth and the thickness that each keeps from skin.
const GAP: f64 = 0.006;

/// How far (m) a part reaches beyond its vertices: the gap, and what lies between them and those of its neighbours.
const AROUND: f64 = 0.015;

/// How often the skins that meet are looked for at most, and how often they give way to each other before they are looked for
/// anew.
const SEARCHES: usize = 8;
const STEPS: usize = 4;

/// Room (m) between skins that is enough for no more to be asked for.
const ENOUGH: f64 = 0.001;

/// Skin that sees other skin nearer than this (m) in the template pose is left alone: lips, lids, and between toes.
const FOLDED_AT_REST: f64 = 0.012;

/// Part of the thickness of a limb that its skin may sink by, so that opposite sides never meet.
const MOST_SUNK: f64 = 0.4;

/// Where the skin of a model can give way, and how far.
#[derive(Debug)]
pub(crate) struct SkinContact {
    /// Tree over all faces but those of bony parts, made in the template pose.
    tree: TriangleBvh,
    /// Vertices of each part that can meet the skin of another and give way.
    soft: [Vec<u32>; Part::COUNT],
    /// How far each vertex may be moved (m); 0 where it is bone.
    most: Vec<f64>,
    /// Thickness of the body under each vertex (m), in the template pose.
    thickness: Vec<f64>,
}

/// Memory that is kept from pose to pose.
#[derive(Debug, Clone, Default)]
pub(crate) struct ContactScratch {
    tree: Option<TriangleBvh>,
    near: Vec<u32>,
    seen: Vec<Option<Touch>>,
    giving: Giving,
}

impl SkinContact {
    pub(crate) fn new(topology: &Topology, template: &[Vec3], vertex_parts: &[Part], face_parts: &[Part]) -> Self {
        let all = TriangleBvh::new(topology, template);
        let normals = vertex_normals(topology, template);
        let surface = Surface { topology, tree: &all, x: template };
        let thickness: Vec<f64> = (0..template.len()).map(|v| surface.thickness(template[v], normals[v])).collect();
        let is_soft =
            |v: usize| !is_bony(vertex_parts[v]) && surface.facing(template[v], normals[v], FOLDED_AT_REST).is_none();
        let mut soft: [Vec<u32>; Part::COUNT] = Default::default();
        let mut most = vec![0.0; template.len()];
        for v in (0..template.len()).filter(|&v| is_soft(v)) {
            soft[vertex_parts[v].index()].push(v as u32);
            most[v] = MOST_SUNK * thickness[v];
        }
        let faces: Vec<u32> =
            (0u32..).zip(face_parts).filter(|(_, part)| !is_bony(**part)).map(|(face, _)| face).collect();
        Self { tree: TriangleBvh::of_faces(topology, template, &faces), soft, most, thickness }
    }

    /// Moves vertices (m) of the body whose template pose is `rest` until no skin is in other skin, as far as it can give way.
    pub(crate) fn give_way(&self, topology: &Topology, rest: &[Vec3], scratch: &mut ContactScratch, x: &mut [Vec3]) {
        let tree = scratch.tree.get_or_insert_with(|| self.tree.clone());
        let giving = &mut scratch.giving;
        giving.start(x);
        for search in 0..SEARCHES {
            tree.refit(x);
            let surface = Surface { topology, tree, x };
            if search == 0 {
                self.near_other_parts(x, &mut scratch.near);
            } else {
                giving.beside(topology, &self.most, &mut scratch.near);
            }
            surface.touches(&scratch.near, rest, &self.thickness, &mut scratch.seen);
            giving.take(scratch.seen.iter().flatten().copied(), topology, &self.most);
            if giving.least_room(x) >= ENOUGH {
                return;
            }
            for _ in 0..STEPS {
                giving.step(topology, &self.most, x);
            }
        }
    }

    /// The vertices that lie in the box of another part than their own, or nearly so: no others can touch it.
    fn near_other_parts(&self, x: &[Vec3], near: &mut Vec<u32>) {
        near.clear();
        let boxes = self.soft.each_ref().map(|vertices| {
            let nothing = (Vec3::INFINITY, Vec3::NEG_INFINITY);
            let (low, high) =
                vertices.iter().map(|&v| x[v as usize]).fold(nothing, |(low, high), p| (low.min(p), high.max(p)));
            (low - AROUND, high + AROUND)
        });
        for (part, vertices) in self.soft.iter().enumerate() {
            let (bottom, top) = boxes[part];
            let meets = boxes.each_ref().map(|(low, high)| low.cmple(top).all() && high.cmpge(bottom).all());
            near.extend(vertices.iter().copied().filter(|&v| {
                let p = x[v as usize];
                let holds = |other: usize| boxes[other].0.cmple(p).all() && boxes[other].1.cmpge(p).all();
                (0..Part::COUNT).any(|other| other != part && meets[other] && holds(other))
            }));
        }
    }
}

/// Whether a part keeps its shape.
fn is_bony(part: Part) -> bool {
    use Part::{Head, LeftFoot, LeftHand, RightFoot, RightHand};
    matches!(part, Head | LeftHand | RightHand | LeftFoot | RightFoot)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use modiste_core::{Quat, Topology, TriangleBvh, Vec3, shapes::icosphere};

    use super::{ContactScratch, GAP, SkinContact};
    use crate::Part;

    /// Two balls of 0.1 m whose middles are `distance` (m) apart: one shape, two limbs.
    fn balls(distance: f64) -> (Arc<Topology>, Vec<Vec3>) {
        let ball = icosphere(4);
        let count = ball.vertices.len() as u32;
        let x = [-0.5, 0.5].into_iter().flat_map(|side| {
            let turn = Quat::from_rotation_y(0.7 * side) * Quat::from_rotation_z(0.4);
            ball.vertices.iter().map(move |&p| turn * (0.1 * p) + side * distance * Vec3::X).collect::<Vec<_>>()
        });
        let faces = ball.topology.faces();
        let both = faces.iter().copied().chain(faces.iter().map(|face| face.map(|vertex| vertex + count)));
        (Arc::new(Topology::new(2 * ball.vertices.len(), both.collect()).unwrap()), x.collect())
    }

    fn contact(topology: &Topology, rest: &[Vec3], parts: [Part; 2]) -> SkinContact {
        let of = |count: usize| parts.into_iter().flat_map(|part| vec![part; count / 2]).collect::<Vec<_>>();
        SkinContact::new(topology, rest, &of(rest.len()), &of(topology.face_count()))
    }

    #[test]
    fn two_limbs_that_pass_through_each_other_meet_in_the_middle() {
        let (topology, rest) = balls(0.3);
        let contact = contact(&topology, &rest, [Part::LeftThigh, Part::RightThigh]);
        let mut scratch = ContactScratch::default();
        for overlap in [0.003, 0.01, 0.03, 0.05] {
            let (_, before) = balls(0.2 - overlap);
            let mut x = before.clone();
            contact.give_way(&topology, &rest, &mut scratch, &mut x);
            assert_eq!(TriangleBvh::new(&topology, &x).self_intersections(&x), [] as [[u32; 2]; 0], "{overlap}");
            let half = x.len() / 2;
            let left = x[..half].iter().map(|p| p.x).fold(f64::MIN, f64::max);
            let right = x[half..].iter().map(|p| p.x).fold(f64::MAX, f64::min);
            assert!(right - left > 0.3 * GAP && right - left < 3.0 * GAP, "{overlap}: {left} to {right}");
            assert!((left + right).abs() < 5e-4, "{overlap}: {left} to {right}");
            let far = (0..half).filter(|&v| before[v].x < -0.12).all(|v| x[v] == before[v]);
            assert!(far, "{overlap}: the far side stays as it was");
        }
    }

    #[test]
    fn limbs_as_wide_as_a_broad_trunk_give_way_too() {
        let wide = |distance: f64| {
            let (topology, x) = balls(distance);
            (topology, x.iter().map(|p| 1.9 * *p).collect::<Vec<Vec3>>())
        };
        let (topology, rest) = wide(0.3);
        let (_, mut x) = wide(0.19);
        let contact = contact(&topology, &rest, [Part::LeftUpperArm, Part::Chest]);
        assert!(!TriangleBvh::new(&topology, &x).self_intersections(&x).is_empty());
        contact.give_way(&topology, &rest, &mut ContactScratch::default(), &mut x);
        assert_eq!(TriangleBvh::new(&topology, &x).self_intersections(&x), [] as [[u32; 2]; 0]);
    }

    #[test]
    fn bones_and_limbs_that_do_not_meet_stay_as_they_are() {
        let (topology, rest) = balls(0.3);
        let mut scratch = ContactScratch::default();
        for (distance, parts) in
            [(0.22, [Part::LeftThigh, Part::RightThigh]), (0.17, [Part::LeftHand, Part::RightHand])]
        {
            let (_, before) = balls(distance);
            let mut x = before.clone();
            contact(&topology, &rest, parts).give_way(&topology, &rest, &mut scratch, &mut x);
            assert_eq!(x, before);
        }
    }
}
