//! Small meshes with known properties, for tests, examples and benchmarks.

use std::collections::HashMap;
use std::sync::Arc;

use crate::{Mesh, Topology, Vec3};

fn mesh(vertices: Vec<Vec3>, faces: Vec<[u32; 3]>) -> Mesh {
    let topology = Topology::new(vertices.len(), faces).expect("the generated faces are valid");
    Mesh { topology: Arc::new(topology), vertices }
}

/// A unit sphere: an icosahedron whose faces are split in four `subdivisions` times (20·4^s faces).
pub fn icosphere(subdivisions: usize) -> Mesh {
    let golden = f64::midpoint(1.0, 5.0f64.sqrt());
    let mut vertices = Vec::new();
    for (a, b) in [(-1.0, golden), (1.0, golden), (-1.0, -golden), (1.0, -golden)] {
        vertices.push(Vec3::new(a, b, 0.0).normalize());
    }
    for (a, b) in [(-1.0, golden), (1.0, golden), (-1.0, -golden), (1.0, -golden)] {
        vertices.push(Vec3::new(0.0, a, b).normalize());
    }
    for (a, b) in [(-1.0, golden), (1.0, golden), (-1.0, -golden), (1.0, -golden)] {
        vertices.push(Vec3::new(b, 0.0, a).normalize());
    }
    let mut faces: Vec<[u32; 3]> = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    for _ in 0..subdivisions {
        let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                vertices.push((vertices[a as usize] + vertices[b as usize]).normalize());
                vertices.len() as u32 - 1
            })
        };
        faces = faces
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    mesh(vertices, faces)
}

/// A unit square in the plane z = 0 with `rows` × `columns` cells of two triangles each, normal +Z.
pub fn grid(rows: usize, columns: usize) -> Mesh {
    let width = columns as u32 + 1;
    let vertices = (0..=rows)
        .flat_map(|row| {
            (0..=columns).map(move |column| Vec3::new(column as f64 / columns as f64, row as f64 / rows as f64, 0.0))
        })
        .collect();
    let faces = (0..rows as u32)
        .flat_map(|row| (0..columns as u32).map(move |column| row * width + column))
        .flat_map(|corner| [[corner, corner + 1, corner + width + 1], [corner, corner + width + 1, corner + width]])
        .collect();
    mesh(vertices, faces)
}

/// A torus about the Y axis with radii `major` > `minor` (m), `rings` × `sides` cells.
pub fn torus(major: f64, minor: f64, rings: usize, sides: usize) -> Mesh {
    let angle = |index: usize, count: usize| index as f64 / count as f64 * std::f64::consts::TAU;
    let vertices = (0..rings)
        .flat_map(|ring| {
            (0..sides).map(move |side| {
                let (around, across) = (angle(ring, rings), angle(side, sides));
                let radius = major + minor * across.cos();
                Vec3::new(radius * around.cos(), minor * across.sin(), radius * around.sin())
            })
        })
        .collect();
    let at = |ring: usize, side: usize| ((ring % rings) * sides + side % sides) as u32;
    let faces = (0..rings)
        .flat_map(|ring| {
            (0..sides).flat_map(move |side| {
                let (a, b) = (at(ring, side), at(ring, side + 1));
                let (c, d) = (at(ring + 1, side + 1), at(ring + 1, side));
                [[a, b, c], [a, c, d]]
            })
        })
        .collect();
    mesh(vertices, faces)
}
