//! Hair: thin strips that face the viewer, shaded along their tangent.

use rayon::prelude::*;

use super::canvas::{BAND_ROWS, SUPERSAMPLES};
use super::light::{Lights, linear_from_srgb};
use super::raster::{Band, Corner};
use super::{Camera, Canvas};
use crate::Vec3;

/// Strands that are drawn together.
#[derive(Debug, Clone, Copy)]
pub struct Strands<'a> {
    /// Points in world (m), `points_per_strand` of each strand, the root first.
    pub points: &'a [Vec3],
    /// Points of a strand; at least 2.
    pub points_per_strand: usize,
    /// Colour of each strand (sRGB, 0–1); fewer repeat the last one.
    pub colours: &'a [[f32; 3]],
    /// Width at the root (m); strands taper to a third of it.
    pub width: f64,
}

/// Darkness at the root, where strands shade each other.
const ROOT_SHADE: f64 = 0.55;

impl Canvas {
    /// Draws strands as strips turned to the viewer, lit after Kajiya and Kay (1989): by the angles between tangent,
    /// light and viewer. Strands nearer to the viewer hide others, by the depth of every sample.
    ///
    /// Strands that reach behind the eye or are not finite are left out.
    pub fn draw_strands(&mut self, camera: &Camera, strands: &Strands<'_>) {
        let (columns, rows) = (self.width() * SUPERSAMPLES, self.height() * SUPERSAMPLES);
        let each = strands.points_per_strand;
        if columns == 0 || rows == 0 || each < 2 {
            return;
        }
        let lights = Lights::for_camera(camera);
        let corners: Vec<[Corner; 2]> = strands
            .points
            .par_chunks_exact(each)
            .enumerate()
            .flat_map_iter(|(index, points)| {
                let srgb = strands.colours.get(index).or(strands.colours.last()).copied().unwrap_or([0.3, 0.2, 0.1]);
                let albedo = srgb.map(|c| linear_from_srgb(f64::from(c).clamp(0.0, 1.0)));
                (0..each).map(move |at| (points, at, albedo))
            })
            .map(|(points, at, albedo)| {
                let tangent = (points[(at + 1).min(each - 1)] - points[at.saturating_sub(1)]).normalize_or(Vec3::Y);
                let towards_viewer = camera.towards_viewer(points[at]);
                let along = at as f64 / (each - 1) as f64;
                let shade = ROOT_SHADE + (1.0 - ROOT_SHADE) * (3.0 * along).min(1.0);
                let colour = lights.shade_strand(albedo.map(|c| shade * c), tangent, towards_viewer);
                let half =
                    0.5 * strands.width * (1.0 - 0.67 * along) * tangent.cross(towards_viewer).normalize_or(Vec3::X);
                [-1.0, 1.0].map(|side| Corner {
                    at: camera.project(points[at] + side * half, columns, rows),
                    front: colour,
                    back: colour,
                })
            })
            .collect();
        let mut bins = vec![Vec::new(); rows.div_ceil(BAND_ROWS)];
        for first in (0..corners.len()).filter(|at| at % each + 1 < each) {
            let quad = [&corners[first], &corners[first + 1]];
            if !quad.iter().all(|pair| pair.iter().all(|corner| corner.at.visible)) {
                continue;
            }
            let heights = quad.map(|pair| [pair[0].at.y, pair[1].at.y]);
            let top = heights.as_flattened().iter().copied().fold(f32::INFINITY, f32::min);
            let bottom = heights.as_flattened().iter().copied().fold(f32::NEG_INFINITY, f32::max);
            if bottom < 0.0 || top >= rows as f32 {
                continue;
            }
            let last = (bottom as usize / BAND_ROWS).min(bins.len() - 1);
            for bin in &mut bins[top.max(0.0) as usize / BAND_ROWS..=last] {
                bin.push(first);
            }
        }
        self.colour
            .par_chunks_mut(columns * BAND_ROWS)
            .zip(self.nearness.par_chunks_mut(columns * BAND_ROWS))
            .zip(&bins)
            .enumerate()
            .for_each(|(index, ((colour, nearness), quads))| {
                let mut band = Band { first_row: index * BAND_ROWS, columns, colour, nearness };
                for &first in quads {
                    let ([a, b], [c, d]) = (&corners[first], &corners[first + 1]);
                    band.fill([a, b, c]);
                    band.fill([b, d, c]);
                }
            });
    }
}
