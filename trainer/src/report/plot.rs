//! Curves with axes and a legend, as SVG.

use std::error::Error;

use plotters::coord::CoordTranslate;
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use plotters::drawing::DrawingAreaErrorKind;
use plotters::prelude::*;

/// An axis: its title with the unit, and whether equal steps are equal factors.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// The title.
    pub title: String,
    /// What equal steps mean.
    pub scale: Scale,
}

/// What equal steps along an axis mean.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Things of these names, in this order, the first one at 1; no lines join them. (Across only.)
    Names(Vec<String>),
    /// Equal differences, from 0 on.
    Linear,
    /// Equal factors, with ticks at powers of 2: numbers of samples.
    Doublings,
    /// Equal factors, with ticks at 1, 2 and 5 times powers of 10: errors.
    Decades,
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// A line through discs.
    Discs,
    /// A line through triangles.
    Triangles,
    /// A line through crosses.
    Crosses,
    /// A dashed line through rings.
    Rings,
    /// Large discs alone.
    Dots,
}

/// Colors that the color-blind can tell apart (Okabe and Ito), each with a meaning of its own in
/// all plots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hue {
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

/// Points of one meaning.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// The name in the legend.
    pub name: String,
    /// The color.
    pub hue: Hue,
    /// The way it is drawn.
    pub mark: Mark,
    /// x and y; points that the axes cannot show (not finite, or not positive on a scale of
    /// factors) are left out.
    pub points: Vec<[f64; 2]>,
}

/// A drawing of several series over common axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Plot {
    /// What it shows, above it.
    pub title: String,
    /// Across.
    pub x: Axis,
    /// Up.
    pub y: Axis,
    /// What is drawn, in the order of the legend.
    pub series: Vec<Series>,
}

/// A plot cannot be drawn.
#[derive(Debug, thiserror::Error)]
#[error("cannot draw the plot \"{title}\": {reason}")]
pub struct PlotError {
    title: String,
    reason: String,
}

/// Pixels without legend and names.
const SIZE: (u32, u32) = (700, 400);
/// A line of the legend, and how many entries it has: so many that the first ones are seen on a
/// phone, where the right of a drawing is out of sight.
const LEGEND_LINE: u32 = 24;
const LEGEND_ENTRIES: usize = 3;
/// Pixels of an entry, whose names are "NJR15" or "Ours, diffuse".
const LEGEND_ENTRY: i32 = 150;
/// Pixels of a letter of names at the axis, and the most that are shown of a name.
const LETTER: u32 = 6;
const MOST_LETTERS: usize = 28;
/// The most names: more would lie on one another.
const MOST_NAMES: usize = 45;
const FONT: &str = "sans-serif";

impl Hue {
    fn color(self) -> RGBColor {
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
    /// Where a value lies along the axis; None if nowhere.
    fn place(&self, value: f64) -> Option<f64> {
        let place = match self {
            Self::Linear | Self::Names(_) => value,
            Self::Doublings => value.log2(),
            Self::Decades => value.log10(),
        };
        place.is_finite().then_some(place)
    }

    /// The ends of an axis that shows all these places.
    fn ends(&self, places: impl Iterator<Item = f64> + Clone) -> [f64; 2] {
        if let Self::Names(names) = self {
            return [0.5, names.len().max(1) as f64 + 0.5];
        }
        let low = places.clone().reduce(f64::min).unwrap_or(0.0);
        let high = places.reduce(f64::max).unwrap_or(1.0);
        match self {
            Self::Linear | Self::Names(_) => [low.min(0.0), high.max(1e-9) * 1.05],
            // Room for the marks, and never nothing.
            Self::Doublings => [low - 0.25, high + 0.25],
            Self::Decades => [low - 0.05, high.max(low + 0.1) + 0.05],
        }
    }

    /// The places of ticks between the ends.
    fn ticks(&self, [low, high]: [f64; 2]) -> Vec<f64> {
        let within = |place: &f64| (low..=high).contains(place);
        match self {
            Self::Names(names) => {
                let step = names.len().div_ceil(MOST_NAMES).max(1);
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
            Self::Doublings => (-4..40).map(f64::from).filter(within).collect(),
            Self::Decades => (-12..12)
                .flat_map(|power| [1.0, 2.0, 5.0].map(|m: f64| m.log10() + f64::from(power)))
                .filter(within)
                .collect(),
        }
    }

    /// What a tick says.
    fn label(&self, place: f64) -> String {
        let value = match self {
            Self::Names(names) => {
                let index = (place.round() as usize).saturating_sub(1);
                let name = names.get(index).map_or("", String::as_str);
                return name.chars().take(MOST_LETTERS).collect();
            }
            Self::Linear => place,
            Self::Doublings => place.exp2(),
            Self::Decades => 10f64.powf(place),
        };
        // As many digits as the tick needs, which is few.
        let text = format!("{value:.6}");
        match text.contains('.') {
            true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
            false => text,
        }
    }
}

/// An axis' range with its ticks, for plotters.
struct Ticked {
    ends: [f64; 2],
    ticks: Vec<f64>,
}

impl Ranged for Ticked {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (from, to): (i32, i32)) -> i32 {
        let [low, high] = self.ends;
        let share = (value - low) / (high - low);
        from + (share * f64::from(to - from)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.ticks.clone()
    }

    fn range(&self) -> std::ops::Range<f64> {
        self.ends[0]..self.ends[1]
    }
}

impl Plot {
    /// The plot as SVG, on white; of the class `on-white`, so that a page can turn it dark.
    ///
    /// # Errors
    /// In practice none: the drawing goes to memory.
    pub fn to_svg(&self) -> Result<String, PlotError> {
        let mut svg = String::new();
        self.draw(&mut svg).map_err(|error| PlotError {
            title: self.title.clone(),
            reason: error.to_string(),
        })?;
        Ok(svg.replacen("<svg ", "<svg class=\"on-white\" ", 1))
    }

    /// Where the points of a series lie.
    fn places(&self, series: &Series) -> Vec<(f64, f64)> {
        let place = |[x, y]: &[f64; 2]| Some((self.x.scale.place(*x)?, self.y.scale.place(*y)?));
        series.points.iter().filter_map(place).collect()
    }

    fn draw(&self, svg: &mut String) -> Result<(), Box<dyn Error + '_>> {
        let names = match &self.x.scale {
            Scale::Names(names) => names.iter().map(|name| name.chars().count()).max(),
            _ => None,
        };
        let names = names.map_or(0, |letters| letters.min(MOST_LETTERS) as u32 * LETTER);
        let legend = LEGEND_LINE * (self.series.len().div_ceil(LEGEND_ENTRIES) as u32) + 8;
        let size = (SIZE.0, SIZE.1 + names + legend);
        let root = SVGBackend::with_string(svg, size).into_drawing_area();
        root.fill(&WHITE)?;
        let (above, below) = root.split_vertically(SIZE.1 + names);
        let places: Vec<_> = self
            .series
            .iter()
            .map(|series| self.places(series))
            .collect();
        let all = || places.iter().flatten().copied();
        let axis = |scale: &Scale, ends: [f64; 2]| Ticked {
            ends,
            ticks: scale.ticks(ends),
        };
        let across = axis(&self.x.scale, self.x.scale.ends(all().map(|(x, _)| x)));
        let up = axis(&self.y.scale, self.y.scale.ends(all().map(|(_, y)| y)));
        let mut labels = TextStyle::from((FONT, 13).into_font());
        if names > 0 {
            // They are long, and there are many of them.
            labels = labels.transform(FontTransform::Rotate90);
        }
        let mut chart = ChartBuilder::on(&above)
            .caption(&self.title, (FONT, 18))
            .margin(10)
            .x_label_area_size(44 + names)
            .y_label_area_size(66)
            .build_cartesian_2d(across, up)?;
        chart
            .configure_mesh()
            .light_line_style(WHITE)
            .bold_line_style(RGBColor(225, 225, 222))
            .x_desc(&self.x.title)
            .y_desc(&self.y.title)
            .axis_desc_style((FONT, 15))
            .x_labels(MOST_NAMES)
            .x_label_style(labels)
            .y_label_style((FONT, 13))
            .x_label_formatter(&|place| self.x.scale.label(*place))
            .y_label_formatter(&|place| self.y.scale.label(*place))
            .draw()?;
        // The legend is below the axes, where no curve can lie behind it.
        for ((series, points), entry) in self.series.iter().zip(places).zip(0..) {
            let color = series.hue.color();
            let line = color.stroke_width(2);
            match series.mark {
                Mark::Dots => {}
                // What is between two things of different names is nothing.
                _ if names > 0 => {}
                Mark::Rings => {
                    chart.draw_series(DashedLineSeries::new(points.clone(), 6, 4, line))?;
                }
                _ => {
                    chart.draw_series(LineSeries::new(points.clone(), line))?;
                }
            }
            for at in points {
                draw_mark(chart.plotting_area(), series.mark, at, color)?;
            }
            let [row, column] = [entry / LEGEND_ENTRIES, entry % LEGEND_ENTRIES];
            let x = 20 + LEGEND_ENTRY * column as i32;
            let y = LEGEND_LINE as i32 * row as i32 + 10;
            draw_mark(&below, series.mark, (x, y), color)?;
            below.draw(&Text::new(series.name.clone(), (x + 14, y - 7), (FONT, 15)))?;
        }
        root.present()?;
        Ok(())
    }
}

/// The mark of a point, or of the legend.
fn draw_mark<DB: DrawingBackend, C: CoordTranslate>(
    area: &DrawingArea<DB, C>,
    mark: Mark,
    at: C::From,
    color: RGBColor,
) -> Result<(), DrawingAreaErrorKind<DB::ErrorType>> {
    let (filled, line) = (color.filled(), color.stroke_width(2));
    match mark {
        Mark::Discs => area.draw(&Circle::new(at, 4, filled)),
        Mark::Dots => area.draw(&Circle::new(at, 7, filled)),
        Mark::Rings => area.draw(&Circle::new(at, 4, line)),
        Mark::Triangles => area.draw(&TriangleMarker::new(at, 5, filled)),
        Mark::Crosses => area.draw(&Cross::new(at, 4, line)),
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
                scale: Scale::Doublings,
            },
            y: Axis {
                title: "Loss".into(),
                scale: Scale::Decades,
            },
            series: vec![Series {
                name: "Ours".into(),
                hue: Hue::Blue,
                mark: Mark::Discs,
                points,
            }],
        }
    }

    #[test]
    fn a_plot_names_its_axes_ticks_and_series() {
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
            "three points and the legend's"
        );
    }

    #[test]
    fn things_with_names_are_named_and_not_joined() {
        let mut plot = plot(vec![[1.0, 0.1], [2.0, 0.02], [3.0, 0.01]]);
        assert!(plot.to_svg().unwrap().contains("<polyline"));
        let names = ["gold-paint", "felt", "steel"].map(str::to_owned);
        plot.x.scale = Scale::Names(names.to_vec());
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
        // On white everywhere; a page turns what is of this class.
        assert!(svg.starts_with("<svg class=\"on-white\""));
    }

    #[test]
    fn points_that_no_axis_shows_are_left_out() {
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
            labels(Scale::Decades, [-2.0, -0.9]),
            ["0.01", "0.02", "0.05", "0.1"]
        );
        assert_eq!(labels(Scale::Doublings, [-0.25, 2.25]), ["1", "2", "4"]);
    }
}
