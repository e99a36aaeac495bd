//! Sampling of directions: uniform, as seen on a sphere, by a Sobol sequence, or in proportion to the mean BRDF.

use std::f32::consts::{FRAC_PI_2, PI, TAU};
use std::iter::repeat_with;

use glimpse_core::geometry::{Angles, Directions, HalfDifference};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::{Material, angles_of};

/// Upper limits of theta_h, theta_d and phi_d, radians. The lower limits are 0.
pub const RANGE: [f32; 3] = [FRAC_PI_2, FRAC_PI_2, PI];
/// The length of a sequence of `sobol_burley`.
const SOBOL_POINTS: u32 = 1 << 16;

/// Returns a stream of the random numbers of a seed.
#[must_use]
pub fn random_stream(seed: u64, stream: u64) -> ChaCha8Rng {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(stream);
    random
}

/// Returns `count` angles that are uniform in (theta_h, theta_d, phi_d) over the valid region, by rejection. phi_d is
/// in \[0, 2 pi).
#[must_use]
pub fn uniform_valid(count: usize, seed: u64) -> Vec<Angles<f32>> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let [theta_h, theta_d, phi_d] = RANGE;
    let ranges = [theta_h, theta_d, 2.0 * phi_d];
    let drawn = repeat_with(|| ranges.map(|range| range * random.random::<f32>()));
    let drawn = drawn.map(Angles::from_array);
    let is_valid = |angles: &Angles<f32>| HalfDifference::from_angles(*angles).is_valid();
    drawn.filter(is_valid).take(count).collect()
}

/// Returns `count` angles with the distribution of an orthographic image of a sphere under a uniform sky. phi_d is in
/// \[0, 2 pi).
#[must_use]
pub fn sphere_view_samples(count: usize, seed: u64) -> Vec<Angles<f32>> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let drawn = repeat_with(|| {
        // The image of the sphere is a disc, so that sin^2(theta_o) is uniform. Under a uniform sky, cos(theta_i) is
        // uniform.
        let [sin_squared, cos_theta_i, turn]: [f32; 3] = random.random();
        let (sin_phi, cos_phi) = (TAU * turn).sin_cos();
        let sin_theta_i = (1.0 - cos_theta_i * cos_theta_i).sqrt();
        let directions = Directions {
            incoming: [sin_theta_i * cos_phi, sin_theta_i * sin_phi, cos_theta_i],
            outgoing: [sin_squared.sqrt(), 0.0, (1.0 - sin_squared).sqrt()],
        };
        HalfDifference::from_directions(&directions).filter(HalfDifference::is_valid)
    });
    let angles = drawn.flatten().map(|at| angles_of(&at));
    angles.take(count).collect()
}

/// Returns the first `count` valid points of the three-dimensional Sobol sequence, Owen-scrambled with `seed` and
/// scaled to [`RANGE`]. phi_d is in \[0, pi). Returns fewer points if 65,536 candidates do not suffice.
#[must_use]
pub fn sobol_valid(count: usize, seed: u32) -> Vec<Angles<f32>> {
    transformed_sobol(count, seed, |[h, d, phi]| Angles {
        theta_h: RANGE[0] * h,
        theta_d: RANGE[1] * d,
        phi_d: RANGE[2] * phi,
    })
}

/// Returns the first `count` valid angles that a function makes of the points of the Sobol sequence in the unit cube.
fn transformed_sobol(
    count: usize,
    seed: u32,
    angles: impl Fn([f32; 3]) -> Angles<f32>,
) -> Vec<Angles<f32>> {
    (0..SOBOL_POINTS)
        .map(|index| angles([0, 1, 2].map(|axis| sobol_burley::sample(index, axis, seed))))
        .filter(|angles| HalfDifference::from_angles(*angles).is_valid())
        .take(count)
        .collect()
}

/// The number of cells along theta_h, theta_d and phi_d.
const CELLS: [usize; 3] = [48, 48, 24];
/// The number of cells with the same theta_h and theta_d.
const ROW: usize = CELLS[2];
/// The number of cells with the same theta_h.
const SLAB: usize = CELLS[1] * CELLS[2];
/// An offset that keeps the logarithm of a black BRDF finite, sr^-1.
const LOG_OFFSET: f32 = 1e-4;

/// The geometric mean of materials' BRDFs times cos(theta_i), as a density over (theta_h, theta_d, phi_d). It is
/// constant in each of 48 x 48 x 24 cells, and 0 where a direction is below the horizon.
pub struct MeanBrdf {
    /// The density of each cell, not normalized. theta_h varies slowest, phi_d fastest.
    density: Vec<f64>,
}

impl MeanBrdf {
    /// Averages the logarithms of the materials' BRDFs over materials and channels.
    #[must_use]
    pub fn new(materials: &[Box<dyn Material>]) -> Self {
        let density = (0..CELLS[0] * SLAB).into_par_iter().map(|cell| {
            let angles = angles([cell / SLAB, cell % SLAB / ROW, cell % ROW], [0.5; 3]);
            let at = HalfDifference::from_angles(angles);
            if !at.is_valid() {
                return 0.0;
            }
            let logarithms = materials.iter().flat_map(|material| {
                material
                    .at_angles(angles)
                    .map(|f| f64::from(f.max(0.0) + LOG_OFFSET).ln())
            });
            let mean = logarithms.sum::<f64>() / (3 * materials.len()).max(1) as f64;
            mean.exp() * f64::from(at.cos_theta_i())
        });
        Self {
            density: density.collect(),
        }
    }

    /// Returns `count` valid samples: points of an Owen-scrambled Sobol sequence, transformed by the inverse cumulative
    /// distribution along each coordinate. Returns fewer if 65,536 points do not suffice.
    #[must_use]
    pub fn samples(&self, count: usize, seed: u32) -> Vec<Angles<f32>> {
        // A cell at the border of the valid region contains invalid angles.
        transformed_sobol(count, seed, |point| self.invert(point))
    }

    /// Transforms a point of the unit cube by the inverse cumulative distribution along each coordinate.
    fn invert(&self, point: [f32; 3]) -> Angles<f32> {
        let slabs = self.density.chunks(SLAB).map(|slab| slab.iter().sum());
        let (h, in_h) = invert_distribution(slabs, point[0]);
        let slab = self.density.chunks(SLAB).nth(h).unwrap_or_default();
        let (d, in_d) = invert_distribution(slab.chunks(ROW).map(|row| row.iter().sum()), point[1]);
        let row = slab.chunks(ROW).nth(d).unwrap_or_default();
        let (phi, in_phi) = invert_distribution(row.iter().copied(), point[2]);
        angles([h, d, phi], [in_h, in_d, in_phi])
    }
}

/// Returns the cell at which the cumulative distribution reaches `point` in \[0, 1\], and the position within the cell.
fn invert_distribution(densities: impl Iterator<Item = f64> + Clone, point: f32) -> (usize, f32) {
    let mut rest = f64::from(point) * densities.clone().sum::<f64>();
    let mut last = (0, 0.5);
    for (index, density) in densities.enumerate() {
        if density > 0.0 {
            if rest < density {
                return (index, (rest / density) as f32);
            }
            last = (index, 1.0);
        }
        rest -= density;
    }
    last
}

/// Returns the angles at a position within a cell, each coordinate in \[0, 1\].
fn angles(cell: [usize; 3], within: [f32; 3]) -> Angles<f32> {
    Angles::from_array(
        [0, 1, 2].map(|axis| RANGE[axis] * (cell[axis] as f32 + within[axis]) / CELLS[axis] as f32),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sphere_views_follow_disc_and_sky() {
        let angles = sphere_view_samples(20_000, 7);
        let fraction = |condition: &dyn Fn(&HalfDifference<f32>) -> bool| {
            let directions = angles.iter().copied().map(HalfDifference::from_angles);
            directions.filter(condition).count() as f32 / angles.len() as f32
        };
        // theta_o is below 45 degrees on half of the disc, and cos(theta_i) is above 0.75 on a quarter of the sky.
        let within_45 = fraction(&|at| at.cos_theta_o() > 0.5_f32.sqrt());
        let near_zenith = fraction(&|at| at.cos_theta_i() > 0.75);
        assert!((within_45 - 0.5).abs() < 0.02, "{within_45}");
        assert!((near_zenith - 0.25).abs() < 0.02, "{near_zenith}");
        assert!(
            angles
                .iter()
                .all(|at| HalfDifference::from_angles(*at).is_valid())
        );
    }

    #[test]
    fn samples_follow_the_density() {
        let materials = crate::Source("procedural:5:3".to_owned()).load();
        let materials = materials.expect("procedural materials");
        let mean = MeanBrdf::new(&materials);
        let samples = mean.samples(4_096, 1);
        assert_eq!(samples.len(), 4_096);
        let low = |angles: &&Angles<f32>| angles.theta_h < 0.5 * RANGE[0];
        let fraction = samples.iter().filter(low).count() as f64 / 4_096.0;
        let slabs: Vec<f64> = mean
            .density
            .chunks(SLAB)
            .map(|slab| slab.iter().sum())
            .collect();
        let expected = slabs[..CELLS[0] / 2].iter().sum::<f64>() / slabs.iter().sum::<f64>();
        assert!(
            (fraction - expected).abs() < 0.02,
            "{fraction} instead of {expected}"
        );
        assert!(
            expected > 0.6,
            "highlights are at small theta_h: {expected}"
        );
        assert_eq!(samples, mean.samples(4_096, 1));
    }

    #[test]
    fn inverts_a_distribution_with_empty_cells() {
        let densities = [0.0, 1.0, 0.0, 3.0];
        let cell_and_fraction = |point| invert_distribution(densities.into_iter(), point);
        assert_eq!(cell_and_fraction(0.0), (1, 0.0));
        assert_eq!(cell_and_fraction(0.125), (1, 0.5));
        assert_eq!(cell_and_fraction(0.25), (3, 0.0));
        assert_eq!(cell_and_fraction(0.625), (3, 0.5));
        assert_eq!(cell_and_fraction(1.0), (3, 1.0));
    }
}
