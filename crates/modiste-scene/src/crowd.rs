//! Many people in one place: where they stand, and their picture.

use std::sync::Arc;

use modiste_body::{Motion, Part};
use modiste_core::render::{Camera, Figure, Image, Paint, bounds, picture_on};
use modiste_core::{Quat, Rng, Topology, Vec3, uniform};
use modiste_io::IoError;
use serde::{Deserialize, Serialize};

use crate::Animation;

/// Distance between neighbours (m).
const SPACING: f64 = 1.3;
/// How far somebody may stand from their place in the grid (m).
const JITTER: f64 = 0.25;
/// How far somebody may look away from straight ahead (rad).
const TURN: f64 = 0.7;
/// Size of the picture (pixels).
const SIZE: [usize; 2] = [1920, 1080];
/// How far above the horizon the camera stands (rad).
const ELEVATION: f64 = 0.30;

/// Where somebody stands and looks.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// On the floor (m): X to the right of a viewer in front, Z towards them.
    pub position: [f64; 2],
    /// Where they look, about Y from +Z (rad).
    pub heading: f64,
}

/// Places for `count` people: a grid twice as wide as deep, every other row between those before, a little disorder.
pub fn scatter(count: usize, rng: &mut Rng) -> Vec<Place> {
    let columns = ((2 * count) as f64).sqrt().ceil().max(1.0) as usize;
    let around = |rng: &mut Rng, reach: f64| reach * (2.0 * uniform(rng) - 1.0);
    (0..count)
        .map(|index| {
            let (row, column) = (index / columns, index % columns);
            let shift = if row % 2 == 0 { 0.0 } else { 0.5 };
            let x = (column as f64 + shift - 0.5 * (columns - 1) as f64) * SPACING;
            let position = [x + around(rng, JITTER), -(row as f64) * SPACING + around(rng, JITTER)];
            Place { position, heading: around(rng, TURN) }
        })
        .collect()
}

impl Place {
    /// Takes a motion here: in its middle the person stands at this place and looks the way that it says.
    pub fn bring(&self, motion: &mut Motion) {
        let Some(middle) = motion.frames.get(motion.frames.len() / 2) else { return };
        let ahead = middle.rotation(Part::Pelvis) * Vec3::Z;
        let turn = Quat::from_rotation_y(self.heading - ahead.x.atan2(ahead.z));
        let from = Vec3::new(middle.root_translation.x, 0.0, middle.root_translation.z);
        let to = Vec3::new(self.position[0], 0.0, self.position[1]);
        for pose in &mut motion.frames {
            pose.root_translation = turn * (pose.root_translation - from) + to;
            pose.set_rotation(Part::Pelvis, turn * pose.rotation(Part::Pelvis));
        }
    }
}

/// A picture of a crowd: one frame of everybody.
#[derive(Debug, Default)]
pub struct CrowdPicture {
    meshes: Vec<(Arc<Topology>, Vec<[f32; 3]>, [f32; 3])>,
}

impl CrowdPicture {
    /// Adds the middle frame of an animation.
    ///
    /// # Errors
    /// Frames on disk that cannot be read.
    pub fn add(&mut self, animation: &Animation) -> Result<(), IoError> {
        for track in &animation.tracks {
            let mut vertices = Vec::new();
            track.frames.read(animation.frame_count() / 2, &mut vertices)?;
            self.meshes.push((Arc::clone(&track.topology), vertices, track.colour));
        }
        Ok(())
    }

    /// Takes over what another one holds.
    pub fn append(&mut self, other: Self) {
        self.meshes.extend(other.meshes);
    }

    /// Draws everybody from the front.
    pub fn draw(&self) -> Image {
        let point = |p: &[f32; 3]| Vec3::from_array(p.map(f64::from));
        let points: Vec<Vec<Vec3>> =
            self.meshes.iter().map(|(_, vertices, _)| vertices.iter().map(point).collect()).collect();
        let figures: Vec<Figure<'_>> = self
            .meshes
            .iter()
            .zip(&points)
            .map(|((topology, _, colour), points)| Figure::new(topology, points, Paint::Solid(*colour)))
            .collect();
        let camera = Camera::framing(bounds(&figures), 0.0, ELEVATION, SIZE[0] as f64 / SIZE[1] as f64);
        picture_on(SIZE[0], SIZE[1], &camera, &figures, 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::scatter;
    use modiste_body::{Motion, Part, Pose};
    use modiste_core::{Quat, Vec3, seeded_rng};

    #[test]
    fn nobody_stands_on_anybody_and_the_seed_decides() {
        let places = scatter(50, &mut seeded_rng(3));
        for (index, a) in places.iter().enumerate() {
            for b in &places[..index] {
                let apart = (a.position[0] - b.position[0]).hypot(a.position[1] - b.position[1]);
                assert!(apart > 0.6, "{apart}");
            }
        }
        assert_eq!(places, scatter(50, &mut seeded_rng(3)));
        assert_ne!(places, scatter(50, &mut seeded_rng(4)));
        assert!(scatter(0, &mut seeded_rng(3)).is_empty());
    }

    #[test]
    fn a_motion_is_brought_to_its_place_as_a_whole() {
        let frame = |index: usize| {
            let mut pose = Pose::template(Vec3::new(1.0, 0.9, index as f64));
            pose.set_rotation(Part::Pelvis, Quat::from_rotation_y(0.3) * Quat::from_rotation_x(0.2));
            pose
        };
        let mut motion = Motion { fps: 30.0, frames: (0..5).map(frame).collect() };
        let place = super::Place { position: [4.0, -2.0], heading: -0.5 };
        place.bring(&mut motion);
        let middle = &motion.frames[2];
        assert!(middle.root_translation.distance(Vec3::new(4.0, 0.9, -2.0)) < 1e-12);
        let ahead = middle.rotation(Part::Pelvis) * Vec3::Z;
        assert!((ahead.x.atan2(ahead.z) + 0.5).abs() < 1e-9);
        let step = motion.frames[3].root_translation.distance(middle.root_translation);
        assert!((step - 1.0).abs() < 1e-12);
    }
}
