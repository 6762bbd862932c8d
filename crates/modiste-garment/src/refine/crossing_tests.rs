//! What the last stage of the fit is for: triangles that cross though their corners are outside, layers, and folds.

use std::sync::Arc;

use modiste_core::shapes::{grid, icosphere};
use modiste_core::{Mesh, Quat, Topology, Vec3};

use super::{Below, Cover, ExactOptions, Fit, FitOptions, Obstacle};
use crate::check::{Checker, FrameCheck};

/// Fits a garment over a body, and over a garment below where there is one; with so many rounds of the last stage.
fn fitted(body: &Mesh, inner: Option<&Mesh>, garment: &Mesh, rounds: usize) -> Mesh {
    let obstacle = Obstacle::single(body.topology.clone(), &body.vertices);
    let below = inner.map(|inner| Obstacle::garment(inner.topology.clone(), &inner.vertices, 0.0015));
    let all = [Some(&obstacle), below.as_ref()].into_iter().flatten();
    let below: Vec<Below<'_>> = all.map(|obstacle| Below { obstacle, members: &[] }).collect();
    let exact = Some(ExactOptions { fold_rounds: rounds, crossing_rounds: rounds, ..ExactOptions::default() });
    let mut fit = Fit::new(&garment.topology, &[], FitOptions { exact, ..FitOptions::default() });
    let mut vertices = garment.vertices.clone();
    fit.approach(&obstacle, &vertices);
    fit.fit(&below, &Cover::default(), &mut vertices);
    Mesh { vertices, topology: garment.topology.clone() }
}

fn check(meshes: &[&Mesh]) -> FrameCheck {
    let parts: Vec<_> = meshes.iter().map(|mesh| (Arc::clone(&mesh.topology), mesh.vertices.as_slice())).collect();
    Checker::new(&parts).check(&meshes.iter().map(|mesh| mesh.vertices.clone()).collect::<Vec<_>>())
}

/// A limb of 6 mm along Z, in no plane of symmetry of the sheets.
fn limb(middle: Vec3) -> Mesh {
    let ball = icosphere(5);
    let turn = Quat::from_rotation_y(0.13) * Quat::from_rotation_z(0.02);
    let vertices = ball.vertices.iter().map(|v| turn * (Vec3::new(0.006, 0.006, 0.3) * *v) + middle).collect();
    Mesh { vertices, ..ball }
}

/// A coarse level sheet at a height, 0.32 m wide.
fn sheet(height: f64) -> Mesh {
    let mesh = grid(8, 8);
    let vertices = mesh.vertices.iter().map(|v| Vec3::new(0.32 * v.x - 0.165, height, 0.32 * v.y - 0.155)).collect();
    let mut mesh = Mesh { vertices, ..mesh };
    let [a, b, c] = mesh.topology.faces()[0].map(|vertex| mesh.vertices[vertex as usize]);
    if (b - a).cross(c - a).y < 0.0 {
        mesh.vertices.iter_mut().for_each(|v| v.x = -v.x);
    }
    mesh
}

#[test]
fn edges_across_a_thin_limb_are_lifted_over_it() {
    let (body, cloth) = (limb(Vec3::ZERO), sheet(0.003));
    let crossing = |rounds: usize| check(&[&body, &fitted(&body, None, &cloth, rounds)]).garments[0];
    let before = crossing(0);
    assert!(before.inside.count == 0 && before.body.depth > 0.002, "{before:?}");
    let after = crossing(2);
    assert!(after.inside.count == 0 && after.body.depth < 0.0005, "{after:?}");
    // Smooth: the cloth beside the limb comes along, and what is far away stays.
    let moved = fitted(&body, None, &cloth, 2);
    let moves = moved.vertices.iter().zip(&cloth.vertices).map(|(a, b)| a.distance(*b));
    assert!(moves.clone().fold(0.0, f64::max) < 0.012);
}

#[test]
fn an_outer_layer_that_cuts_through_a_ridge_of_the_inner_one_is_lifted_over_it() {
    let body = limb(Vec3::new(0.0, -0.2, 0.0));
    let (inner, cloth) = (limb(Vec3::ZERO), sheet(0.003));
    let crossing = |rounds: usize| check(&[&body, &inner, &fitted(&body, Some(&inner), &cloth, rounds)]);
    let before = crossing(0).layers[0];
    assert!(before.crossings.depth > 0.002, "{before:?}");
    let after = crossing(2).layers[0];
    assert!(after.crossings.depth < 0.0005 && after.below.depth < 0.0005, "{after:?}");
}

#[test]
fn a_fold_whose_tip_is_through_the_sheet_beside_it_is_drawn_out() {
    // A level sheet and, of the same garment, a pyramid on its tip, which is 3 mm through the middle of a triangle.
    let level = sheet(0.0);
    let count = level.vertices.len() as u32;
    let face = level.topology.faces()[60].map(|vertex| level.vertices[vertex as usize]);
    let tip = (face[0] + face[1] + face[2]) / 3.0 - 0.003 * Vec3::Y;
    let corner = |angle: f64| tip + Vec3::new(0.02 * angle.cos(), 0.04, 0.02 * angle.sin());
    let vertices: Vec<Vec3> =
        level.vertices.iter().copied().chain([tip, corner(0.3), corner(2.4), corner(4.5)]).collect();
    let pyramid = [[0, 2, 1], [0, 3, 2], [0, 1, 3]].map(|face| face.map(|vertex| vertex + count));
    let faces = level.topology.faces().iter().copied().chain(pyramid).collect();
    let cloth = Mesh { topology: Topology::new(vertices.len(), faces).unwrap().into(), vertices };
    let body = limb(Vec3::new(0.0, -1.0, 0.0));
    let crossing = |rounds: usize| check(&[&body, &fitted(&body, None, &cloth, rounds)]).garments[0].itself;
    let (before, after) = (crossing(0), crossing(2));
    assert!(before.depth > 0.002, "{before:?}");
    assert!(after.depth < 0.002, "{before:?} {after:?}");
}

#[test]
fn a_fingertip_that_presses_on_cloth_from_outside_stays_outside_of_it() {
    let ball = |subdivisions: usize, radius: f64, middle: Vec3| {
        let ball = icosphere(subdivisions);
        Mesh { vertices: ball.vertices.iter().map(|v| radius * *v + middle).collect(), ..ball }
    };
    // Smaller than the triangle of cloth that it presses on, whose corners are clear of it.
    let (trunk, cloth) = (ball(5, 0.2, Vec3::ZERO), ball(4, 0.2075, Vec3::ZERO));
    let [a, b, c] = cloth.topology.faces()[77].map(|vertex| cloth.vertices[vertex as usize]);
    let fingertip = ball(3, 0.004, (a + b + c).normalize() * 0.2085);
    let count = trunk.vertices.len() as u32;
    let faces = fingertip.topology.faces().iter().map(|face| face.map(|vertex| vertex + count));
    let faces = trunk.topology.faces().iter().copied().chain(faces).collect();
    let vertices: Vec<Vec3> = trunk.vertices.iter().chain(&fingertip.vertices).copied().collect();
    let body = Mesh { topology: Topology::new(vertices.len(), faces).unwrap().into(), vertices };
    let before = check(&[&body, &cloth]).garments[0].body;
    assert!(before.depth > 0.0015, "{before:?}");
    let after = check(&[&body, &fitted(&body, None, &cloth, 0)]).garments[0];
    assert!(after.inside.count == 0 && after.body.depth < 0.0005, "{after:?}");
}
