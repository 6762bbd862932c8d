use std::sync::Arc;

use modiste_core::shapes::{icosphere, torus};
use modiste_core::{Mesh, Topology, Vec3};

use super::{CheckReport, Checker, FrameCheck, Limits};

fn check(meshes: &[&Mesh]) -> FrameCheck {
    let parts: Vec<_> = meshes.iter().map(|mesh| (Arc::clone(&mesh.topology), mesh.vertices.as_slice())).collect();
    let frame: Vec<Vec<Vec3>> = meshes.iter().map(|mesh| mesh.vertices.clone()).collect();
    Checker::new(&parts).check(&frame)
}

/// A ball of this radius around a point.
fn ball(radius: f64, centre: Vec3) -> Mesh {
    let unit = icosphere(4);
    Mesh { vertices: unit.vertices.iter().map(|v| radius * *v + centre).collect(), ..unit }
}

/// A square sheet of `2 half` at a height, of two triangles.
fn sheet(half: f64, height: f64) -> Mesh {
    let corner = |x: f64, z: f64| Vec3::new(x * half, height, z * half);
    let topology = Topology::new(4, vec![[0, 1, 2], [0, 2, 3]]).unwrap();
    let vertices = vec![corner(-1.0, 1.1), corner(1.0, 1.0), corner(1.2, -1.0), corner(-1.0, -1.0)];
    Mesh { topology: topology.into(), vertices }
}

#[test]
fn a_garment_around_the_body_has_no_findings() {
    let found = check(&[&ball(0.1, Vec3::ZERO), &ball(0.11, Vec3::ZERO), &ball(0.12, Vec3::ZERO)]);
    assert_eq!(found.body.count, 0);
    assert_eq!(found.garments, [super::GarmentCheck::default(); 2]);
    assert_eq!((found.layers[0].below.count, found.layers[0].crossings.count), (0, 0));
    let mut report = CheckReport::new(&["a", "b"], Limits::default());
    report.add(&found);
    assert!(report.holds && report.frames == 1);
}

#[test]
fn a_garment_that_is_too_narrow_is_inside_by_as_much() {
    let found = check(&[&ball(0.1, Vec3::ZERO), &ball(0.097, Vec3::ZERO)]).garments[0];
    assert_eq!(found.inside.count, icosphere(4).vertices.len());
    // Corners of the smaller ball are nearer to the faces of the larger than the radii differ.
    assert!((found.inside.depth - 0.003).abs() < 2e-4, "{found:?}");
    assert_eq!(found.body.count, 0);
    assert!(found.body.depth >= found.inside.depth);
}

#[test]
fn skin_through_a_large_triangle_is_found_and_as_deep_as_the_cap_is_high() {
    for height in [0.098, 0.0996] {
        let found = check(&[&ball(0.1, Vec3::ZERO), &sheet(0.4, height)]).garments[0];
        assert_eq!(found.inside.count, 0, "no corner of the sheet is inside");
        assert!(found.body.count > 0);
        assert!((found.body.depth - (0.1 - height)).abs() < 1e-4, "{found:?} at {height}");
        let mut report = CheckReport::new(&["sheet"], Limits::default());
        report.add(&FrameCheck { garments: vec![found], ..FrameCheck::default() });
        assert_eq!(report.holds, height > 0.0995);
    }
}

#[test]
fn an_outer_garment_below_the_inner_one_is_found_beside_it_not() {
    let (body, inner) = (ball(0.05, Vec3::ZERO), ball(0.1, Vec3::ZERO));
    let layers = check(&[&body, &inner, &ball(0.095, Vec3::ZERO)]).layers[0];
    assert_eq!(layers.below.count, inner.vertices.len());
    assert!((layers.below.depth - 0.005).abs() < 3e-4, "{layers:?}");
    // A sheet cuts the top off by 2 mm.
    let layers = check(&[&body, &inner, &sheet(0.4, 0.098)]).layers[0];
    assert_eq!(layers.below.count, 0);
    assert!(layers.crossings.count > 0 && (layers.crossings.depth - 0.002).abs() < 1e-4, "{layers:?}");
    // Past the rim of a sheet nothing is below it.
    let small = sheet(0.1, 0.2);
    let lower = Mesh { vertices: sheet(0.12, 0.19).vertices, ..small.clone() };
    assert_eq!(check(&[&body, &small, &lower]).layers[0].below.count, 0);
}

#[test]
fn a_garment_in_itself_is_as_deep_as_its_triangles_must_move() {
    // A large triangle, and the tip of another 4 mm through it.
    let topology = Topology::new(6, vec![[0, 1, 2], [3, 4, 5]]).unwrap();
    let vertices =
        [[-0.3, 1.0, -0.3], [0.3, 1.0, -0.3], [0.0, 1.0, 0.5], [0.0, 0.996, 0.0], [0.03, 1.1, 0.01], [-0.03, 1.1, 0.0]];
    let garment = Mesh { topology: topology.into(), vertices: vertices.map(Vec3::from_array).to_vec() };
    let found = check(&[&ball(0.1, Vec3::ZERO), &garment]).garments[0];
    assert_eq!(found.itself.count, 1);
    assert!((found.itself.depth - 0.004).abs() < 1e-12, "{found:?}");
    let mut report = CheckReport::new(&["flags"], Limits::default());
    for _ in 0..3 {
        report.add(&FrameCheck { garments: vec![found], ..FrameCheck::default() });
    }
    assert!(report.holds, "a garment in itself is told, no failure");
    assert_eq!(report.garments[0].crossing_itself.too_deep, [[0, 2]]);
}

/// Two balls as one body, in each other by a fifth of their radius.
fn two_balls() -> Mesh {
    let (left, right) = (ball(0.1, -0.08 * Vec3::X), ball(0.1, 0.08 * Vec3::X));
    let count = left.vertices.len() as u32;
    let faces = left.topology.faces();
    let all = faces.iter().copied().chain(faces.iter().map(|face| face.map(|v| v + count))).collect();
    let vertices: Vec<Vec3> = left.vertices.iter().chain(&right.vertices).copied().collect();
    Mesh { topology: Topology::new(vertices.len(), all).unwrap().into(), vertices }
}

#[test]
fn cloth_between_parts_of_the_body_that_are_in_each_other_is_pinched() {
    let body = two_balls();
    let around = |centre: Vec3| ball(0.004, centre);
    let found = check(&[&body, &around(Vec3::ZERO)]);
    // The way by which two triangles come apart is not longer than they are.
    assert!(found.body.count > 0 && found.body.depth > 0.005, "{:?}", found.body);
    let cloth = found.garments[0];
    assert_eq!((cloth.inside.count, cloth.pinched.count), (0, icosphere(4).vertices.len()));
    assert!(cloth.pinched.depth > 0.03, "the way out is long");
    assert!(cloth.body.depth <= 0.0);
    // In one ball below skin that can be seen it is plainly inside.
    let cloth = check(&[&body, &around(Vec3::new(0.08, 0.09, 0.0))]).garments[0];
    assert_eq!((cloth.inside.count, cloth.pinched.count), (icosphere(4).vertices.len(), 0));
    assert!((cloth.inside.depth - 0.014).abs() < 5e-4, "{cloth:?}");
}

#[test]
fn findings_do_not_depend_on_where_the_scene_stands() {
    let turn = modiste_core::rotation_from_vector(Vec3::new(0.3, 1.1, -0.4));
    let moved = |mesh: &Mesh| {
        let vertices = mesh.vertices.iter().map(|v| turn * *v + Vec3::new(2.0, -1.0, 0.5)).collect();
        Mesh { vertices, ..mesh.clone() }
    };
    let meshes = [two_balls(), torus(0.12, 0.03, 40, 20), ball(0.1, Vec3::new(0.05, 0.05, 0.0))];
    let here = check(&meshes.each_ref());
    let there = check(&meshes.each_ref().map(moved).each_ref());
    assert!(here.garments[0].body.count > 0 && here.layers[0].crossings.count > 0);
    assert_eq!(here.garments[0].inside.count, there.garments[0].inside.count);
    assert_eq!(here.layers[0].crossings.count, there.layers[0].crossings.count);
    let close = |a: f64, b: f64| (a - b).abs() < 3e-5;
    assert!(close(here.garments[1].body.depth, there.garments[1].body.depth), "{here:?} {there:?}");
    assert!(close(here.layers[0].crossings.depth, there.layers[0].crossings.depth));
}

#[test]
fn what_crosses_the_body_is_caught_only_where_its_parts_are_in_each_other() {
    let body = two_balls();
    // A sheet cuts both balls where they meet; one that is higher cuts them far from each other.
    let found = check(&[&body, &sheet(0.4, 0.055)]).garments[0];
    assert!(found.caught.count > 0 && found.caught.depth > 0.01, "{found:?}");
    let found = check(&[&body, &sheet(0.4, 0.097)]).garments[0];
    assert_eq!((found.caught.count, found.inside.count), (0, 0));
    assert!((found.body.depth - 0.003).abs() < 1e-4, "{found:?}");
    let found = check(&[&ball(0.1, Vec3::ZERO), &sheet(0.4, 0.055)]).garments[0];
    assert!(found.caught.count == 0 && found.body.depth > 0.04, "no place for excuses: {found:?}");
    let mut report = CheckReport::new(&["sheet"], Limits::default());
    report.add(&FrameCheck { garments: vec![found], ..FrameCheck::default() });
    assert!(!report.holds);
}

#[test]
fn cloth_in_one_part_only_is_inside_though_buried_skin_is_nearest() {
    // In the left ball, 5 mm from where the right one begins.
    let cloth = ball(0.002, Vec3::new(-0.025, 0.0, 0.0));
    let found = check(&[&two_balls(), &cloth]).garments[0];
    assert_eq!((found.inside.count, found.pinched.count), (cloth.vertices.len(), 0));
    assert!((found.inside.depth - 0.007).abs() < 5e-4, "{found:?}");
}

#[test]
fn past_a_hem_that_is_folded_over_nothing_is_below() {
    let body = ball(0.1, Vec3::ZERO);
    // A cap over the top whose rim is turned up and outwards, and a point just beyond.
    let cap = icosphere(4);
    let faces: Vec<[u32; 3]> = cap
        .topology
        .faces()
        .iter()
        .copied()
        .filter(|face| face.iter().all(|&v| cap.vertices[v as usize].y > 0.3))
        .collect();
    let turned = |v: &Vec3| {
        let fold = (0.45 - v.y).max(0.0);
        let height = 0.11 + 0.05 * fold;
        height * Vec3::new(v.x, v.y + 2.0 * fold, v.z).normalize_or_zero()
    };
    let topology = Topology::new(cap.vertices.len(), faces).unwrap();
    let hem = Mesh { topology: topology.into(), vertices: cap.vertices.iter().map(turned).collect() };
    for (around, up, height) in (0..6)
        .flat_map(|turn| [0.33, 0.36, 0.39].map(|up| (f64::from(turn), up)))
        .flat_map(|(around, up)| [0.103, 0.108].map(|height| (around, up, height)))
    {
        let towards = Vec3::new(around.cos(), up / 0.94, around.sin()).normalize_or_zero();
        let past = ball(0.001, height * towards);
        assert_eq!(check(&[&body, &hem, &past]).layers[0].below.count, 0, "{around} {up} {height}");
    }
    let under = ball(0.001, 0.105 * Vec3::Y);
    assert_eq!(check(&[&body, &hem, &under]).layers[0].below.count, under.vertices.len());
}
