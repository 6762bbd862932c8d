//! Alignment of sizes (Guan, appendix A): the template's triangulation carried to another outline.

use modiste_core::{SolveError, SparseCholesky, Vec2, Vec3};

use super::panel_mesh::{PanelMesh, boundary_points};
use crate::pattern::{Outline, signed_area};

/// How well a size took over the template's triangulation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AlignQuality {
    /// Smallest ratio of a triangle's area to its area in the template, scaled by the ratio of the whole panels; above zero
    /// where no triangle turned over.
    pub min_area_ratio: f64,
    /// Smallest angle (degrees).
    pub min_angle_degrees: f64,
}

/// The vertices (m) of the template's mesh in the outline of another size.
///
/// Guan eq. 34: each inner vertex keeps its combination `c_i = Σ α_ij c_j` of its neighbours in the template, in the least
/// squares sense, with α the mean value coordinates of Floater (2003), positive and summing to one. The outline is kept
/// exactly: boundary vertices sit at the same share of the arc length between the same grading points, so that both sides
/// of a seam still correspond (the paper fixes the grading points alone).
///
/// # Errors
/// [`SolveError`] where the least squares cannot be solved.
pub fn align_panel(template: &PanelMesh, target: &Outline) -> Result<(Vec<Vec2>, AlignQuality), SolveError> {
    let boundary = boundary_points(target, &template.edge_segments);
    let inner = template.points.len() - boundary.len();
    let mut points = boundary.clone();
    if inner > 0 {
        points.extend(solve_inside(template, &boundary, inner)?);
    }
    let quality = quality(template, &points);
    Ok((points, quality))
}

/// Normal equations of the rows `c_i − Σ α_ij c_j = 0` over inner vertices, boundary on the right-hand side.
fn solve_inside(template: &PanelMesh, boundary: &[Vec2], inner: usize) -> Result<Vec<Vec2>, SolveError> {
    let weights = mean_value_weights(template);
    let first = boundary.len();
    let mut triplets = Vec::new();
    let mut rhs = vec![Vec3::ZERO; inner];
    for row in &weights {
        let mut unknowns: Vec<(usize, f64)> = Vec::with_capacity(row.len());
        let mut known = Vec2::ZERO;
        for &(vertex, coefficient) in row {
            if vertex < first {
                known -= coefficient * boundary[vertex];
            } else {
                unknowns.push((vertex - first, coefficient));
            }
        }
        for &(i, a) in &unknowns {
            rhs[i] += a * known.extend(0.0);
            triplets.extend(unknowns.iter().filter(|(j, _)| *j <= i).map(|&(j, b)| (i, j, a * b)));
        }
    }
    SparseCholesky::new(inner, &triplets)?.solve_points(&mut rhs);
    Ok(rhs.into_iter().map(|p| p.truncate()).collect())
}

/// For each inner vertex the coefficients of its row: one for itself, `−α_ij` for its neighbours.
fn mean_value_weights(template: &PanelMesh) -> Vec<Vec<(usize, f64)>> {
    let first = template.boundary_count();
    let points = &template.points;
    // Floater: w_ij = (tan(β/2) + tan(γ/2)) / |x_j − x_i| with the angles at i on both sides of the edge.
    let mut rows: Vec<Vec<(usize, f64)>> = vec![Vec::new(); points.len() - first];
    for face in &template.faces {
        for corner in 0..3 {
            let [i, j, k] = [0, 1, 2].map(|c| face[(corner + c) % 3] as usize);
            if i < first {
                continue;
            }
            let (to_j, to_k) = (points[j] - points[i], points[k] - points[i]);
            let half_tangent = (0.5 * to_j.angle_to(to_k).abs()).tan();
            for (vertex, length) in [(j, to_j.length()), (k, to_k.length())] {
                match rows[i - first].iter_mut().find(|(v, _)| *v == vertex) {
                    Some((_, weight)) => *weight += half_tangent / length,
                    None => rows[i - first].push((vertex, half_tangent / length)),
                }
            }
        }
    }
    for (i, row) in rows.iter_mut().enumerate() {
        let total: f64 = row.iter().map(|(_, w)| w).sum();
        row.iter_mut().for_each(|(_, w)| *w /= -total);
        row.push((i + first, 1.0));
    }
    rows
}

fn quality(template: &PanelMesh, points: &[Vec2]) -> AlignQuality {
    let areas = |points: &[Vec2]| -> Vec<f64> {
        template.faces.iter().map(|f| signed_area(&f.map(|v| points[v as usize]))).collect()
    };
    let (before, after) = (areas(&template.points), areas(points));
    let scale = after.iter().sum::<f64>() / before.iter().sum::<f64>();
    let min_area_ratio = before.iter().zip(&after).map(|(b, a)| a / (b * scale)).fold(f64::INFINITY, f64::min);
    let aligned = PanelMesh { points: points.to_vec(), ..template.clone() };
    AlignQuality { min_area_ratio, min_angle_degrees: aligned.min_angle_degrees() }
}

#[cfg(test)]
mod tests {
    use super::align_panel;
    use crate::cut::mesh_panel;
    use crate::pattern::{draft_shorts, draft_tshirt};
    use modiste_body::Gender;

    #[test]
    fn aligning_to_itself_changes_nothing() {
        let pattern = draft_tshirt(Gender::Female);
        let outline = &pattern.panels[0].outlines[pattern.template_size];
        let mesh = mesh_panel(outline, &vec![8; outline.vertices.len()], 0.03);
        let (points, quality) = align_panel(&mesh, outline).unwrap();
        let worst = points.iter().zip(&mesh.points).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        assert!(worst < 1e-9, "{worst}");
        assert!((quality.min_area_ratio - 1.0).abs() < 1e-6);
    }

    #[test]
    fn an_affine_outline_gives_the_affine_mesh() {
        // Mean value coordinates have affine precision, so a stretched outline must give the stretched mesh.
        let pattern = draft_shorts(Gender::Male);
        let outline = pattern.panels[0].outlines[4].clone();
        let mesh = mesh_panel(&outline, &vec![8; outline.vertices.len()], 0.03);
        let scaled = |v: modiste_core::Vec2| v * 1.3;
        let mut larger = outline.clone();
        larger.vertices.iter_mut().for_each(|v| *v = scaled(*v));
        let (points, _) = align_panel(&mesh, &larger).unwrap();
        let worst = points.iter().zip(&mesh.points).map(|(a, b)| a.distance(scaled(*b))).fold(0.0, f64::max);
        assert!(worst < 1e-9, "{worst}");
    }

    #[test]
    fn no_triangle_turns_over_in_any_size() {
        for gender in Gender::ALL {
            for pattern in [draft_tshirt(gender), draft_shorts(gender)] {
                for panel in &pattern.panels {
                    let outline = &panel.outlines[pattern.template_size];
                    let segments: Vec<usize> = (0..outline.vertices.len())
                        .map(|e| (outline.edge_length(e) / 0.02).round().max(1.0) as usize)
                        .collect();
                    let mesh = mesh_panel(outline, &segments, 0.02);
                    for (size, target) in panel.outlines.iter().enumerate() {
                        let (_, quality) = align_panel(&mesh, target).unwrap();
                        let name = format!("{} {} {} {size}: {quality:?}", pattern.gender, pattern.garment, panel.name);
                        assert!(quality.min_area_ratio > 0.2, "{name}");
                        assert!(quality.min_angle_degrees > 8.0, "{name}");
                    }
                }
            }
        }
    }
}
