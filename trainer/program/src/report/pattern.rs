//! Drawings of sample patterns: over theta_h and theta_d, and as directions to light and sensor, seen from above.

use glimpse_core::geometry::{Angles, HalfDifference};
use maud::{Markup, html};

use super::svg::{COLORS, StyleRule, TEXT, ThemedColor, drawing, one_decimal};

/// The maximum number of samples with printed numbers.
const MAX_NUMBERED: usize = 16;
/// Pixels per degree and origin of the upper drawing.
const SCALE: f32 = 3.0;
const ORIGIN: [f32; 2] = [66.0, 294.0];
/// Radius of the hemispheres, and their centers for light and sensor.
const HORIZON: f32 = 145.0;
const CENTERS: [[f32; 2]; 2] = [[185.0, 540.0], [515.0, 540.0]];
/// Length of a sample's hand: the short line that shows phi_d.
const HAND: f32 = 11.0;
/// Left edge and first baseline of the legend, and the height of a line.
const LEGEND: [f32; 2] = [400.0, 50.0];
const LINE_HEIGHT: f32 = 30.0;

/// Colors in addition to the common style; lights are orange discs, sensors blue squares.
const RULES: [StyleRule; 6] = [
    (".always", "fill", ThemedColor::new("#d3e6f1", "#1d3a4c")),
    (".some", "fill", ThemedColor::new("#edf3f7", "#1b2830")),
    (".light", "fill", COLORS[1]),
    (".sensor", "fill", COLORS[0]),
    (".hand", "stroke", TEXT),
    (".dot", "fill", TEXT),
];
const SHAPES: &str = ".plot .hand{stroke-width:1.5}.plot .out{opacity:0.35}";

/// Draws a sample pattern as an SVG, for a file or for embedding in a page.
///
/// The upper drawing shows each sample as a dot over theta_h and theta_d in degrees. A short line, the hand, shows
/// phi_d: it points to the right for 0 and up for 90 degrees. In the dark triangle, both directions are above the
/// horizon for every phi_d; elsewhere only for phi_d near 90 degrees.
///
/// The lower drawings show the directions to light (discs) and sensor (squares) of each sample with phi_h = 0,
/// projected straight down on the surface. Their distance from the center is the sine of the polar angle.
///
/// Up to 16 samples are numbered from 0, as in the recipe. Samples with a direction below the horizon are faint.
/// Samples with an angle that is not finite are left out.
#[must_use]
pub fn pattern_svg(angles: &[Angles<f32>]) -> String {
    let finite = angles.iter().enumerate();
    let finite =
        finite.filter(|(_, angles)| angles.to_array().iter().all(|angle| angle.is_finite()));
    let samples: Vec<DrawnSample> = finite
        .map(|(index, angles)| DrawnSample::new(index, angles))
        .collect();
    let numbered = angles.len() <= MAX_NUMBERED;
    let marks = html! {
        (axes())
        @for (center, title) in CENTERS.into_iter().zip(["light", "sensor"]) {
            (hemisphere(center, title))
        }
        (legend(angles.len(), numbered))
        @for sample in &samples { (sample.marks(numbered)) }
    };
    let label = format!("Sample pattern of {} pairs of directions", angles.len());
    drawing([700.0, 718.0], &label, &RULES, SHAPES, &marks)
}

/// Returns the point of a pair of angles, in degrees, in the upper drawing.
fn point(theta_h: f32, theta_d: f32) -> [f32; 2] {
    let [left, bottom] = ORIGIN;
    [left + SCALE * theta_h, bottom - SCALE * theta_d]
}

/// Draws the valid region, axes, ticks and labels of the upper drawing.
fn axes() -> Markup {
    let [left, bottom] = ORIGIN;
    let [right, top] = point(90.0, 90.0);
    let [x, y] = point(45.0, 45.0);
    let (side, label_x) = (right - left, 20.0);
    html! {
        rect.some x=(left) y=(top) width=(side) height=(side) {}
        path.always d=(format!("M{left} {bottom}H{right}L{left} {top}z")) {}
        path.axis d=(format!("M{left} {top}V{bottom}H{right}")) {}
        @for degrees in (0..=90_u8).step_by(30) {
            @let [x, y] = point(degrees.into(), degrees.into());
            text.mid x=(x) y=(bottom + 17.0) { (degrees) "\u{b0}" }
            text.end x=(left - 6.0) y=(y + 4.0) { (degrees) "\u{b0}" }
        }
        text.mid x=(x) y=(bottom + 40.0) { "\u{3b8}h, polar angle of the half vector" }
        text.mid x=(label_x) y=(y) transform=(format!("rotate(-90 {label_x} {y})")) {
            "\u{3b8}d, of the difference vector"
        }
    }
}

/// Draws circles of 30, 60 and 90 degrees around a center, with a title.
fn hemisphere([x, y]: [f32; 2], title: &str) -> Markup {
    let [left, right] = [x - HORIZON, x + HORIZON];
    let [top, bottom] = [y - HORIZON, y + HORIZON];
    html! {
        @for degrees in [30.0_f32, 60.0, 90.0] {
            @let radius = HORIZON * degrees.to_radians().sin();
            @let class = if degrees < 90.0 { "grid" } else { "axis" };
            circle class=(class) cx=(x) cy=(y) r=(one_decimal(radius)) {}
            text.dim.mid x=(x) y=(one_decimal(y + radius - 4.0)) { (degrees) "\u{b0}" }
        }
        path.grid d=(format!("M{left} {y}H{right}M{x} {top}V{bottom}")) {}
        text.dim x=(right + 5.0) y=(y + 4.0) { "\u{3c6} 0\u{b0}" }
        text.mid x=(x) y=(top - 14.0) { "towards the " (title) ", seen from above" }
    }
}

/// Draws the legend of the marks.
fn legend(samples: usize, numbered: bool) -> Markup {
    let [left, top] = LEGEND;
    let middle = left + 6.0;
    let baseline = |index: u8| top + LINE_HEIGHT * f32::from(index);
    let square = |class: &str, y: f32, side: f32| {
        let (x, y) = (middle - side / 2.0, y - 4.0 - side / 2.0);
        html! { rect class=(class) x=(x) y=(y) width=(side) height=(side) {} }
    };
    let disc = |class: &str, y: f32, radius: f32| {
        html! { circle class=(class) cx=(middle) cy=(y - 4.0) r=(radius) {} }
    };
    let hand = |y: f32| {
        let (y, end) = (y - 4.0, middle + HAND);
        html! { path.hand d=(format!("M{middle} {y}H{end}")) {} }
    };
    let entries = [
        (disc("dot", baseline(1), 3.5), "half and difference vector"),
        (
            hand(baseline(2)),
            "points to \u{3c6}d: right 0\u{b0}, up 90\u{b0}",
        ),
        (disc("light", baseline(3), 4.5), "direction to the light"),
        (
            square("sensor", baseline(4), 8.0),
            "direction to the sensor",
        ),
        (
            square("always", baseline(5), 14.0),
            "above the horizon for every \u{3c6}d",
        ),
        (
            square("some", baseline(6), 14.0),
            "only for \u{3c6}d near 90\u{b0}",
        ),
    ];
    html! {
        text x=(left) y=(baseline(0)) {
            (samples) " samples"
            @if numbered { ", numbered as in the recipe" }
        }
        @for (index, (mark, meaning)) in (1_u8..).zip(entries) {
            (mark)
            text x=(left + 26.0) y=(baseline(index)) { (meaning) }
        }
    }
}

/// A sample with its three points: over the angles, and as direction to light and to sensor.
struct DrawnSample {
    index: usize,
    valid: bool,
    phi_d: f32,
    points: [[f32; 2]; 3],
}

impl DrawnSample {
    fn new(index: usize, angles: &Angles<f32>) -> Self {
        let half_difference = HalfDifference::from_angles(*angles);
        let directions = half_difference.directions();
        let project =
            |[x, y]: [f32; 2], [right, up, _]: [f32; 3]| [x + HORIZON * right, y - HORIZON * up];
        let [light, sensor] = CENTERS;
        Self {
            index,
            valid: half_difference.is_valid(),
            phi_d: angles.phi_d,
            points: [
                point(angles.theta_h.to_degrees(), angles.theta_d.to_degrees()),
                project(light, directions.incoming),
                project(sensor, directions.outgoing),
            ],
        }
    }

    /// Draws the three marks, each with the sample's number at its upper right if `numbered` is set.
    fn marks(&self, numbered: bool) -> Markup {
        let [[x, y], [light_x, light_y], [sensor_x, sensor_y]] = self.points;
        let (sin, cos) = self.phi_d.sin_cos();
        let (tip_x, tip_y) = (x + HAND * cos, y - HAND * sin);
        let hand = format!("M{x:.1} {y:.1}L{tip_x:.1} {tip_y:.1}");
        html! {
            g.out[!self.valid] {
                path.hand d=(hand) {}
                circle.dot cx=(one_decimal(x)) cy=(one_decimal(y)) r="3.5" {}
                circle.light cx=(one_decimal(light_x)) cy=(one_decimal(light_y)) r="4.5" {}
                rect.sensor x=(one_decimal(sensor_x - 4.0)) y=(one_decimal(sensor_y - 4.0))
                    width="8" height="8" {}
                @if numbered {
                    @for [x, y] in self.points {
                        text.dim.mid x=(one_decimal(x + 11.0)) y=(one_decimal(y - 4.0)) { (self.index) }
                    }
                }
            }
        }
    }
}
