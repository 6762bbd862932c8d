//! Normals of a surface that moves.

use modiste_core::{Topology, Vec3, corners};

/// Unit normals of faces, away from the body where `outward` says what that is, and angle-weighted ones of vertices.
pub(crate) fn find_normals(
    topology: &Topology,
    vertices: &[Vec3],
    outward: &[Vec3],
    face_normals: &mut [Vec3],
    vertex_normals: &mut [Vec3],
) {
    vertex_normals.fill(Vec3::ZERO);
    for (&face, normal) in topology.faces().iter().zip(face_normals) {
        let corners = corners(face, vertices);
        *normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
        if !outward.is_empty() {
            let outward: Vec3 = face.iter().map(|&vertex| outward[vertex as usize]).sum();
            *normal = if outward.dot(*normal) < 0.0 { -*normal } else { *normal };
        }
        for (corner, angle) in angles(corners).into_iter().enumerate() {
            vertex_normals[face[corner] as usize] += angle * *normal;
        }
    }
    for normal in vertex_normals {
        *normal = normal.normalize_or_zero();
    }
}

/// Inner angles of a triangle; all right angles where an edge has no length. They weigh normals, nothing else, so f32 does.
fn angles([a, b, c]: [Vec3; 3]) -> [f64; 3] {
    let (ab, bc, ca) = (b - a, c - b, a - c);
    // A fourth lane fills the register.
    let squared = [ca.length_squared() as f32, ab.length_squared() as f32, bc.length_squared() as f32, 1.0];
    let inverse = squared.map(|squared| 1.0 / squared.max(f32::MIN_POSITIVE).sqrt());
    let products = [ca.dot(ab) as f32, ab.dot(bc) as f32, bc.dot(ca) as f32, 0.0];
    let cosines = std::array::from_fn(|corner| -products[corner] * inverse[corner] * inverse[(corner + 1) % 3]);
    let [at_a, at_b, at_c, _] = angles_of_cosines(cosines).map(f64::from);
    [at_a, at_b, at_c]
}

/// Arc cosines within 7e-5, several times faster than the exact ones (Abramowitz and Stegun 4.4.45).
fn angles_of_cosines(cosines: [f32; 4]) -> [f32; 4] {
    let x = cosines.map(|cosine| cosine.abs().min(1.0));
    let root = x.map(|x| (1.0 - x).sqrt());
    let series = x.map(|x| 1.570_728_8 + x * (-0.212_114_4 + x * (0.074_261 - 0.018_729_3 * x)));
    std::array::from_fn(|lane| {
        let positive = root[lane] * series[lane];
        if cosines[lane] < 0.0 { std::f32::consts::PI - positive } else { positive }
    })
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_fast_arc_cosine_is_close() {
        for step in 0..=2000 {
            let x = f64::from(step) / 1000.0 - 1.0;
            let [found, ..] = super::angles_of_cosines([x as f32; 4]);
            assert!((f64::from(found) - x.acos()).abs() < 7e-5, "{x}");
        }
    }
}
