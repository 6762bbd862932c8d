//! Pictures of meshes on the CPU: enough to judge a result by eye, in a few tens of milliseconds.
//!
//! A [`Canvas`] is a z-buffered, supersampled drawing surface; [`Canvas::finish`] turns it into an [`Image`]. The lights
//! (key, fill, rim and a sky-to-ground hemisphere) stand relative to the camera, so front, side and back are lit alike.
//!
//! ```
//! use modiste_core::{Topology, Vec3, render};
//! let topology = Topology::new(3, vec![[0, 1, 2]])?;
//! let vertices = [Vec3::ZERO, Vec3::X, Vec3::Y];
//! let figures = [render::Figure::new(&topology, &vertices, render::Paint::Solid([0.8, 0.3, 0.2]))];
//! let camera = render::Camera::framing(render::bounds(&figures), 0.0, 0.1, 1.0);
//! let image = render::picture(64, 64, &camera, &figures);
//! assert_eq!(image.rgb.len(), 64 * 64 * 3);
//! # Ok::<(), modiste_core::TopologyError>(())
//! ```

mod camera;
mod canvas;
mod ground;
mod image;
mod label;
mod light;
mod raster;
mod strands;

pub use camera::Camera;
pub use canvas::Canvas;
pub use image::{Image, contact_sheet};
pub use label::label_width;
pub use light::linear_from_srgb;
pub use strands::Strands;

use crate::{Topology, Vec3};

/// Colours of a mesh; sRGB components in 0–1.
#[derive(Debug, Clone, PartialEq)]
pub enum Paint {
    /// One colour everywhere.
    Solid([f32; 3]),
    /// One colour per vertex, interpolated over the faces.
    PerVertex(Vec<[f32; 3]>),
}

/// A mesh to be drawn: borrowed topology and positions with a paint.
#[derive(Debug, Clone)]
pub struct Figure<'a> {
    /// The faces.
    pub topology: &'a Topology,
    /// Vertex positions in world (m).
    pub vertices: &'a [Vec3],
    /// Its colours.
    pub paint: Paint,
}

impl<'a> Figure<'a> {
    /// A figure of these parts.
    pub fn new(topology: &'a Topology, vertices: &'a [Vec3], paint: Paint) -> Self {
        Self { topology, vertices, paint }
    }
}

/// Lower and upper corner (m) of the box around all vertices; the unit box if there are none.
pub fn bounds(figures: &[Figure<'_>]) -> [Vec3; 2] {
    bounds_of(figures.iter().flat_map(|figure| figure.vertices))
}

/// Lower and upper corner of the box around finite points; the unit box if there are none.
pub fn bounds_of<'a>(points: impl IntoIterator<Item = &'a Vec3>) -> [Vec3; 2] {
    let mut corners: Option<[Vec3; 2]> = None;
    for &point in points.into_iter().filter(|point| point.is_finite()) {
        let [lower, upper] = corners.unwrap_or([point, point]);
        corners = Some([lower.min(point), upper.max(point)]);
    }
    corners.unwrap_or([Vec3::ZERO, Vec3::ONE])
}

/// Draws figures on a ground plane at their lowest vertex, with its soft shadow.
pub fn picture(width: usize, height: usize, camera: &Camera, figures: &[Figure<'_>]) -> Image {
    picture_on(width, height, camera, figures, bounds(figures)[0].y)
}

/// Draws figures over a ground plane at height `ground` (m), with its soft shadow.
pub fn picture_on(width: usize, height: usize, camera: &Camera, figures: &[Figure<'_>], ground: f64) -> Image {
    let mut canvas = Canvas::new(width, height);
    for figure in figures {
        canvas.draw(camera, figure.topology, figure.vertices, &figure.paint);
    }
    canvas.draw_ground(camera, ground, figures);
    canvas.finish()
}

#[cfg(test)]
mod tests;
