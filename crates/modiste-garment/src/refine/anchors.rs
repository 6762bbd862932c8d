//! Where the garment is: its translation from pairs of points (Guan ch. 5 §4, "Details").

use modiste_core::Vec3;

/// The translation (m) that brings the garment's anchors to those of the body in the least-squares sense: the mean of
/// their differences. Anchors are pairs of a garment vertex and a body vertex.
pub fn translation(anchors: &[[u32; 2]], garment: &[Vec3], body: &[Vec3]) -> Vec3 {
    let difference = |&[on_garment, on_body]: &[u32; 2]| body[on_body as usize] - garment[on_garment as usize];
    anchors.iter().map(difference).sum::<Vec3>() / anchors.len().max(1) as f64
}

/// How far (m) the garment's anchors lie from their places on the body, in the mean. What a garment does by itself on a
/// body: a wide collar hangs lower than a narrow one.
pub fn offset(anchors: &[[u32; 2]], garment: &[Vec3], places: &[Vec3]) -> Vec3 {
    let difference = |(&[vertex, _], place): (&[u32; 2], &Vec3)| garment[vertex as usize] - *place;
    anchors.iter().zip(places).map(difference).sum::<Vec3>() / anchors.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::{offset, translation};
    use modiste_core::Vec3;

    #[test]
    fn the_sum_of_squares_is_smallest_at_the_translation() {
        let garment = [Vec3::new(0.0, 1.0, 0.0), Vec3::new(1.0, 1.0, 0.5), Vec3::new(0.0, 2.0, 1.0)];
        let body = [Vec3::new(3.0, 1.0, 0.0), Vec3::new(4.2, 1.0, 0.4)];
        let anchors = [[0, 0], [1, 1], [2, 1]];
        let cost = |shift: Vec3| -> f64 {
            anchors.iter().map(|&[g, b]| (garment[g as usize] + shift).distance_squared(body[b as usize])).sum()
        };
        let best = translation(&anchors, &garment, &body);
        for step in [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z] {
            assert!(cost(best + 1e-3 * step) > cost(best));
        }
    }

    #[test]
    fn a_translation_leaves_no_offset() {
        let garment = [Vec3::new(0.0, 1.0, 0.0), Vec3::new(1.0, 1.0, 0.5)];
        let body = [Vec3::new(3.0, 1.0, 0.0), Vec3::new(4.2, 1.1, 0.4)];
        let anchors = [[0, 0], [1, 1]];
        let shift = translation(&anchors, &garment, &body);
        assert!((offset(&anchors, &garment, &body) + shift).length() < 1e-12);
        let moved = garment.map(|vertex| vertex + shift);
        assert!(offset(&anchors, &moved, &body).length() < 1e-12);
    }
}
