//! A sample pattern: over theta_h and theta_d, and as directions to light and sensor from above.

use std::fmt::Write as _;

use glimpse_core::geometry::{Angles, HalfDifference};

use super::svg::{Labels, begin};

/// Up to so many samples are numbered.
const NUMBERED: usize = 16;
/// Pixels per degree of the first drawing, and where its origin lies.
const SCALE: f32 = 3.0;
const ORIGIN: [f32; 2] = [66.0, 294.0];
/// Radius of the hemispheres, and the centres of light's and sensor's.
const HORIZON: f32 = 145.0;
const CENTRES: [[f32; 2]; 2] = [[185.0, 540.0], [515.0, 540.0]];
/// Half the length of the hand that shows phi_d.
const HAND: f32 = 11.0;
/// Left edge of the legend, its first line and the height of a line.
const LEGEND: [f32; 2] = [400.0, 50.0];
const LINE: f32 = 30.0;

/// On top of the style of all drawings; lights are orange discs, sensors blue squares.
const STYLE: &str = "\
.plot .always{fill:var(--area)}.plot .some{fill:var(--some)}\
.plot .light{fill:var(--c1)}.plot .sensor{fill:var(--c0)}\
.plot .hand{stroke:var(--ink);stroke-width:1.5}.plot .dot{fill:var(--ink)}\
.plot .out{opacity:0.35}";

/// Draws a sample pattern as an SVG picture, to stand alone or within a page.
///
/// Above, each sample is a dot over theta_h and theta_d in degrees, with a hand that points to
/// phi_d (to the right for 0, up for 90 degrees). Pairs in the dark triangle are above the horizon
/// for every phi_d, those beside it only for phi_d near 90 degrees. Below are the directions to
/// light (discs) and to sensor (squares) of each sample with phi_h = 0, each projected straight
/// down on the surface: their distance from the centre is the sine of the polar angle. Up to 16
/// samples are numbered from 0, as in the recipe. Samples with a direction below the horizon are
/// faint, samples with an angle that is not finite left out.
#[must_use]
pub fn pattern_svg(angles: &[Angles<f32>]) -> String {
    let label = format!("Sample pattern of {} pairs of directions", angles.len());
    let mut svg = begin(700.0, 718.0, &label, STYLE);
    draw_axes(&mut svg);
    for (centre, title) in CENTRES.into_iter().zip(["light", "sensor"]) {
        draw_hemisphere(&mut svg, centre, title);
    }
    let numbered = angles.len() <= NUMBERED;
    draw_legend(&mut svg, angles.len(), numbered);
    let finite = angles.iter().enumerate().filter(|(_, angles)| {
        let Angles {
            theta_h,
            theta_d,
            phi_d,
        } = angles;
        [theta_h, theta_d, phi_d]
            .iter()
            .all(|angle| angle.is_finite())
    });
    let samples: Vec<Drawn> = finite
        .map(|(index, angles)| Drawn::new(index, angles))
        .collect();
    for sample in &samples {
        sample.draw(&mut svg);
    }
    if numbered {
        draw_numbers(&mut svg, &samples);
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
    let (under, beside) = (bottom + 40.0, 20.0);
    let _ = writeln!(
        svg,
        "<text class=\"mid\" x=\"{x}\" y=\"{under}\">&#952;h, polar angle of the half vector</text>\
         <text class=\"mid\" x=\"{beside}\" y=\"{y}\" transform=\"rotate(-90 {beside} {y})\">\
         &#952;d, of the difference vector</text>"
    );
}

/// Circles of 30, 60 and 90 degrees around a centre, and what is seen there.
fn draw_hemisphere(svg: &mut String, [x, y]: [f32; 2], title: &str) {
    for degrees in [30.0_f32, 60.0, 90.0] {
        let radius = HORIZON * degrees.to_radians().sin();
        let (label, class) = (
            y + radius - 4.0,
            if degrees < 90.0 { "grid" } else { "axis" },
        );
        let _ = writeln!(
            svg,
            "<circle class=\"{class}\" cx=\"{x}\" cy=\"{y}\" r=\"{radius:.1}\"/>\
             <text class=\"dim mid\" x=\"{x}\" y=\"{label:.1}\">{degrees}&#176;</text>"
        );
    }
    let [left, right, above] = [x - HORIZON, x + HORIZON, y - HORIZON - 14.0];
    let [top, bottom, beside, line] = [y - HORIZON, y + HORIZON, right + 5.0, y + 4.0];
    let _ = writeln!(
        svg,
        "<path class=\"grid\" d=\"M{left} {y}H{right}M{x} {top}V{bottom}\"/>\
         <text class=\"dim\" x=\"{beside}\" y=\"{line}\">&#966; 0&#176;</text>\
         <text class=\"mid\" x=\"{x}\" y=\"{above}\">towards the {title}, seen from above</text>"
    );
}

/// What the marks mean.
fn draw_legend(svg: &mut String, samples: usize, numbered: bool) {
    let [left, top] = LEGEND;
    let text = left + 26.0;
    let square = |class: &str, y: f32, side: f32| {
        let (x, y) = (left + 6.0 - side / 2.0, y - 4.0 - side / 2.0);
        format!("<rect class=\"{class}\" x=\"{x}\" y=\"{y}\" width=\"{side}\" height=\"{side}\"/>")
    };
    let disc = |class: &str, y: f32, radius: f32| {
        let (x, y) = (left + 6.0, y - 4.0);
        format!("<circle class=\"{class}\" cx=\"{x}\" cy=\"{y}\" r=\"{radius}\"/>")
    };
    let hand = |y: f32| {
        let (x, y, end) = (left + 6.0, y - 4.0, left + 6.0 + HAND);
        format!("<path class=\"hand\" d=\"M{x} {y}H{end}\"/>")
    };
    let count = match numbered {
        true => format!("{samples} samples, numbered as in the recipe"),
        false => format!("{samples} samples"),
    };
    let line = |index: u8| top + LINE * f32::from(index);
    let lines = [
        (String::new(), count),
        (
            disc("dot", line(1), 3.5),
            "half and difference vector".into(),
        ),
        (
            hand(line(2)),
            "points to &#966;d: right 0&#176;, up 90&#176;".into(),
        ),
        (disc("light", line(3), 4.5), "direction to the light".into()),
        (
            square("sensor", line(4), 8.0),
            "direction to the sensor".into(),
        ),
        (
            square("always", line(5), 14.0),
            "above the horizon for every &#966;d".into(),
        ),
        (
            square("some", line(6), 14.0),
            "only for &#966;d near 90&#176;".into(),
        ),
    ];
    for (index, (mark, what)) in (0_u8..).zip(lines) {
        let (y, x) = (line(index), if mark.is_empty() { left } else { text });
        let _ = writeln!(svg, "{mark}<text x=\"{x}\" y=\"{y}\">{what}</text>");
    }
}

/// A sample and where it is drawn: over the angles, and as direction to light and to sensor.
struct Drawn {
    index: usize,
    valid: bool,
    phi_d: f32,
    places: [[f32; 2]; 3],
}

impl Drawn {
    fn new(index: usize, angles: &Angles<f32>) -> Self {
        let at = HalfDifference::from_angles(*angles);
        let directions = at.directions();
        let project =
            |[x, y]: [f32; 2], [right, up, _]: [f32; 3]| [x + HORIZON * right, y - HORIZON * up];
        let [light, sensor] = CENTRES;
        Self {
            index,
            valid: at.is_valid(),
            phi_d: angles.phi_d,
            places: [
                place(angles.theta_h.to_degrees(), angles.theta_d.to_degrees()),
                project(light, directions.incoming),
                project(sensor, directions.outgoing),
            ],
        }
    }

    fn draw(&self, svg: &mut String) {
        let class = if self.valid { "" } else { " class=\"out\"" };
        let [[x, y], [light_x, light_y], [sensor_x, sensor_y]] = self.places;
        let (sin, cos) = self.phi_d.sin_cos();
        let (tip_x, tip_y) = (x + HAND * cos, y - HAND * sin);
        let (corner_x, corner_y) = (sensor_x - 4.0, sensor_y - 4.0);
        let _ = writeln!(
            svg,
            "<g{class}><path class=\"hand\" d=\"M{x:.1} {y:.1}L{tip_x:.1} {tip_y:.1}\"/>\
             <circle class=\"dot\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.5\"/>\
             <circle class=\"light\" cx=\"{light_x:.1}\" cy=\"{light_y:.1}\" r=\"4.5\"/>\
             <rect class=\"sensor\" x=\"{corner_x:.1}\" y=\"{corner_y:.1}\" width=\"8\" \
             height=\"8\"/></g>"
        );
    }
}

/// Numbers beside all marks, where they cover least.
fn draw_numbers(svg: &mut String, samples: &[Drawn]) {
    let mut labels = Labels::default();
    for [x, y] in CENTRES {
        labels.keep_off([x + HORIZON + 19.0, y], [28.0, 12.0]);
        for radius in [30.0_f32, 60.0, 90.0].map(|degrees| HORIZON * degrees.to_radians().sin()) {
            labels.keep_off([x, y + radius - 8.0], [24.0, 12.0]);
        }
    }
    for sample in samples {
        for place in sample.places {
            labels.mark(place);
        }
        let ([x, y], (sin, cos)) = (sample.places[0], sample.phi_d.sin_cos());
        labels.mark([x + 0.8 * HAND * cos, y - 0.8 * HAND * sin]);
    }
    for sample in samples {
        let class = if sample.valid {
            "dim mid"
        } else {
            "dim mid out"
        };
        for mark in sample.places {
            let number = sample.index.to_string();
            let [x, y] = labels.place(mark, number.len());
            let _ = writeln!(
                svg,
                "<text class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\">{number}</text>"
            );
        }
    }
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
        let [x, y] = [66.0 + 90.0, 294.0 - 180.0];
        assert!(
            svg.contains(&format!("class=\"dot\" cx=\"{x:.1}\" cy=\"{y:.1}\"")),
            "{svg}"
        );
        // The hand points up.
        assert!(svg.contains(&format!("M{x:.1} {y:.1}L{x:.1} {:.1}", y - HAND)));
        // By hand: w_i = (sin 30 cos 60, sin 60, ...) = (0.25, 0.866).
        let (x, y) = (185.0 + 145.0 * 0.25, 540.0 - 145.0 * 0.866_03);
        assert!(
            svg.contains(&format!("class=\"light\" cx=\"{x:.1}\" cy=\"{y:.1}\"")),
            "{svg}"
        );
    }

    #[test]
    fn impossible_samples_are_faint_or_left_out() {
        let count = |pattern: &[Angles<f32>], what| pattern_svg(pattern).matches(what).count();
        let legend = 1;
        let pattern = [
            angles(10.0, 10.0, 10.0),
            angles(80.0, 80.0, 0.0),
            angles(f32::NAN, 0.0, 0.0),
        ];
        assert_eq!(count(&pattern, "class=\"dot\""), 2 + legend);
        assert_eq!(count(&pattern, "<g class=\"out\">"), 1);
        assert_eq!(count(&[], "class=\"dot\""), legend);
        assert!(!pattern_svg(&[angles(10.0, 10.0, 10.0); 17]).contains("numbered"));
    }
}
