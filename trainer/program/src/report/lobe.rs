//! A BRDF in the plane of incidence, as a polar plot with a logarithmic radius.

use glimpse_core::geometry::{Directions, HalfDifference};
use glimpse_materials::{Brdf, luminance};
use maud::{Markup, html};

use super::svg::{COLORS, drawing, one_decimal, path_of};

/// The maximum number of curves besides a reference, one for each color.
pub(crate) const MAX_LOBES: usize = COLORS - 1;
/// Number of outgoing angles: every quarter of a degree, the first one half a step above the horizon.
const STEPS: u16 = 720;
/// The numbers of decades of the radial axis.
const MIN_DECADES: i32 = 2;
const MAX_DECADES: i32 = 6;
/// The plot's center and radius, in SVG units.
const CENTER: [f32; 2] = [350.0, 350.0];
const RADIUS: f32 = 285.0;
/// The maximum number of readings with large marks, which do not overlap.
const MAX_LARGE_MARKS: usize = 60;
/// Top of the legend and height of a line, in SVG units.
const LEGEND_TOP: f32 = 418.0;
const LINE_HEIGHT: f32 = 21.0;

/// A BRDF under light from one direction.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Lobe {
    /// Name in the legend.
    pub(crate) name: String,
    /// Polar angle of the light, radians.
    pub(crate) theta_i: f32,
    /// Pairs of outgoing angle in radians and luminance of the BRDF in sr^-1.
    pub(crate) curve: Vec<[f32; 2]>,
    /// True for a reference.
    pub(crate) is_dashed: bool,
    /// One standard deviation of the luminance at each angle of the curve, drawn as a band; empty for none.
    pub(crate) deviations: Vec<f32>,
    /// Readings near the light, drawn as circles.
    pub(crate) readings: Vec<ReadingMark>,
}

/// A reading in the plane of incidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ReadingMark {
    /// Outgoing angle in radians and luminance of the BRDF in sr^-1, as in a curve.
    pub(crate) point: [f32; 2],
    /// False for a reading that a fit does not use, drawn as an open circle.
    pub(crate) is_used: bool,
}

impl Lobe {
    /// Creates the lobe of a BRDF, with a solid curve.
    pub(crate) fn new(name: impl Into<String>, brdf: &dyn Brdf, theta_i: f32) -> Self {
        Self {
            name: name.into(),
            theta_i,
            curve: lobe(brdf, theta_i),
            is_dashed: false,
            deviations: Vec::new(),
            readings: Vec::new(),
        }
    }
}

/// Returns the luminance (Rec. 709) of a BRDF in the plane of incidence.
///
/// The pairs are the outgoing polar angle in radians, in (-pi/2, pi/2), and the luminance of the BRDF in sr^-1 (not
/// times the cosine). Angles are positive on the side opposite the light, so a mirror peaks at `theta_i`.
fn lobe(brdf: &dyn Brdf, theta_i: f32) -> Vec<[f32; 2]> {
    let (angles, half_differences) = lobe_directions(theta_i);
    angles
        .into_iter()
        .zip(brdf.values_at(&half_differences))
        .map(|(angle, value)| [angle, luminance(value)])
        .collect()
}

/// Returns the outgoing polar angles of a [`lobe`], and the pairs of directions.
pub(crate) fn lobe_directions(theta_i: f32) -> (Vec<f32>, Vec<HalfDifference<f32>>) {
    let angle =
        |step: u16| ((f32::from(step) + 0.5) * 180.0 / f32::from(STEPS) - 90.0).to_radians();
    let (sin, cos) = theta_i.sin_cos();
    let samples = (0..STEPS).map(angle).filter_map(|theta_o| {
        let directions = Directions {
            incoming: [-sin, 0.0, cos],
            outgoing: [theta_o.sin(), 0.0, theta_o.cos()],
        };
        Some((theta_o, HalfDifference::from_directions(&directions)?))
    });
    samples.unzip()
}

/// Draws lobes as an SVG, for a file or for embedding in a page.
///
/// The angle from the vertical is the outgoing polar angle. The radius is the logarithm of the luminance of the BRDF
/// in sr^-1, over two to six decades; lower values lie at the center. Triangles on the rim mark the light.
pub(crate) fn lobe_svg(lobes: &[Lobe]) -> String {
    let decades = decades(lobes);
    let position = |[theta_o, value]: [f32; 2]| point(theta_o, RADIUS * fraction(value, decades));
    let path = |points: &mut dyn Iterator<Item = [f32; 2]>| {
        let points = points.filter(|[_, value]| !value.is_nan());
        path_of(&points.map(position).collect::<Vec<_>>())
    };
    let mut legend = "triangle: light".to_owned();
    if lobes.iter().any(|lobe| !lobe.deviations.is_empty()) {
        legend += "; band: one standard deviation";
    }
    if lobes.iter().any(|lobe| !lobe.readings.is_empty()) {
        legend += "; circle: reading (open: not used)";
    }
    let baseline = |index: usize| LEGEND_TOP + LINE_HEIGHT * index as f32;
    let marks = html! {
        (grid(decades))
        @for (index, lobe) in lobes.iter().enumerate() {
            @let y = baseline(index);
            @let radius = if lobe.readings.len() > MAX_LARGE_MARKS { "1.5" } else { "3.5" };
            @let band = lobe.curve.iter().zip(&lobe.deviations);
            @let upper = band.clone().map(|([theta_o, value], deviation)| [*theta_o, value + deviation]);
            @let lower = band.rev().map(|([theta_o, value], deviation)| [*theta_o, value - deviation]);
            g class={ "c" (index % COLORS) } {
                path.band d=(path(&mut upper.chain(lower))) {}
                path.line.dash[lobe.is_dashed] d=(path(&mut lobe.curve.iter().copied())) {}
                path.line.dash[lobe.is_dashed] d=(format!("M70 {}H106", y - 4.0)) {}
                @for reading in &lobe.readings {
                    @let [x, y] = position(reading.point).map(one_decimal);
                    circle.mark.open[!reading.is_used] cx=(x) cy=(y) r=(radius) {}
                }
            }
            text x="116" y=(y) { (lobe.name) }
            path.mark.c6 d=(light_arrow(lobe.theta_i)) {}
        }
        text x="116" y=(baseline(lobes.len())) { (legend) }
    };
    let size = [700.0, baseline(lobes.len() + 1)];
    drawing(size, "BRDF in the plane of incidence", &marks)
}

/// Returns the SVG path of a triangle on the rim that points to the light.
fn light_arrow(theta_i: f32) -> String {
    let corners = [(RADIUS - 14.0, 0.0), (RADIUS, 0.017), (RADIUS, -0.017)];
    path_of(&corners.map(|(radius, offset)| point(offset - theta_i, radius))) + "z"
}

/// Returns the exponents of the powers of ten at the center and at the rim.
fn decades(lobes: &[Lobe]) -> [i32; 2] {
    let points = lobes.iter().flat_map(|lobe| {
        let readings = lobe.readings.iter().map(|reading| &reading.point);
        lobe.curve.iter().chain(readings)
    });
    let values = points.map(|[_, value]| *value);
    let values = values.filter(|value| value.is_normal() && *value > 0.0);
    let [low, high] = [f32::min, f32::max].map(|select| values.clone().reduce(select));
    let high = high.map_or(0, |high| high.log10().ceil() as i32);
    let low = low.map_or(-2, |low| low.log10().floor() as i32);
    [low.clamp(high - MAX_DECADES, high - MIN_DECADES), high]
}

/// Returns the logarithmic position of a value between the decades, 0 to 1.
fn fraction(value: f32, [low, high]: [i32; 2]) -> f32 {
    ((value.max(0.0).log10() - low as f32) / (high - low) as f32).clamp(0.0, 1.0)
}

/// Returns the point at an angle from the vertical, positive to the right, and a radius.
fn point(theta_o: f32, radius: f32) -> [f32; 2] {
    let [x, y] = CENTER;
    [x + radius * theta_o.sin(), y - radius * theta_o.cos()]
}

/// Draws half circles for powers of ten, rays for angles, and their labels.
fn grid([low, high]: [i32; 2]) -> Markup {
    let [x, y] = CENTER;
    let radius = |exponent: i32| RADIUS * (exponent - low) as f32 / (high - low) as f32;
    let arc = |radius: f32| {
        let (left, right) = (x - radius, x + radius);
        format!("M{left:.1} {y}A{radius:.1} {radius:.1} 0 0 1 {right:.1} {y}")
    };
    let ray = |[rim_x, rim_y]: [f32; 2]| format!("M{x} {y}L{rim_x:.1} {rim_y:.1}");
    html! {
        @for exponent in low..=high {
            path.grid d=(arc(radius(exponent))) {}
            text.dim.mid x=(one_decimal(x + radius(exponent))) y=(y + 17.0) {
                "10" tspan dy="-5" font-size="9" { (exponent) }
            }
        }
        @for degrees in (-90..=90_i16).step_by(30) {
            @let angle = f32::from(degrees).to_radians();
            @let [label_x, label_y] = point(angle, RADIUS + 19.0);
            path.grid d=(ray(point(angle, RADIUS))) {}
            text.dim.mid x=(one_decimal(label_x)) y=(one_decimal(label_y + 4.0)) {
                @if degrees < 0 { "\u{2212}" }
                (degrees.abs()) "\u{b0}"
            }
        }
        path.axis d=(format!("M{left} {y}H{right}", left = x - RADIUS, right = x + RADIUS)) {}
        text.mid x=(x) y="22" { "outgoing angle \u{3b8}o in the plane of incidence" }
        text.mid x=(x) y=(y + 41.0) {
            "luminance of the BRDF, sr\u{207b}\u{b9} (not times the cosine), logarithmic"
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mirror_peaks_at_theta_i() {
        let mirror = |at: &HalfDifference<f32>| [at.hz.powi(5000); 3];
        for degrees in [0.0_f32, 30.0, 60.0] {
            let curve = lobe(&mirror, degrees.to_radians());
            let peak = curve.iter().max_by(|a, b| a[1].total_cmp(&b[1])).unwrap();
            assert!((peak[0].to_degrees() - degrees).abs() < 0.2, "{peak:?}");
            assert!((peak[1] - 1.0).abs() < 0.02);
        }
    }
}
