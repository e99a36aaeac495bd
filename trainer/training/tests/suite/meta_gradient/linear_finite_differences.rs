//! Comparison of the gradient of the model Linear's loss with central differences. Basis lookup, measurement, mapping,
//! ridge solve and outer loss are implemented again here, on numbers that record branches.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear::{EPSILON, map, unmap};
use glimpse_core::model::loss::cosine_weighted_log_error;
use glimpse_core::model::{Model, Neural, NeuralParameters, ParameterSet};
use glimpse_core::numeric::Scalar;
use glimpse_gradcheck::{Differences, Traced, gradient_scale, parameters};
use glimpse_materials::NeuralBrdf;
use glimpse_materials::basis::{Basis, Grid, angles_to_f64};
use glimpse_materials::sampling::uniform_valid;
use glimpse_training::linear::principal_components;
use glimpse_training::meta::linear::{OuterBasis, OuterSamples};
use nalgebra::{DMatrix, DVector};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::linear::{MATERIAL_COUNT, MATERIALS};
use crate::support::{angles_from_array, task_gradient};

/// Returns a network's BRDF, and records each branch.
fn brdf(network: &NeuralBrdf, at: &HalfDifference<Traced>) -> [Traced; 3] {
    let weights = network.parameters().iter();
    let weights = weights.map(|weight| Traced((*weight).into()));
    let weights: NeuralParameters<Traced> = parameters(weights, Traced(0.0));
    Neural::brdf::<Traced>(&weights, at)
}

fn traced(at: HalfDifference<f64>) -> HalfDifference<Traced> {
    let [hx, hz, dx, dy, dz] = [at.hx, at.hz, at.dx, at.dy, at.dz].map(Traced);
    HalfDifference { hx, hz, dx, dy, dz }
}

/// Records the bits of a number as branches.
fn record(number: usize) {
    for bit in 0..usize::BITS {
        let sign = if number >> bit & 1 == 1 { 1.0 } else { -1.0 };
        let _ = Traced(sign).if_positive(Traced(1.0), Traced(0.0));
    }
}

/// A row of the basis: mean of ln((f w + e) / e), weight and components at a direction.
struct BasisRow {
    center: Traced,
    weight: Traced,
    components: Vec<f64>,
}

fn basis_row(basis: &Basis, angles: [f64; 3]) -> BasisRow {
    // Interpolation has kinks at the faces of cells, so the cell counts as a branch.
    record(Grid::corners(angles_from_array(angles))[0].node);
    let values = basis.look_up(angles_from_array(angles));
    let at = traced(HalfDifference::from_angles(angles_from_array(angles)));
    let weight = at.cos_theta_i() * at.cos_theta_o();
    BasisRow {
        // The mean is relative to the median.
        center: Traced(values.mean[0] + values.log_median[0] - EPSILON.ln()),
        weight,
        components: values.components.iter().map(|entry| entry[0]).collect(),
    }
}

/// The measurement and the outer loss of one material.
#[derive(Clone, Copy)]
struct Task<'a> {
    network: &'a NeuralBrdf,
    basis: &'a Basis,
    /// All directions, and the material's BRDF at them.
    outer: &'a [Angles<f32>],
    values: &'a [[f32; 3]],
    /// The indices of the directions of the outer loss.
    indices: &'a [u32],
}

impl Task<'_> {
    /// Returns the outer loss of samples at these angles, and records each branch.
    fn loss(&self, samples: &[[f64; 3]], precision: &[f64]) -> Traced {
        let rows: Vec<BasisRow> = samples
            .iter()
            .map(|each| basis_row(self.basis, *each))
            .collect();
        let (count, components) = (samples.len(), precision.len());
        let a = DMatrix::from_fn(count, components, |j, k| rows[j].components[k]);
        let mapped: Vec<[f64; 3]> = samples
            .iter()
            .zip(&rows)
            .map(|(angles, row)| {
                let at = traced(HalfDifference::from_angles(angles_from_array(*angles)));
                brdf(self.network, &at).map(|brdf| (map(brdf, row.weight) - row.center).0)
            })
            .collect();
        let normal =
            a.transpose() * &a + DMatrix::from_diagonal(&DVector::from_row_slice(precision));
        let right_hand_side =
            a.transpose() * DMatrix::from_fn(count, 3, |j, channel| mapped[j][channel]);
        let coefficients = normal
            .lu()
            .solve(&right_hand_side)
            .expect("the system is regular");

        let weight = Traced(1.0 / (3.0 * self.indices.len() as f64));
        let mut loss = Traced(0.0);
        for index in self.indices {
            let index = *index as usize;
            let angles = angles_to_f64(&self.outer[index]);
            let at = traced(HalfDifference::from_angles(angles));
            let basis_row = basis_row(self.basis, [angles.theta_h, angles.theta_d, angles.phi_d]);
            let modeled = [0, 1, 2].map(|channel| {
                // Training stores these rows in single precision.
                let row = basis_row
                    .components
                    .iter()
                    .map(|entry| f64::from(*entry as f32));
                let sum: f64 = row
                    .zip(coefficients.column(channel).iter())
                    .map(|(a, c)| a * c)
                    .sum();
                unmap(Traced(sum) + basis_row.center, basis_row.weight)
            });
            let measured = self.values[index].map(|value| Traced(value.into()));
            loss = loss
                + cosine_weighted_log_error(measured, modeled, at.cos_theta_i(), weight)
                    .error
                    .value();
        }
        loss
    }
}

/// Returns random precisions between 0.5 and 100.
fn precisions(components: usize, random: &mut ChaCha8Rng) -> Vec<f64> {
    let range = 0.5_f64.ln()..100.0_f64.ln();
    (0..components)
        .map(|_| random.random_range(range.clone()).exp())
        .collect()
}

/// Compares the gradient of one material's loss with differences, in double precision, for n samples and m components.
fn compare(samples: usize, components: usize) {
    let all: Vec<usize> = (0..MATERIALS.columns.count()).collect();
    let basis = principal_components(&MATERIALS.columns, &all, components);
    assert_eq!(basis.components(), components);
    let mut by_angles = Differences::new(2e-5, 1e-5);
    let mut by_precision = Differences::new(2e-4, 1e-5);
    const SEEDS: usize = 20;
    for seed in 0..SEEDS {
        let mut random = ChaCha8Rng::seed_from_u64(seed as u64);
        let index = seed % MATERIAL_COUNT;
        let outer = uniform_valid(64, random.random());
        let values: Vec<[f32; 3]> = outer
            .iter()
            .map(|angles| MATERIALS.materials[index].brdf(*angles))
            .collect();
        let indices: Vec<u32> = (0..64).collect();
        let precision = match seed {
            0 => vec![0.5; components],
            1 => vec![100.0; components],
            _ => precisions(components, &mut random),
        };
        let pattern: Vec<[f64; 3]> = uniform_valid(samples, random.random())
            .iter()
            .map(angles_to_f64)
            .map(|angles| [angles.theta_h, angles.theta_d, angles.phi_d])
            .collect();

        let sample_angles: Vec<Angles<f64>> =
            pattern.iter().copied().map(angles_from_array).collect();
        let outer_basis = OuterBasis::new(basis.clone(), &outer);
        let outer_samples = OuterSamples {
            basis: &outer_basis,
            directions: &indices,
            values: &values,
        };
        let network = &MATERIALS.networks[index];
        let gradient = task_gradient(network, &basis, &sample_angles, &precision, &outer_samples);

        let task = Task {
            network,
            basis: &basis,
            outer: &outer,
            values: &values,
            indices: &indices,
        };
        let expected = task.loss(&pattern, &precision).0;
        assert!(
            (gradient.loss - expected).abs() < 1e-11,
            "{} instead of {expected}",
            gradient.loss
        );
        let check = |result: Result<(), String>| {
            if let Err(error) = result {
                panic!("n = {samples}, m = {components}, seed {seed}, {error}");
            }
        };
        let scale = gradient_scale(gradient.by_angles.as_flattened());
        for (index, slope) in gradient.by_angles.as_flattened().iter().enumerate() {
            let name = format!("angle {index}");
            check(by_angles.compare(&name, *slope, scale, |offset| {
                let mut pattern = pattern.clone();
                pattern[index / 3][index % 3] += offset;
                task.loss(&pattern, &precision)
            }));
        }
        let by_precisions = gradient.by_precision.iter().zip(&precision);
        let slopes: Vec<f64> = by_precisions.map(|(slope, p)| slope * p).collect();
        let scale = gradient_scale(&slopes);
        for (index, slope) in slopes.iter().enumerate() {
            let name = format!("ln of precision {index}");
            check(by_precision.compare(&name, *slope, scale, |offset| {
                let mut precision = precision.clone();
                precision[index] *= offset.exp();
                task.loss(&pattern, &precision)
            }));
        }
    }
    let problem = format!("linear, n = {samples}, m = {components}");
    by_angles.assert_enough_compared(
        &format!("{problem}, by angles"),
        SEEDS * 3 * samples * 9 / 10,
    );
    by_precision.assert_enough_compared(
        &format!("{problem}, by precisions"),
        SEEDS * components * 9 / 10,
    );
}

#[test]
fn linear_matches_finite_differences_for_few_samples() {
    compare(3, 5);
    compare(8, 12);
}

#[test]
fn linear_matches_finite_differences_for_many_samples() {
    compare(8, 5);
    compare(20, 12);
    compare(5, 5);
}
