//! Light from every direction, in tables that are quick to look up.

use std::f64::consts::PI;

use super::Image;
use super::octahedral::{CELLS, Gathered, Table, between};

/// Grids that light from a file is gathered on: of 256, 128, 64, 32 and 16 cells along
/// a side.
const LEVELS: usize = 5;
/// The least number of samples from pole to pole of a panorama: one in a thirteenth of a degree,
/// so that the cells around every node of the finest grid get a hundred and more.
const ROWS: usize = 2_400;
/// What a panorama's width may be for each pixel of its height.
const SHAPES: std::ops::RangeInclusive<f32> = 1.9..=2.1;

/// Light from infinitely far away: radiance in linear RGB as a function of direction.
///
/// Directions are unit vectors in the picture's frame: x to the right, y up, z towards the viewer.
/// Radiance is relative; [exposure](super::Image::tone_map) is chosen for the built-in
/// [`studio`](Environment::studio).
///
/// The sphere of directions is unfolded into a square (its octahedral map) and interpolated
/// bilinearly between 257 x 257 nodes. An environment from a file comes with blurred copies of
/// itself: where the nodes that a picture is integrated over are far apart, each sees the mean
/// over its surroundings, so that a sun of half a degree falls neither between them nor on one of
/// them as if it filled all the sky around (as in filtered importance sampling, Krivanek and
/// Colbert 2008). White paint under nothing but such a sun comes out right to 4 % (standard
/// deviation over the sphere; 14 % at worst), the edge of its lit half is softened by some degrees.
#[derive(Clone, Debug)]
pub struct Environment {
    sharp: Table,
    /// Each twice as blurred as the one before, the first twice as blurred as `sharp`.
    blurred: Vec<Table>,
    exposure: f32,
}

impl Environment {
    /// Tabulates a radiance. Features narrower than about three degrees are lost.
    #[must_use]
    pub fn from_fn(radiance: impl Fn([f32; 3]) -> [f32; 3]) -> Self {
        Self {
            sharp: Table::from_fn(radiance),
            blurred: Vec::new(),
            exposure: 1.0,
        }
    }

    /// The same radiance from everywhere.
    #[must_use]
    pub fn constant(radiance: [f32; 3]) -> Self {
        Self::from_fn(|_| radiance)
    }

    /// The light of a panorama in latitude and longitude, laid out as [`Environment::read`] says.
    /// What is negative counts as black. Exposure is chosen by [`Environment::expose`]. Errors say
    /// what is wrong, and the remedy.
    pub(super) fn from_panorama(panorama: &Image) -> Result<Self, String> {
        let mut grids = vec![gather(panorama)?];
        while let (Some(last), true) = (grids.last(), grids.len() < LEVELS) {
            grids.push(last.coarser());
        }
        let mut tables = grids.iter().map(Gathered::to_table);
        let mut environment = Self {
            sharp: tables.next().ok_or("no light")?,
            blurred: tables.collect(),
            exposure: 1.0,
        };
        environment.expose()?;
        Ok(environment)
    }

    /// The radiance arriving from a unit direction.
    #[must_use]
    pub fn radiance(&self, direction: [f32; 3]) -> [f32; 3] {
        let [r, g, b, _] = self.sharp.padded(direction);
        [r, g, b]
    }

    /// The factor that the radiance of its file was multiplied by; 1 without a file.
    #[must_use]
    pub fn exposure(&self) -> f32 {
        self.exposure
    }

    /// True if there may be small bright sources in it.
    pub(super) fn is_detailed(&self) -> bool {
        !self.blurred.is_empty()
    }

    /// How blurred an integral should see it whose nodes lie so many radians apart: 0 is sharp, each
    /// 1 more doubles the blur. Light is spread as far as to the next node: less would lose it
    /// between nodes, more would soften the edge of the lit half of a sphere for nothing.
    pub(super) fn blur(&self, spacing: f32) -> f32 {
        let cell = (4.0 * PI).sqrt() as f32 / CELLS as f32;
        (spacing / cell)
            .log2()
            .clamp(0.0, self.blurred.len() as f32)
    }

    /// The radiance from a unit direction, and a 0, with a blur that [`Environment::blur`] gave.
    #[inline(always)]
    pub(super) fn blurred(&self, direction: [f32; 3], blur: f32) -> [f32; 4] {
        if self.blurred.is_empty() {
            return self.sharp.padded(direction);
        }
        let less = self.table(blur as usize).padded(direction);
        let more = self.table(blur as usize + 1).padded(direction);
        between(less, more, blur.fract())
    }

    /// A table by its blur, the most blurred one if there is none of so much.
    #[inline(always)]
    fn table(&self, blur: usize) -> &Table {
        match blur {
            0 => &self.sharp,
            blur => self
                .blurred
                .get(blur - 1)
                .or(self.blurred.last())
                .unwrap_or(&self.sharp),
        }
    }

    /// Scales the light so that a white diffuse sphere is, averaged over what the viewer sees of
    /// it, as bright as in the studio (luminance of Rec. 709).
    fn expose(&mut self) -> Result<(), String> {
        let brightness = self.brightness();
        let factor = (Self::studio().brightness() / brightness) as f32;
        if !(brightness > 0.0 && factor.is_normal()) {
            return Err(format!(
                "a white sphere would have the brightness {brightness:e} in its light: give a \
                 panorama that is not black"
            ));
        }
        self.sharp.scale(factor);
        for table in &mut self.blurred {
            table.scale(factor);
        }
        self.exposure *= factor;
        Ok(())
    }

    /// Mean luminance of a white diffuse sphere over its visible disc.
    fn brightness(&self) -> f64 {
        // The disc's mean under light of irradiance 1 from an angle gamma to the viewer: Lambert's
        // phase law. Its integral over the sphere of directions is 1.
        let sphere = |[_, _, z]: [f32; 3]| {
            let cos = f64::from(z).clamp(-1.0, 1.0);
            let (gamma, sin) = (cos.acos(), (1.0 - cos * cos).sqrt());
            2.0 / (3.0 * PI * PI) * (sin + (PI - gamma) * cos)
        };
        luminance(self.sharp.integral(sphere))
    }
}

/// Of linear RGB with the primaries of Rec. 709.
fn luminance([r, g, b]: [f64; 3]) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// The light of a panorama on the finest grid.
fn gather(panorama: &Image) -> Result<Gathered, String> {
    let Image {
        width,
        height,
        ref pixels,
    } = *panorama;
    let shape = width as f32 / height as f32;
    if !SHAPES.contains(&shape) || pixels.len() != width * height {
        return Err(format!(
            "{width} x {height} pixels are not the 2:1 of a panorama in latitude and longitude: \
             convert it to that"
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
    // Samples in each pixel, down and across.
    let (down, across) = (ROWS.div_ceil(height), (2 * ROWS).div_ceil(width));
    let turn = 2.0 * PI / (width * across) as f64;
    let azimuths: Vec<[f32; 2]> = (0..width * across)
        .map(|column| ((column as f64 + 0.5) * turn).sin_cos())
        .map(|(sin, cos)| [-sin as f32, cos as f32])
        .collect();
    let mut gathered = Gathered::new(CELLS);
    let step = PI / (height * down) as f64;
    for row in 0..height * down {
        let edges = [row, row + 1].map(|row| (row as f64 * step).cos());
        let solid_angle = (edges[0] - edges[1]) * turn;
        let (sin, cos) = ((row as f64 + 0.5) * step).sin_cos();
        let (sin, cos) = (sin as f32, cos as f32);
        let line = pixels.iter().skip(row / down * width).take(width);
        for (pixel, azimuths) in line.zip(azimuths.chunks_exact(across)) {
            let [r, g, b] = pixel.map(|channel| f64::from(channel.max(0.0)) * solid_angle);
            for [x, z] in azimuths {
                gathered.add([sin * x, cos, sin * z], [r, g, b, solid_angle]);
            }
        }
    }
    Ok(gathered)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Unit directions all over the sphere, poles and equator included.
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
    fn a_table_follows_its_function_without_seams() {
        let smooth = |[x, y, z]: [f32; 3]| [1.0 + x, 2.0 + y * z, (3.0 * z).exp()];
        let environment = Environment::from_fn(smooth);
        for direction in directions() {
            for (looked_up, exact) in environment
                .radiance(direction)
                .iter()
                .zip(smooth(direction))
            {
                assert!(
                    (looked_up - exact).abs() < 2e-3 * exact.max(1.0),
                    "{direction:?}: {looked_up} instead of {exact}"
                );
            }
        }
    }

    #[test]
    fn directions_that_are_none_do_no_harm() {
        let environment = Environment::constant([1.0, 2.0, 3.0]);
        for direction in [[0.0; 3], [f32::NAN; 3], [f32::INFINITY, 0.0, 0.0]] {
            let _ = environment.radiance(direction);
        }
        assert_eq!(environment.radiance([0.0, 0.0, -1.0]), [1.0, 2.0, 3.0]);
    }

    /// A panorama by column and row.
    fn panorama(height: usize, radiance: impl Fn(usize, usize) -> [f32; 3]) -> Image {
        let width = 2 * height;
        let pixels = (0..width * height).map(|index| radiance(index % width, index / width));
        Image {
            width,
            height,
            pixels: pixels.collect(),
        }
    }

    /// The integral of a panorama's green light over the sphere, pixel by pixel.
    fn light(panorama: &Image) -> f64 {
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
    fn light_is_conserved_however_small_its_source() {
        // One pixel of 0.35 degrees at a pole, at the equator, in between, and on the border and
        // corner of the square; and light everywhere.
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
            let gathered = gather(&sun).unwrap();
            let expected = light(&sun);
            for (level, grid) in std::iter::successors(Some(gathered), |grid| Some(grid.coarser()))
                .take(LEVELS)
                .enumerate()
            {
                let [_, found, _] = grid.to_table().integral(|_| 1.0);
                assert!(
                    (found / expected - 1.0).abs() < 0.01,
                    "sun at ({column}, {row}), level {level}: {found} instead of {expected}"
                );
            }
        }
        for height in [1, 7, 64, 1300] {
            let white = gather(&panorama(height, |_, _| [0.5, 1.0, 2.0])).unwrap();
            let table = white.to_table();
            let found = table.integral(|_| 1.0).map(|channel| channel / (4.0 * PI));
            for (found, expected) in found.into_iter().zip([0.5, 1.0, 2.0]) {
                assert!((found / expected - 1.0).abs() < 1e-3, "{found}");
            }
            for direction in directions() {
                let [r, g, b, _] = table.padded(direction);
                assert!((r - 0.5).abs() + (g - 1.0).abs() + (b - 2.0).abs() < 1e-4);
            }
        }
    }

    #[test]
    fn a_panorama_is_the_right_way_round() {
        // Red brightens to the right of the center, green upwards, blue towards the center.
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
        // Exposure is one factor for all.
        let [_, middle, _] = environment.radiance([1.0, 0.0, 0.0]);
        for [x, y, z] in directions() {
            let expected = [2.0 + x, 2.0 + y, 2.0 - z].map(|channel| 0.5 * middle * channel);
            for (found, expected) in environment.radiance([x, y, z]).into_iter().zip(expected) {
                assert!(
                    (found / expected - 1.0).abs() < 0.05,
                    "{x} {y} {z}: {found} {expected}"
                );
            }
        }
    }

    #[test]
    fn exposure_makes_a_white_sphere_as_bright_as_in_the_studio() {
        let dim = panorama(16, |column, row| [1e-4 * (1 + column + row) as f32; 3]);
        let environment = Environment::from_panorama(&dim).unwrap();
        let studio = Environment::studio().brightness();
        assert!((environment.brightness() / studio - 1.0).abs() < 1e-5);
        // The phase law's integral over all directions is 1.
        assert!((Environment::constant([1.0; 3]).brightness() - 1.0).abs() < 1e-3);
    }

    #[test]
    fn panoramas_that_give_no_light_are_refused() {
        let refused = |image: &Image| Environment::from_panorama(image).map(|_| ()).unwrap_err();
        let gray = panorama(4, |_, _| [0.5; 3]);
        let high = Image {
            width: 4,
            height: 8,
            ..gray.clone()
        };
        let proportion = refused(&high);
        assert!(proportion.contains("2:1"), "{proportion}");
        assert!(refused(&Image::filled(0, 0, [0.0; 3])).contains("2:1"));
        let black = refused(&Image::filled(8, 4, [0.0; 3]));
        assert!(!black.contains("2:1"), "{black}");
        assert_eq!(refused(&Image::filled(8, 4, [-1.0; 3])), black);
        for broken in [f32::NAN, f32::INFINITY] {
            let mut image = gray.clone();
            image.pixels[8 + 3] = [0.0, broken, 0.0];
            let place = refused(&image);
            assert!(place.contains('3') && place.contains('1'), "{place}");
            assert_ne!(place, black);
        }
        // A slightly negative channel is black.
        let mut image = gray;
        image.pixels[5] = [-0.1, 0.2, 0.3];
        assert!(Environment::from_panorama(&image).is_ok());
    }
}
