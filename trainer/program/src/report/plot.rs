//! Curves with axes and a legend, as SVG.

use maud::{Markup, html};

use super::svg::{drawing, one_decimal, path_of};

/// An axis of a plot.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Title with the unit.
    pub title: String,
    /// Scale of values along the axis.
    pub scale: Scale,
}

/// The scale of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// A linear scale that contains 0.
    Linear,
    /// A linear scale from the smallest to the largest value.
    Interval,
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

/// The color of a series.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SeriesColor {
    /// Blue.
    Blue,
    /// Vermillion.
    Vermillion,
    /// Bluish green.
    Green,
    /// Reddish purple.
    Purple,
    /// Sky blue.
    Sky,
    /// Orange.
    Orange,
    /// The color of text.
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

/// Left, top, right and bottom end of the axes, in SVG units.
const LEFT: f32 = 76.0;
const TOP: f32 = 42.0;
const RIGHT: f32 = 688.0;
const BOTTOM: f32 = 342.0;
/// Width of a drawing, in SVG units.
const WIDTH: f32 = 700.0;
/// Height of a legend line.
const LEGEND_LINE_HEIGHT: f32 = 24.0;
/// Width of a legend. A phone shows only the left part of a wide drawing.
const LEGEND_WIDTH: usize = 450;
/// Smallest width of a legend entry, width of a letter, and width of the marker with its margins.
const LEGEND_ENTRY_WIDTH: usize = 150;
const LEGEND_LETTER_WIDTH: usize = 8;
const LEGEND_MARKER_WIDTH: usize = 30;
const SHAPES: &str = ".plot .title{font-size:17px}.plot .mark{fill:currentColor}\
                      .plot .line{fill:none;stroke:currentColor;stroke-width:2}\
                      .plot .dash{stroke-dasharray:6 4}";

impl Scale {
    /// Returns the coordinate of a value along the axis; None if it is not finite, or not positive on a logarithmic
    /// scale.
    fn coordinate(&self, value: f64) -> Option<f64> {
        let coordinate = match self {
            Self::Linear | Self::Interval => value,
            Self::Log2 => value.log2(),
            Self::Log10 => value.log10(),
        };
        coordinate.is_finite().then_some(coordinate)
    }

    /// Returns the ends of an axis that shows all these coordinates.
    fn ends(&self, coordinates: impl Iterator<Item = f64> + Clone) -> [f64; 2] {
        let low = coordinates.clone().reduce(f64::min).unwrap_or(0.0);
        let high = coordinates.reduce(f64::max).unwrap_or(1.0);
        match self {
            Self::Linear => [low.min(0.0), high.max(1e-9) * 1.05],
            Self::Interval => [low, high.max(low + 1e-9)],
            // The margins make room for markers and keep the range from being empty.
            Self::Log2 => [low - 0.25, high + 0.25],
            Self::Log10 => [low - 0.05, high.max(low + 0.1) + 0.05],
        }
    }

    /// Returns the coordinates of the ticks between the ends.
    fn ticks(&self, [low, high]: [f64; 2]) -> Vec<f64> {
        let within = |tick: &f64| (low..=high).contains(tick);
        match self {
            Self::Linear | Self::Interval => {
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
            Self::Linear | Self::Interval => tick,
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

/// The range of an axis: its ends in coordinates and on the drawing, and its ticks.
struct Range {
    ends: [f64; 2],
    from: f32,
    to: f32,
    ticks: Vec<f64>,
}

impl Range {
    fn new(
        scale: &Scale,
        coordinates: impl Iterator<Item = f64> + Clone,
        [from, to]: [f32; 2],
    ) -> Self {
        let ends = scale.ends(coordinates);
        let ticks = scale.ticks(ends);
        Self {
            ends,
            from,
            to,
            ticks,
        }
    }

    /// Returns the position of a coordinate on the drawing.
    fn position(&self, coordinate: f64) -> f32 {
        let [low, high] = self.ends;
        self.from + ((coordinate - low) / (high - low)) as f32 * (self.to - self.from)
    }
}

impl Plot {
    /// Draws the plot as an SVG, for a file or for embedding in a page.
    #[must_use]
    pub fn to_svg(&self) -> String {
        let points: Vec<Vec<[f64; 2]>> = self.series.iter().map(|one| self.points(one)).collect();
        let axis = |index: usize| points.iter().flatten().map(move |point| point[index]);
        let x = Range::new(&self.x.scale, axis(0), [LEFT, RIGHT]);
        let y = Range::new(&self.y.scale, axis(1), [BOTTOM, TOP]);
        let names = self.series.iter().map(|series| series.name.chars().count());
        let entry_width =
            LEGEND_MARKER_WIDTH + LEGEND_LETTER_WIDTH * names.max().unwrap_or_default();
        let entry_width = entry_width.max(LEGEND_ENTRY_WIDTH);
        let columns = (LEGEND_WIDTH / entry_width).max(1);
        // The legend is below the axes, where it does not cover any curve.
        let legend_top = BOTTOM + 66.0;
        let entry_at = |index: usize| {
            let [row, column] = [index / columns, index % columns];
            [
                20.0 + (entry_width * column) as f32,
                legend_top + LEGEND_LINE_HEIGHT * row as f32,
            ]
        };
        let marks = html! {
            text.title.mid x=(WIDTH / 2.0) y="26" { (self.title) }
            (self.axes(&x, &y))
            text.mid x=((LEFT + RIGHT) / 2.0) y=(BOTTOM + 40.0) { (self.x.title) }
            @for (index, (series, points)) in self.series.iter().zip(&points).enumerate() {
                @let at: Vec<[f32; 2]> =
                    points.iter().map(|[a, b]| [x.position(*a), y.position(*b)]).collect();
                @let [legend_x, legend_y] = entry_at(index);
                g class={ "c" (series.color as usize) } {
                    @if series.marker != Marker::LargeDisc && at.len() > 1 {
                        path.line.dash[series.marker == Marker::Ring] d=(path_of(&at)) {}
                    }
                    @for point in &at { (series.marker.at(*point)) }
                    (series.marker.at([legend_x, legend_y]))
                }
                text x=(legend_x + 14.0) y=(legend_y + 5.0) { (series.name) }
            }
        };
        let lines = self.series.len().div_ceil(columns) as f32;
        let height = legend_top + LEGEND_LINE_HEIGHT * lines;
        drawing([WIDTH, height], &self.title, &[], SHAPES, &marks)
    }

    /// Draws both axes with ticks and labels, and the title of the vertical one.
    fn axes(&self, x: &Range, y: &Range) -> Markup {
        let middle = (TOP + BOTTOM) / 2.0;
        html! {
            @for tick in &x.ticks {
                @let at = one_decimal(x.position(*tick));
                path.grid d=(format!("M{at} {TOP}V{BOTTOM}")) {}
                text.dim.mid x=(at) y=(BOTTOM + 18.0) { (self.x.scale.label(*tick)) }
            }
            @for tick in &y.ticks {
                @let at = y.position(*tick);
                path.grid d=(format!("M{LEFT} {at:.1}H{RIGHT}")) {}
                text.dim.end x=(LEFT - 7.0) y=(one_decimal(at + 4.0)) { (self.y.scale.label(*tick)) }
            }
            path.axis d=(format!("M{LEFT} {TOP}V{BOTTOM}H{RIGHT}")) {}
            text.mid x="20" y=(middle) transform=(format!("rotate(-90 20 {middle})")) { (self.y.title) }
        }
    }

    /// Returns the coordinates of the points of a series.
    fn points(&self, series: &Series) -> Vec<[f64; 2]> {
        let coordinates =
            |[x, y]: &[f64; 2]| Some([self.x.scale.coordinate(*x)?, self.y.scale.coordinate(*y)?]);
        series.points.iter().filter_map(coordinates).collect()
    }
}

impl Marker {
    /// Draws the marker of a point or of a legend entry.
    fn at(self, [x, y]: [f32; 2]) -> Markup {
        let [at_x, at_y] = [x, y].map(one_decimal);
        html! {
            @match self {
                Self::Disc => circle.mark cx=(at_x) cy=(at_y) r="4" {},
                Self::LargeDisc => circle.mark cx=(at_x) cy=(at_y) r="7" {},
                Self::Ring => circle.line cx=(at_x) cy=(at_y) r="4" {},
                Self::Triangle => path.mark d=(format!("M{at_x} {:.1}l5 9h-10z", y - 5.0)) {},
                Self::Cross => path.line d=(format!("M{:.1} {:.1}l8 8m0 -8l-8 8", x - 4.0, y - 4.0)) {},
            }
        }
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
                name: "Glimpse".into(),
                color: SeriesColor::Blue,
                marker: Marker::Disc,
                points,
            }],
        }
    }

    #[test]
    fn skips_points_without_coordinates() {
        let points = vec![[1.0, 0.0], [2.0, f64::NAN], [0.0, 1.0], [4.0, 0.5]];
        let svg = plot(points).to_svg();
        assert_eq!(svg.matches("<circle").count(), 1 + 1);
        assert!(!plot(Vec::new()).to_svg().contains("NaN"));
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
