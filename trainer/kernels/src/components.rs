//! The loss of a material that is made of principal components, a function of its coefficients, on
//! lanes.

use glimpse_core::model::linear::unmap;
use glimpse_core::model::loss::cosine_weighted_log_error;

use crate::dual::Dual;
use crate::lanes::{Kernel, Lanes, MOST_OCTETS, Octet, dispatch};
use crate::samples::OctetRgb;

/// Principal components at many directions, eight in an octet.
#[derive(Clone, Debug, Default)]
pub struct ComponentTable {
    /// m.
    pub components: usize,
    /// For each octet of directions: cos(theta_i), cos(theta_i) cos(theta_o), the mean of
    /// ln((f w + e) / e), and the m components.
    pub octets: Vec<Octet>,
}

/// Octets of a direction before its components.
pub const HEAD: usize = 3;

impl ComponentTable {
    fn row(&self, octet: u32) -> &[Octet] {
        let length = HEAD + self.components;
        &self.octets[octet as usize * length..][..length]
    }

    /// The weighted loss over some octets of directions, of coefficients of red, green and blue one
    /// after the other, and that of black, f = 0; adds the first one's gradient by the coefficients, if
    /// that is asked for.
    ///
    /// `values` are the material's there, sr^-1, and every one counts for `weight`.
    #[must_use]
    pub fn loss(
        &self,
        coefficients: &[f32],
        order: &[u32],
        values: &[OctetRgb],
        weight: f32,
        gradient: Option<&mut [f32]>,
    ) -> [f32; 2] {
        dispatch(ComponentLoss {
            table: self,
            coefficients,
            order,
            values,
            weight,
            gradient,
        })
    }
}

struct ComponentLoss<'a, 'g> {
    table: &'a ComponentTable,
    coefficients: &'a [f32],
    order: &'a [u32],
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
        let mut of_black = L::constant(0.0);
        let mut sums = vec![L::zero_sum(); 3 * components];
        let none = Octet::default();
        for (order, values) in self
            .order
            .chunks(L::OCTETS)
            .zip(self.values.chunks(L::OCTETS))
        {
            let last = order.len() - 1;
            let mut rows = [self.table.row(order[0]); MOST_OCTETS];
            let mut rgb = [&values[0]; MOST_OCTETS];
            let counts = Octet([self.weight; 8]);
            let mut weights = [&none; MOST_OCTETS];
            for k in 0..L::OCTETS {
                rows[k] = self.table.row(order[k.min(last)]);
                rgb[k] = &values[k.min(last)];
                weights[k] = if k <= last { &counts } else { &none };
            }
            let [a, b, c, d] = rows;
            // No closure: the compiler leaves those out of line.
            macro_rules! head {
                ($index:expr) => {
                    L::load([&a[$index], &b[$index], &c[$index], &d[$index]])
                };
            }
            let (cosine, cosines, mean) = (head!(0), head!(1), head!(2));
            let (mut by_red, mut by_green, mut by_blue) = (mean, mean, mean);
            for k in 0..components {
                let row = head!(HEAD + k);
                by_red = by_red.plus_product(row, L::broadcast(red[k]));
                by_green = by_green.plus_product(row, L::broadcast(green[k]));
                by_blue = by_blue.plus_product(row, L::broadcast(blue[k]));
            }
            let zero = Dual::from_value(L::constant(0.0));
            let cosines = Dual::from_value(cosines);
            let along = [L::constant(1.0)];
            let red = unmap(
                Dual {
                    value: by_red,
                    tangent: along,
                },
                zero,
                cosines,
            );
            let green = unmap(
                Dual {
                    value: by_green,
                    tangent: along,
                },
                zero,
                cosines,
            );
            let blue = unmap(
                Dual {
                    value: by_blue,
                    tangent: along,
                },
                zero,
                cosines,
            );
            let [e, f, g, h] = rgb;
            let measured = [
                L::load([&e[0], &f[0], &g[0], &h[0]]),
                L::load([&e[1], &f[1], &g[1], &h[1]]),
                L::load([&e[2], &f[2], &g[2], &h[2]]),
            ];
            let modeled = [red.value, green.value, blue.value];
            let weight = L::load(weights);
            let found = cosine_weighted_log_error(measured, modeled, cosine, weight);
            loss = loss + found.error.value();
            let nothing = [L::constant(0.0); 3];
            let black = cosine_weighted_log_error(measured, nothing, cosine, weight);
            of_black = of_black + black.error.value();
            if self.gradient.is_some() {
                let [by_red, by_green, by_blue] = found.by_modeled;
                let by_red = by_red * red.tangent[0];
                let by_green = by_green * green.tangent[0];
                let by_blue = by_blue * blue.tangent[0];
                for k in 0..components {
                    let row = head!(HEAD + k);
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
        [loss.total(), of_black.total()]
    }
}
