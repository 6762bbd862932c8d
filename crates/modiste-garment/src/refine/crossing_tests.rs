//! What the last stage of the fit is for: triangles that cross though their corners are outside, layers, and folds.

use std::sync::Arc;

use modiste_core::shapes::{grid, icosphere};
use modiste_core::{Mesh, Quat, Vec3};

use super::{Below, Cover, ExactOptions, Fit, FitOptions, Obstacle};
use crate::check::{Checker, FrameCheck};

/// Fits a garment over a body, and over a garment below where there is one; with so many rounds of the last stage.
fn fitted(body: &Mesh, inner: Option<&Mesh>, garment: &Mesh, crossing_rounds: usize) -> Mesh {
    let obstacle = Obstacle::single(body.topology.clone(), &body.vertices);
    let below = inner.map(|inner| Obstacle::garment(inner.topology.clone(), &inner.vertices, 0.0015));
    let all = [Some(&obstacle), below.as_ref()].into_iter().flatten();
    let below: Vec<Below<'_>> = all.map(|obstacle| Below { obstacle, members: &[] }).collect();
    let exact = Some(ExactOptions { crossing_rounds, ..ExactOptions::default() });
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
fn a_sheet_that_is_folded_through_itself_is_parted() {
    // Folded in a wide bend, its upper half 8 mm above the lower one but for a dent, which is 6 mm through it.
    let mesh = grid(60, 60);
    let (length, radius) = (0.4, 0.004);
    let bent = |v: &Vec3| {
        let along = length * (v.x - 0.5);
        let arc = std::f64::consts::PI * radius;
        let z = length * v.y;
        if along < 0.0 {
            return Vec3::new(along, 0.0, z);
        }
        if along < arc {
            let angle = along / radius;
            return Vec3::new(radius * angle.sin(), radius * (1.0 - angle.cos()), z);
        }
        let back = along - arc;
        let dent = 0.014 * (-((back - 0.1).powi(2) + (z - 0.2).powi(2)) / (2.0 * 0.008f64.powi(2))).exp();
        Vec3::new(-back, 2.0 * radius - dent, z)
    };
    let cloth = Mesh { vertices: mesh.vertices.iter().map(bent).collect(), ..mesh };
    let body = limb(Vec3::new(0.0, -1.0, 0.0));
    let crossing = |rounds: usize| check(&[&body, &fitted(&body, None, &cloth, rounds)]).garments[0].itself;
    let (before, after) = (crossing(0), crossing(2));
    assert!(before.depth > 0.002, "{before:?} {after:?}");
    assert!(after.depth < 0.002 && after.count < before.count / 2, "{before:?} {after:?}");
}
