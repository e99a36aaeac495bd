//! The loss of a combination of principal components as a function of its coefficients, on lanes.

use glimpse_core::model::linear::unmap;
use glimpse_core::model::loss::cosine_weighted_log_error;

use crate::dual::Dual;
use crate::lanes::{InstructionSet, Lanes, MAX_OCTETS, Octet, WIDTH, add_totals, kernel, load};
use crate::samples::OctetRgb;

/// Principal components at many directions, eight directions per octet.
#[derive(Clone, Debug, Default)]
pub struct ComponentTable {
    /// m, the number of components.
    pub components: usize,
    /// One row per octet of directions: cos(theta_i), cos(theta_i) cos(theta_o), the mean of ln((f w + e) / e), and the
    /// m components.
    pub octets: Vec<Octet>,
}

/// The number of octets in a row before its components.
pub const HEADER_OCTETS: usize = 3;

impl ComponentTable {
    fn row(&self, octet: u32) -> &[Octet] {
        let length = HEADER_OCTETS + self.components;
        &self.octets[octet as usize * length..][..length]
    }
}

kernel! {
    on InstructionSet::detect();
    /// Returns the weighted loss at some directions, and the loss of a black material, f = 0, at the same directions.
    ///
    /// `coefficients` are those of red, then green, then blue. `octets` are the indices of octets of directions.
    /// `values` are the material's BRDF at these, sr^-1 (not times the cosine); each has weight `weight`. The gradient
    /// of the first loss with respect to the coefficients is added to `gradient`.
    #[must_use]
    pub fn component_loss<'a, L: Lanes>(
        table: &'a ComponentTable,
        coefficients: &'a [f32],
        octets: &'a [u32],
        values: &'a [OctetRgb],
        weight: f32,
        gradient: Option<&'a mut [f32]>,
    ) -> [f32; 2] {
        let components = table.components;
        let mut loss = L::constant(0.0);
        let mut black_loss = L::constant(0.0);
        let mut sums = vec![L::zero_sum(); 3 * components];
        let zero_weights = Octet::default();
        let full_weights = Octet([weight; WIDTH]);
        for (octets, values) in octets.chunks(L::OCTETS).zip(values.chunks(L::OCTETS)) {
            let last = octets.len() - 1;
            let mut rows = [table.row(octets[0]); MAX_OCTETS];
            let mut rgb = [&values[0]; MAX_OCTETS];
            let mut weights = [&zero_weights; MAX_OCTETS];
            for k in 0..L::OCTETS {
                rows[k] = table.row(octets[k.min(last)]);
                rgb[k] = &values[k.min(last)];
                if k <= last {
                    weights[k] = &full_weights;
                }
            }
            let cos_theta_i = load!(rows, row => row[0]);
            let cosine_product = load!(rows, row => row[1]);
            let mean = load!(rows, row => row[2]);
            let mut mapped = [mean; 3];
            for k in 0..components {
                let row = load!(rows, row => row[HEADER_OCTETS + k]);
                for (channel, mapped) in mapped.iter_mut().enumerate() {
                    let coefficient = coefficients[channel * components + k];
                    *mapped = mapped.plus_product(row, L::broadcast(coefficient));
                }
            }
            let black = [L::constant(0.0); 3];
            let [mut measured, mut modeled, mut slopes] = [black; 3];
            for channel in 0..3 {
                measured[channel] = load!(rgb, octets => octets[channel]);
                let mapped = Dual {
                    value: mapped[channel],
                    tangent: [L::constant(1.0)],
                };
                let brdf = unmap(mapped, Dual::from_value(cosine_product));
                modeled[channel] = brdf.value;
                slopes[channel] = brdf.tangent[0];
            }
            let weight = L::load(weights);
            let term = cosine_weighted_log_error(measured, modeled, cos_theta_i, weight);
            loss = loss + term.error.value();
            let black_term = cosine_weighted_log_error(measured, black, cos_theta_i, weight);
            black_loss = black_loss + black_term.error.value();
            if gradient.is_some() {
                let mut by_mapped = term.by_modeled;
                for (derivative, slope) in by_mapped.iter_mut().zip(slopes) {
                    *derivative = *derivative * slope;
                }
                for k in 0..components {
                    let row = load!(rows, row => row[HEADER_OCTETS + k]);
                    for (channel, by_mapped) in by_mapped.iter().enumerate() {
                        L::add_product(&mut sums[channel * components + k], *by_mapped, row);
                    }
                }
            }
        }
        if let Some(gradient) = gradient {
            add_totals::<L>(&sums, gradient);
        }
        [loss.total(), black_loss.total()]
    }
}
