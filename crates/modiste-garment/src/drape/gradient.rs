//! Deformation gradients as rows of numbers for the principal component analysis, and back.

use modiste_core::{Mat3, Topology, Vec3, face_areas};

/// Numbers per face.
pub(crate) const PER_FACE: usize = 9;

/// The gradients, face after face, column by column.
pub(crate) fn flatten(gradients: &[Mat3]) -> Vec<f32> {
    gradients.iter().flat_map(|gradient| gradient.to_cols_array().map(|value| value as f32)).collect()
}

/// The gradient of one face in a flat row.
pub(crate) fn gradient_of(face: &[f32]) -> Mat3 {
    let at = |index: usize| f64::from(face[index]);
    Mat3::from_cols_array(&[at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7), at(8)])
}

/// One weight per number of a flat row: the area of its face over the mean area of the faces.
pub(crate) fn area_weights(topology: &Topology, template: &[Vec3]) -> Vec<f32> {
    let areas = face_areas(topology, template);
    let mean = areas.iter().sum::<f64>() / areas.len().max(1) as f64;
    areas.iter().flat_map(|area| [(area / mean) as f32; PER_FACE]).collect()
}
