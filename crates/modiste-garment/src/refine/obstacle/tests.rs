use super::{NO_HINT, Obstacle};
use crate::refine::crowding::FREE;
use modiste_body::Part;
use modiste_core::shapes::{grid, icosphere};
use modiste_core::{Topology, Vec3, normal, seeded_rng};
use std::sync::Arc;

#[test]
fn distances_from_a_sphere_are_signed_and_exact_to_its_facets() {
    let sphere = icosphere(4);
    let obstacle = Obstacle::single(sphere.topology.clone(), &sphere.vertices);
    let mut rng = seeded_rng(1);
    for _ in 0..500 {
        let direction = Vec3::new(normal(&mut rng), normal(&mut rng), normal(&mut rng)).normalize();
        let radius = 0.9 + 0.1 * normal(&mut rng).abs().min(2.0);
        let contact = obstacle.contact(radius * direction, 0.5, &mut NO_HINT.clone()).unwrap();
        assert!((contact.distance - (radius - 1.0)).abs() < 2e-3, "{} {radius}", contact.distance);
        assert!(contact.normal.dot(direction) > 0.99);
    }
}

/// A trunk and a thigh, spheres of radius 1 with centres 1.6 apart.
pub(crate) fn crossing() -> Obstacle {
    let sphere = icosphere(4);
    let shift = Vec3::new(1.6, 0.0, 0.0);
    let count = sphere.vertices.len() as u32;
    let vertices: Vec<Vec3> =
        sphere.vertices.iter().copied().chain(sphere.vertices.iter().map(|v| *v + shift)).collect();
    let faces = sphere.topology.faces();
    let both = faces.iter().copied().chain(faces.iter().map(|face| face.map(|vertex| vertex + count))).collect();
    let mut parts = vec![Part::Chest; faces.len()];
    parts.resize(2 * faces.len(), Part::LeftThigh);
    Obstacle::body(Arc::new(Topology::new(vertices.len(), both).unwrap()), &parts, &parts, &vertices)
}

/// Signed distance from the union of the two spheres: outside the nearer, inside the nearest point of the union's
/// surface, which may be on the circle where they cross.
pub(crate) fn union_distance(p: Vec3) -> f64 {
    let centres = [Vec3::ZERO, Vec3::new(1.6, 0.0, 0.0)];
    let outside = centres.map(|centre| p.distance(centre) - 1.0);
    if outside.iter().all(|distance| *distance >= 0.0) {
        return outside[0].min(outside[1]);
    }
    let mut nearest = f64::INFINITY;
    for (centre, other) in [(centres[0], centres[1]), (centres[1], centres[0])] {
        let foot = centre + (p - centre).normalize_or(Vec3::Y);
        if foot.distance(other) >= 1.0 {
            nearest = nearest.min(foot.distance(p));
        }
    }
    let radial = p.y.hypot(p.z) - 0.6;
    -nearest.min((p.x - 0.8).hypot(radial))
}

#[test]
fn where_parts_cross_the_distance_is_that_of_their_union() {
    let obstacle = crossing();
    let mut rng = seeded_rng(6);
    let (mut pinched, mut worst) = (0, 0.0f64);
    for _ in 0..2000 {
        let p = Vec3::new(0.8 + 0.3 * normal(&mut rng), 0.5 * normal(&mut rng), 0.5 * normal(&mut rng));
        let Some(contact) = obstacle.contact(p, 0.5, &mut NO_HINT.clone()) else { continue };
        let wanted = union_distance(p);
        if wanted.abs() > 0.02 {
            assert_eq!(contact.distance < 0.0, wanted < 0.0, "{p} {wanted} {contact:?}");
        }
        // Along the crossing the mesh is as fine as its triangles.
        worst = worst.max((contact.distance - wanted).abs());
        pinched += usize::from(contact.pinched);
        // Following the normal leads out, or near the crossing to within half an edge of a triangle from it.
        let exit = p - (contact.distance - 0.05) * contact.normal;
        assert!(contact.distance > 0.0 || union_distance(exit) > -0.04, "{p} {exit}");
    }
    assert!(worst < 0.08, "{worst}");
    assert!(pinched > 100);
}

/// Two balls of 10 cm as one body, with a gap between them or, below 0, in each other.
fn balls(gap: f64) -> Obstacle {
    let ball = icosphere(4);
    let count = ball.vertices.len() as u32;
    let faces = ball.topology.faces().iter();
    let both = faces.clone().copied().chain(faces.map(|face| face.map(|vertex| vertex + count))).collect();
    let parts: Vec<Part> = (0..2 * ball.topology.face_count())
        .map(|face| if face < ball.topology.face_count() { Part::Chest } else { Part::LeftUpperArm })
        .collect();
    let half = Vec3::new(0.1 + 0.5 * gap, 0.0, 0.0);
    let vertices = ball.vertices.iter();
    let vertices: Vec<Vec3> =
        vertices.clone().map(|v| 0.1 * *v - half).chain(vertices.map(|v| 0.1 * *v + half)).collect();
    let topology = Arc::new(Topology::new(vertices.len(), both).unwrap());
    Obstacle::body(topology, &parts, &parts, &vertices)
}

#[test]
fn what_is_told_quickly_is_what_the_tree_says() {
    let mut rng = seeded_rng(9);
    for gap in [-0.03, -0.005, 0.002, 0.01, 0.05] {
        let body = balls(gap);
        let (mut certain, mut pinched) = (0, 0);
        for _ in 0..3000 {
            let mut draw = |scale: f64| scale * Vec3::new(normal(&mut rng), normal(&mut rng), normal(&mut rng));
            let side = if draw(1.0).x < 0.0 { -1.0 } else { 1.0 };
            let centre = Vec3::new(side * (0.1 + 0.5 * gap), 0.0, 0.0);
            let point = centre + (0.1 + draw(0.008).x) * draw(1.0).normalize_or(Vec3::Y);
            // The face that was nearest before the point moved by a centimetre or two.
            let mut hint = body
                .nearest_where((point + draw(0.01), f64::INFINITY), &mut NO_HINT.clone(), |_, _| true)
                .unwrap()
                .face;
            let quick = body.touch(point, f64::INFINITY, &mut hint).unwrap();
            let slow = body.contact(point, f64::INFINITY, &mut NO_HINT.clone()).unwrap();
            if quick.pinched {
                pinched += 1;
                assert!(body.is_inside(point), "gap {gap}, {point}: {quick:?}");
                continue;
            }
            // Further out than this it does not matter which of two surfaces is nearer.
            if quick.distance.min(slow.distance) > FREE {
                continue;
            }
            // From within, one of two flat faces may be as good as the other.
            let tolerance = if slow.distance < 0.0 { 2e-4 } else { 1e-9 };
            let difference = (quick.distance - slow.distance).abs();
            assert!(difference < tolerance, "gap {gap}, {point}: {quick:?} {slow:?}");
            certain += usize::from(quick.certain);
        }
        assert!(certain > 1500, "gap {gap}: {certain}");
        assert!((pinched > 20) == (gap < 0.0), "gap {gap}: {pinched}");
    }
}

#[test]
fn what_holds_a_point_has_it_inside() {
    let mut rng = seeded_rng(10);
    for gap in [-0.03, 0.002] {
        let body = balls(gap);
        let mut held = 0;
        for _ in 0..2000 {
            let mut draw = |scale: f64| scale * Vec3::new(normal(&mut rng), normal(&mut rng), normal(&mut rng));
            let centre = Vec3::new(if draw(1.0).x < 0.0 { -0.1 } else { 0.1 }, 0.0, 0.0);
            let point = centre + (0.1 + draw(0.008).x) * draw(1.0).normalize_or(Vec3::Y);
            let contact = body.touch(point, f64::INFINITY, &mut NO_HINT.clone()).unwrap();
            if contact.distance.abs() > 1e-4 {
                assert_eq!(body.holds(point, &contact), body.is_inside(point), "gap {gap}, {point}: {contact:?}");
                held += usize::from(contact.distance < 0.0);
            }
        }
        assert!(held > 500, "{held}");
    }
}

#[test]
fn away_from_the_crossing_nothing_is_pinched() {
    let obstacle = crossing();
    let contact = obstacle.contact(Vec3::new(-0.9, 0.0, 0.0), 0.5, &mut NO_HINT.clone()).unwrap();
    assert!(!contact.pinched && (contact.distance + 0.1).abs() < 3e-3);
}

#[test]
fn beside_an_open_surface_there_is_no_contact() {
    let square = grid(4, 4);
    let obstacle = Obstacle::garment(square.topology.clone(), &square.vertices, 0.001);
    let at = |x: f64, z: f64| {
        let contact = obstacle.contact(Vec3::new(x, 0.5, z), 0.1, &mut NO_HINT.clone());
        contact.map(|contact| contact.distance)
    };
    assert!((at(0.5, 0.02).unwrap() - 0.019).abs() < 1e-12);
    assert!((at(0.5, -0.02).unwrap() + 0.021).abs() < 1e-12);
    assert!((at(-0.002, -0.02).unwrap() + 0.021).abs() < 1e-12);
    assert_eq!(at(-0.02, -0.02), None);
}

#[test]
fn above_a_rim_that_is_folded_over_is_outside() {
    // A level band whose last row is folded back under it, so that its outer side looks down.
    let band = grid(4, 4);
    let folded = |v: &Vec3| if v.x > 0.8 { Vec3::new(0.6, v.y, -0.02) } else { *v };
    let vertices: Vec<Vec3> = band.vertices.iter().map(folded).collect();
    let mut obstacle = Obstacle::garment(band.topology.clone(), &vertices, 0.001);
    assert!(obstacle.face_normal(0).z > 0.0);
    let distance = |obstacle: &Obstacle, x: f64, z: f64| {
        obstacle.contact(Vec3::new(x, 0.4, z), 0.3, &mut NO_HINT.clone()).unwrap().distance
    };
    assert!(distance(&obstacle, 0.68, -0.04) > 0.0, "by its sides the fold has its outside below");
    obstacle.update_worn(&vertices, vertices.iter().map(|_| Vec3::Z));
    assert!(distance(&obstacle, 0.68, -0.04) < 0.0);
    assert!(distance(&obstacle, 0.76, 0.05) > 0.048);
    assert!(distance(&obstacle, 0.3, 0.02) > 0.018);
}

#[test]
fn hints_change_the_time_but_not_the_answer() {
    let obstacle = crossing();
    let mut hint = NO_HINT;
    let mut rng = seeded_rng(2);
    let mut point = Vec3::new(0.0, 1.05, 0.0);
    for _ in 0..300 {
        point += 0.05 * Vec3::new(normal(&mut rng), normal(&mut rng), normal(&mut rng));
        point = point.clamp_length(0.8, 1.1);
        let warm = obstacle.contact(point, 0.4, &mut hint).map(|contact| contact.distance);
        let cold = obstacle.contact(point, 0.4, &mut NO_HINT.clone()).map(|contact| contact.distance);
        assert!(warm == cold || (warm.unwrap() - cold.unwrap()).abs() < 1e-9);
    }
}
