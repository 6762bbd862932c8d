//! The lights of the studio and what they make of a surface.

use super::Camera;
use crate::Vec3;

/// Lights fixed to the camera's heading.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lights {
    /// Unit vector to the main light; it also casts the shadow on the ground.
    pub key: Vec3,
    fill: Vec3,
    rim: Vec3,
}

const KEY_COLOUR: [f64; 3] = [0.95, 0.92, 0.87];
const FILL_COLOUR: [f64; 3] = [0.17, 0.18, 0.21];
const RIM_COLOUR: [f64; 3] = [0.30, 0.32, 0.36];
const SKY_COLOUR: [f64; 3] = [0.34, 0.35, 0.38];
const GROUND_COLOUR: [f64; 3] = [0.10, 0.095, 0.09];
/// How far the key light reaches around the terminator (0 = a point, 1 = all around).
const KEY_WRAP: f64 = 0.12;
const SHEEN: f64 = 0.05;
const SHEEN_POWER: i32 = 24;

impl Lights {
    /// The lights for one camera.
    pub(super) fn for_camera(camera: &Camera) -> Self {
        let axes = camera.axes();
        let right = Vec3::new(axes.x_axis.x, 0.0, axes.x_axis.z).normalize_or(Vec3::X);
        let towards = right.cross(Vec3::Y);
        let place = |r: f64, u: f64, t: f64| (r * right + u * Vec3::Y + t * towards).normalize();
        Self { key: place(-0.62, 0.85, 0.62), fill: place(0.85, 0.25, 0.45), rim: place(0.45, 0.55, -0.75) }
    }

    /// Colour (sRGB, 0–255) of a surface with this linear `albedo` and unit `normal` that faces the viewer.
    pub(super) fn shade(&self, albedo: [f64; 3], normal: Vec3, towards_viewer: Vec3) -> [f32; 3] {
        let key = ((normal.dot(self.key) + KEY_WRAP) / (1.0 + KEY_WRAP)).max(0.0);
        let fill = (0.5 + 0.5 * normal.dot(self.fill)).powi(2);
        let grazing = 1.0 - normal.dot(towards_viewer).clamp(0.0, 1.0);
        let rim = (normal.dot(self.rim) + 0.3).max(0.0) * grazing.powi(3);
        let half = (self.key + towards_viewer).normalize_or_zero();
        let sheen = SHEEN * normal.dot(half).max(0.0).powi(SHEEN_POWER);
        let sky = 0.5 + 0.5 * normal.y;
        let mut out = [0.0f32; 3];
        for channel in 0..3 {
            let hemisphere = GROUND_COLOUR[channel] + sky * (SKY_COLOUR[channel] - GROUND_COLOUR[channel]);
            let light = hemisphere + key * KEY_COLOUR[channel] + fill * FILL_COLOUR[channel];
            let linear = albedo[channel] * light + (0.25 + albedo[channel]) * rim * RIM_COLOUR[channel] + sheen;
            out[channel] = (255.0 * srgb_from_linear(soften(linear))) as f32;
        }
        out
    }
}

impl Lights {
    /// Colour (sRGB, 0–255) of a strand with this linear `albedo` and unit `tangent`: Kajiya and Kay 1989, a diffuse part by
    /// the sine of the angle to the light and a highlight around the mirrored cone.
    pub(super) fn shade_strand(&self, albedo: [f64; 3], tangent: Vec3, towards_viewer: Vec3) -> [f32; 3] {
        let sine = |cosine: f64| (1.0 - cosine * cosine).max(0.0).sqrt();
        let (to_view, view_sine) = (tangent.dot(towards_viewer), sine(tangent.dot(towards_viewer)));
        let lobe = |light: Vec3, power: i32| {
            let to_light = tangent.dot(light);
            (view_sine * sine(to_light) - to_view * to_light).max(0.0).powi(power)
        };
        let key = sine(tangent.dot(self.key));
        let fill = sine(tangent.dot(self.fill));
        let highlight = 0.10 * lobe(self.key, 40) + 0.05 * lobe(self.rim, 16);
        let glow = 0.45 * lobe(self.key, 10);
        let mut out = [0.0f32; 3];
        for channel in 0..3 {
            let light =
                0.5 * SKY_COLOUR[channel] + 0.62 * key * KEY_COLOUR[channel] + 0.5 * fill * FILL_COLOUR[channel] + glow;
            let linear = albedo[channel] * light + highlight * KEY_COLOUR[channel];
            out[channel] = (255.0 * srgb_from_linear(soften(linear))) as f32;
        }
        out
    }
}

/// Keeps the shadows linear and rolls highlights off below 1.
fn soften(linear: f64) -> f64 {
    const SHOULDER: f64 = 0.7;
    if linear <= SHOULDER {
        return linear.max(0.0);
    }
    let room = 1.0 - SHOULDER;
    SHOULDER + room * (1.0 - (-(linear - SHOULDER) / room).exp())
}

/// IEC 61966-2-1 encoding.
pub(super) fn srgb_from_linear(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Linear value of an sRGB component, both in 0–1 (IEC 61966-2-1).
pub fn linear_from_srgb(srgb: f64) -> f64 {
    if srgb <= 0.040_45 { srgb / 12.92 } else { ((srgb + 0.055) / 1.055).powf(2.4) }
}
