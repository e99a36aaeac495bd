//! Importance sampling of the mean BRDF (paper, "Mean-BRDF importance sampling").

use glimpse_core::geometry::{Angles, HalfDifference};
use rayon::prelude::*;

use super::{RANGE, transformed_sobol};
use crate::Material;

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
    use crate::Procedural;

    #[test]
    fn samples_follow_the_density() {
        let materials: Vec<Box<dyn Material>> = Procedural::set(5, 3)
            .into_iter()
            .map(|material| Box::new(material) as Box<dyn Material>)
            .collect();
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
