//! A picture of what was understood of photographs.

use glimpse_fitting::photo::{PhotoReading, Photograph, PixelUse};

use super::Picture;
use super::sheet::{displayed, sheet};

const GREEN: [u8; 3] = [60, 220, 90];
const YELLOW: [u8; 3] = [255, 220, 0];

/// Draws two tiles for each of the first 12 photographs. In the first, as a display with a gamma of 2.2 shows the photograph, the
/// ball's outline is green, and a yellow cross is where light and camera have the same angle to the normal: a glossy ball has
/// its highlight there. In the second, pixels of readings are green, other used ones gray, saturated ones red, shadowed ones
/// blue, grazing ones and the rim orange, outliers pink, and masked ones violet.
#[must_use]
pub fn overview(
    photographs: &[Photograph],
    uses: &[Vec<Option<PixelUse>>],
    readings: &[PhotoReading],
) -> Picture {
    sheet(photographs, 2, |tile, image, pixel, [x, y]| {
        let Photograph { ball, light, .. } = &photographs[image];
        let shown = displayed(photographs[image].radiance(pixel));
        if tile == 0 {
            let [right, up, toward] = light.direction;
            let scale = ball.radius / (2.0 + 2.0 * toward).sqrt();
            let [column, row] = ball.center;
            let arms = [x - column - scale * right, y - row + scale * up].map(f64::abs);
            let from_rim = ((x - column).hypot(y - row) - ball.radius).abs();
            let is_cross = arms[0].min(arms[1]) < 0.7 && arms[0].max(arms[1]) < 0.1 * ball.radius;
            let is_outline = from_rim < 0.004 * ball.radius + 0.5;
            let outlined = if is_outline { GREEN } else { shown };
            return if is_cross { YELLOW } else { outlined };
        }
        let is_read = |one: &PhotoReading| one.photograph == image && one.index == pixel;
        match uses[image][pixel] {
            Some(PixelUse::Used) if readings.iter().any(is_read) => GREEN,
            None | Some(PixelUse::Used) => [shown[1]; 3],
            Some(PixelUse::Saturated) => [230, 50, 50],
            Some(PixelUse::Shadowed) => [50, 90, 200],
            Some(PixelUse::Grazing | PixelUse::Rim) => [230, 140, 40],
            Some(PixelUse::Outlier) => [255, 0, 200],
            Some(PixelUse::Masked) => [110, 60, 150],
        }
    })
}
