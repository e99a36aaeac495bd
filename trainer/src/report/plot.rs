//! Curves with axes and a legend, as SVG.

use std::error::Error;

use plotters::coord::CoordTranslate;
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use plotters::drawing::DrawingAreaErrorKind;
use plotters::prelude::*;

/// An axis of a plot.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Title with the unit.
    pub title: String,
    /// Scale of values along the axis.
    pub scale: Scale,
}

/// The scale of an axis.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Named categories in this order, the first one at 1; points are not joined by lines. For the x axis only.
    Categories(Vec<String>),
    /// A linear scale that contains 0.
    Linear,
    /// A logarithmic scale with ticks at powers of 2, for numbers of samples.
    Log2,
    /// A logarithmic scale with ticks at 1, 2 and 5 times powers of 10, for errors.
    Log10,
}

/// The marker and line style of a series.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Marker {
    /// A line through discs.
    Disc,
    /// A line through triangles.
    Triangle,
    /// A line through crosses.
    Cross,
    /// A dashed line through rings.
    Ring,
    /// Large discs without a line.
    LargeDisc,
}

/// Colors that remain distinct for color-blind readers (Okabe and Ito).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SeriesColor {
    /// Vermillion.
    Vermillion,
    /// Orange.
    Orange,
    /// Blue.
    Blue,
    /// Bluish green.
    Green,
    /// Reddish purple.
    Purple,
    /// Sky blue.
    Sky,
    /// Black.
    Black,
}

/// A series of points.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Color of markers and line.
    pub color: SeriesColor,
    /// Marker and line style.
    pub marker: Marker,
    /// Pairs of x and y. Points that are not finite, or not positive on a logarithmic scale, are left out.
    pub points: Vec<[f64; 2]>,
}

/// A plot of several series over common axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Plot {
    /// Title above the plot.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Series in the order of the legend.
    pub series: Vec<Series>,
}

/// An error of the plot library.
#[derive(Debug, thiserror::Error)]
#[error("cannot draw the plot \"{title}\": {reason}")]
pub struct PlotError {
    title: String,
    reason: String,
}

/// Width and height in pixels, without the legend and category names.
const SIZE: (u32, u32) = (700, 400);
/// Height of a legend line in pixels.
const LEGEND_LINE_HEIGHT: u32 = 24;
/// Width of a legend in pixels. A phone shows only the left part of a wide drawing.
const LEGEND_WIDTH: usize = 450;
/// Smallest width of a legend entry, width of a letter, and width of the marker with its margins, in pixels.
const LEGEND_ENTRY_WIDTH: usize = 150;
const LEGEND_LETTER_WIDTH: usize = 8;
const LEGEND_MARKER_WIDTH: usize = 30;
/// Width in pixels of a letter of a category name, and the maximum number of letters. Longer names are cut.
const LETTER_WIDTH: u32 = 6;
const MAX_NAME_LETTERS: usize = 28;
/// Maximum number of category labels on the axis. More would overlap.
const MAX_NAMES: usize = 45;
const FONT: &str = "sans-serif";

impl SeriesColor {
    fn rgb(self) -> RGBColor {
        match self {
            Self::Vermillion => RGBColor(213, 94, 0),
            Self::Orange => RGBColor(230, 159, 0),
            Self::Blue => RGBColor(0, 114, 178),
            Self::Green => RGBColor(0, 158, 115),
            Self::Purple => RGBColor(204, 121, 167),
            Self::Sky => RGBColor(86, 180, 233),
            Self::Black => BLACK,
        }
    }
}

impl Scale {
    /// Returns the coordinate of a value along the axis; None if it is not finite, or not positive on a logarithmic
    /// scale.
    fn coordinate(&self, value: f64) -> Option<f64> {
        let coordinate = match self {
            Self::Linear | Self::Categories(_) => value,
            Self::Log2 => value.log2(),
            Self::Log10 => value.log10(),
        };
        coordinate.is_finite().then_some(coordinate)
    }

    /// Returns the ends of an axis that shows all these coordinates.
    fn ends(&self, coordinates: impl Iterator<Item = f64> + Clone) -> [f64; 2] {
        if let Self::Categories(names) = self {
            return [0.5, names.len().max(1) as f64 + 0.5];
        }
        let low = coordinates.clone().reduce(f64::min).unwrap_or(0.0);
        let high = coordinates.reduce(f64::max).unwrap_or(1.0);
        match self {
            Self::Linear | Self::Categories(_) => [low.min(0.0), high.max(1e-9) * 1.05],
            // The margins make room for markers and keep the range from being empty.
            Self::Log2 => [low - 0.25, high + 0.25],
            Self::Log10 => [low - 0.05, high.max(low + 0.1) + 0.05],
        }
    }

    /// Returns the coordinates of the ticks between the ends.
    fn ticks(&self, [low, high]: [f64; 2]) -> Vec<f64> {
        let within = |tick: &f64| (low..=high).contains(tick);
        match self {
            Self::Categories(names) => {
                let step = names.len().div_ceil(MAX_NAMES).max(1);
                (1..=names.len())
                    .step_by(step)
                    .map(|number| number as f64)
                    .collect()
            }
            Self::Linear => {
                let rough = (high - low) / 6.0;
                let power = 10f64.powf(rough.log10().floor());
                let factor = [1.0, 2.0, 5.0, 10.0]
                    .into_iter()
                    .find(|factor| factor * power >= rough);
                let step = factor.unwrap_or(10.0) * power;
                (0..=12)
                    .map(|index| ((low / step).ceil() + f64::from(index)) * step)
                    .filter(within)
                    .collect()
            }
            Self::Log2 => (-4..40).map(f64::from).filter(within).collect(),
            Self::Log10 => (-12..12)
                .flat_map(|power| {
                    [1.0, 2.0, 5.0].map(|factor: f64| factor.log10() + f64::from(power))
                })
                .filter(within)
                .collect(),
        }
    }

    /// Returns the label of a tick.
    fn label(&self, tick: f64) -> String {
        let value = match self {
            Self::Categories(names) => {
                let index = (tick.round() as usize).saturating_sub(1);
                let name = names.get(index).map_or("", String::as_str);
                return name.chars().take(MAX_NAME_LETTERS).collect();
            }
            Self::Linear => tick,
            Self::Log2 => tick.exp2(),
            Self::Log10 => 10f64.powf(tick),
        };
        // Remove trailing zeros.
        let text = format!("{value:.6}");
        match text.contains('.') {
            true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
            false => text,
        }
    }
}

/// The range of an axis with its ticks, for plotters.
struct TickedRange {
    ends: [f64; 2],
    ticks: Vec<f64>,
}

impl Ranged for TickedRange {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (from, to): (i32, i32)) -> i32 {
        let [low, high] = self.ends;
        let fraction = (value - low) / (high - low);
        from + (fraction * f64::from(to - from)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.ticks.clone()
    }

    fn range(&self) -> std::ops::Range<f64> {
        self.ends[0]..self.ends[1]
    }
}

impl Plot {
    /// Draws the plot as SVG on white, with the class `on-white`, so that a page can invert it in dark mode.
    ///
    /// # Errors
    /// If the plot library fails. Drawing to memory is not expected to fail.
    pub fn to_svg(&self) -> Result<String, PlotError> {
        let mut svg = String::new();
        self.draw(&mut svg).map_err(|error| PlotError {
            title: self.title.clone(),
            reason: error.to_string(),
        })?;
        Ok(svg.replacen("<svg ", "<svg class=\"on-white\" ", 1))
    }

    /// Returns the coordinates of the points of a series.
    fn points(&self, series: &Series) -> Vec<(f64, f64)> {
        let coordinates =
            |[x, y]: &[f64; 2]| Some((self.x.scale.coordinate(*x)?, self.y.scale.coordinate(*y)?));
        series.points.iter().filter_map(coordinates).collect()
    }

    fn draw(&self, svg: &mut String) -> Result<(), Box<dyn Error + '_>> {
        let max_letters = match &self.x.scale {
            Scale::Categories(names) => names.iter().map(|name| name.chars().count()).max(),
            _ => None,
        };
        let names_height = max_letters.map_or(0, |letters| {
            letters.min(MAX_NAME_LETTERS) as u32 * LETTER_WIDTH
        });
        let longest = self
            .series
            .iter()
            .map(|series| series.name.chars().count())
            .max();
        let entry_width = LEGEND_MARKER_WIDTH + LEGEND_LETTER_WIDTH * longest.unwrap_or_default();
        let entry_width = entry_width.max(LEGEND_ENTRY_WIDTH);
        let columns = (LEGEND_WIDTH / entry_width).max(1);
        let legend_height = LEGEND_LINE_HEIGHT * (self.series.len().div_ceil(columns) as u32) + 8;
        let size = (SIZE.0, SIZE.1 + names_height + legend_height);
        let root = SVGBackend::with_string(svg, size).into_drawing_area();
        root.fill(&WHITE)?;
        let (chart_area, legend_area) = root.split_vertically(SIZE.1 + names_height);
        let points: Vec<_> = self
            .series
            .iter()
            .map(|series| self.points(series))
            .collect();
        let all_points = || points.iter().flatten().copied();
        let ticked_range = |scale: &Scale, ends: [f64; 2]| TickedRange {
            ends,
            ticks: scale.ticks(ends),
        };
        let x_range = ticked_range(
            &self.x.scale,
            self.x.scale.ends(all_points().map(|(x, _)| x)),
        );
        let y_range = ticked_range(
            &self.y.scale,
            self.y.scale.ends(all_points().map(|(_, y)| y)),
        );
        let mut labels = TextStyle::from((FONT, 13).into_font());
        if names_height > 0 {
            // Long names do not fit side by side.
            labels = labels.transform(FontTransform::Rotate90);
        }
        let mut chart = ChartBuilder::on(&chart_area)
            .caption(&self.title, (FONT, 18))
            .margin(10)
            .x_label_area_size(44 + names_height)
            .y_label_area_size(66)
            .build_cartesian_2d(x_range, y_range)?;
        chart
            .configure_mesh()
            .light_line_style(WHITE)
            .bold_line_style(RGBColor(225, 225, 222))
            .x_desc(&self.x.title)
            .y_desc(&self.y.title)
            .axis_desc_style((FONT, 15))
            .x_labels(MAX_NAMES)
            .x_label_style(labels)
            .y_label_style((FONT, 13))
            .x_label_formatter(&|tick| self.x.scale.label(*tick))
            .y_label_formatter(&|tick| self.y.scale.label(*tick))
            .draw()?;
        // The legend is below the axes, where it does not cover any curve.
        for ((series, points), entry) in self.series.iter().zip(points).zip(0..) {
            let color = series.color.rgb();
            let line = color.stroke_width(2);
            match series.marker {
                Marker::LargeDisc => {}
                // Categories are discrete, so their points are not joined.
                _ if names_height > 0 => {}
                Marker::Ring => {
                    chart.draw_series(DashedLineSeries::new(points.clone(), 6, 4, line))?;
                }
                _ => {
                    chart.draw_series(LineSeries::new(points.clone(), line))?;
                }
            }
            for point in points {
                draw_marker(chart.plotting_area(), series.marker, point, color)?;
            }
            let [row, column] = [entry / columns, entry % columns];
            let x = 20 + (entry_width * column) as i32;
            let y = LEGEND_LINE_HEIGHT as i32 * row as i32 + 10;
            draw_marker(&legend_area, series.marker, (x, y), color)?;
            legend_area.draw(&Text::new(series.name.clone(), (x + 14, y - 7), (FONT, 15)))?;
        }
        root.present()?;
        Ok(())
    }
}

/// Draws the marker of a point or of a legend entry.
fn draw_marker<DB: DrawingBackend, C: CoordTranslate>(
    area: &DrawingArea<DB, C>,
    marker: Marker,
    center: C::From,
    color: RGBColor,
) -> Result<(), DrawingAreaErrorKind<DB::ErrorType>> {
    let (filled, line) = (color.filled(), color.stroke_width(2));
    match marker {
        Marker::Disc => area.draw(&Circle::new(center, 4, filled)),
        Marker::LargeDisc => area.draw(&Circle::new(center, 7, filled)),
        Marker::Ring => area.draw(&Circle::new(center, 4, line)),
        Marker::Triangle => area.draw(&TriangleMarker::new(center, 5, filled)),
        Marker::Cross => area.draw(&Cross::new(center, 4, line)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(points: Vec<[f64; 2]>) -> Plot {
        Plot {
            title: "Loss & samples".into(),
            x: Axis {
                title: "samples n".into(),
                scale: Scale::Log2,
            },
            y: Axis {
                title: "Loss".into(),
                scale: Scale::Log10,
            },
            series: vec![Series {
                name: "Ours".into(),
                color: SeriesColor::Blue,
                marker: Marker::Disc,
                points,
            }],
        }
    }

    #[test]
    fn labels_axes_ticks_and_series() {
        let svg = plot(vec![[1.0, 0.1], [8.0, 0.02], [64.0, 0.01]])
            .to_svg()
            .unwrap();
        for text in [
            "Loss &amp; samples",
            "samples n",
            "Ours",
            "\n64\n",
            "\n0.05\n",
        ] {
            assert!(svg.contains(text), "no {text:?} in {svg}");
        }
        assert_eq!(
            svg.matches("<circle").count(),
            3 + 1,
            "three points and one legend entry"
        );
    }

    #[test]
    fn categories_are_labeled_and_not_joined() {
        let mut plot = plot(vec![[1.0, 0.1], [2.0, 0.02], [3.0, 0.01]]);
        assert!(plot.to_svg().unwrap().contains("<polyline"));
        let names = ["gold-paint", "felt", "steel"].map(str::to_owned);
        plot.x.scale = Scale::Categories(names.to_vec());
        let svg = plot.to_svg().unwrap();
        for name in names {
            assert!(svg.contains(&format!("\n{name}\n")), "no {name} in {svg}");
        }
        assert_eq!(svg.matches("<circle").count(), 3 + 1);
        let blue = "stroke=\"#0072B2\"";
        let lines = svg.split("<polyline").skip(1);
        assert!(
            !lines
                .into_iter()
                .any(|line| line.split('>').next().unwrap().contains(blue))
        );
        // A page inverts this class in dark mode.
        assert!(svg.starts_with("<svg class=\"on-white\""));
    }

    #[test]
    fn skips_points_without_coordinates() {
        let points = vec![[1.0, 0.0], [2.0, f64::NAN], [0.0, 1.0], [4.0, 0.5]];
        let svg = plot(points).to_svg().unwrap();
        assert_eq!(svg.matches("<circle").count(), 1 + 1);
        assert!(plot(Vec::new()).to_svg().is_ok());
    }

    #[test]
    fn ticks_are_round_numbers() {
        let labels = |scale: Scale, ends| -> Vec<String> {
            scale
                .ticks(ends)
                .into_iter()
                .map(|tick| scale.label(tick))
                .collect()
        };
        assert_eq!(labels(Scale::Linear, [0.0, 16.0]), ["0", "5", "10", "15"]);
        assert_eq!(
            labels(Scale::Log10, [-2.0, -0.9]),
            ["0.01", "0.02", "0.05", "0.1"]
        );
        assert_eq!(labels(Scale::Log2, [-0.25, 2.25]), ["1", "2", "4"]);
    }
}
