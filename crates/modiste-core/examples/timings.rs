//! Times the kernels that run once per frame, at the size of a body and a garment, on one core.
//!
//! `cargo run --release -p modiste-core --example timings`
#![allow(clippy::print_stdout, reason = "the table is the result")]

use std::time::Instant;

use modiste_core::shapes::{grid, torus};
use modiste_core::{
    GradientReconstruction, Pca, QuantisedBasis, TriangleBvh, Vec3, deformation_gradients, normal, seeded_rng,
    vertex_normals,
};

fn main() {
    queries();
    reconstruction();
    expansion();
    components();
}

/// Prints the median time of a few runs.
fn time(what: &str, runs: usize, mut run: impl FnMut()) {
    let mut times: Vec<f64> = (0..runs)
        .map(|_| {
            let start = Instant::now();
            run();
            start.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    times.sort_by(f64::total_cmp);
    println!("{what:60} {:9.3} ms", times[runs / 2]);
}

fn queries() {
    // 26,800 faces with edges of about 1 cm, as a body has.
    let body = torus(0.45, 0.11, 200, 67);
    let normals = vertex_normals(&body.topology, &body.vertices);
    let mut rng = seeded_rng(1);
    let points: Vec<Vec3> = (0..18_900)
        .map(|i| {
            let vertex = i % body.vertices.len();
            let jitter = 0.005 * Vec3::new(normal(&mut rng), normal(&mut rng), normal(&mut rng));
            body.vertices[vertex] + 0.01 * normal(&mut rng).abs() * normals[vertex] + jitter
        })
        .collect();
    println!("surface of {} faces, {} points", body.topology.face_count(), points.len());
    let mut tree = TriangleBvh::new(&body.topology, &body.vertices);
    time("build the tree", 9, || tree = TriangleBvh::new(&body.topology, &body.vertices));
    time("refit the tree", 9, || tree.refit(&body.vertices));
    let mut found = 0;
    time("closest points within 3 cm", 15, || {
        found = points.iter().filter(|&&p| tree.closest_point(&body.vertices, p, 0.03).is_some()).count();
    });
    println!("    {found} found");
    let nearest = |&p: &Vec3| tree.closest_point(&body.vertices, p, 0.03).map(|at| at.face);
    let last: Vec<Option<u32>> = points.iter().map(nearest).collect();
    time("the same, knowing the faces of the last frame", 15, || {
        let near =
            |(&p, &face): (&Vec3, &Option<u32>)| tree.closest_point_near(&body.vertices, p, 0.03, face).is_some();
        found = points.iter().zip(&last).filter(|&pair| near(pair)).count();
    });
    time("winding numbers", 5, || {
        found = points.iter().filter(|&&p| tree.contains(&body.vertices, p)).count();
    });
    println!("    {found} inside");
    time("self-intersections", 5, || found = tree.self_intersections(&body.vertices).len());
    time("vertex normals", 9, || {
        std::hint::black_box(vertex_normals(&body.topology, &body.vertices));
    });
}

fn reconstruction() {
    let garment = grid(125, 149);
    let mut rng = seeded_rng(2);
    let target: Vec<Vec3> = garment
        .vertices
        .iter()
        .map(|&p| Vec3::new(p.x, (3.0 * p.y).sin(), (3.0 * p.y).cos()) + 1e-4 * normal(&mut rng))
        .collect();
    println!("garment of {} vertices, {} faces", garment.vertices.len(), garment.topology.face_count());
    let mut solver = GradientReconstruction::new(&garment.topology, &garment.vertices).expect("the grid is sound");
    time("factor", 5, || {
        solver = GradientReconstruction::new(&garment.topology, &garment.vertices).expect("the grid is sound");
    });
    let mut gradients = Vec::new();
    time("gradients", 9, || gradients = deformation_gradients(&garment.topology, &garment.vertices, &target));
    let mut out = vec![Vec3::ZERO; target.len()];
    time("right-hand side, solve, centre", 31, || solver.reconstruct(&gradients, &mut out));
}

fn components() {
    let (m, n) = (300, 100_000);
    let mut rng = seeded_rng(4);
    let samples: Vec<Vec<f32>> = (0..m).map(|_| (0..n).map(|_| normal(&mut rng) as f32).collect()).collect();
    let views: Vec<&[f32]> = samples.iter().map(Vec::as_slice).collect();
    println!("{m} samples of {n} dimensions, on all cores");
    time("50 principal components", 1, || {
        std::hint::black_box(Pca::fit(&views, 50).expect("the samples are finite"));
    });
}

fn expansion() {
    let (k, n) = (50, 337_824);
    let mut rng = seeded_rng(3);
    let basis: Vec<f32> = (0..k * n).map(|_| normal(&mut rng) as f32).collect();
    let mean = vec![1.0f32; n];
    let coefficients: Vec<f64> = (0..k).map(|_| normal(&mut rng)).collect();
    let mut out = vec![0.0f32; n];
    println!("basis of {k} components, {n} dimensions");
    let quantised = QuantisedBasis::<i16>::from_f32(&basis, k, n).expect("the basis is finite");
    time("expand i16", 9, || quantised.expand(&mean, &coefficients, &mut out));
    let pca = Pca { mean, basis, std_devs: vec![1.0; k], ..Pca::default() };
    time("expand f32", 9, || pca.expand(&coefficients, &mut out));
}
