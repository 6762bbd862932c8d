//! Pictures of a fit map.

use modiste_core::render::{Image, Paint, contact_sheet, label_width};
use modiste_io::IoError;

use crate::{Animation, FitMap};

/// Colour of the body under the map (sRGB).
const BODY: [f32; 3] = [0.72, 0.72, 0.74];
const INK: [u8; 3] = [50, 52, 58];
/// Height of a legend, and of its bar (pixels).
const LEGEND: usize = 76;
const BAR: usize = 22;
/// Labels on a legend.
const TICKS: usize = 6;

/// One quantity of a map with its colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layer {
    /// Distance from the body.
    Ease,
    /// Stretch against the pattern.
    Strain,
}

impl Layer {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Ease, Self::Strain];

    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ease => "ease",
            Self::Strain => "strain",
        }
    }

    fn title(self) -> &'static str {
        match self {
            Self::Ease => "ease: distance from the body (mm)",
            Self::Strain => "strain: largest stretch against the pattern (%)",
        }
    }

    /// Values and their colours (sRGB), ascending; in between they are interpolated.
    fn scale(self) -> &'static [(f64, [f32; 3])] {
        match self {
            Self::Ease => &[
                (0.0, [0.70, 0.09, 0.17]),
                (10.0, [0.94, 0.54, 0.38]),
                (20.0, [0.98, 0.93, 0.75]),
                (35.0, [0.57, 0.77, 0.87]),
                (60.0, [0.13, 0.40, 0.67]),
            ],
            Self::Strain => &[
                (-5.0, [0.13, 0.40, 0.67]),
                (0.0, [0.95, 0.95, 0.93]),
                (5.0, [0.99, 0.78, 0.45]),
                (10.0, [0.89, 0.35, 0.20]),
                (20.0, [0.55, 0.05, 0.15]),
            ],
        }
    }

    /// The colour of a value (sRGB).
    fn colour(self, value: f64) -> [f32; 3] {
        let scale = self.scale();
        let above = scale.iter().position(|(stop, _)| value < *stop).unwrap_or(scale.len());
        match (above.checked_sub(1).map(|below| scale[below]), scale.get(above)) {
            (Some((low, from)), Some((high, to))) => {
                let share = ((value - low) / (high - low)) as f32;
                std::array::from_fn(|channel| from[channel] + share * (to[channel] - from[channel]))
            }
            (Some((_, colour)), None) => colour,
            (None, first) => first.map_or([0.5; 3], |(_, colour)| *colour),
        }
    }

    /// A bar of all colours with its values.
    fn legend(self, width: usize) -> Image {
        let mut image = Image::filled(width, LEGEND, [255; 3]);
        image.label(12, 8, self.title(), INK, 2);
        let (low, high) = (self.scale()[0].0, self.scale()[self.scale().len() - 1].0);
        let (left, right) = (width / 4, width - 40);
        let value = |x: usize| low + (high - low) * (x - left) as f64 / (right - left) as f64;
        for x in left..=right {
            let colour = self.colour(value(x)).map(|component| (255.0 * component).round() as u8);
            for y in 30..30 + BAR {
                image.set_pixel(x, y, colour);
            }
        }
        for tick in 0..TICKS {
            let x = left + tick * (right - left) / (TICKS - 1);
            let text = format!("{:.0}", value(x));
            image.label(x - label_width(&text, 2) / 2, 34 + BAR, &text, INK, 2);
        }
        image
    }
}

impl FitMap {
    /// The colours (sRGB) of the vertices of each garment.
    pub fn colours(&self, layer: Layer) -> Vec<Vec<[f32; 3]>> {
        let values = |garment: &crate::GarmentMap| match layer {
            Layer::Ease => garment.ease_mm.iter().map(|&value| layer.colour(value)).collect(),
            Layer::Strain => garment.strain_percent.iter().map(|&value| layer.colour(value)).collect(),
        };
        self.garments.iter().map(values).collect()
    }

    /// One frame from four sides in the colours of ease, below it in those of strain, each with its legend.
    ///
    /// # Errors
    /// Frames on disk that cannot be read.
    pub fn picture(&self, animation: &Animation, frame: usize) -> Result<Image, IoError> {
        let mut rows = Vec::new();
        for layer in Layer::ALL {
            let garments = self.colours(layer).into_iter().map(Paint::PerVertex);
            let paints: Vec<Paint> = std::iter::once(Paint::Solid(BODY)).chain(garments).collect();
            let tiles = animation.views(frame, &paints)?;
            let sheet = contact_sheet(&tiles, tiles.len());
            let legend = layer.legend(sheet.width);
            rows.extend([legend, sheet]);
        }
        let (width, height) = (rows[1].width, rows.iter().map(|row| row.height).sum());
        let mut image = Image::filled(width, height, [255; 3]);
        let mut top = 0;
        for row in &rows {
            image.paste(row, 0, top);
            top += row.height;
        }
        Ok(image)
    }
}

#[cfg(test)]
mod tests {
    use super::Layer;

    #[test]
    fn colours_go_from_stop_to_stop_and_stay_at_the_ends() {
        for layer in Layer::ALL {
            let scale = layer.scale();
            assert!(scale.windows(2).all(|pair| pair[0].0 < pair[1].0));
            for (value, colour) in scale {
                let close = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6);
                assert!(close(layer.colour(*value), *colour));
                assert!(close(layer.colour(-1e9), scale[0].1));
                assert!(close(layer.colour(1e9), scale[scale.len() - 1].1));
            }
        }
        let middle = Layer::Ease.colour(5.0);
        assert!((middle[0] - 0.82).abs() < 1e-6, "{middle:?}");
        let legend = Layer::Strain.legend(600);
        assert_ne!(legend.pixel(200, 40), legend.pixel(500, 40));
    }
}
