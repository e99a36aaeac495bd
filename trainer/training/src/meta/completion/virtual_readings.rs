//! Virtual readings: completed coefficients, evaluated at fixed directions.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear::unmap;
use glimpse_kernels::Dual;
use glimpse_kernels::lanes::{Octet, OctetDirections, WIDTH};
use glimpse_kernels::samples::{OctetRgb, transpose_rgb};
use glimpse_materials::basis::{Basis, angles_to_f64};
use glimpse_materials::sampling::{sobol_valid, sphere_view_samples};

/// The share of directions distributed like those of a rendered sphere, as in the loss.
const SPHERE_SHARE: f32 = 0.25;
/// The seed of the directions.
const SEED: u32 = 7;

/// The principal components at fixed directions. The number of directions is a multiple of eight.
pub struct VirtualReadings {
    /// The directions.
    pub angles: Vec<Angles<f32>>,
    /// The directions in octets.
    pub octet_directions: Vec<OctetDirections>,
    /// cos(theta_i) cos(theta_o) at each direction.
    cosines: Vec<f32>,
    /// The mean of the mapped training columns at each direction.
    pub center: Vec<f32>,
    /// The components: a row of m for each direction.
    pub rows: Vec<f32>,
    components: usize,
}

/// The BRDF at the directions, sr⁻¹, and its derivatives with respect to the mapped values.
pub struct VirtualValues {
    /// The BRDF in octets.
    pub octets: Vec<OctetRgb>,
    slopes: Vec<[f32; 3]>,
}

impl VirtualReadings {
    /// Evaluates the components of a basis at `count` directions, rounded up to whole octets.
    #[must_use]
    pub fn new(basis: &Basis, count: usize) -> Self {
        let count = count.next_multiple_of(WIDTH);
        let on_sphere = (SPHERE_SHARE * count as f32) as usize;
        let mut angles = sobol_valid(count - on_sphere, SEED);
        angles.extend(sphere_view_samples(on_sphere, SEED.into()));
        let directions: Vec<HalfDifference<f32>> = angles
            .iter()
            .copied()
            .map(HalfDifference::from_angles)
            .collect();
        let entries: Vec<_> = angles
            .iter()
            .map(|angles| basis.look_up(angles_to_f64(angles)))
            .collect();
        Self {
            octet_directions: directions.chunks(WIDTH).map(Octet::transpose).collect(),
            cosines: directions
                .iter()
                .map(|at| at.cos_theta_i() * at.cos_theta_o())
                .collect(),
            center: entries
                .iter()
                .map(|entry| entry.center()[0] as f32)
                .collect(),
            rows: entries
                .iter()
                .flat_map(|entry| entry.components.iter().map(|component| component[0] as f32))
                .collect(),
            components: basis.components(),
            angles,
        }
    }

    /// Returns the number of directions.
    #[must_use]
    pub fn len(&self) -> usize {
        self.angles.len()
    }

    /// Returns true without directions.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.angles.is_empty()
    }

    /// Evaluates coefficients: those of red, then of green, then of blue.
    #[must_use]
    pub fn values(&self, coefficients: &[f32]) -> VirtualValues {
        let rows = self.rows.chunks_exact(self.components);
        let each = rows.zip(&self.center).zip(&self.cosines);
        let (values, slopes): (Vec<[f32; 3]>, Vec<[f32; 3]>) = each
            .map(|((row, center), cosines)| {
                let mut values = [0.0; 3];
                let mut slopes = [0.0; 3];
                let channels = coefficients.chunks_exact(self.components);
                for ((value, slope), channel) in values.iter_mut().zip(&mut slopes).zip(channels) {
                    let products = row.iter().zip(channel);
                    let sum: f32 = products.map(|(entry, a)| entry * a).sum();
                    let mapped = Dual {
                        value: center + sum,
                        tangent: [1.0],
                    };
                    let brdf = unmap(mapped, Dual::from_value(*cosines));
                    (*value, [*slope]) = (brdf.value, brdf.tangent);
                }
                (values, slopes)
            })
            .unzip();
        VirtualValues {
            octets: values.chunks(WIDTH).map(transpose_rgb).collect(),
            slopes,
        }
    }

    /// Adds the gradient with respect to the coefficients, given the derivative with respect to the BRDF of each
    /// direction.
    pub fn add_gradient(
        &self,
        values: &VirtualValues,
        by_brdf: impl Iterator<Item = [f32; 3]>,
        by_coefficients: &mut [f32],
    ) {
        let rows = self.rows.chunks_exact(self.components);
        for ((row, slopes), by_brdf) in rows.zip(&values.slopes).zip(by_brdf) {
            let channels = by_coefficients.chunks_exact_mut(self.components);
            for ((channel, slope), by_f) in channels.zip(slopes).zip(by_brdf) {
                let factor = slope * by_f;
                for (entry, component) in channel.iter_mut().zip(row) {
                    *entry += factor * component;
                }
            }
        }
    }
}
