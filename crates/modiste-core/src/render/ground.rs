//! The ground plane and the soft shadow of the figures on it.

use rayon::prelude::*;

use super::canvas::{SUPERSAMPLES, background, pack};
use super::light::Lights;
use super::{Camera, Canvas, Figure, bounds};
use crate::Vec3;

/// Cells along the longer side of the shadow map.
const MAP_CELLS: usize = 256;
/// Space around the figures that the map covers (m).
const MAP_MARGIN: f64 = 0.5;
/// Casters up to this height above the ground (m), with the radius of the blur (m) and the strength of their shadow: what
/// is higher casts a softer shadow.
const KEY_LAYERS: [(f64, f64, f32); 3] = [(0.35, 0.015, 0.40), (0.9, 0.032, 0.36), (f64::INFINITY, 0.055, 0.32)];
/// Height (m) over which the dark spot under feet fades, its blur radius (m) and strength.
const CONTACT: (f64, f64, f32) = (0.10, 0.03, 0.55);
/// Colour of the lit ground (sRGB, 0–255).
const GROUND: [f32; 3] = [232.0, 231.0, 229.0];

impl Canvas {
    /// Draws a ground plane at height `ground` (m) that fades into the background, with the shadow of the figures.
    ///
    /// Call it after the figures are drawn: it respects what is nearer.
    pub fn draw_ground(&mut self, camera: &Camera, ground: f64, casters: &[Figure<'_>]) {
        let (width, height) = (self.width(), self.height());
        let corners = bounds(casters);
        let shadow = Shadow::new(casters, corners, ground, Lights::for_camera(camera).key);
        let centre = 0.5 * (corners[0] + corners[1]);
        let reach = 0.5 * (corners[1] - corners[0]).length().max(0.2);
        let columns = width * SUPERSAMPLES;
        let row_length = (columns * SUPERSAMPLES).max(1);
        let (colours, depths) = (&mut self.colour, &mut self.nearness);
        colours.par_chunks_mut(row_length).zip(depths.par_chunks_mut(row_length)).enumerate().for_each(
            |(y, (colour, nearness))| {
                let behind = background(y as f32 / height as f32);
                for x in 0..width {
                    let (origin, along) = camera.ray(x as f64 + 0.5, y as f64 + 0.5, width, height);
                    let ahead = (ground - origin.y) / along.y;
                    if !ahead.is_finite() || ahead <= 0.0 {
                        continue;
                    }
                    let point = origin + ahead * along;
                    let away = Vec3::new(point.x - centre.x, 0.0, point.z - centre.z).length() / reach;
                    let presence = 1.0 - ((away - 0.8) / 1.6).clamp(0.0, 1.0);
                    let dark = shadow.at(point.x, point.z);
                    if presence <= 0.0 && dark <= 0.0 {
                        continue;
                    }
                    let near = camera.nearness(ahead);
                    let packed = pack([0, 1, 2].map(|channel| {
                        let lit = behind[channel] + presence as f32 * (GROUND[channel] - behind[channel]);
                        lit * (1.0 - dark as f32)
                    }));
                    for sample in 0..SUPERSAMPLES * SUPERSAMPLES {
                        let index = sample / SUPERSAMPLES * columns + x * SUPERSAMPLES + sample % SUPERSAMPLES;
                        if near > nearness[index] {
                            nearness[index] = near;
                            colour[index] = packed;
                        }
                    }
                }
            },
        );
    }
}

/// How dark the ground is, on a grid in X and Z.
#[derive(Debug)]
struct Shadow {
    origin: [f64; 2],
    cell: f64,
    size: [usize; 2],
    darkness: Vec<f32>,
}

impl Shadow {
    fn new(casters: &[Figure<'_>], [lower, upper]: [Vec3; 2], ground: f64, key: Vec3) -> Self {
        let shift = key / key.y;
        let tall = (upper.y - ground).max(0.0);
        let span = |low: f64, high: f64, slope: f64| {
            (low - MAP_MARGIN + (-slope * tall).min(0.0), high + MAP_MARGIN + (-slope * tall).max(0.0))
        };
        let (left, right) = span(lower.x, upper.x, shift.x);
        let (rear, front) = span(lower.z, upper.z, shift.z);
        let cell = (right - left).max(front - rear) / MAP_CELLS as f64;
        let size = [((right - left) / cell).ceil() as usize, ((front - rear) / cell).ceil() as usize];
        let mut map = Self { origin: [left, rear], cell, size, darkness: vec![0.0; size[0] * size[1]] };
        let mut layers = vec![map.darkness.clone(); KEY_LAYERS.len()];
        let mut contact = map.darkness.clone();
        for figure in casters {
            for face in figure.topology.faces() {
                let triangle = face.map(|vertex| figure.vertices[vertex as usize]);
                map.splat(triangle, |point| {
                    let above = (point.y - ground).max(0.0);
                    let layer = KEY_LAYERS.iter().position(|layer| above <= layer.0).unwrap_or(0);
                    (point - above * shift, layer, above)
                })
                .for_each(|(key_cell, foot_cell, layer, above)| {
                    if let Some(cell) = key_cell {
                        layers[layer][cell] = 1.0;
                    }
                    if let Some(cell) = foot_cell.filter(|_| above < 5.0 * CONTACT.0) {
                        contact[cell] = contact[cell].max((-above / CONTACT.0).exp() as f32);
                    }
                });
            }
        }
        // Layers add up to at most one shadow, so that no seam shows where one ends and the next begins.
        for (layer, (_, radius, strength)) in layers.into_iter().zip(KEY_LAYERS) {
            let layer = map.blurred(layer, radius);
            for (total, value) in map.darkness.iter_mut().zip(layer) {
                *total = (*total + strength * value).min(KEY_LAYERS[0].2);
            }
        }
        let contact = map.blurred(contact, CONTACT.1);
        for (total, value) in map.darkness.iter_mut().zip(contact) {
            *total = 1.0 - (1.0 - *total) * (1.0 - CONTACT.2 * value);
        }
        map
    }

    /// Points spread over a triangle, one per cell or denser: cells of the point cast along the light and straight down.
    fn splat<'a>(
        &'a self,
        [a, b, c]: [Vec3; 3],
        cast: impl Fn(Vec3) -> (Vec3, usize, f64) + 'a,
    ) -> impl Iterator<Item = (Option<usize>, Option<usize>, usize, f64)> + 'a {
        let longest = (b - a).length().max((c - b).length()).max((a - c).length());
        let steps = if longest.is_finite() { (longest / self.cell).ceil().clamp(1.0, 512.0) as usize } else { 0 };
        (0..steps).flat_map(move |i| (0..steps - i).map(move |j| (i, j))).map(move |(i, j)| {
            let third = 1.0 / 3.0;
            let (u, v) = ((i as f64 + third) / steps as f64, (j as f64 + third) / steps as f64);
            let point = a + u * (b - a) + v * (c - a);
            let (on_ground, layer, above) = cast(point);
            (self.index(on_ground.x, on_ground.z), self.index(point.x, point.z), layer, above)
        })
    }

    fn index(&self, x: f64, z: f64) -> Option<usize> {
        let (column, row) = (((x - self.origin[0]) / self.cell).floor(), ((z - self.origin[1]) / self.cell).floor());
        let inside = column >= 0.0 && row >= 0.0 && column < self.size[0] as f64 && row < self.size[1] as f64;
        inside.then(|| row as usize * self.size[0] + column as usize)
    }

    /// A layer blurred twice by a box of this radius (m).
    fn blurred(&self, mut layer: Vec<f32>, radius: f64) -> Vec<f32> {
        let cells = (radius / self.cell).round().max(1.0) as usize;
        for _ in 0..2 {
            blur_rows(&mut layer, self.size[0], cells);
            layer = transpose(&layer, self.size[0]);
            blur_rows(&mut layer, self.size[1], cells);
            layer = transpose(&layer, self.size[1]);
        }
        layer
    }

    /// Darkness (0–1) at a point of the ground, interpolated between cells; nothing outside the map.
    fn at(&self, x: f64, z: f64) -> f64 {
        let (column, row) = ((x - self.origin[0]) / self.cell - 0.5, (z - self.origin[1]) / self.cell - 0.5);
        if column < 0.0 || row < 0.0 {
            return 0.0;
        }
        let (i, j) = (column as usize, row as usize);
        if i + 1 >= self.size[0] || j + 1 >= self.size[1] {
            return 0.0;
        }
        let (fx, fz) = (column - i as f64, row - j as f64);
        let value = |i: usize, j: usize| f64::from(self.darkness[j * self.size[0] + i]);
        let upper = value(i, j) + fx * (value(i + 1, j) - value(i, j));
        let lower = value(i, j + 1) + fx * (value(i + 1, j + 1) - value(i, j + 1));
        upper + fz * (lower - upper)
    }
}

/// Running mean over `2 radius + 1` cells of each row; outside a row is zero.
fn blur_rows(values: &mut [f32], columns: usize, radius: usize) {
    let scale = 1.0 / (2 * radius + 1) as f32;
    let mut source = vec![0.0f32; columns];
    for row in values.chunks_exact_mut(columns) {
        source.copy_from_slice(row);
        let mut sum: f32 = source[..radius.min(columns)].iter().sum();
        for column in 0..columns {
            sum += source.get(column + radius).copied().unwrap_or(0.0);
            if column > radius {
                sum -= source[column - radius - 1];
            }
            row[column] = sum * scale;
        }
    }
}

fn transpose(values: &[f32], columns: usize) -> Vec<f32> {
    let rows = values.len() / columns;
    let mut out = Vec::with_capacity(values.len());
    for column in 0..columns {
        out.extend((0..rows).map(|row| values[row * columns + column]));
    }
    out
}
