//! A BRDF in the plane of incidence, as a polar plot with a logarithmic radius.

use std::fmt::Write as _;

use glimpse_core::geometry::{Directions, HalfDifference};

use super::html::escape;
use super::svg::{COLOURS, begin, power_of_ten};
use crate::material::Brdf;

/// How many curves can be told apart: one for each colour.
pub const MOST_LOBES: usize = COLOURS;
/// Outgoing angles: every quarter of a degree, half a step off the horizon.
const STEPS: u16 = 720;
/// The most decades that are shown.
const DECADES: i32 = 6;
/// The plot's centre and radius.
const CENTRE: [f32; 2] = [350.0, 350.0];
const RADIUS: f32 = 285.0;
/// Where the legend begins, and the height of one of its lines.
const LEGEND: f32 = 418.0;
const LINE: f32 = 21.0;

/// On top of the style of all drawings.
const STYLE: &str = "\
.plot .curve{fill:none;stroke-width:2;stroke-linejoin:round}.plot .dash{stroke-dasharray:7 4}\
.plot .light{fill:var(--ink)}";

/// Curves of one colour: a BRDF under light from one direction.
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
/// luminance of the BRDF in sr^-1, over two to six decades. What is below them is at the centre.
/// Triangles on the rim mark the light. Colours repeat after [`MOST_LOBES`].
#[must_use]
pub fn lobe_svg(lobes: &[Lobe]) -> String {
    let decades = decades(lobes);
    let lines = lobes
        .iter()
        .map(|lobe| 1 + usize::from(lobe.dashed.is_some()))
        .sum::<usize>()
        + 1;
    let height = LEGEND + LINE * lines as f32;
    let mut svg = begin(700.0, height, "BRDF in the plane of incidence", STYLE);
    draw_grid(&mut svg, decades);
    let mut y = LEGEND;
    for (index, lobe) in lobes.iter().enumerate() {
        let colour = index % COLOURS;
        let dashed = lobe
            .dashed
            .iter()
            .map(|(name, curve)| (name, curve, " dash"));
        for (name, curve, class) in [(&lobe.name, &lobe.curve, "")].into_iter().chain(dashed) {
            let stroke = format!("class=\"curve{class}\" style=\"stroke:var(--c{colour})\"");
            let _ = write!(svg, "<path {stroke} d=\"");
            let places = curve.iter().filter(|[_, value]| !value.is_nan());
            for (index, [theta_o, value]) in places.enumerate() {
                let [x, y] = place(*theta_o, RADIUS * share(*value, decades));
                let _ = write!(svg, "{}{x:.1} {y:.1}", if index == 0 { 'M' } else { 'L' });
            }
            let (middle, name) = (y - 4.0, escape(name));
            let _ = writeln!(
                svg,
                "\"/>\n<path {stroke} d=\"M70 {middle}H106\"/><text x=\"116\" y=\"{y}\">{name}</text>"
            );
            y += LINE;
        }
        let [tip, left, right] = [(RADIUS - 14.0, 0.0), (RADIUS, 0.017), (RADIUS, -0.017)]
            .map(|(radius, aside)| place(aside - lobe.theta_i, radius));
        let _ = writeln!(
            svg,
            "<path class=\"light\" d=\"{}\"/>",
            triangle([tip, left, right])
        );
    }
    let middle = y - 4.0;
    let mark = triangle([[95.0, middle], [81.0, middle - 5.0], [81.0, middle + 5.0]]);
    let _ = writeln!(
        svg,
        "<path class=\"light\" d=\"{mark}\"/><text x=\"116\" y=\"{y}\">direction to the light</text>"
    );
    svg + "</svg>\n"
}

/// The exponents of the powers of ten at the centre and at the rim.
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
    let [x, y] = CENTRE;
    [x + radius * theta_o.sin(), y - radius * theta_o.cos()]
}

fn triangle([[ax, ay], [bx, by], [cx, cy]]: [[f32; 2]; 3]) -> String {
    format!("M{ax:.1} {ay:.1}L{bx:.1} {by:.1}L{cx:.1} {cy:.1}z")
}

/// Half circles for powers of ten, rays for angles, and what they mean.
fn draw_grid(svg: &mut String, [low, high]: [i32; 2]) {
    let [x, y] = CENTRE;
    let under = y + 17.0;
    for exponent in low..=high {
        let radius = RADIUS * (exponent - low) as f32 / (high - low) as f32;
        let (left, right) = (x - radius, x + radius);
        let label = power_of_ten(exponent);
        let _ = writeln!(
            svg,
            "<path class=\"grid\" d=\"M{left:.1} {y}A{radius:.1} {radius:.1} 0 0 1 {right:.1} {y}\"/>\
             <text class=\"dim mid\" x=\"{right:.1}\" y=\"{under}\">{label}</text>"
        );
    }
    for degrees in (-90..=90_i16).step_by(30) {
        let angle = f32::from(degrees).to_radians();
        let ([rim_x, rim_y], [label_x, label_y]) =
            (place(angle, RADIUS), place(angle, RADIUS + 19.0));
        let (label_y, sign) = (label_y + 4.0, if degrees < 0 { "\u{2212}" } else { "" });
        let _ = writeln!(
            svg,
            "<path class=\"grid\" d=\"M{x} {y}L{rim_x:.1} {rim_y:.1}\"/>\
             <text class=\"dim mid\" x=\"{label_x:.1}\" y=\"{label_y:.1}\">{sign}{}&#176;</text>",
            degrees.abs()
        );
    }
    let (left, right, below) = (x - RADIUS, x + RADIUS, y + 41.0);
    let _ = writeln!(
        svg,
        "<path class=\"axis\" d=\"M{left} {y}H{right}\"/>\
         <text class=\"mid\" x=\"{x}\" y=\"22\">outgoing angle &#952;o in the plane of incidence</text>\
         <text class=\"mid\" x=\"{x}\" y=\"{below}\">luminance of the BRDF, sr&#8315;&#185; (not times \
         the cosine), logarithmic</text>"
    );
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
        // Straight up, 0.02 is log10(2) of three decades above the centre.
        let up = 350.0 - 285.0 * std::f64::consts::LOG10_2 / 3.0;
        assert!(svg.contains(&format!("d=\"M350.0 {up:.1}L")), "{svg}");
    }
}
