//! Deformation gradients as rows of numbers for the principal component analysis, and back.

use modiste_core::{Mat3, Topology, Vec3, corners, face_areas};

/// Numbers per face.
///
/// A gradient of DRAPE eq. 1 takes the normal of a face to the cross product of where it takes two vectors in its plane,
/// so these two say it all: six numbers, where the paper stores nine.
pub(crate) const PER_FACE: usize = 6;

/// Per face of the template two unit vectors in its plane at right angles, and its normal.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TangentFrames {
    /// Columns: the two vectors and the normal.
    template_from_tangent: Vec<Mat3>,
}

impl TangentFrames {
    /// The frames of a template (m). A face without area, whose gradient is the identity, has that of the world.
    pub(crate) fn new(topology: &Topology, template: &[Vec3]) -> Self {
        let frame = |&face: &[u32; 3]| {
            let [a, b, c] = corners(face, template);
            let (first, normal) = ((b - a).normalize_or_zero(), (b - a).cross(c - a).normalize_or_zero());
            let frame = Mat3::from_cols(first, normal.cross(first), normal);
            if frame.determinant() > 0.5 { frame } else { Mat3::IDENTITY }
        };
        Self { template_from_tangent: topology.faces().iter().map(frame).collect() }
    }

    /// The gradients, face after face: where the two vectors in its plane go.
    pub(crate) fn flatten(&self, gradients: &[Mat3]) -> Vec<f32> {
        let faces = gradients.iter().zip(&self.template_from_tangent);
        let moved = faces.flat_map(|(gradient, frame)| [*gradient * frame.x_axis, *gradient * frame.y_axis]);
        moved.flat_map(|vector| vector.as_vec3().to_array()).collect()
    }

    /// The gradients of a flat row, on vectors given in the template's coordinates.
    pub(crate) fn gradients(&self, row: &[f32]) -> Vec<Mat3> {
        let faces = row.as_chunks::<PER_FACE>().0.iter().zip(&self.template_from_tangent);
        faces.map(|(numbers, frame)| gradient_of_tangents(numbers) * frame.transpose()).collect()
    }

    /// A flat row of gradients on other faces, each of which lies on one of those that `old` belongs to: what they do to the
    /// vectors of these frames, as far as those lie in the plane of the old face.
    pub(crate) fn carry(&self, old: &Self, origins: &[u32], row: &[f32]) -> Vec<f32> {
        let row = row.as_chunks::<PER_FACE>().0;
        let faces = origins.iter().zip(&self.template_from_tangent);
        let numbers = faces.flat_map(|(&origin, frame)| {
            let (from, gradient) =
                (&old.template_from_tangent[origin as usize], gradient_of_tangents(&row[origin as usize]));
            let moved = |axis: Vec3| axis.dot(from.x_axis) * gradient.x_axis + axis.dot(from.y_axis) * gradient.y_axis;
            [moved(frame.x_axis), moved(frame.y_axis)]
        });
        numbers.flat_map(|vector| vector.as_vec3().to_array()).collect()
    }

    /// Matrices that do to vectors in the plane of each face what a flat row says, and take its normal to nothing.
    pub(crate) fn in_plane(&self, row: &[f32]) -> Vec<Mat3> {
        let faces = row.as_chunks::<PER_FACE>().0.iter().zip(&self.template_from_tangent);
        faces
            .map(|(numbers, frame)| {
                let [a, b, c, d, e, f] = numbers.map(f64::from);
                Mat3::from_cols(Vec3::new(a, b, c), Vec3::new(d, e, f), Vec3::ZERO) * frame.transpose()
            })
            .collect()
    }

    /// Gradients that are to be applied before those of [`gradient_of_tangents`], so that the product needs no further
    /// change of coordinates.
    pub(crate) fn into_tangents(self, gradients: &mut [Mat3]) {
        for (gradient, frame) in gradients.iter_mut().zip(&self.template_from_tangent) {
            *gradient = frame.transpose() * *gradient;
        }
    }
}

/// The gradient of one face in a flat row, on vectors given in the face's tangent frame.
pub(crate) fn gradient_of_tangents(face: &[f32; PER_FACE]) -> Mat3 {
    let [a, b, c, d, e, f] = face.map(f64::from);
    let (first, second) = (Vec3::new(a, b, c), Vec3::new(d, e, f));
    Mat3::from_cols(first, second, first.cross(second))
}

/// One weight per number of a flat row: the area of its face over the mean area of the faces.
pub(crate) fn area_weights(topology: &Topology, template: &[Vec3]) -> Vec<f32> {
    let areas = face_areas(topology, template);
    let mean = areas.iter().sum::<f64>() / areas.len().max(1) as f64;
    areas.iter().flat_map(|area| [(area / mean) as f32; PER_FACE]).collect()
}

#[cfg(test)]
mod tests {
    use super::TangentFrames;
    use modiste_core::{Mat3, Topology, Vec3, deformation_gradients};

    #[test]
    fn six_numbers_hold_a_gradient_and_a_face_without_area_is_the_identity() {
        let topology = Topology::new(5, vec![[0, 1, 2], [1, 3, 2], [0, 4, 1]]).unwrap();
        let along = Vec3::new(0.2, 0.0, 0.1);
        let template = [Vec3::ZERO, along, Vec3::new(0.0, 0.3, 0.0), Vec3::new(0.3, 0.2, -0.2), 0.5 * along];
        let target = template.map(|x| Vec3::new(1.1 * x.x + x.y * x.y, 0.8 * x.y - 0.3 * x.z, x.z + 0.5 * x.x));
        let gradients = deformation_gradients(&topology, &template, &target);
        let frames = TangentFrames::new(&topology, &template);
        let found = frames.gradients(&frames.flatten(&gradients));
        for (wanted, found) in gradients.iter().zip(&found) {
            assert!(wanted.abs_diff_eq(*found, 1e-6), "{wanted} {found}");
        }
        assert!(found[2].abs_diff_eq(Mat3::IDENTITY, 1e-6));
        let mut shapes = vec![Mat3::from_rotation_x(0.4); 3];
        frames.clone().into_tangents(&mut shapes);
        let row = frames.flatten(&gradients);
        let product = super::gradient_of_tangents(&row.as_chunks().0[1]) * shapes[1];
        assert!(product.abs_diff_eq(gradients[1] * Mat3::from_rotation_x(0.4), 1e-6));
    }
}
