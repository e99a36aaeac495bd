//! Environment lighting, tabulated for fast lookup.

use std::f64::consts::PI;

use super::Image;
use super::octahedral::{CELLS, LightGrid, RadianceTable, lerp};

/// Number of grids for light from a file: 256, 128, 64, 32 and 16 cells along a side.
const LEVELS: usize = 5;
/// Minimum number of samples of a panorama from pole to pole, 0.075 degrees apart. The cells around each node of the
/// finest grid then receive at least a hundred samples.
const MIN_SAMPLE_ROWS: usize = 2_400;
/// Accepted ratios of a panorama's width to its height.
const ASPECT_RATIOS: std::ops::RangeInclusive<f32> = 1.9..=2.1;

/// An environment map: radiance in linear RGB as a function of direction, from infinitely far away.
///
/// Directions are unit vectors in the picture's frame: x to the right, y up, z towards the viewer.
/// Radiance is relative, on the scale of the built-in [`studio`](Environment::studio).
/// [`Image::tone_map`](super::Image::tone_map) expects this scale.
///
/// The octahedral map unfolds the sphere of directions into a square. Radiance is tabulated at 257 x 257 nodes of
/// the square and interpolated bilinearly.
///
/// An environment from a file also has blurred copies, as in filtered importance sampling (Krivanek and Colbert
/// 2008). If integration nodes are far apart, each node uses the mean radiance around it. A sun of half a degree
/// is then neither missed between nodes nor counted for the whole solid angle of one node. For white paint under such
/// a sun alone, the radiance has an error of 4 % (standard deviation over the sphere; 14 % at worst), and the edge of
/// the lit half is softened by a few degrees.
#[derive(Clone, Debug)]
pub struct Environment {
    sharp: RadianceTable,
    /// Blurred copies, each twice as blurred as the previous one; the first is twice as blurred as `sharp`.
    blurred: Vec<RadianceTable>,
    exposure: f32,
}

impl Environment {
    /// Tabulates a function of a unit direction. Features narrower than about three degrees are lost.
    #[must_use]
    pub fn from_fn(radiance: impl Fn([f32; 3]) -> [f32; 3]) -> Self {
        Self {
            sharp: RadianceTable::from_fn(radiance),
            blurred: Vec::new(),
            exposure: 1.0,
        }
    }

    /// Converts a panorama in latitude and longitude with the layout of [`Environment::read`], and sets the exposure.
    ///
    /// Negative values count as black. An error states the problem and the remedy.
    pub(super) fn from_panorama(panorama: &Image) -> Result<Self, String> {
        let mut grids = vec![to_light_grid(panorama)?];
        while let (Some(last), true) = (grids.last(), grids.len() < LEVELS) {
            grids.push(last.coarser());
        }
        let mut tables = grids.iter().map(LightGrid::to_table);
        let mut environment = Self {
            sharp: tables.next().ok_or("no light")?,
            blurred: tables.collect(),
            exposure: 1.0,
        };
        environment.set_exposure()?;
        Ok(environment)
    }

    /// Returns the radiance arriving from a unit direction.
    #[must_use]
    pub fn radiance(&self, direction: [f32; 3]) -> [f32; 3] {
        let [r, g, b, _] = self.sharp.radiance_padded(direction);
        [r, g, b]
    }

    /// Returns the factor by which the file's radiance was multiplied; 1 for an environment without a file.
    #[must_use]
    pub fn exposure(&self) -> f32 {
        self.exposure
    }

    /// Returns true if the environment may have small bright sources.
    pub(super) fn may_have_small_sources(&self) -> bool {
        !self.blurred.is_empty()
    }

    /// Returns the blur level for integration nodes that are `spacing` radians apart: 0 is sharp, and each step of 1
    /// doubles the width of the blur.
    ///
    /// The blur reaches to the next node. A narrower one would lose light between nodes; a wider one would soften the
    /// edge of a sphere's lit half unnecessarily.
    pub(super) fn blur_level(&self, spacing: f32) -> f32 {
        let cell = (4.0 * PI).sqrt() as f32 / CELLS as f32;
        (spacing / cell)
            .log2()
            .clamp(0.0, self.blurred.len() as f32)
    }

    /// Returns the radiance from a unit direction, padded by a 0, at a level from [`Environment::blur_level`].
    #[inline(always)]
    pub(super) fn blurred_radiance(&self, direction: [f32; 3], level: f32) -> [f32; 4] {
        if self.blurred.is_empty() {
            return self.sharp.radiance_padded(direction);
        }
        let sharper = self.table(level as usize).radiance_padded(direction);
        let softer = self.table(level as usize + 1).radiance_padded(direction);
        lerp(sharper, softer, level.fract())
    }

    /// Returns the table of a blur level, or the most blurred one if there is none of that level.
    #[inline(always)]
    fn table(&self, level: usize) -> &RadianceTable {
        match level {
            0 => &self.sharp,
            level => self
                .blurred
                .get(level - 1)
                .or(self.blurred.last())
                .unwrap_or(&self.sharp),
        }
    }

    /// Scales the radiance: the mean luminance (Rec. 709) of a white diffuse sphere, over its visible disc, becomes
    /// that in the studio.
    fn set_exposure(&mut self) -> Result<(), String> {
        let luminance = self.sphere_luminance();
        let factor = (Self::studio().sphere_luminance() / luminance) as f32;
        if !(luminance > 0.0 && factor.is_normal()) {
            return Err(format!(
                "a white sphere in this light has luminance {luminance:e}: give a panorama that is not black"
            ));
        }
        self.sharp.scale(factor);
        for table in &mut self.blurred {
            table.scale(factor);
        }
        self.exposure *= factor;
        Ok(())
    }

    /// Returns the mean luminance of a white diffuse sphere over its visible disc.
    fn sphere_luminance(&self) -> f64 {
        // Lambert's phase law: the mean radiance of the disc for light of irradiance 1 at an angle gamma to the viewer.
        // Its integral over the sphere of directions is 1.
        let phase_law = |[_, _, z]: [f32; 3]| {
            let cos = f64::from(z).clamp(-1.0, 1.0);
            let (gamma, sin) = (cos.acos(), (1.0 - cos * cos).sqrt());
            2.0 / (3.0 * PI * PI) * (sin + (PI - gamma) * cos)
        };
        luminance(self.sharp.integral(phase_law))
    }
}

/// Returns the luminance of linear RGB with the primaries of Rec. 709.
fn luminance([r, g, b]: [f64; 3]) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// Distributes the light of a panorama over a grid of [`CELLS`] cells along a side.
fn to_light_grid(panorama: &Image) -> Result<LightGrid, String> {
    let Image {
        width,
        height,
        ref pixels,
    } = *panorama;
    let aspect_ratio = width as f32 / height as f32;
    if !ASPECT_RATIOS.contains(&aspect_ratio) || pixels.len() != width * height {
        return Err(format!(
            "a panorama of {width} x {height} pixels is not in latitude and longitude, whose aspect ratio \
             is 2:1: convert it"
        ));
    }
    if let Some(index) = pixels
        .iter()
        .position(|pixel| !pixel.iter().all(|channel| channel.is_finite()))
    {
        let (column, row) = (index % width, index / width);
        return Err(format!(
            "the pixel in column {column} and row {row} is infinite or not a number: replace it"
        ));
    }
    // Samples per pixel, vertically and horizontally.
    let samples_down = MIN_SAMPLE_ROWS.div_ceil(height);
    let samples_across = (2 * MIN_SAMPLE_ROWS).div_ceil(width);
    let azimuth_step = 2.0 * PI / (width * samples_across) as f64;
    let azimuths: Vec<[f32; 2]> = (0..width * samples_across)
        .map(|column| ((column as f64 + 0.5) * azimuth_step).sin_cos())
        .map(|(sin, cos)| [-sin as f32, cos as f32])
        .collect();
    let mut grid = LightGrid::new(CELLS);
    let polar_step = PI / (height * samples_down) as f64;
    for row in 0..height * samples_down {
        let edges = [row, row + 1].map(|row| (row as f64 * polar_step).cos());
        let solid_angle = (edges[0] - edges[1]) * azimuth_step;
        let (sin, cos) = ((row as f64 + 0.5) * polar_step).sin_cos();
        let (sin, cos) = (sin as f32, cos as f32);
        let pixel_row = pixels.iter().skip(row / samples_down * width).take(width);
        for (pixel, azimuths) in pixel_row.zip(azimuths.chunks_exact(samples_across)) {
            let [r, g, b] = pixel.map(|channel| f64::from(channel.max(0.0)) * solid_angle);
            for [x, z] in azimuths {
                grid.add([sin * x, cos, sin * z], [r, g, b, solid_angle]);
            }
        }
    }
    Ok(grid)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Iterates over unit directions on the whole sphere, including poles and equator.
    fn directions() -> impl Iterator<Item = [f32; 3]> {
        (0..=36).flat_map(|polar| {
            (0..72).map(move |azimuth| {
                let (sin, cos) = (polar as f32 * 5.0).to_radians().sin_cos();
                let (y, x) = (azimuth as f32 * 5.0).to_radians().sin_cos();
                [sin * x, sin * y, cos]
            })
        })
    }

    #[test]
    fn table_approximates_function_without_seams() {
        let smooth = |[x, y, z]: [f32; 3]| [1.0 + x, 2.0 + y * z, (3.0 * z).exp()];
        let environment = Environment::from_fn(smooth);
        for direction in directions() {
            for (tabulated, exact) in environment
                .radiance(direction)
                .iter()
                .zip(smooth(direction))
            {
                assert!(
                    (tabulated - exact).abs() < 2e-3 * exact.max(1.0),
                    "{direction:?}: {tabulated} instead of {exact}"
                );
            }
        }
    }

    #[test]
    fn invalid_directions_do_not_panic() {
        let environment = Environment::from_fn(|_| [1.0, 2.0, 3.0]);
        for direction in [[0.0; 3], [f32::NAN; 3], [f32::INFINITY, 0.0, 0.0]] {
            let _ = environment.radiance(direction);
        }
        assert_eq!(environment.radiance([0.0, 0.0, -1.0]), [1.0, 2.0, 3.0]);
    }

    /// Creates a panorama from a function of column and row.
    fn panorama(height: usize, radiance: impl Fn(usize, usize) -> [f32; 3]) -> Image {
        let width = 2 * height;
        let pixels = (0..width * height).map(|index| radiance(index % width, index / width));
        Image {
            width,
            height,
            pixels: pixels.collect(),
        }
    }

    /// Integrates a panorama's green channel over the sphere, pixel by pixel.
    fn green_light(panorama: &Image) -> f64 {
        let step = PI / panorama.height as f64;
        let rows = panorama.pixels.chunks_exact(panorama.width).enumerate();
        rows.map(|(row, pixels)| {
            let edges = [row, row + 1].map(|edge| (edge as f64 * step).cos());
            let sum: f64 = pixels.iter().map(|pixel| f64::from(pixel[1])).sum();
            sum * (edges[0] - edges[1]) * step
        })
        .sum()
    }

    #[test]
    fn small_sources_keep_their_light() {
        // Each sun is one pixel of 0.35 degrees over dim light. The suns are at a pole, at the equator, in between,
        // and at an edge and a corner of the octahedral map.
        let suns = [
            (0, 0),
            (100, 255),
            (511, 256),
            (700, 200),
            (512, 300),
            (256, 128),
            (3, 511),
        ];
        for (column, row) in suns {
            let sun = panorama(512, |x, y| {
                [0.0, if (x, y) == (column, row) { 1e6 } else { 1e-3 }, 0.0]
            });
            let grid = to_light_grid(&sun).unwrap();
            let expected = green_light(&sun);
            for (level, grid) in std::iter::successors(Some(grid), |grid| Some(grid.coarser()))
                .take(LEVELS)
                .enumerate()
            {
                let [_, actual, _] = grid.to_table().integral(|_| 1.0);
                assert!(
                    (actual / expected - 1.0).abs() < 0.01,
                    "sun at ({column}, {row}), level {level}: {actual} instead of {expected}"
                );
            }
        }
        for height in [1, 7, 64, 1300] {
            let white = to_light_grid(&panorama(height, |_, _| [0.5, 1.0, 2.0])).unwrap();
            let table = white.to_table();
            let actual = table.integral(|_| 1.0).map(|channel| channel / (4.0 * PI));
            for (actual, expected) in actual.into_iter().zip([0.5, 1.0, 2.0]) {
                assert!((actual / expected - 1.0).abs() < 1e-3, "{actual}");
            }
            for direction in directions() {
                let [r, g, b, _] = table.radiance_padded(direction);
                assert!((r - 0.5).abs() + (g - 1.0).abs() + (b - 2.0).abs() < 1e-4);
            }
        }
    }

    #[test]
    fn panorama_is_oriented_correctly() {
        // Red increases to the right, green upwards, and blue towards the center of the panorama.
        let (height, width) = (64, 128.0);
        let image = panorama(height, |column, row| {
            let azimuth = ((column as f32 + 0.5) / width - 0.5) * std::f32::consts::TAU;
            let polar = (row as f32 + 0.5) / height as f32 * std::f32::consts::PI;
            [
                2.0 + polar.sin() * azimuth.sin(),
                2.0 + polar.cos(),
                2.0 + polar.sin() * azimuth.cos(),
            ]
        });
        let environment = Environment::from_panorama(&image).unwrap();
        // Exposure multiplies all channels by one factor.
        let [_, green, _] = environment.radiance([1.0, 0.0, 0.0]);
        for [x, y, z] in directions() {
            let expected = [2.0 + x, 2.0 + y, 2.0 - z].map(|channel| 0.5 * green * channel);
            for (actual, expected) in environment.radiance([x, y, z]).into_iter().zip(expected) {
                assert!(
                    (actual / expected - 1.0).abs() < 0.05,
                    "{x} {y} {z}: {actual} {expected}"
                );
            }
        }
    }

    #[test]
    fn exposure_matches_studio_luminance() {
        let dim = panorama(16, |column, row| [1e-4 * (1 + column + row) as f32; 3]);
        let environment = Environment::from_panorama(&dim).unwrap();
        let studio = Environment::studio().sphere_luminance();
        assert!((environment.sphere_luminance() / studio - 1.0).abs() < 1e-5);
        // The phase law's integral over all directions is 1.
        assert!((Environment::from_fn(|_| [1.0; 3]).sphere_luminance() - 1.0).abs() < 1e-3);
    }

    #[test]
    fn rejects_invalid_panoramas() {
        let rejection = |image: &Image| Environment::from_panorama(image).map(|_| ()).unwrap_err();
        let gray = panorama(4, |_, _| [0.5; 3]);
        let tall = Image {
            width: 4,
            height: 8,
            ..gray.clone()
        };
        let aspect_error = rejection(&tall);
        assert!(aspect_error.contains("2:1"), "{aspect_error}");
        assert!(rejection(&Image::filled(0, 0, [0.0; 3])).contains("2:1"));
        let black = rejection(&Image::filled(8, 4, [0.0; 3]));
        assert!(!black.contains("2:1"), "{black}");
        assert_eq!(rejection(&Image::filled(8, 4, [-1.0; 3])), black);
        for invalid in [f32::NAN, f32::INFINITY] {
            let mut image = gray.clone();
            image.pixels[8 + 3] = [0.0, invalid, 0.0];
            let error = rejection(&image);
            assert!(error.contains('3') && error.contains('1'), "{error}");
            assert_ne!(error, black);
        }
        // A slightly negative channel is black.
        let mut image = gray;
        image.pixels[5] = [-0.1, 0.2, 0.3];
        assert!(Environment::from_panorama(&image).is_ok());
    }
}
