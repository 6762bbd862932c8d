//! Shape deformation gradients: D of SCAPE.

use modiste_core::{Mat3, Topology, Vec3};

/// Per face the matrix D that takes the edges of `source` to those of `target` (Guan ch. 3 §2).
///
/// DRAPE eq. 1 fixes the third direction by the cross product of the edges, so a body twice as large would be four times
/// as thick along the normals. Where `Q` turns an edge out of its plane before `D` is applied, that would show; here the
/// unit normal goes to the unit normal times the square root of the area ratio, so a scaled body has `D = s I`.
pub(crate) fn shape_gradients(topology: &Topology, source: &[Vec3], target: &[Vec3]) -> Vec<Mat3> {
    topology
        .faces()
        .iter()
        .map(|&face| {
            let from = frame(face, source);
            if from.determinant() > 0.0 { frame(face, target) * from.inverse() } else { Mat3::IDENTITY }
        })
        .collect()
}

/// The two edges at the first corner and the normal, as long as the square root of the parallelogram's area.
fn frame(face: [u32; 3], x: &[Vec3]) -> Mat3 {
    let [a, b, c] = face.map(|vertex| x[vertex as usize]);
    let (first, second) = (b - a, c - a);
    let normal = first.cross(second);
    let length = normal.length();
    Mat3::from_cols(first, second, if length > 0.0 { normal / length.sqrt() } else { Vec3::ZERO })
}

#[cfg(test)]
mod tests {
    use modiste_core::{Mat3, Quat, Topology, Vec3};

    use super::shape_gradients;

    #[test]
    fn similarity_gives_scaled_rotation() {
        let topology = Topology::new(4, vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]).unwrap();
        let source = [Vec3::ZERO, Vec3::X, Vec3::new(0.2, 1.1, 0.0), Vec3::new(0.1, 0.3, 0.8)];
        let map = Mat3::from_quat(Quat::from_scaled_axis(Vec3::new(0.3, -0.8, 0.5))) * 1.7;
        let target = source.map(|x| map * x + Vec3::Y);
        for gradient in shape_gradients(&topology, &source, &target) {
            assert!((gradient - map).to_cols_array().iter().all(|x| x.abs() < 1e-12));
        }
    }
}
