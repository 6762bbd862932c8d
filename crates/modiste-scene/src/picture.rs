//! Pictures of an animation: contact sheets.

use modiste_core::Vec3;
use modiste_core::render::{Camera, Canvas, Figure, Image, Paint, bounds_of, contact_sheet};
use modiste_io::IoError;

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
    ///
    /// # Errors
    /// Frames on disk that cannot be read.
    pub fn contact_sheet(&self, count: usize) -> Result<Image, IoError> {
        let picks = spread(self.frame_count(), count);
        let heading = picks.first().map_or(0.0, |&frame| self.headings[frame]);
        let reach = self.reach(&picks)?;
        let tile = |&frame: &usize| {
            let mut tile = self.tile(frame, heading + AZIMUTH, reach, &self.paints())?;
            let seconds = frame as f64 / self.fps;
            tile.label(12, 12, &format!("frame {frame}  {seconds:.2} s"), INK, 2);
            Ok(tile)
        };
        let tiles = picks.iter().map(tile).collect::<Result<Vec<Image>, IoError>>()?;
        Ok(contact_sheet(&tiles, picks.len().div_ceil(2)))
    }

    /// One frame from the front, both sides and the back.
    ///
    /// # Errors
    /// Frames on disk that cannot be read.
    pub fn turnaround(&self, frame: usize) -> Result<Image, IoError> {
        let tiles = self.views(frame, &self.paints())?;
        Ok(contact_sheet(&tiles, TURNAROUND.len()))
    }

    /// The tiles of a turnaround, each mesh in its paint.
    pub(crate) fn views(&self, frame: usize, paints: &[Paint]) -> Result<Vec<Image>, IoError> {
        let reach = self.reach(&[frame])?;
        let view = |(name, azimuth): (&str, f64)| {
            let mut tile = self.tile(frame, self.headings[frame] + azimuth, reach, paints)?;
            tile.label(12, 12, name, INK, 2);
            Ok(tile)
        };
        TURNAROUND.into_iter().map(view).collect()
    }

    /// The colours of the meshes.
    pub(crate) fn paints(&self) -> Vec<Paint> {
        self.tracks.iter().map(|track| Paint::Solid(track.colour)).collect()
    }

    /// One frame, with the camera following the person; `reach` is the box around them.
    fn tile(&self, frame: usize, azimuth: f64, reach: [Vec3; 2], paints: &[Paint]) -> Result<Image, IoError> {
        let vertices =
            self.tracks.iter().map(|track| track.points(frame)).collect::<Result<Vec<Vec<Vec3>>, IoError>>()?;
        let meshes = self.tracks.iter().zip(&vertices).zip(paints);
        let figures: Vec<Figure<'_>> =
            meshes.map(|((track, vertices), paint)| Figure::new(&track.topology, vertices, paint.clone())).collect();
        let place = place(&vertices[0]);
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
        Ok(canvas.finish())
    }

    /// A box around the person, relative to [`place`], that holds them in all of these frames whichever way the camera turns.
    fn reach(&self, frames: &[usize]) -> Result<[Vec3; 2], IoError> {
        let mut radius = 0.3f64;
        let mut heights = [0.0f64, 1.0];
        for &frame in frames {
            let points = self.tracks[0].points(frame)?;
            let place = place(&points);
            for point in points {
                radius = radius.max((point.x - place.x).hypot(point.z - place.z));
                heights = [heights[0].min(point.y), heights[1].max(point.y)];
            }
        }
        // The corners of a square stand √2 further out than the circle that it must hold.
        let half = radius * std::f64::consts::FRAC_1_SQRT_2;
        Ok([Vec3::new(-half, heights[0], -half), Vec3::new(half, heights[1], half)])
    }
}

/// Where a person is: the middle of the body, on the floor.
fn place(body: &[Vec3]) -> Vec3 {
    let [lower, upper] = bounds_of(body);
    let middle = 0.5 * (lower + upper);
    Vec3::new(middle.x, 0.0, middle.z)
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
