//! Filling of triangles.

use super::camera::Projected;
use super::canvas::pack;

/// A vertex ready to be drawn: its place on the picture and its colour from both sides (sRGB, 0–255).
#[derive(Debug, Clone, Copy)]
pub(super) struct Corner {
    pub at: Projected,
    pub front: [f32; 3],
    pub back: [f32; 3],
}

/// Some rows of samples of a canvas.
#[derive(Debug)]
pub(super) struct Band<'a> {
    pub first_row: usize,
    pub columns: usize,
    pub colour: &'a mut [u32],
    pub nearness: &'a mut [f32],
}

impl Band<'_> {
    /// Fills one triangle where it is nearer than what is there.
    pub(super) fn fill(&mut self, corners: [&Corner; 3]) {
        let [a, b, c] = corners.map(|corner| corner.at);
        let area = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
        if area == 0.0 || !area.is_finite() {
            return;
        }
        // Rows run downwards, so a face that is counter-clockwise in space has a negative area here.
        let colours = corners.map(|corner| if area < 0.0 { corner.front } else { corner.back });
        let rows = self.colour.len() / self.columns;
        let first = self.first_row as f32;
        let y_range = sample_range([a.y - first, b.y - first, c.y - first], rows);
        let x_range = sample_range([a.x, b.x, c.x], self.columns);
        let inverse = 1.0 / area;
        // Weight of corner i at a sample: start + dx * column + dy * row, measured from corner a.
        let step_b = [(c.y - a.y) * inverse, -(c.x - a.x) * inverse];
        let step_c = [-(b.y - a.y) * inverse, (b.x - a.x) * inverse];
        for row in y_range {
            let dy = row as f32 + 0.5 + first - a.y;
            for column in x_range.clone() {
                let dx = column as f32 + 0.5 - a.x;
                let at_b = step_b[0] * dx + step_b[1] * dy;
                let at_c = step_c[0] * dx + step_c[1] * dy;
                let at_a = 1.0 - at_b - at_c;
                if at_a < 0.0 || at_b < 0.0 || at_c < 0.0 {
                    continue;
                }
                let nearness = at_a * a.nearness + at_b * b.nearness + at_c * c.nearness;
                let index = row * self.columns + column;
                if nearness <= self.nearness[index] {
                    continue;
                }
                self.nearness[index] = nearness;
                let weights = [at_a * a.weight, at_b * b.weight, at_c * c.weight];
                let total = 1.0 / (weights[0] + weights[1] + weights[2]);
                let mut colour = [0.0f32; 3];
                for channel in 0..3 {
                    let sum = weights[0] * colours[0][channel]
                        + weights[1] * colours[1][channel]
                        + weights[2] * colours[2][channel];
                    colour[channel] = sum * total;
                }
                self.colour[index] = pack(colour);
            }
        }
    }
}

/// Indices of the samples (at half-integers) between the smallest and the largest value, within `0..count`.
fn sample_range(values: [f32; 3], count: usize) -> std::ops::Range<usize> {
    let low = values[0].min(values[1]).min(values[2]);
    let high = values[0].max(values[1]).max(values[2]);
    let first = (low - 0.5).ceil().max(0.0) as usize;
    let end = ((high - 0.5).floor() + 1.0).clamp(0.0, count as f32) as usize;
    first..end.max(first)
}
