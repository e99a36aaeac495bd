//! Curves with axes and a legend, as SVG.

use maud::{Markup, html};

use super::svg::{COLORS, drawing, one_decimal, path_of};

/// The scale of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scale {
    /// A linear scale from the smallest to the largest value.
    Linear,
    /// A logarithmic scale with ticks at powers of 2, for numbers of samples.
    Log2,
    /// A logarithmic scale with ticks at 1, 2 and 5 times powers of 10, for errors.
    Log10,
}

/// A series of points.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Series {
    /// Name in the legend.
    pub(crate) name: String,
    /// Index of the color and marker, which repeat.
    pub(crate) color: usize,
    /// True for a dashed line through rings.
    pub(crate) is_dashed: bool,
    /// Pairs of x and y. Points that are not finite, or not positive on a logarithmic scale, are left out.
    pub(crate) points: Vec<[f64; 2]>,
}

/// A plot of several series over common axes, the vertical one with a logarithmic scale. Titles of axes have the unit.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Plot {
    /// Title above the plot.
    pub(crate) title: String,
    /// Title and scale of the horizontal axis.
    pub(crate) x: (String, Scale),
    /// Title of the vertical axis.
    pub(crate) y: String,
    /// Series in the order of the legend.
    pub(crate) series: Vec<Series>,
}

/// Left, top, right and bottom end of the axes, in SVG units.
const LEFT: f32 = 76.0;
const TOP: f32 = 42.0;
const RIGHT: f32 = 688.0;
const BOTTOM: f32 = 342.0;
/// Width of a drawing, in SVG units.
const WIDTH: f32 = 700.0;
/// Height of a legend line, each with the name of a series.
const LEGEND_LINE_HEIGHT: f32 = 24.0;

impl Scale {
    /// Returns the coordinate of a value along the axis; None if it is not finite, or not positive on a logarithmic
    /// scale.
    fn coordinate(self, value: f64) -> Option<f64> {
        let coordinate = match self {
            Self::Linear => value,
            Self::Log2 => value.log2(),
            Self::Log10 => value.log10(),
        };
        coordinate.is_finite().then_some(coordinate)
    }

    /// Returns the ends of an axis that shows all these coordinates.
    fn ends(self, coordinates: impl Iterator<Item = f64> + Clone) -> [f64; 2] {
        let low = coordinates.clone().reduce(f64::min).unwrap_or(0.0);
        let high = coordinates.reduce(f64::max).unwrap_or(1.0);
        match self {
            Self::Linear => [low, high.max(low + 1e-9)],
            // The margins make room for markers and keep the range from being empty.
            Self::Log2 => [low - 0.25, high + 0.25],
            Self::Log10 => [low - 0.05, high.max(low + 0.1) + 0.05],
        }
    }

    /// Returns the coordinates of the ticks between the ends.
    fn ticks(self, [low, high]: [f64; 2]) -> Vec<f64> {
        let within = |tick: &f64| (low..=high).contains(tick);
        match self {
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
    fn label(self, tick: f64) -> String {
        let value = match self {
            Self::Linear => tick,
            Self::Log2 => tick.exp2(),
            Self::Log10 => 10f64.powf(tick),
        };
        // Rounding removes errors of the exponentials.
        ((value * 1e6).round() / 1e6).to_string()
    }
}

/// An axis on the drawing: its scale, its ends in coordinates, and their positions.
struct Range {
    scale: Scale,
    ends: [f64; 2],
    positions: [f32; 2],
}

impl Range {
    fn new(scale: Scale, points: impl Iterator<Item = f64> + Clone, positions: [f32; 2]) -> Self {
        Self {
            scale,
            ends: scale.ends(points),
            positions,
        }
    }

    /// Returns the position of a coordinate on the drawing.
    fn position(&self, coordinate: f64) -> f32 {
        let [low, high] = self.ends;
        let [from, to] = self.positions;
        from + ((coordinate - low) / (high - low)) as f32 * (to - from)
    }

    /// Returns the positions of the ticks, with their labels.
    fn ticks(&self) -> impl Iterator<Item = (f32, String)> {
        let ticks = self.scale.ticks(self.ends).into_iter();
        ticks.map(|tick| (self.position(tick), self.scale.label(tick)))
    }
}

impl Plot {
    /// The scale of the vertical axis.
    const Y: Scale = Scale::Log10;

    /// Draws the plot as an SVG, for a file or for embedding in a page.
    pub(crate) fn to_svg(&self) -> String {
        let points: Vec<Vec<[f64; 2]>> = self.series.iter().map(|one| self.points(one)).collect();
        let axis = |index: usize| points.iter().flatten().map(move |point| point[index]);
        let x = Range::new(self.x.1, axis(0), [LEFT, RIGHT]);
        let y = Range::new(Self::Y, axis(1), [BOTTOM, TOP]);
        // The legend is below the axes, where it does not cover any curve.
        let baselines = (0..).map(|line: u16| BOTTOM + 66.0 + LEGEND_LINE_HEIGHT * f32::from(line));
        let marks = html! {
            text.title.mid x=(WIDTH / 2.0) y="26" { (self.title) }
            (self.axes(&x, &y))
            text.mid x=((LEFT + RIGHT) / 2.0) y=(BOTTOM + 40.0) { (self.x.0) }
            @for ((series, points), baseline) in self.series.iter().zip(&points).zip(baselines) {
                @let at: Vec<[f32; 2]> =
                    points.iter().map(|[a, b]| [x.position(*a), y.position(*b)]).collect();
                g class={ "c" (series.color % COLORS) } {
                    path.line.dash[series.is_dashed] d=(path_of(&at)) {}
                    @for point in at.iter().chain([&[LEFT, baseline - 5.0]]) { (series.marker(*point)) }
                }
                text x=(LEFT + 14.0) y=(baseline) { (series.name) }
            }
        };
        let height = BOTTOM + 66.0 + LEGEND_LINE_HEIGHT * self.series.len() as f32;
        drawing([WIDTH, height], &self.title, &marks)
    }

    /// Draws both axes with ticks and labels, and the title of the vertical one.
    fn axes(&self, x: &Range, y: &Range) -> Markup {
        let middle = (TOP + BOTTOM) / 2.0;
        html! {
            @for (at, label) in x.ticks() {
                path.grid d=(format!("M{at:.1} {TOP}V{BOTTOM}")) {}
                text.dim.mid x=(one_decimal(at)) y=(BOTTOM + 18.0) { (label) }
            }
            @for (at, label) in y.ticks() {
                path.grid d=(format!("M{LEFT} {at:.1}H{RIGHT}")) {}
                text.dim.end x=(LEFT - 7.0) y=(one_decimal(at + 4.0)) { (label) }
            }
            path.axis d=(format!("M{LEFT} {TOP}V{BOTTOM}H{RIGHT}")) {}
            text.mid x="20" y=(middle) transform=(format!("rotate(-90 20 {middle})")) { (self.y) }
        }
    }

    /// Returns the coordinates of the points of a series.
    fn points(&self, series: &Series) -> Vec<[f64; 2]> {
        let coordinates =
            |[x, y]: &[f64; 2]| Some([self.x.1.coordinate(*x)?, Self::Y.coordinate(*y)?]);
        series.points.iter().filter_map(coordinates).collect()
    }
}

impl Series {
    /// Draws the marker of a point or of the legend.
    fn marker(&self, [x, y]: [f32; 2]) -> Markup {
        let [left, top] = [x - 4.0, y - 4.0].map(one_decimal);
        html! {
            @match (self.is_dashed, self.color % 3) {
                (true, _) => circle.line cx=(one_decimal(x)) cy=(one_decimal(y)) r="4" {},
                (_, 0) => circle.mark cx=(one_decimal(x)) cy=(one_decimal(y)) r="4" {},
                (_, 1) => path.mark d=(format!("M{x:.1} {top}l5 9h-10z")) {},
                _ => path.line d=(format!("M{left} {top}l8 8m0 -8l-8 8")) {},
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn skips_points_without_coordinates() {
        let svg = |points: Vec<[f64; 2]>| {
            let series = Series {
                name: "c".into(),
                color: 0,
                is_dashed: false,
                points,
            };
            let plot = Plot {
                title: "d".into(),
                x: ("a & b".into(), Scale::Log2),
                y: "a & b".into(),
                series: vec![series],
            };
            plot.to_svg()
        };
        let points = vec![[1.0, 0.0], [2.0, f64::NAN], [0.0, 1.0], [4.0, 0.5]];
        assert_eq!(svg(points).matches("<circle").count(), 1 + 1);
        assert!(!svg(Vec::new()).contains("NaN"));
    }
}
