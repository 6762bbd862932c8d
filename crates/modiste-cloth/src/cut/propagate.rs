//! From a flat alignment to a draped one (Guan, appendix A, last step).

use modiste_core::{Vec2, Vec3};

/// The draped version M of an aligned flat panel m.
///
/// `flat` and `faces` are the target's own flat mesh m^r, `draped` (m) the same mesh after simulation, M^r. Each vertex of
/// `aligned` is written in the triangle of m^r that it falls into, and the same combination is taken in M^r. A vertex that
/// falls beside the mesh, where the outlines differ by a chord, takes the nearest triangle.
///
/// Returns `None` where the target has no triangle with area.
pub fn propagate(flat: &[Vec2], faces: &[[u32; 3]], draped: &[Vec3], aligned: &[Vec2]) -> Option<Vec<Vec3>> {
    aligned
        .iter()
        .map(|&p| {
            let mut best: Option<([u32; 3], [f64; 3], f64)> = None;
            for &face in faces {
                let Some(weights) = barycentric(p, face.map(|v| flat[v as usize])) else { continue };
                let outside = -weights.iter().copied().fold(0.0, f64::min);
                if best.is_none_or(|(_, _, least)| outside < least) {
                    best = Some((face, weights, outside));
                }
                if outside <= 0.0 {
                    break;
                }
            }
            best.map(|(face, weights, _)| (0..3).map(|c| weights[c] * draped[face[c] as usize]).sum())
        })
        .collect()
}

/// Barycentric coordinates; negative outside. `None` for a triangle without area.
fn barycentric(p: Vec2, [a, b, c]: [Vec2; 3]) -> Option<[f64; 3]> {
    let area = (b - a).perp_dot(c - a);
    if area.abs() < f64::MIN_POSITIVE {
        return None;
    }
    let u = (b - p).perp_dot(c - p) / area;
    let v = (c - p).perp_dot(a - p) / area;
    Some([u, v, 1.0 - u - v])
}

#[cfg(test)]
mod tests {
    use super::propagate;
    use crate::cut::{align_panel, mesh_panel};
    use crate::pattern::draft_tshirt;
    use modiste_body::Gender;
    use modiste_core::{Vec2, Vec3};

    /// Lays a panel on a cylinder: an isometric drape with a known answer at every point.
    fn drape(p: Vec2) -> Vec3 {
        let radius = 0.15;
        Vec3::new(radius * (p.x / radius).sin(), p.y, radius * (p.x / radius).cos())
    }

    #[test]
    fn an_aligned_drape_lies_on_the_drape() {
        let pattern = draft_tshirt(Gender::Male);
        let sleeve = &pattern.panels[2];
        let template_outline = &sleeve.outlines[pattern.template_size];
        let template = mesh_panel(template_outline, &[10; 5], 0.02);
        // The target has its own mesh, of another resolution.
        let target_outline = &sleeve.outlines[2];
        let target = mesh_panel(target_outline, &[17; 5], 0.012);
        let draped: Vec<Vec3> = target.points.iter().map(|p| drape(*p)).collect();
        let (aligned, _) = align_panel(&template, target_outline).unwrap();
        let result = propagate(&target.points, &target.faces, &draped, &aligned).unwrap();
        let worst = result.iter().zip(&aligned).map(|(m, p)| m.distance(drape(*p))).fold(0.0, f64::max);
        // Chord error of the target's triangles on the cylinder: edge² / (8 radius).
        // The longest edges are those of the hem: a seventeenth of 0.38 m.
        assert!(worst < (0.38f64 / 17.0).powi(2) / (8.0 * 0.15), "{worst}");
    }
}
