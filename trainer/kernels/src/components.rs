//! The loss of a combination of principal components as a function of its coefficients, on lanes.

use glimpse_core::model::linear::unmap;
use glimpse_core::model::loss::cosine_weighted_log_error;

use crate::dual::Dual;
use crate::lanes::{Kernel, Lanes, MAX_OCTETS, Octet, WIDTH, dispatch};
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

    /// Returns the weighted loss at some directions, and the loss of a black material, f = 0, at the same directions.
    ///
    /// `coefficients` are those of red, then green, then blue. `octets` are the indices of octets of directions.
    /// `values` are the material's BRDF at these, sr^-1 (not times the cosine); each has weight `weight`. The gradient
    /// of the first loss with respect to the coefficients is added to `gradient`.
    #[must_use]
    pub fn loss(
        &self,
        coefficients: &[f32],
        octets: &[u32],
        values: &[OctetRgb],
        weight: f32,
        gradient: Option<&mut [f32]>,
    ) -> [f32; 2] {
        dispatch(ComponentLoss {
            table: self,
            coefficients,
            octets,
            values,
            weight,
            gradient,
        })
    }
}

struct ComponentLoss<'a, 'g> {
    table: &'a ComponentTable,
    coefficients: &'a [f32],
    octets: &'a [u32],
    values: &'a [OctetRgb],
    weight: f32,
    gradient: Option<&'g mut [f32]>,
}

impl Kernel for ComponentLoss<'_, '_> {
    type Output = [f32; 2];

    #[inline(always)]
    fn run<L: Lanes>(self) -> [f32; 2] {
        let components = self.table.components;
        let (red, rest) = self.coefficients.split_at(components);
        let (green, blue) = rest.split_at(components);
        let mut loss = L::constant(0.0);
        let mut black_loss = L::constant(0.0);
        let mut sums = vec![L::zero_sum(); 3 * components];
        let zero_weights = Octet::default();
        for (octets, values) in self
            .octets
            .chunks(L::OCTETS)
            .zip(self.values.chunks(L::OCTETS))
        {
            let last = octets.len() - 1;
            let mut rows = [self.table.row(octets[0]); MAX_OCTETS];
            let mut rgb = [&values[0]; MAX_OCTETS];
            let full_weights = Octet([self.weight; WIDTH]);
            let mut weights = [&zero_weights; MAX_OCTETS];
            for k in 0..L::OCTETS {
                rows[k] = self.table.row(octets[k.min(last)]);
                rgb[k] = &values[k.min(last)];
                weights[k] = if k <= last {
                    &full_weights
                } else {
                    &zero_weights
                };
            }
            let [a, b, c, d] = rows;
            // This is a macro because the compiler does not inline closures here.
            macro_rules! entry {
                ($index:expr) => {
                    L::load([&a[$index], &b[$index], &c[$index], &d[$index]])
                };
            }
            let (cos_theta_i, cosine_product, mean) = (entry!(0), entry!(1), entry!(2));
            let (mut mapped_red, mut mapped_green, mut mapped_blue) = (mean, mean, mean);
            for k in 0..components {
                let row = entry!(HEADER_OCTETS + k);
                mapped_red = mapped_red.plus_product(row, L::broadcast(red[k]));
                mapped_green = mapped_green.plus_product(row, L::broadcast(green[k]));
                mapped_blue = mapped_blue.plus_product(row, L::broadcast(blue[k]));
            }
            let cosine_product = Dual::from_value(cosine_product);
            let tangent = [L::constant(1.0)];
            let red = unmap(
                Dual {
                    value: mapped_red,
                    tangent,
                },
                cosine_product,
            );
            let green = unmap(
                Dual {
                    value: mapped_green,
                    tangent,
                },
                cosine_product,
            );
            let blue = unmap(
                Dual {
                    value: mapped_blue,
                    tangent,
                },
                cosine_product,
            );
            let [e, f, g, h] = rgb;
            let measured = [
                L::load([&e[0], &f[0], &g[0], &h[0]]),
                L::load([&e[1], &f[1], &g[1], &h[1]]),
                L::load([&e[2], &f[2], &g[2], &h[2]]),
            ];
            let modeled = [red.value, green.value, blue.value];
            let weight = L::load(weights);
            let term = cosine_weighted_log_error(measured, modeled, cos_theta_i, weight);
            loss = loss + term.error.value();
            let black = [L::constant(0.0); 3];
            let black_term = cosine_weighted_log_error(measured, black, cos_theta_i, weight);
            black_loss = black_loss + black_term.error.value();
            if self.gradient.is_some() {
                let [by_red, by_green, by_blue] = term.by_modeled;
                let by_red = by_red * red.tangent[0];
                let by_green = by_green * green.tangent[0];
                let by_blue = by_blue * blue.tangent[0];
                for k in 0..components {
                    let row = entry!(HEADER_OCTETS + k);
                    L::add_product(&mut sums[k], by_red, row);
                    L::add_product(&mut sums[components + k], by_green, row);
                    L::add_product(&mut sums[2 * components + k], by_blue, row);
                }
            }
        }
        if let Some(gradient) = self.gradient {
            let mut totals = vec![0.0; 3 * components];
            L::totals(&sums, &mut totals);
            for (entry, total) in gradient.iter_mut().zip(totals) {
                *entry += total;
            }
        }
        [loss.total(), black_loss.total()]
    }
}
