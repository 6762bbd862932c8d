//! Pictures of an animation: contact sheets.

use modiste_core::Vec3;
use modiste_core::render::{Camera, Canvas, Figure, Image, Paint, bounds_of, contact_sheet};

use crate::Animation;

/// Size of one tile (pixels).
const TILE: [usize; 2] = [380, 640];
/// From where a person is seen in a contact sheet, relative to their heading (rad).
const AZIMUTH: f64 = 0.45;
/// How far above the horizon the camera stands (rad).
const ELEVATION: f64 = 0.12;
const INK: [u8; 3] = [70, 72, 78];

/// The views of a turnaround: name and azimuth (rad).
const TURNAROUND: [(&str, f64); 4] = [
    ("front", 0.0),
    ("left side", std::f64::consts::FRAC_PI_2),
    ("back", std::f64::consts::PI),
    ("right side", -std::f64::consts::FRAC_PI_2),
];

impl Animation {
    /// `count` frames spread evenly over the animation, in two rows, from the front quarter.
    pub fn contact_sheet(&self, count: usize) -> Image {
        let picks = spread(self.frame_count(), count);
        let heading = picks.first().map_or(0.0, |&frame| self.headings[frame]);
        let reach = self.reach(&picks);
        let tiles: Vec<Image> = picks
            .iter()
            .map(|&frame| {
                let mut tile = self.tile(frame, heading + AZIMUTH, reach);
                let seconds = frame as f64 / self.fps;
                tile.label(12, 12, &format!("frame {frame}  {seconds:.2} s"), INK, 2);
                tile
            })
            .collect();
        contact_sheet(&tiles, picks.len().div_ceil(2))
    }

    /// One frame from the front, both sides and the back.
    pub fn turnaround(&self, frame: usize) -> Image {
        let reach = self.reach(&[frame]);
        let tiles = TURNAROUND.map(|(name, azimuth)| {
            let mut tile = self.tile(frame, self.headings[frame] + azimuth, reach);
            tile.label(12, 12, name, INK, 2);
            tile
        });
        contact_sheet(&tiles, TURNAROUND.len())
    }

    /// One frame, with the camera following the person; `reach` is the box around them.
    fn tile(&self, frame: usize, azimuth: f64, reach: [Vec3; 2]) -> Image {
        let vertices: Vec<Vec<Vec3>> = self.tracks.iter().map(|track| track.points(frame)).collect();
        let figures: Vec<Figure<'_>> = self
            .tracks
            .iter()
            .zip(&vertices)
            .map(|(track, vertices)| Figure::new(&track.topology, vertices, Paint::Solid(track.colour)))
            .collect();
        let place = self.place(frame);
        let aspect = TILE[0] as f64 / TILE[1] as f64;
        let camera = Camera::framing(reach.map(|corner| corner + place), azimuth, ELEVATION, aspect);
        let mut canvas = Canvas::new(TILE[0], TILE[1]);
        for figure in &figures {
            canvas.draw(&camera, figure.topology, figure.vertices, &figure.paint);
        }
        if let Some(hair) = &self.hair {
            hair.draw(&mut canvas, &camera, frame, &self.tracks[0].topology, &vertices[0]);
        }
        canvas.draw_ground(&camera, 0.0, &figures);
        canvas.finish()
    }

    /// Where the person is in a frame: the middle of the body, on the floor.
    fn place(&self, frame: usize) -> Vec3 {
        let [lower, upper] = bounds_of(&self.tracks[0].points(frame));
        let middle = 0.5 * (lower + upper);
        Vec3::new(middle.x, 0.0, middle.z)
    }

    /// A box around the person, relative to [`Self::place`], that holds them in all of these frames whichever way the
    /// camera turns.
    fn reach(&self, frames: &[usize]) -> [Vec3; 2] {
        let mut radius = 0.3f64;
        let mut heights = [0.0f64, 1.0];
        for &frame in frames {
            let place = self.place(frame);
            for point in self.tracks[0].points(frame) {
                radius = radius.max((point.x - place.x).hypot(point.z - place.z));
                heights = [heights[0].min(point.y), heights[1].max(point.y)];
            }
        }
        // The corners of a square stand √2 further out than the circle that it must hold.
        let half = radius * std::f64::consts::FRAC_1_SQRT_2;
        [Vec3::new(-half, heights[0], -half), Vec3::new(half, heights[1], half)]
    }
}

/// `count` indices spread evenly over `0..total`, first and last among them; fewer when there are fewer.
fn spread(total: usize, count: usize) -> Vec<usize> {
    let count = count.min(total);
    (0..count).map(|i| if count == 1 { total / 2 } else { i * (total - 1) / (count - 1) }).collect()
}

#[cfg(test)]
mod tests {
    use super::spread;

    #[test]
    fn picks_are_even_and_distinct() {
        assert_eq!(spread(100, 4), [0, 33, 66, 99]);
        assert_eq!(spread(3, 8), [0, 1, 2]);
        assert_eq!(spread(9, 1), [4]);
        assert!(spread(0, 8).is_empty());
    }
}
