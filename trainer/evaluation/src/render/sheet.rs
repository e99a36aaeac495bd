//! Sheets of photographs of a ball.

use glimpse_fitting::photo::Photograph;

use super::{Picture, Raster};

/// The largest side of a tile, in pixels, and the number of photographs on a sheet.
const MAX_SIDE: f64 = 512.0;
const MAX_ROWS: usize = 12;
/// The ratio of the side of a ball's square to its diameter.
const MARGIN: f64 = 1.05;

/// Returns a value on a display whose gamma is 2.2, from 0 to 1.
pub(super) fn level(value: f64) -> f64 {
    value.clamp(0.0, 1.0).powf(1.0 / 2.2)
}

/// Returns the pixel of a display whose gamma is 2.2.
pub(super) fn displayed(light: [f64; 3]) -> [u8; 3] {
    light.map(|value| (255.0 * level(value)).round() as u8)
}

/// Draws a row of tiles around the ball for each of the first 12 photographs. The color is that of a tile, a photograph, a pixel of
/// it, and its place.
pub(super) fn sheet(
    photographs: &[Photograph],
    columns: usize,
    color: impl Fn(usize, usize, usize, [f64; 2]) -> [u8; 3],
) -> Picture {
    let rows = photographs.iter().enumerate().take(MAX_ROWS);
    let tiles = rows.flat_map(|(index, one)| (0..columns).map(move |tile| (tile, index, one)));
    let tiles = tiles.map(|(tile, index, one)| {
        let square = 2.0 * MARGIN * one.ball.radius;
        let block = (square / MAX_SIDE).ceil().max(1.0);
        let side = (square / block) as usize;
        let (width, height) = (one.picture.width as f64, one.picture.height as f64);
        let pixels = (0..side * side).map(|pixel| {
            let [x, y] = [(pixel % side, 0), (pixel / side, 1)].map(|(step, axis): (_, usize)| {
                (one.ball.center[axis] - 0.5 * square + block * step as f64).round()
            });
            let is_inside = x >= 0.0 && y >= 0.0 && x < width && y < height;
            let color = || color(tile, index, (y * width + x) as usize, [x, y]);
            is_inside.then(color).unwrap_or_default()
        });
        Raster {
            width: side,
            height: side,
            pixels: pixels.collect(),
        }
    });
    Picture::grid(&tiles.collect::<Vec<_>>(), columns, 4)
}
