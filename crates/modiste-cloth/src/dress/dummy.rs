//! A dressmaker's dummy of lofted tubes, for tests: trunk, arms 45° down, legs apart, each a closed surface.

use std::sync::Arc;

use modiste_body::Part;
use modiste_core::{Topology, Vec3};

use super::Mannequin;

const SIDES: usize = 24;

/// A closed tube through elliptic rings, with its parts by ring.
#[derive(Default)]
struct Loft {
    vertices: Vec<Vec3>,
    vertex_parts: Vec<Part>,
    faces: Vec<[u32; 3]>,
    face_parts: Vec<Part>,
}

impl Loft {
    /// Adds a tube; each ring is its centre, its two half-axis vectors and its part. The direction of travel is the cross
    /// product of the axes.
    fn tube(&mut self, rings: &[(Vec3, Vec3, Vec3, Part)]) {
        let first = self.vertices.len() as u32;
        for (centre, a, b, part) in rings {
            for side in 0..SIDES {
                let angle = std::f64::consts::TAU * side as f64 / SIDES as f64;
                self.vertices.push(*centre + angle.cos() * *a + angle.sin() * *b);
                self.vertex_parts.push(*part);
            }
        }
        let id = |ring: usize, side: usize| first + (ring * SIDES + side % SIDES) as u32;
        let mut face = |corners: [u32; 3], part: Part| {
            self.faces.push(corners);
            self.face_parts.push(part);
        };
        for ring in 0..rings.len() - 1 {
            for side in 0..SIDES {
                let [p, q, r, s] = [id(ring, side), id(ring, side + 1), id(ring + 1, side + 1), id(ring + 1, side)];
                face([p, q, r], rings[ring].3);
                face([p, r, s], rings[ring].3);
            }
        }
        let last = rings.len() - 1;
        let caps = first + (rings.len() * SIDES) as u32;
        for side in 0..SIDES {
            face([caps, id(0, side + 1), id(0, side)], rings[0].3);
            face([caps + 1, id(last, side), id(last, side + 1)], rings[last].3);
        }
        for ring in [0, last] {
            self.vertices.push(rings[ring].0);
            self.vertex_parts.push(rings[ring].3);
        }
    }
}

/// A dummy of a woman's size, as `girth` times as wide.
pub(crate) fn dummy(girth: f64) -> Mannequin {
    let mut loft = Loft::default();
    // Travelling up: z × x = y.
    let ring = |y: f64, width: f64, depth: f64, part: Part| {
        (Vec3::new(0.0, y, 0.0), girth * depth * Vec3::Z, girth * width * Vec3::X, part)
    };
    loft.tube(&[
        ring(0.80, 0.10, 0.09, Part::Pelvis),
        ring(0.84, 0.165, 0.12, Part::Pelvis),
        ring(0.90, 0.165, 0.12, Part::Pelvis),
        ring(1.00, 0.135, 0.10, Part::Abdomen),
        ring(1.10, 0.135, 0.10, Part::Chest),
        ring(1.25, 0.155, 0.12, Part::Chest),
        ring(1.33, 0.165, 0.10, Part::Chest),
        ring(1.37, 0.12, 0.075, Part::Chest),
        ring(1.40, 0.06, 0.06, Part::Neck),
        ring(1.50, 0.055, 0.055, Part::Head),
        ring(1.60, 0.08, 0.09, Part::Head),
        ring(1.65, 0.03, 0.03, Part::Head),
    ]);
    let mut joints = [Vec3::ZERO; Part::COUNT];
    for (part, y) in
        [(Part::Pelvis, 0.90), (Part::Abdomen, 1.0), (Part::Chest, 1.1), (Part::Neck, 1.38), (Part::Head, 1.5)]
    {
        joints[part.index()] = Vec3::new(0.0, y, 0.0);
    }
    let (arms, legs) = (
        [
            [Part::LeftShoulder, Part::LeftUpperArm, Part::LeftForearm, Part::LeftHand],
            [Part::RightShoulder, Part::RightUpperArm, Part::RightForearm, Part::RightHand],
        ],
        [[Part::LeftThigh, Part::LeftShin, Part::LeftFoot], [Part::RightThigh, Part::RightShin, Part::RightFoot]],
    );
    for (side, (arm, leg)) in [1.0, -1.0].into_iter().zip(arms.into_iter().zip(legs)) {
        let shoulder = Vec3::new(side * 0.15 * girth, 1.32, 0.0);
        let along = Vec3::new(side, -1.0, 0.0).normalize();
        let across = Vec3::Z.cross(along);
        let ring = |t: f64, radius: f64, part: Part| {
            (shoulder + t * along, radius * Vec3::Z.cross(along).cross(along) * -1.0, radius * across, part)
        };
        let ordered = |t, radius, part| {
            let (centre, a, b, part) = ring(t, radius, part);
            if a.cross(b).dot(along) > 0.0 { (centre, a, b, part) } else { (centre, b, a, part) }
        };
        loft.tube(&[
            ordered(-0.03, 0.03, arm[1]),
            ordered(0.0, 0.048 * girth, arm[1]),
            ordered(0.28, 0.042 * girth, arm[1]),
            ordered(0.30, 0.042 * girth, arm[2]),
            ordered(0.52, 0.03, arm[3]),
        ]);
        for (part, t) in [(arm[0], -0.05), (arm[1], 0.0), (arm[2], 0.29), (arm[3], 0.52)] {
            joints[part.index()] = shoulder + t * along;
        }
        let hip = Vec3::new(side * 0.085 * girth, 0.86, 0.0);
        let ankle = Vec3::new(side * 0.16, 0.0, 0.0);
        let ring = |t: f64, radius: f64, part: Part| (hip.lerp(ankle, t), radius * Vec3::X, radius * Vec3::Z, part);
        loft.tube(&[
            ring(0.0, 0.06 * girth, leg[0]),
            ring(0.08, 0.078 * girth, leg[0]),
            ring(0.45, 0.06 * girth, leg[0]),
            ring(0.55, 0.055, leg[1]),
            ring(1.0, 0.04, leg[2]),
        ]);
        for (part, t) in [(leg[0], 0.0), (leg[1], 0.5), (leg[2], 0.95)] {
            joints[part.index()] = hip.lerp(ankle, t);
        }
    }
    let topology = Topology::new(loft.vertices.len(), loft.faces).unwrap();
    Mannequin {
        topology: Arc::new(topology),
        vertices: loft.vertices,
        face_parts: loft.face_parts,
        vertex_parts: loft.vertex_parts,
        joints,
    }
}

#[cfg(test)]
mod tests {
    use super::dummy;
    use crate::dress::{Carrier, Dressed, Mannequin, Tailor, TailorOptions};
    use crate::pattern::{GARMENTS, builtin};
    use modiste_body::Gender;
    use modiste_core::volume;
    use std::sync::Arc;

    #[test]
    fn the_dummy_is_closed_and_measures_like_a_woman() {
        let dummy = dummy(1.0);
        assert!(dummy.topology.edges().iter().all(|edge| edge.faces[1].is_some()));
        assert!(volume(&dummy.topology, &dummy.vertices) > 0.03);
        let girths = dummy.girths();
        assert!((0.8..1.0).contains(&girths.chest) && (0.65..0.85).contains(&girths.waist), "{girths:?}");
        assert!((0.85..1.05).contains(&girths.hip), "{girths:?}");
        assert!((0.75..0.83).contains(&dummy.crotch_height()), "{}", dummy.crotch_height());
    }

    /// As a drape is checked, but for cloth inside the body: the limbs of the dummy cross its trunk, and a vertex may lie
    /// between their surfaces.
    fn check(dressed: &Dressed) {
        let mut quality = dressed.quality.clone();
        assert!(100 * quality.inside < dressed.state.positions.len(), "{quality:?}");
        quality.inside = 0;
        quality.check().unwrap();
    }

    /// Sews both garments at a coarse size, and carries them to a wider dummy in a larger size.
    #[test]
    fn garments_are_sewn_and_carried() {
        let (body, wider): (Mannequin, Mannequin) = (dummy(1.0), dummy(1.12));
        for garment in GARMENTS {
            let pattern = Arc::new(builtin(garment, Gender::Female).unwrap().unwrap());
            let tailor =
                Tailor::new(pattern, TailorOptions { vertex_count: 1000, ..TailorOptions::default() }).unwrap();
            let dressed = tailor.dress(&body).unwrap();
            assert!(dressed.widest_seam < 1e-3, "{garment}");
            check(&dressed);
            assert!(dressed.speed < 0.5, "{garment} {}", dressed.speed);
            let carrier = Carrier::new(&dressed.state.positions, &body.vertices);
            let carried = tailor.redress(&carrier, &dressed, &body, (&wider, 0.0)).unwrap();
            check(&carried);
            assert!(carried.fitting.size > dressed.fitting.size, "{garment}");
            // The same dressing gives the same drape, bit for bit.
            let again = tailor.redress(&carrier, &dressed, &body, (&wider, 0.0)).unwrap();
            assert_eq!(again.state.positions, carried.state.positions);
        }
    }
}
