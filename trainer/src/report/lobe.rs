//! A BRDF in the plane of incidence, as a polar plot with a logarithmic radius.

use glimpse_core::geometry::{Directions, HalfDifference};
use glimpse_materials::Brdf;
use maud::{Markup, html};

use super::svg::{COLORS, INK, Rule, drawing, power_of_ten, tenths};

/// How many curves can be told apart: one for each color.
pub const MOST_LOBES: usize = COLORS.len();
/// Outgoing angles: every quarter of a degree, half a step off the horizon.
const STEPS: u16 = 720;
/// The most decades that are shown.
const DECADES: i32 = 6;
/// The plot's center and radius.
const CENTER: [f32; 2] = [350.0, 350.0];
const RADIUS: f32 = 285.0;
/// Where the legend begins, and the height of one of its lines.
const LEGEND: f32 = 418.0;
const LINE: f32 = 21.0;

/// On top of the style of all drawings: the colors of curves, by their order.
const RULES: [Rule; 7] = [
    (".light", "fill", INK),
    (".c0", "stroke", COLORS[0]),
    (".c1", "stroke", COLORS[1]),
    (".c2", "stroke", COLORS[2]),
    (".c3", "stroke", COLORS[3]),
    (".c4", "stroke", COLORS[4]),
    (".c5", "stroke", COLORS[5]),
];
const SHAPES: &str = ".plot .curve{fill:none;stroke-width:2;stroke-linejoin:round}\
                      .plot .dash{stroke-dasharray:7 4}";

/// Curves of one color: a BRDF under light from one direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Lobe {
    /// What it is, for the legend.
    pub name: String,
    /// Polar angle of the light, radians.
    pub theta_i: f32,
    /// The luminance of the BRDF by outgoing angle, as [`lobe`] gives it; drawn as a line.
    pub curve: Vec<[f32; 2]>,
    /// What it is compared with, drawn dashed, with a name; may be none.
    pub dashed: Option<(String, Vec<[f32; 2]>)>,
}

/// The luminance (Rec. 709) of a BRDF in the plane of incidence: pairs of the outgoing polar angle
/// in radians, in (-pi/2, pi/2), and BRDF in sr^-1 (not times the cosine). Positive angles are
/// across the normal from the light, so that a mirror's peak is at `theta_i`.
pub fn lobe(brdf: &(impl Brdf + ?Sized), theta_i: f32) -> Vec<[f32; 2]> {
    let angle =
        |step: u16| ((f32::from(step) + 0.5) * 180.0 / f32::from(STEPS) - 90.0).to_radians();
    let (sin, cos) = theta_i.sin_cos();
    let places = (0..STEPS).map(angle).filter_map(|theta_o| {
        let directions = Directions {
            incoming: [-sin, 0.0, cos],
            outgoing: [theta_o.sin(), 0.0, theta_o.cos()],
        };
        Some((theta_o, HalfDifference::from_directions(&directions)?))
    });
    let (angles, at): (Vec<f32>, Vec<_>) = places.unzip();
    let mut values = vec![[0.0; 3]; at.len()];
    brdf.evaluate(&at, &mut values);
    let luminance = |[r, g, b]: [f32; 3]| 0.2126 * r + 0.7152 * g + 0.0722 * b;
    let values = values.into_iter().map(luminance);
    angles
        .into_iter()
        .zip(values)
        .map(|(angle, value)| [angle, value])
        .collect()
}

/// Draws lobes as an SVG picture, to stand alone or within a page.
///
/// The angle from the vertical is the outgoing polar angle; the radius is the logarithm of the
/// luminance of the BRDF in sr^-1, over two to six decades. What is below them is at the center.
/// Triangles on the rim mark the light. Colors repeat after [`MOST_LOBES`].
#[must_use]
pub fn lobe_svg(lobes: &[Lobe]) -> String {
    let decades = decades(lobes);
    let lines = lobes
        .iter()
        .map(|lobe| 1 + usize::from(lobe.dashed.is_some()))
        .sum::<usize>()
        + 1;
    let height = LEGEND + LINE * lines as f32;
    let mut line = (0..).map(|index: u16| LEGEND + LINE * f32::from(index));
    let mut next_line = || line.next().unwrap_or(height);
    let marks = html! {
        (grid(decades))
        @for (index, lobe) in lobes.iter().enumerate() {
            @let dashed = lobe.dashed.iter().map(|(name, curve)| (name, curve, true));
            @for (name, curve, dash) in [(&lobe.name, &lobe.curve, false)].into_iter().chain(dashed) {
                @let y = next_line();
                g class={ "c" (index % COLORS.len()) } {
                    path.curve.dash[dash] d=(path(curve, decades)) {}
                    path.curve.dash[dash] d=(format!("M70 {middle}H106", middle = y - 4.0)) {}
                }
                text x="116" y=(y) { (name) }
            }
            path.light d=(light(lobe.theta_i)) {}
        }
        @let y = next_line();
        path.light d=(pointer(y - 4.0)) {}
        text x="116" y=(y) { "direction to the light" }
    };
    let label = "BRDF in the plane of incidence";
    drawing([700.0, height], label, &RULES, SHAPES, &marks)
}

/// The line of a curve.
fn path(curve: &[[f32; 2]], decades: [i32; 2]) -> String {
    let places = curve.iter().filter(|[_, value]| !value.is_nan());
    let places = places.map(|[theta_o, value]| {
        let [x, y] = place(*theta_o, RADIUS * share(*value, decades));
        format!("{x:.1} {y:.1}")
    });
    match places.collect::<Vec<_>>().join("L") {
        none if none.is_empty() => none,
        places => format!("M{places}"),
    }
}

/// A triangle on the rim that points to the light.
fn light(theta_i: f32) -> String {
    let corners = [(RADIUS - 14.0, 0.0), (RADIUS, 0.017), (RADIUS, -0.017)];
    triangle(corners.map(|(radius, aside)| place(aside - theta_i, radius)))
}

/// The same in the legend.
fn pointer(y: f32) -> String {
    triangle([[95.0, y], [81.0, y - 5.0], [81.0, y + 5.0]])
}

/// The exponents of the powers of ten at the center and at the rim.
fn decades(lobes: &[Lobe]) -> [i32; 2] {
    let dashed = lobes
        .iter()
        .filter_map(|lobe| lobe.dashed.as_ref())
        .map(|(_, curve)| curve);
    let curves = lobes.iter().map(|lobe| &lobe.curve).chain(dashed);
    let values = curves.flatten().map(|[_, value]| *value);
    let values: Vec<f32> = values
        .filter(|value| value.is_normal() && *value > 0.0)
        .collect();
    // `as` saturates.
    let high = values
        .iter()
        .copied()
        .reduce(f32::max)
        .map_or(0, |most| most.log10().ceil() as i32);
    let low = values
        .iter()
        .copied()
        .reduce(f32::min)
        .map_or(-2, |least| least.log10().floor() as i32);
    [low.clamp(high - DECADES, high - 2), high]
}

/// A value's place between the decades, 0 to 1.
fn share(value: f32, [low, high]: [i32; 2]) -> f32 {
    ((value.max(0.0).log10() - low as f32) / (high - low) as f32).clamp(0.0, 1.0)
}

/// Where an angle, positive to the right, and a radius lie.
fn place(theta_o: f32, radius: f32) -> [f32; 2] {
    let [x, y] = CENTER;
    [x + radius * theta_o.sin(), y - radius * theta_o.cos()]
}

fn triangle([[ax, ay], [bx, by], [cx, cy]]: [[f32; 2]; 3]) -> String {
    format!("M{ax:.1} {ay:.1}L{bx:.1} {by:.1}L{cx:.1} {cy:.1}z")
}

/// Half circles for powers of ten, rays for angles, and what they mean.
fn grid([low, high]: [i32; 2]) -> Markup {
    let [x, y] = CENTER;
    let reach = |exponent: i32| RADIUS * (exponent - low) as f32 / (high - low) as f32;
    let arc = |radius: f32| {
        let (left, right) = (x - radius, x + radius);
        format!("M{left:.1} {y}A{radius:.1} {radius:.1} 0 0 1 {right:.1} {y}")
    };
    let ray = |[rim_x, rim_y]: [f32; 2]| format!("M{x} {y}L{rim_x:.1} {rim_y:.1}");
    html! {
        @for exponent in low..=high {
            path.grid d=(arc(reach(exponent))) {}
            text.dim.mid x=(tenths(x + reach(exponent))) y=(y + 17.0) { (power_of_ten(exponent)) }
        }
        @for degrees in (-90..=90_i16).step_by(30) {
            @let angle = f32::from(degrees).to_radians();
            @let [label_x, label_y] = place(angle, RADIUS + 19.0);
            path.grid d=(ray(place(angle, RADIUS))) {}
            text.dim.mid x=(tenths(label_x)) y=(tenths(label_y + 4.0)) {
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

    fn named(name: &str, curve: Vec<[f32; 2]>) -> Lobe {
        Lobe {
            name: name.into(),
            theta_i: 0.5,
            curve,
            dashed: None,
        }
    }

    #[test]
    fn a_lobe_peaks_where_a_mirror_does() {
        let mirror = |at: &HalfDifference<f32>| [at.hz.powi(5000); 3];
        for degrees in [0.0_f32, 30.0, 60.0] {
            let curve = lobe(&mirror, degrees.to_radians());
            let peak = curve.iter().max_by(|a, b| a[1].total_cmp(&b[1])).unwrap();
            assert!((peak[0].to_degrees() - degrees).abs() < 0.2, "{peak:?}");
            assert!((peak[1] - 1.0).abs() < 0.02);
        }
    }

    #[test]
    fn the_radius_is_the_logarithm_over_whole_decades() {
        let curve = vec![[0.0, 0.02], [0.3, 3.0]];
        assert_eq!(decades(&[named("a", curve.clone())]), [-2, 1]);
        assert!((share(1.0, [-2, 1]) - 2.0 / 3.0).abs() < 1e-6);
        assert_eq!(
            [0.0, -1.0, f32::NAN, 1e9].map(|value| share(value, [-2, 1])),
            [0.0, 0.0, 0.0, 1.0]
        );
        assert_eq!(
            decades(&[named("a", vec![[0.0, 1e-20], [0.1, 50.0]])]),
            [-4, 2]
        );
        assert_eq!(decades(&[]), [-2, 0]);
        let svg = lobe_svg(&[named("<a>", curve)]);
        assert!(svg.contains("&lt;a&gt;") && svg.contains("10⁻²"), "{svg}");
        // Straight up, 0.02 is log10(2) of three decades above the center.
        let up = 350.0 - 285.0 * std::f64::consts::LOG10_2 / 3.0;
        assert!(svg.contains(&format!("d=\"M350.0 {up:.1}L")), "{svg}");
    }
}
