//! A sample pattern drawn twice: over theta_h and theta_d, and as directions seen from above.

use std::fmt::Write as _;

use glimpse_core::angles::{Angles, HalfDifference};

/// Up to so many samples are numbered.
const NUMBERED: usize = 16;
/// Pixels per degree of the first drawing, and where its origin lies.
const SCALE: f32 = 3.0;
const ORIGIN: [f32; 2] = [54.0, 300.0];
/// Radius and centre of the second drawing.
const HORIZON: f32 = 135.0;
const CENTRE: [f32; 2] = [530.0, 165.0];
/// Half the length of the hand that shows phi_d.
const HAND: f32 = 9.0;

/// Colours for light and dark surroundings; lights are orange discs, sensors blue squares.
const STYLE: &str = "\
.pattern{--ink:#1c1c1e;--faint:#77777d;--area:#dcebf4;--some:#eef4f8;--light:#d55e00;--sensor:#0072b2}\
@media(prefers-color-scheme:dark){.pattern{--ink:#e8e8e6;--faint:#9a9aa0;--area:#1d3a4c;\
--some:#1b2830;--light:#e69f00;--sensor:#56b4e9}}\
.pattern text{font:13px system-ui,'DejaVu Sans',sans-serif;fill:var(--ink)}\
.pattern .small{font-size:11px;fill:var(--faint)}\
.pattern .mid{text-anchor:middle}.pattern .end{text-anchor:end}\
.pattern .axis{fill:none;stroke:var(--faint)}\
.pattern .always{fill:var(--area)}.pattern .some{fill:var(--some)}\
.pattern .light{fill:var(--light);stroke:none}.pattern .sensor{fill:var(--sensor);stroke:none}\
.pattern .pair{stroke:var(--faint);stroke-width:0.7}\
.pattern .hand{stroke:var(--ink);stroke-width:1.5}\
.pattern .dot{fill:var(--ink)}\
.pattern .out{opacity:0.35}";

/// Draws a sample pattern as an SVG picture, to stand alone or within a page.
///
/// At the left each sample is a dot over theta_h and theta_d in degrees, with a hand that points to
/// phi_d (to the right for 0, up for 90 degrees). Pairs in the dark triangle are above the horizon
/// for every phi_d, those beside it only for phi_d near 90 degrees. At the right are the directions
/// to light (disc) and sensor (square) of each sample, seen from above with phi_h = 0. Samples with
/// a direction below the horizon are faint, samples with an angle that is not finite left out.
#[must_use]
pub fn pattern_svg(angles: &[Angles<f32>]) -> String {
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 700 350\" class=\"pattern\" \
         role=\"img\" aria-label=\"Sample pattern of {} pairs of directions\">\n\
         <style>{STYLE}</style>\n",
        angles.len()
    );
    draw_axes(&mut svg);
    draw_hemisphere(&mut svg);
    for (index, angles) in angles.iter().enumerate() {
        let Angles {
            theta_h,
            theta_d,
            phi_d,
        } = *angles;
        if [theta_h, theta_d, phi_d]
            .iter()
            .all(|angle| angle.is_finite())
        {
            let number = (index < NUMBERED).then_some(index + 1);
            draw_sample(&mut svg, angles, number);
        }
    }
    svg + "</svg>\n"
}

/// Where a pair of angles in degrees lies in the first drawing.
fn place(theta_h: f32, theta_d: f32) -> [f32; 2] {
    let [left, bottom] = ORIGIN;
    [left + SCALE * theta_h, bottom - SCALE * theta_d]
}

/// Plane, valid region, ticks and labels of the first drawing.
fn draw_axes(svg: &mut String) {
    let [left, bottom] = ORIGIN;
    let [right, top] = place(90.0, 90.0);
    let side = right - left;
    let _ = writeln!(
        svg,
        "<rect class=\"some\" x=\"{left}\" y=\"{top}\" width=\"{side}\" height=\"{side}\"/>\n\
         <path class=\"always\" d=\"M{left} {bottom}H{right}L{left} {top}z\"/>\n\
         <path class=\"axis\" d=\"M{left} {top}V{bottom}H{right}\"/>"
    );
    for degrees in (0..=90_u8).step_by(30) {
        let [x, y] = place(degrees.into(), degrees.into());
        let (under, beside) = (bottom + 17.0, left - 6.0);
        let middle = y + 4.0;
        let _ = writeln!(
            svg,
            "<text class=\"mid\" x=\"{x}\" y=\"{under}\">{degrees}&#176;</text>\
             <text class=\"end\" x=\"{beside}\" y=\"{middle}\">{degrees}&#176;</text>"
        );
    }
    let [x, y] = place(45.0, 45.0);
    let (under, beside) = (bottom + 38.0, 14.0);
    let _ = writeln!(
        svg,
        "<text class=\"mid\" x=\"{x}\" y=\"{under}\">&#952;h</text>\
         <text class=\"mid\" x=\"{beside}\" y=\"{y}\" transform=\"rotate(-90 {beside} {y})\">\
         &#952;d</text>"
    );
    let ([low_x, low_y], [high_x, high_y]) = (place(1.5, 2.5), place(88.5, 85.5));
    let _ = writeln!(
        svg,
        "<text class=\"small\" x=\"{low_x}\" y=\"{low_y}\">valid for every &#966;d</text>\
         <text class=\"small end\" x=\"{high_x}\" y=\"{high_y}\">only near &#966;d = 90&#176;</text>"
    );
}

/// Circles of 30, 60 and 90 degrees and the legend of the second drawing.
fn draw_hemisphere(svg: &mut String) {
    let [x, y] = CENTRE;
    for degrees in [30.0_f32, 60.0, 90.0] {
        let radius = HORIZON * degrees.to_radians().sin();
        let label = y + radius - 4.0;
        let _ = writeln!(
            svg,
            "<circle class=\"axis\" cx=\"{x}\" cy=\"{y}\" r=\"{radius:.1}\"/>\
             <text class=\"small mid\" x=\"{x}\" y=\"{label:.1}\">{degrees}&#176;</text>"
        );
    }
    let (bottom, line) = (y + HORIZON + 32.0, y + HORIZON + 36.0);
    let (light, sensor) = (x - 80.0, x + 12.0);
    let _ = writeln!(
        svg,
        "<circle class=\"light\" cx=\"{light}\" cy=\"{bottom}\" r=\"4.5\"/>\
         <text x=\"{0}\" y=\"{line}\">light</text>\
         <rect class=\"sensor\" x=\"{1}\" y=\"{2}\" width=\"8\" height=\"8\"/>\
         <text x=\"{3}\" y=\"{line}\">sensor</text>",
        light + 10.0,
        sensor - 4.0,
        bottom - 4.0,
        sensor + 10.0,
    );
}

/// One sample in both drawings.
fn draw_sample(svg: &mut String, angles: &Angles<f32>, number: Option<usize>) {
    let at = HalfDifference::from_angles(*angles);
    let class = if at.is_valid() { "" } else { " class=\"out\"" };
    let [x, y] = place(angles.theta_h.to_degrees(), angles.theta_d.to_degrees());
    let (sin, cos) = angles.phi_d.sin_cos();
    let (tip_x, tip_y) = (x + HAND * cos, y - HAND * sin);
    let _ = write!(
        svg,
        "<g{class}><path class=\"hand\" d=\"M{x:.1} {y:.1}L{tip_x:.1} {tip_y:.1}\"/>\
         <circle class=\"dot\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.5\"/>"
    );
    let directions = at.directions();
    let [light, sensor] = [directions.incoming, directions.outgoing].map(|[x, y, _]| {
        let [centre_x, centre_y] = CENTRE;
        [centre_x + HORIZON * x, centre_y - HORIZON * y]
    });
    let ([light_x, light_y], [sensor_x, sensor_y]) = (light, sensor);
    let (corner_x, corner_y) = (sensor_x - 3.5, sensor_y - 3.5);
    let _ = write!(
        svg,
        "<path class=\"pair\" d=\"M{light_x:.1} {light_y:.1}L{sensor_x:.1} {sensor_y:.1}\"/>\
         <circle class=\"light\" cx=\"{light_x:.1}\" cy=\"{light_y:.1}\" r=\"4\"/>\
         <rect class=\"sensor\" x=\"{corner_x:.1}\" y=\"{corner_y:.1}\" width=\"7\" height=\"7\"/>"
    );
    if let Some(number) = number {
        for [x, y] in [[x, y], light, sensor] {
            let (x, y) = (x + 5.0, y - 5.0);
            let _ = write!(
                svg,
                "<text class=\"small\" x=\"{x:.1}\" y=\"{y:.1}\">{number}</text>"
            );
        }
    }
    svg.push_str("</g>\n");
}

#[cfg(test)]
mod tests {
    use super::*;

    fn angles(theta_h: f32, theta_d: f32, phi_d: f32) -> Angles<f32> {
        let [theta_h, theta_d, phi_d] = [theta_h, theta_d, phi_d].map(f32::to_radians);
        Angles {
            theta_h,
            theta_d,
            phi_d,
        }
    }

    #[test]
    fn samples_lie_where_their_angles_say() {
        let svg = pattern_svg(&[angles(30.0, 60.0, 90.0)]);
        let [x, y] = [54.0 + 90.0, 300.0 - 180.0];
        assert!(
            svg.contains(&format!("class=\"dot\" cx=\"{x:.1}\" cy=\"{y:.1}\"")),
            "{svg}"
        );
        // The hand points up.
        assert!(svg.contains(&format!("M{x:.1} {y:.1}L{x:.1} {:.1}", y - HAND)));
        // By hand: w_i = (sin 30 cos 60, sin 60, ...) = (0.25, 0.866).
        let (x, y) = (530.0 + 135.0 * 0.25, 165.0 - 135.0 * 0.866);
        assert!(
            svg.contains(&format!("class=\"light\" cx=\"{x:.1}\" cy=\"{y:.1}\"")),
            "{svg}"
        );
    }

    #[test]
    fn impossible_samples_are_faint_or_left_out() {
        let count = |pattern: &[Angles<f32>], what| pattern_svg(pattern).matches(what).count();
        let pattern = [
            angles(10.0, 10.0, 10.0),
            angles(80.0, 80.0, 0.0),
            angles(f32::NAN, 0.0, 0.0),
        ];
        assert_eq!(count(&pattern, "class=\"dot\""), 2);
        assert_eq!(count(&pattern, "<g class=\"out\">"), 1);
        assert_eq!(count(&[], "class=\"dot\""), 0);
    }
}
