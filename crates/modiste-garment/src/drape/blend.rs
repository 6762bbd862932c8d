//! How much each face of a garment turns with each part of the body.

use modiste_body::scape::RotationBlend;
use modiste_body::{Part, Pose};
use modiste_core::{Mat3, Quat, SparseCholesky, vertex_areas};

use super::training_set::Garment;
use crate::GarmentError;

/// Weights below this are dropped.
const FAINT: f64 = 0.01;

/// The parts that faces and vertices follow.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PartBlend {
    pub(crate) faces: RotationBlend,
    pub(crate) vertices: RotationBlend,
}

/// The parts that each face and vertex follows: its own where `width` (m) is 0, as in the paper, otherwise the parts around it, by
/// what is left of each part's cloth after it has spread like heat over `width`.
///
/// One implicit step of the heat equation, `(M + width² L) w = M w₀`, with lumped areas M and the cotangent Laplacian L of
/// the template.
///
/// # Errors
/// A template whose system cannot be solved.
pub(crate) fn blend_parts(garment: &Garment, width: f64) -> Result<PartBlend, GarmentError> {
    let (topology, x) = (&garment.topology, &garment.template);
    let count = topology.vertex_count();
    if !(width > 0.0) {
        let shares = |vertex: usize| Part::ALL.map(|part| share(garment, vertex, part));
        let vertices: Vec<_> = (0..count).map(shares).collect();
        return Ok(PartBlend {
            faces: RotationBlend::rigid(&garment.face_parts),
            vertices: RotationBlend::from_part_weights(&vertices, FAINT),
        });
    }
    // Vertices that no face uses must not make the matrix singular.
    let areas: Vec<f64> =
        vertex_areas(topology, x).into_iter().map(|area| area.max(f64::MIN_POSITIVE.sqrt())).collect();
    let mut triplets: Vec<(usize, usize, f64)> = areas.iter().enumerate().map(|(v, &area)| (v, v, area)).collect();
    for face in topology.faces() {
        for corner in 0..3 {
            let [a, b, apex] = [1, 2, 0].map(|next| face[(corner + next) % 3] as usize);
            let (u, v) = (x[a] - x[apex], x[b] - x[apex]);
            let sine = u.cross(v).length();
            // A negative cotangent would let weights leave 0 to 1.
            let weight = if sine > 0.0 { width * width * 0.5 * (u.dot(v) / sine).max(0.0) } else { 0.0 };
            triplets.extend([(a, a, weight), (b, b, weight), (a.max(b), a.min(b), -weight)]);
        }
    }
    let heat = SparseCholesky::new(count, &triplets).map_err(GarmentError::solve("blending of part rotations"))?;
    let mut of_faces = vec![[0.0; Part::COUNT]; topology.face_count()];
    let mut of_vertices = vec![[0.0; Part::COUNT]; count];
    for part in Part::ALL.into_iter().filter(|part| garment.face_parts.contains(part)) {
        let mut weights = vec![0.0; count];
        for (vertex, weight) in weights.iter_mut().enumerate() {
            *weight = areas[vertex] * share(garment, vertex, part);
        }
        heat.solve(&mut weights);
        for (vertex, weight) in of_vertices.iter_mut().zip(&weights) {
            vertex[part.index()] = *weight;
        }
        for (face, corners) in of_faces.iter_mut().zip(topology.faces()) {
            face[part.index()] = corners.iter().map(|&v| weights[v as usize]).sum::<f64>() / 3.0;
        }
    }
    Ok(PartBlend {
        faces: RotationBlend::from_part_weights(&of_faces, FAINT),
        vertices: RotationBlend::from_part_weights(&of_vertices, FAINT),
    })
}

/// The rotations of faces or vertices in one pose.
#[derive(Debug, Clone)]
pub(crate) struct Turns<'a> {
    blend: &'a RotationBlend,
    quaternions: [Quat; Part::COUNT],
    matrices: [Mat3; Part::COUNT],
}

impl<'a> Turns<'a> {
    pub(crate) fn new(blend: &'a RotationBlend, pose: &Pose) -> Self {
        let quaternions = pose.world_quaternions();
        Self { blend, quaternions, matrices: quaternions.map(Mat3::from_quat) }
    }

    /// From the template to the world, for one face or vertex.
    pub(crate) fn rotation(&self, index: usize) -> Mat3 {
        self.blend.rotation(index, &self.quaternions, &self.matrices)
    }
}

/// The share of the faces around a vertex that follow a part.
fn share(garment: &Garment, vertex: usize, part: Part) -> f64 {
    let around = garment.topology.vertex_faces(vertex);
    let own = around.iter().filter(|&&face| garment.face_parts[face as usize] == part).count();
    own as f64 / around.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use modiste_body::Part;
    use modiste_core::{Mat3, Quat, Vec3};

    use super::blend_parts;
    use crate::drape::synthetic::training_set;

    #[test]
    fn rotations_pass_from_part_to_part_without_a_jump() {
        let garment = training_set().garment;
        let mut quaternions = [Quat::IDENTITY; Part::COUNT];
        quaternions[Part::Chest.index()] = Quat::from_axis_angle(Vec3::X, 1.0);
        let matrices = quaternions.map(Mat3::from_quat);
        let largest_jump = |width: f64| {
            let blend = blend_parts(&garment, width).unwrap().faces;
            let angle = |face: u32| {
                let axis = blend.rotation(face as usize, &quaternions, &matrices) * Vec3::Y;
                axis.z.atan2(axis.y)
            };
            let between = garment.topology.edges().iter().filter_map(|edge| Some((edge.faces[0]?, edge.faces[1]?)));
            between.map(|(a, b)| (angle(a) - angle(b)).abs()).fold(0.0, f64::max)
        };
        assert!((largest_jump(0.0) - 1.0).abs() < 1e-9, "the paper: {}", largest_jump(0.0));
        assert!(largest_jump(0.1) < 0.5, "{}", largest_jump(0.1));
    }

    #[test]
    fn far_from_a_border_a_face_follows_its_own_part() {
        let garment = training_set().garment;
        let blend = blend_parts(&garment, 0.02).unwrap().faces;
        let mut quaternions = [Quat::IDENTITY; Part::COUNT];
        quaternions[Part::Chest.index()] = Quat::from_axis_angle(Vec3::X, 1.0);
        let matrices = quaternions.map(Mat3::from_quat);
        let height =
            |face: usize| garment.topology.faces()[face].iter().map(|&v| garment.template[v as usize].y).sum::<f64>();
        let faces = 0..garment.topology.face_count();
        let top = faces.max_by(|&a, &b| height(a).total_cmp(&height(b))).unwrap();
        assert_eq!(garment.face_parts[top], Part::Chest);
        assert!(blend.rotation(top, &quaternions, &matrices).abs_diff_eq(matrices[Part::Chest.index()], 0.05));
    }
}
