//! Drawings of sample patterns: the directions to light and sensor, seen from above.

use glimpse_core::geometry::{Angles, HalfDifference};
use maud::{Markup, html};

use super::svg::{drawing, one_decimal};

/// The maximum number of samples with printed numbers.
const MAX_NUMBERED: usize = 16;
/// Center and radius of the hemisphere, in SVG units.
const CENTER: [f32; 2] = [350.0, 330.0];
const HORIZON: f32 = 290.0;

/// Draws a sample pattern as an SVG, for a file or for embedding in a page.
///
/// The drawing shows the directions to light (discs) and sensor (squares) of each sample with phi_h = 0, projected
/// straight down on the surface. Their distance from the center is the sine of the polar angle.
///
/// Up to 16 samples are numbered from 0, as in the recipe. Samples with a direction below the horizon are faint.
/// Samples with an angle that is not finite are left out.
pub(crate) fn pattern_svg(angles: &[Angles<f32>]) -> String {
    let is_numbered = angles.len() <= MAX_NUMBERED;
    let marks = html! {
        (hemisphere())
        @for (index, angles) in angles.iter().enumerate() {
            @let at = HalfDifference::from_angles(*angles);
            @let directions = at.directions();
            @let points = [directions.incoming, directions.outgoing].map(project);
            @if points.as_flattened().iter().all(|length| length.is_finite()) {
                g.out[!at.is_valid()] {
                    (light(points[0]))
                    (sensor(points[1]))
                    @for [x, y] in points {
                        @if is_numbered {
                            text.dim.mid x=(one_decimal(x + 11.0)) y=(one_decimal(y - 4.0)) { (index) }
                        }
                    }
                }
            }
        }
        (light([200.0, 656.0]))
        text x="212" y="661" { "direction to the light" }
        (sensor([390.0, 656.0]))
        text x="402" y="661" { "direction to the sensor" }
    };
    let label = format!("Sample pattern of {} pairs of directions", angles.len());
    drawing([700.0, 680.0], &label, &marks)
}

/// Returns the point of a direction.
fn project([right, up, _]: [f32; 3]) -> [f32; 2] {
    let [x, y] = CENTER;
    [x + HORIZON * right, y - HORIZON * up]
}

fn light([x, y]: [f32; 2]) -> Markup {
    html! { circle.mark.c1 cx=(one_decimal(x)) cy=(one_decimal(y)) r="4.5" {} }
}

fn sensor([x, y]: [f32; 2]) -> Markup {
    let [x, y] = [x - 4.0, y - 4.0].map(one_decimal);
    html! { rect.mark.c0 x=(x) y=(y) width="8" height="8" {} }
}

/// Draws the axes, and circles of 30, 60 and 90 degrees.
fn hemisphere() -> Markup {
    let [x, y] = CENTER;
    html! {
        @for degrees in [30.0_f32, 60.0, 90.0] {
            @let radius = HORIZON * degrees.to_radians().sin();
            circle.grid cx=(x) cy=(y) r=(one_decimal(radius)) {}
            text.dim.mid x=(x) y=(one_decimal(y + radius - 4.0)) { (degrees) "\u{b0}" }
        }
        path.grid d=(format!("M{} {y}h{len}M{x} {}v{len}", x - HORIZON, y - HORIZON, len = 2.0 * HORIZON)) {}
        text.dim x=(x + HORIZON + 5.0) y=(y + 4.0) { "\u{3c6} 0\u{b0}" }
        text.mid x=(x) y="22" { "directions, seen from above" }
    }
}
