//! The outer loss of one task of the model Linear, and its gradient through the solve.

use glimpse_core::fit::ridge::{RidgeGradient, scratch_length};
use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear::unmap;
use glimpse_core::model::loss::cosine_weighted_log_error;
use glimpse_kernels::Dual;
use glimpse_materials::basis::{AngleDual, Basis, Coefficients, angles_to_f64};
use rayon::prelude::*;

use crate::linear::ReducedBasis;

/// A basis, evaluated at the directions of the outer loss.
pub struct OuterBasis {
    pub(super) basis: Basis,
    directions: Vec<HalfDifference<f64>>,
    components: Vec<f32>,
    center: Vec<f64>,
}

impl OuterBasis {
    /// Evaluates a basis at angles in radians.
    #[must_use]
    pub fn new(basis: Basis, angles: &[Angles<f32>]) -> Self {
        let angles: Vec<Angles<f64>> = angles.iter().map(angles_to_f64).collect();
        let blocks: Vec<ReducedBasis> = angles
            .par_chunks(256)
            .map(|angles| ReducedBasis::new(&basis, angles))
            .collect();
        let components = blocks.iter().flat_map(|block| &block.basis);
        let center = blocks.iter().flat_map(|block| &block.center);
        Self {
            directions: angles
                .into_iter()
                .map(HalfDifference::from_angles)
                .collect(),
            components: components.map(|value| *value as f32).collect(),
            center: center.map(|dual| dual.value).collect(),
            basis,
        }
    }
}

/// The outer samples of one material, which define its loss as a function of coefficients.
pub struct OuterSamples<'a> {
    /// The basis at all directions of the pool.
    pub basis: &'a OuterBasis,
    /// The directions of the loss, as indices into the pool.
    pub directions: &'a [u32],
    /// The material's BRDF at all directions of the pool, sr⁻¹.
    pub values: &'a [[f32; 3]],
}

impl OuterSamples<'_> {
    /// Returns the mean loss of coefficients, and adds its derivatives with respect to the coefficients to `lambda`.
    #[must_use]
    pub fn loss(&self, coefficients: &Coefficients, mut lambda: Option<&mut Coefficients>) -> f64 {
        let outer = self.basis;
        let components = outer.basis.components();
        let share = 1.0 / (3.0 * self.directions.len() as f64);
        let mut loss = 0.0;
        for direction in self.directions {
            let index = *direction as usize;
            let row = &outer.components[index * components..][..components];
            let direction = &outer.directions[index];
            let weight = Dual::from_value(direction.cos_theta_i() * direction.cos_theta_o());
            // Dual numbers, because `unmap` in core has no separate derivative.
            let modeled: [Dual<f64>; 3] = coefficients.each_ref().map(|coefficients| {
                let products = row.iter().zip(coefficients);
                let sum: f64 = products.map(|(a, c)| f64::from(*a) * c).sum();
                let mapped = Dual {
                    value: sum + outer.center[index],
                    tangent: [1.0],
                };
                unmap(mapped, weight)
            });
            let weighted = cosine_weighted_log_error(
                self.values[index].map(f64::from),
                modeled.map(|brdf| brdf.value),
                direction.cos_theta_i(),
                share,
            );
            loss += weighted.error.value();
            let Some(lambda) = &mut lambda else {
                continue;
            };
            for ((lambda, by_brdf), brdf) in lambda.iter_mut().zip(weighted.by_modeled).zip(modeled)
            {
                let slope = by_brdf * brdf.tangent[0];
                for (entry, a) in lambda.iter_mut().zip(row) {
                    *entry += slope * f64::from(*a);
                }
            }
        }
        loss
    }
}

/// The outer loss of one material, and its gradient.
#[derive(Clone, Debug)]
pub struct TaskGradient {
    /// The loss.
    pub loss: f64,
    /// The derivatives with respect to theta_h, theta_d and phi_d of each sample.
    pub by_angles: Vec<[f64; 3]>,
    /// The derivative with respect to the precision of each coefficient.
    pub by_precision: Vec<f64>,
}

impl TaskGradient {
    /// Fits the coefficients of a material measured at the pattern, and differentiates its loss. `precision` is
    /// factorized by [`ReducedBasis::factorize`].
    #[must_use]
    pub fn new(
        reduced: &ReducedBasis,
        (precision, factors): (&[f64], &[f64]),
        measured: &[[AngleDual; 3]],
        outer: &OuterSamples<'_>,
    ) -> Self {
        let samples = reduced.samples();
        let components = precision.len();
        let system = reduced.system(precision);
        let mut scratch = vec![0.0; components + scratch_length(samples, components)];
        let zeros = || [(); 3].map(|()| vec![0.0; components]);
        let mapped: [Vec<AngleDual>; 3] = [0, 1, 2].map(|channel| {
            let brdf = measured.iter().map(|brdf| brdf[channel]).enumerate();
            brdf.map(|(sample, brdf)| reduced.mapped(sample, brdf))
                .collect()
        });
        let values: [Vec<f64>; 3] = mapped
            .each_ref()
            .map(|mapped| mapped.iter().map(|mapped| mapped.value).collect());
        let mut coefficients = zeros();
        for (values, coefficients) in values.iter().zip(&mut coefficients) {
            system.solve(factors, values, coefficients, &mut scratch);
        }
        let mut lambda = zeros();
        let loss = outer.loss(&coefficients, Some(&mut lambda));

        let mut by_angles = vec![[0.0; 3]; samples];
        let mut by_basis = vec![0.0; samples * components];
        let mut by_precision = vec![0.0; components];
        for channel in 0..3 {
            let mut by_mapped = vec![0.0; samples];
            let mut gradient = RidgeGradient {
                targets: &mut by_mapped,
                rows: &mut by_basis,
                precision: &mut by_precision,
            };
            let solved = (&values[channel][..], &coefficients[channel][..]);
            system.adjoint(
                factors,
                solved,
                &lambda[channel],
                &mut gradient,
                &mut scratch,
            );
            let mapped = mapped[channel].iter().zip(by_mapped);
            for (by_angles, (mapped, by_mapped)) in by_angles.iter_mut().zip(mapped) {
                add_scaled(by_angles, by_mapped, &mapped.tangent);
            }
        }
        let rows = by_basis
            .chunks(components)
            .zip(reduced.derivatives.chunks(components));
        for (by_angles, (by_row, derivatives)) in by_angles.iter_mut().zip(rows) {
            for (by_entry, derivatives) in by_row.iter().zip(derivatives) {
                add_scaled(by_angles, *by_entry, derivatives);
            }
        }
        Self {
            loss,
            by_angles,
            by_precision,
        }
    }

    pub(super) fn add(&mut self, other: &Self, share: f64) {
        self.loss += share * other.loss;
        for (sum, derivatives) in self.by_angles.iter_mut().zip(&other.by_angles) {
            add_scaled(sum, share, derivatives);
        }
        add_scaled(&mut self.by_precision, share, &other.by_precision);
    }
}

/// sum += factor * vector
fn add_scaled(sum: &mut [f64], factor: f64, vector: &[f64]) {
    for (entry, value) in sum.iter_mut().zip(vector) {
        *entry += factor * value;
    }
}
