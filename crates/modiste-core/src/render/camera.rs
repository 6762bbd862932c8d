//! Where the picture is taken from.

use crate::{Mat3, Vec3};

/// Vertical field of view (rad) of [`Camera::framing`]: long enough that bodies keep their proportions.
const FRAMING_FIELD_OF_VIEW: f64 = 0.42;
/// Part of the picture left free around a framed box.
const FRAMING_MARGIN: f64 = 1.06;
/// Nothing nearer to a perspective eye than this (m) is drawn.
const NEAR: f64 = 0.01;

/// A camera: a view frame and a projection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    eye: Vec3,
    /// Columns: right, up, backward (towards the viewer).
    world_from_camera: Mat3,
    projection: Projection,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Projection {
    /// Tangent of half the vertical field of view.
    Perspective { half_height: f64 },
    /// Half of the height of the picture (m).
    Orthographic { half_height: f64 },
}

/// A point on the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Projected {
    /// Pixels from the left edge.
    pub x: f32,
    /// Pixels from the top edge.
    pub y: f32,
    /// Larger is nearer; linear over a triangle on the picture.
    pub nearness: f32,
    /// Weight that makes interpolation over the picture right in space.
    pub weight: f32,
    /// In front of the eye.
    pub visible: bool,
}

impl Camera {
    /// A perspective camera at `eye` that looks at `target`; `field_of_view` is the vertical angle (rad).
    pub fn look_at(eye: Vec3, target: Vec3, field_of_view: f64) -> Self {
        let half_height = (0.5 * field_of_view).tan().max(1e-6);
        Self { eye, world_from_camera: axes(eye, target), projection: Projection::Perspective { half_height } }
    }

    /// A parallel camera that looks from `eye` at `target`; the picture shows `height` metres from bottom to top.
    pub fn orthographic(eye: Vec3, target: Vec3, height: f64) -> Self {
        let projection = Projection::Orthographic { half_height: (0.5 * height).max(1e-9) };
        Self { eye, world_from_camera: axes(eye, target), projection }
    }

    /// A perspective camera that shows the whole box `[lower, upper]` on a picture of `aspect` = width / height.
    ///
    /// `azimuth` (rad) turns around the box: 0 is in front (+Z), π/2 at its left hand (+X), π behind. `elevation` (rad) is
    /// upwards.
    pub fn framing(corners: [Vec3; 2], azimuth: f64, elevation: f64, aspect: f64) -> Self {
        let [lower, upper] = corners;
        let centre = 0.5 * (lower + upper);
        let outward = direction(azimuth, elevation);
        let half_height = (0.5 * FRAMING_FIELD_OF_VIEW).tan();
        let frame = axes(centre + outward, centre);
        let distance = box_corners(corners)
            .map(|corner| {
                let local = frame.transpose() * (corner - centre);
                local.z + FRAMING_MARGIN * (local.x.abs() / aspect).max(local.y.abs()) / half_height
            })
            .fold(0.1, f64::max);
        Self::look_at(centre + distance * outward, centre, FRAMING_FIELD_OF_VIEW)
    }

    /// The parallel counterpart of [`Camera::framing`].
    pub fn framing_orthographic(corners: [Vec3; 2], azimuth: f64, elevation: f64, aspect: f64) -> Self {
        let centre = 0.5 * (corners[0] + corners[1]);
        let outward = direction(azimuth, elevation);
        let frame = axes(centre + outward, centre);
        let half = box_corners(corners)
            .map(|corner| {
                let local = frame.transpose() * (corner - centre);
                (local.x.abs() / aspect).max(local.y.abs())
            })
            .fold(1e-3, f64::max);
        let distance = (corners[1] - corners[0]).length() + 1.0;
        Self::orthographic(centre + distance * outward, centre, 2.0 * FRAMING_MARGIN * half)
    }

    /// Where the camera stands (m).
    pub fn eye(&self) -> Vec3 {
        self.eye
    }

    /// Columns: right, up and backward in world.
    pub(super) fn axes(&self) -> Mat3 {
        self.world_from_camera
    }

    /// Unit vector from `point` to the viewer.
    pub(super) fn towards_viewer(&self, point: Vec3) -> Vec3 {
        match self.projection {
            Projection::Perspective { .. } => (self.eye - point).normalize_or_zero(),
            Projection::Orthographic { .. } => self.world_from_camera.z_axis,
        }
    }

    /// The point on a picture of `width` × `height` pixels.
    pub(super) fn project(&self, point: Vec3, width: usize, height: usize) -> Projected {
        let local = self.world_from_camera.transpose() * (point - self.eye);
        let ahead = -local.z;
        let (half, nearness, weight, visible) = match self.projection {
            Projection::Perspective { half_height } => {
                (half_height * ahead.max(NEAR), 1.0 / ahead.max(NEAR), 1.0 / ahead.max(NEAR), ahead > NEAR)
            }
            Projection::Orthographic { half_height } => (half_height, -ahead, 1.0, true),
        };
        let scale = 0.5 * height as f64 / half;
        Projected {
            x: (0.5 * width as f64 + scale * local.x) as f32,
            y: (0.5 * height as f64 - scale * local.y) as f32,
            nearness: nearness as f32,
            weight: weight as f32,
            visible: visible && local.is_finite(),
        }
    }

    /// Origin and direction of the ray through a point of the picture; parameter 1 lies one metre ahead.
    pub(super) fn ray(&self, x: f64, y: f64, width: usize, height: usize) -> (Vec3, Vec3) {
        let across = (2.0 * x - width as f64) / height as f64;
        let up = 1.0 - 2.0 * y / height as f64;
        match self.projection {
            Projection::Perspective { half_height } => {
                (self.eye, self.world_from_camera * Vec3::new(half_height * across, half_height * up, -1.0))
            }
            Projection::Orthographic { half_height } => (
                self.eye + self.world_from_camera * Vec3::new(half_height * across, half_height * up, 0.0),
                -self.world_from_camera.z_axis,
            ),
        }
    }

    /// The nearness (see [`Projected`]) of a point `ahead` metres along the view.
    pub(super) fn nearness(&self, ahead: f64) -> f32 {
        match self.projection {
            Projection::Perspective { .. } => (1.0 / ahead.max(NEAR)) as f32,
            Projection::Orthographic { .. } => -ahead as f32,
        }
    }
}

fn direction(azimuth: f64, elevation: f64) -> Vec3 {
    Vec3::new(azimuth.sin() * elevation.cos(), elevation.sin(), azimuth.cos() * elevation.cos())
}

fn axes(eye: Vec3, target: Vec3) -> Mat3 {
    let backward = (eye - target).normalize_or(Vec3::Z);
    let up = if backward.y.abs() > 0.9999 { Vec3::NEG_Z } else { Vec3::Y };
    let right = up.cross(backward).normalize_or(Vec3::X);
    Mat3::from_cols(right, backward.cross(right), backward)
}

fn box_corners([lower, upper]: [Vec3; 2]) -> impl Iterator<Item = Vec3> {
    let pick = |bit: bool, low: f64, high: f64| if bit { high } else { low };
    (0..8).map(move |i| {
        Vec3::new(
            pick(i & 1 != 0, lower.x, upper.x),
            pick(i & 2 != 0, lower.y, upper.y),
            pick(i & 4 != 0, lower.z, upper.z),
        )
    })
}
