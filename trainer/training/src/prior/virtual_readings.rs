//! Virtual readings: completed coefficients, evaluated at fixed directions.

use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::linear::unmap;
use glimpse_fitting::linear::ComponentsAt;
use glimpse_kernels::Dual;
use glimpse_kernels::lanes::{Octet, OctetDirections, WIDTH};
use glimpse_kernels::samples::{OctetRgb, transpose_rgb};
use glimpse_materials::basis::Basis;
use glimpse_materials::sampling::{sobol_valid, sphere_view_samples};

/// The share of directions distributed like those of a rendered sphere, as in the loss.
const SPHERE_SHARE: f32 = 0.25;
/// The seed of the directions.
const SEED: u32 = 7;

/// The principal components at fixed directions. The number of directions is a multiple of eight.
pub struct VirtualReadings {
    /// The components.
    pub at: ComponentsAt,
    /// The directions in octets.
    pub octet_directions: Vec<OctetDirections>,
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
        let directions = angles.iter().copied().map(HalfDifference::from_angles);
        let directions: Vec<HalfDifference<f32>> = directions.collect();
        Self {
            octet_directions: directions.chunks(WIDTH).map(Octet::transpose).collect(),
            at: ComponentsAt::new(basis, angles),
        }
    }

    /// Returns the number of directions.
    #[must_use]
    pub fn len(&self) -> usize {
        self.at.count()
    }

    /// Returns true without directions.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.at.angles.is_empty()
    }

    /// Evaluates coefficients: those of red, then of green, then of blue.
    #[must_use]
    pub fn values(&self, coefficients: &[f32]) -> VirtualValues {
        let components = self.at.components;
        let rows = self.at.rows.chunks_exact(components);
        let each = rows.zip(&self.at.mean).zip(&self.at.cosines);
        let (values, slopes): (Vec<[f32; 3]>, Vec<[f32; 3]>) = each
            .map(|((row, center), cosines)| {
                let mut values = [0.0; 3];
                let mut slopes = [0.0; 3];
                let channels = coefficients.chunks_exact(components);
                for ((value, slope), channel) in values.iter_mut().zip(&mut slopes).zip(channels) {
                    let products = row.iter().zip(channel);
                    let sum: f32 = products.map(|(entry, a)| entry * a).sum();
                    let mapped = Dual {
                        value: center.value + sum,
                        tangent: [1.0],
                    };
                    let brdf = unmap(mapped, Dual::from_value(cosines.value));
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
        let rows = self.at.rows.chunks_exact(self.at.components);
        for ((row, slopes), by_brdf) in rows.zip(&values.slopes).zip(by_brdf) {
            let channels = by_coefficients.chunks_exact_mut(self.at.components);
            for ((channel, slope), by_f) in channels.zip(slopes).zip(by_brdf) {
                let factor = slope * by_f;
                for (entry, component) in channel.iter_mut().zip(row) {
                    *entry += factor * component;
                }
            }
        }
    }
}
