//! The drawing surface: supersampled colour and depth.

use rayon::prelude::*;

use super::camera::Projected;
use super::light::{Lights, linear_from_srgb};
use super::raster::{Band, Corner};
use super::{Camera, Image, Paint};
use crate::{Topology, Vec3};

/// Samples per pixel along each axis.
pub(super) const SUPERSAMPLES: usize = 2;
/// Rows of samples that one task fills.
pub(super) const BAND_ROWS: usize = 64;
/// Background at the top and at the bottom of the picture (sRGB, 0–255).
const BACKGROUND: [[f32; 3]; 2] = [[222.0, 225.0, 230.0], [240.0, 240.0, 239.0]];

/// A surface to draw on: colour and depth, `SUPERSAMPLES`² samples a pixel.
#[derive(Debug, Clone)]
pub struct Canvas {
    width: usize,
    height: usize,
    /// Packed sRGB bytes (red lowest), sample rows from the top.
    pub(super) colour: Vec<u32>,
    pub(super) nearness: Vec<f32>,
}

impl Canvas {
    /// An empty canvas of `width` × `height` pixels.
    pub fn new(width: usize, height: usize) -> Self {
        let (columns, rows) = (width * SUPERSAMPLES, height * SUPERSAMPLES);
        let mut colour = Vec::with_capacity(columns * rows);
        for row in 0..rows {
            let packed = pack(background(row as f32 / rows as f32));
            colour.resize(colour.len() + columns, packed);
        }
        Self { width, height, colour, nearness: vec![f32::NEG_INFINITY; columns * rows] }
    }

    /// Width (pixels).
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height (pixels).
    pub fn height(&self) -> usize {
        self.height
    }

    /// Draws a mesh, both sides of every face, with smooth normals.
    ///
    /// Faces that reach behind the eye are left out, as are those with a corner that is not finite. A `PerVertex` paint with
    /// too few colours repeats its last one.
    pub fn draw(&mut self, camera: &Camera, topology: &Topology, vertices: &[Vec3], paint: &Paint) {
        let (columns, rows) = (self.width * SUPERSAMPLES, self.height * SUPERSAMPLES);
        if columns == 0 || rows == 0 || vertices.len() < topology.vertex_count() {
            return;
        }
        let corners = self.shade_vertices(camera, topology, vertices, paint);
        let bins = bin_faces(topology, &corners, rows);
        self.colour
            .par_chunks_mut(columns * BAND_ROWS)
            .zip(self.nearness.par_chunks_mut(columns * BAND_ROWS))
            .zip(&bins)
            .enumerate()
            .for_each(|(index, ((colour, nearness), faces))| {
                let mut band = Band { first_row: index * BAND_ROWS, columns, colour, nearness };
                for &face in faces {
                    band.fill(topology.faces()[face as usize].map(|vertex| &corners[vertex as usize]));
                }
            });
    }

    /// Averages the samples into a picture.
    pub fn finish(self) -> Image {
        let columns = self.width * SUPERSAMPLES;
        let mut rgb = vec![0u8; 3 * self.width * self.height];
        rgb.par_chunks_mut((3 * self.width).max(1)).enumerate().for_each(|(y, row)| {
            for (x, pixel) in row.chunks_exact_mut(3).enumerate() {
                let mut sums = [0u32; 3];
                for sample_row in 0..SUPERSAMPLES {
                    let at = (y * SUPERSAMPLES + sample_row) * columns + x * SUPERSAMPLES;
                    for &packed in &self.colour[at..at + SUPERSAMPLES] {
                        for (channel, sum) in sums.iter_mut().enumerate() {
                            *sum += packed >> (8 * channel) & 0xff;
                        }
                    }
                }
                const COUNT: u32 = (SUPERSAMPLES * SUPERSAMPLES) as u32;
                for (byte, sum) in pixel.iter_mut().zip(sums) {
                    *byte = ((sum + COUNT / 2) / COUNT) as u8;
                }
            }
        });
        Image { width: self.width, height: self.height, rgb }
    }

    fn shade_vertices(&self, camera: &Camera, topology: &Topology, vertices: &[Vec3], paint: &Paint) -> Vec<Corner> {
        let lights = Lights::for_camera(camera);
        let (columns, rows) = (self.width * SUPERSAMPLES, self.height * SUPERSAMPLES);
        (0..topology.vertex_count())
            .into_par_iter()
            .map(|vertex| {
                let point = vertices[vertex];
                let normal = vertex_normal(topology, vertices, vertex);
                let srgb = match paint {
                    Paint::Solid(colour) => *colour,
                    Paint::PerVertex(colours) => colours.get(vertex).or(colours.last()).copied().unwrap_or([0.5; 3]),
                };
                let albedo = srgb.map(|c| linear_from_srgb(f64::from(c).clamp(0.0, 1.0)));
                let towards_viewer = camera.towards_viewer(point);
                Corner {
                    at: camera.project(point, columns, rows),
                    front: lights.shade(albedo, normal, towards_viewer),
                    back: lights.shade(albedo.map(|c| 0.8 * c), -normal, towards_viewer),
                }
            })
            .collect()
    }
}

/// Background colour (sRGB, 0–255) at `down` (0 = top, 1 = bottom).
pub(super) fn background(down: f32) -> [f32; 3] {
    [0, 1, 2].map(|channel| BACKGROUND[0][channel] + down * (BACKGROUND[1][channel] - BACKGROUND[0][channel]))
}

/// Packs components 0–255, red lowest.
pub(super) fn pack(colour: [f32; 3]) -> u32 {
    let [red, green, blue] = colour.map(|component| (component + 0.5).clamp(0.0, 255.0) as u32);
    red | green << 8 | blue << 16
}

fn vertex_normal(topology: &Topology, vertices: &[Vec3], vertex: usize) -> Vec3 {
    let mut sum = Vec3::ZERO;
    for &face in topology.vertex_faces(vertex) {
        let [a, b, c] = topology.faces()[face as usize].map(|corner| vertices[corner as usize]);
        sum += (b - a).cross(c - a);
    }
    sum.normalize_or(Vec3::Y)
}

/// Faces that touch each band of rows, in face order.
fn bin_faces(topology: &Topology, corners: &[Corner], rows: usize) -> Vec<Vec<u32>> {
    let mut bins = vec![Vec::new(); rows.div_ceil(BAND_ROWS)];
    for (index, face) in (0u32..).zip(topology.faces()) {
        let at: [Projected; 3] = face.map(|vertex| corners[vertex as usize].at);
        if !at.iter().all(|corner| corner.visible) {
            continue;
        }
        let top = at.iter().map(|corner| corner.y).fold(f32::INFINITY, f32::min);
        let bottom = at.iter().map(|corner| corner.y).fold(f32::NEG_INFINITY, f32::max);
        if bottom < 0.0 || top >= rows as f32 {
            continue;
        }
        let first = top.max(0.0) as usize / BAND_ROWS;
        let last = (bottom as usize / BAND_ROWS).min(bins.len() - 1);
        for bin in &mut bins[first..=last] {
            bin.push(index);
        }
    }
    bins
}
