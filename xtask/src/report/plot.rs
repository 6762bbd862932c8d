//! Plots as SVG.

use anyhow::{Result, anyhow, ensure};
use plotters::prelude::*;

/// A named run of points.
#[derive(Debug, Clone)]
pub(crate) struct Series {
    pub(crate) name: String,
    pub(crate) points: Vec<(f64, f64)>,
}

impl Series {
    /// A series with this name.
    pub(crate) fn new(name: impl Into<String>, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.into(), points }
    }
}

const SIZE: (u32, u32) = (720, 420);
const COLOURS: [RGBColor; 6] = [
    RGBColor(31, 94, 152),
    RGBColor(196, 78, 52),
    RGBColor(62, 132, 84),
    RGBColor(128, 84, 150),
    RGBColor(180, 140, 40),
    RGBColor(90, 90, 90),
];

/// Lines over a common axis, with an optional dashed line at a target. The vertical axis starts at zero.
pub(crate) fn lines(labels: [&str; 2], series: &[Series], target: Option<f64>) -> Result<String> {
    draw(labels, series, target, Mark::Line)
}

/// Points, with an optional dashed line at a target.
pub(crate) fn points(labels: [&str; 2], series: &[Series], target: Option<f64>) -> Result<String> {
    draw(labels, series, target, Mark::Point)
}

#[derive(Clone, Copy, PartialEq)]
enum Mark {
    Line,
    Point,
}

fn draw(labels: [&str; 2], series: &[Series], target: Option<f64>, mark: Mark) -> Result<String> {
    let mut svg = String::new();
    draw_into(&mut svg, labels, series, target, mark)?;
    Ok(svg)
}

fn draw_into(svg: &mut String, labels: [&str; 2], series: &[Series], target: Option<f64>, mark: Mark) -> Result<()> {
    let all =
        || series.iter().flat_map(|series| &series.points).filter(|point| point.0.is_finite() && point.1.is_finite());
    ensure!(all().next().is_some(), "there is nothing to plot");
    let span = |values: &mut dyn Iterator<Item = f64>| {
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
    };
    let (left, right) = span(&mut all().map(|point| point.0));
    let (low, high) = span(&mut all().map(|point| point.1).chain(target));
    let room = 0.08 * (high - low.min(0.0)).max(1e-12);
    let bottom = if low < 0.0 { low - room } else { 0.0 };
    let failed = |error: &dyn std::fmt::Display| anyhow!("cannot draw a plot: {error}");
    let area = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    area.fill(&WHITE).map_err(|error| failed(&error))?;
    let mut chart = ChartBuilder::on(&area)
        .margin(14)
        .x_label_area_size(42)
        .y_label_area_size(58)
        .build_cartesian_2d(left..right.max(left + 1e-9), bottom..high + room)
        .map_err(|error| failed(&error))?;
    chart
        .configure_mesh()
        .light_line_style(WHITE.mix(0.0))
        .bold_line_style(BLACK.mix(0.1))
        .x_desc(labels[0])
        .y_desc(labels[1])
        .label_style(("sans-serif", 14))
        .draw()
        .map_err(|error| failed(&error))?;
    if let Some(target) = target {
        let dashes = DashedLineSeries::new([(left, target), (right, target)], 6, 4, BLACK.mix(0.6).stroke_width(1));
        chart.draw_series(dashes).map_err(|error| failed(&error))?;
    }
    for (series, colour) in series.iter().zip(COLOURS.iter().cycle()) {
        let style = colour.stroke_width(2);
        let points = series.points.iter().copied();
        let drawn = match mark {
            Mark::Line => chart.draw_series(LineSeries::new(points, style)),
            Mark::Point => chart.draw_series(points.map(|point| Circle::new(point, 3, colour.mix(0.6).filled()))),
        };
        let annotation = drawn.map_err(|error| failed(&error))?;
        annotation.label(&series.name).legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], style));
    }
    if series.len() > 1 {
        chart
            .configure_series_labels()
            .background_style(WHITE.mix(0.85))
            .label_font(("sans-serif", 14))
            .position(SeriesLabelPosition::UpperRight)
            .draw()
            .map_err(|error| failed(&error))?;
    }
    area.present().map_err(|error| failed(&error))
}

#[cfg(test)]
mod tests {
    use super::{Series, lines};

    #[test]
    fn a_plot_is_svg_with_its_words_and_curves() {
        let series =
            [Series::new("first", vec![(0.0, 1.0), (1.0, 2.0)]), Series::new("second", vec![(0.0, 2.0), (1.0, 3.0)])];
        let svg = lines(["coefficients", "error (mm)"], &series, Some(1.5)).unwrap();
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
        for word in ["coefficients", "error (mm)", "first", "second"] {
            assert!(svg.contains(word), "{word}");
        }
        assert!(svg.matches("<polyline").count() >= 2);
        assert!(lines(["a", "b"], &[], None).is_err());
    }
}
