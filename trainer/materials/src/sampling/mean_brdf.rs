//! Importance sampling of the mean BRDF (paper, "Mean-BRDF importance sampling").

use glimpse_core::geometry::{Angles, HalfDifference};
use rayon::prelude::*;

use super::range::RANGE;
use crate::Material;

/// Cells along theta_h, theta_d and phi_d.
const CELLS: [usize; 3] = [48, 48, 24];
/// Cells of all phi_d, and of all theta_d and phi_d.
const ROW: usize = CELLS[2];
const SLAB: usize = CELLS[1] * CELLS[2];
/// Keeps the logarithm of black finite, sr^-1.
const BLACK: f32 = 1e-4;

/// The logarithmic mean of materials, times the cosine, as a density over (theta_h, theta_d, phi_d);
/// 0 where a direction is below the horizon. It is constant within each of 48 x 48 x 24 cells.
pub struct MeanBrdf {
    /// The cells' shares, not normalized: theta_h slowest, phi_d fastest.
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
                    .brdf(angles)
                    .map(|f| f64::from(f.max(0.0) + BLACK).ln())
            });
            let mean = logarithms.sum::<f64>() / (3 * materials.len()).max(1) as f64;
            mean.exp() * f64::from(at.cos_theta_i())
        });
        Self {
            density: density.collect(),
        }
    }

    /// So many valid samples: points of an Owen-scrambled Sobol sequence through the inverse of the
    /// distribution, coordinate by coordinate.
    #[must_use]
    pub fn samples(&self, count: usize, seed: u32) -> Vec<Angles<f32>> {
        (0..1 << 16)
            .map(|index| {
                let point = [0, 1, 2].map(|axis| sobol_burley::sample(index, axis, seed));
                self.invert(point)
            })
            // A cell at the border may be valid at its center only.
            .filter(|angles| HalfDifference::from_angles(*angles).is_valid())
            .take(count)
            .collect()
    }

    /// The angles below which lie these shares of the distribution, coordinate by coordinate.
    fn invert(&self, point: [f32; 3]) -> Angles<f32> {
        let slabs = self.density.chunks(SLAB).map(|slab| slab.iter().sum());
        let (h, in_h) = inverse(slabs, point[0]);
        let slab = self.density.chunks(SLAB).nth(h).unwrap_or_default();
        let (d, in_d) = inverse(slab.chunks(ROW).map(|row| row.iter().sum()), point[1]);
        let row = slab.chunks(ROW).nth(d).unwrap_or_default();
        let (phi, in_phi) = inverse(row.iter().copied(), point[2]);
        angles([h, d, phi], [in_h, in_d, in_phi])
    }
}

/// The cell in which a share of the sum of all of them is reached, and how far within it.
fn inverse(shares: impl Iterator<Item = f64> + Clone, point: f32) -> (usize, f32) {
    let mut rest = f64::from(point) * shares.clone().sum::<f64>();
    let mut last = (0, 0.5);
    for (index, share) in shares.enumerate() {
        if share > 0.0 {
            if rest < share {
                return (index, (rest / share) as f32);
            }
            last = (index, 1.0);
        }
        rest -= share;
    }
    last
}

/// The angles at a place within a cell.
fn angles(cell: [usize; 3], within: [f32; 3]) -> Angles<f32> {
    let [theta_h, theta_d, phi_d] =
        [0, 1, 2].map(|axis| RANGE[axis] * (cell[axis] as f32 + within[axis]) / CELLS[axis] as f32);
    Angles {
        theta_h,
        theta_d,
        phi_d,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Procedural;

    #[test]
    fn samples_gather_where_the_mean_is_bright() {
        let materials: Vec<Box<dyn Material>> = Procedural::set(5, 3)
            .into_iter()
            .map(|material| Box::new(material) as Box<dyn Material>)
            .collect();
        let mean = MeanBrdf::new(&materials);
        let samples = mean.samples(4_096, 1);
        assert_eq!(samples.len(), 4_096);
        let low = |angles: &&Angles<f32>| angles.theta_h < 0.5 * RANGE[0];
        let found = samples.iter().filter(low).count() as f64 / 4_096.0;
        let slabs: Vec<f64> = mean
            .density
            .chunks(SLAB)
            .map(|slab| slab.iter().sum())
            .collect();
        let expected = slabs[..CELLS[0] / 2].iter().sum::<f64>() / slabs.iter().sum::<f64>();
        assert!(
            (found - expected).abs() < 0.02,
            "{found} instead of {expected}"
        );
        assert!(
            expected > 0.6,
            "highlights are at small theta_h: {expected}"
        );
        assert_eq!(samples, mean.samples(4_096, 1));
    }

    #[test]
    fn a_distribution_is_inverted_cell_by_cell() {
        let shares = [0.0, 1.0, 0.0, 3.0];
        let at = |point| inverse(shares.into_iter(), point);
        assert_eq!(at(0.0), (1, 0.0));
        assert_eq!(at(0.125), (1, 0.5));
        assert_eq!(at(0.25), (3, 0.0));
        assert_eq!(at(0.625), (3, 0.5));
        assert_eq!(at(1.0), (3, 1.0));
    }
}
