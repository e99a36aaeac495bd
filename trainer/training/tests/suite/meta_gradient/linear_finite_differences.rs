//! The gradient of the model Linear's loss against central differences: basis look-ups, measurements,
//! mapping, ridge solve and outer loss, written a second time on numbers that record their kinks.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear::{EPSILON, map, unmap};
use glimpse_core::model::loss::cosine_weighted_log_error;
use glimpse_core::model::{Model, Neural, NeuralParameters, ParameterSet};
use glimpse_core::numeric::Scalar;
use glimpse_gradcheck::{Differences, Traced, parameters, scale_of};
use glimpse_materials::NeuralBrdf;
use glimpse_materials::basis::{Basis, Grid, angles_to_f64};
use glimpse_materials::sampling::uniform_valid;
use glimpse_training::linear::principal_components;
use glimpse_training::meta::linear::{OuterBasis, OuterSamples};
use nalgebra::{DMatrix, DVector};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::linear::{MATERIALS, SET};
use crate::support::{angles_from_array, task_gradient};

/// A network's BRDF, every branch on the way recorded.
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

/// Records a number as the branches that lead to it.
fn record(number: usize) {
    for bit in 0..usize::BITS {
        let sign = if number >> bit & 1 == 1 { 1.0 } else { -1.0 };
        let _ = Traced(sign).if_positive(Traced(1.0), Traced(0.0));
    }
}

/// The basis at a place: mean, median BRDF, weight and components.
struct Place {
    mean: Traced,
    median: Traced,
    weight: Traced,
    row: Vec<f64>,
}

fn place(basis: &Basis, angles: [f64; 3]) -> Place {
    // The cell that the place is in: interpolation has kinks at its faces.
    record(Grid::corners(angles_from_array(angles))[0].node);
    let found = basis.look_up(angles_from_array(angles));
    let at = traced(HalfDifference::from_angles(angles_from_array(angles)));
    let weight = at.cos_theta_i() * at.cos_theta_o();
    // ln(median w + e) undone.
    let above = Traced(found.log_median[0]).exp() - Traced(EPSILON);
    Place {
        mean: Traced(found.mean[0]),
        median: above.relu() / weight,
        weight,
        row: found.components.iter().map(|entry| entry[0]).collect(),
    }
}

/// One material, and where and how it is measured and judged.
#[derive(Clone, Copy)]
struct Task<'a> {
    network: &'a NeuralBrdf,
    basis: &'a Basis,
    /// Where the loss is taken, and the material there.
    outer: &'a [Angles<f32>],
    values: &'a [[f32; 3]],
    directions: &'a [u32],
}

impl Task<'_> {
    /// The outer loss for samples at these angles, every branch on the way recorded.
    fn loss(&self, samples: &[[f64; 3]], precision: &[f64]) -> Traced {
        let places: Vec<Place> = samples
            .iter()
            .map(|each| place(self.basis, *each))
            .collect();
        let (count, components) = (samples.len(), precision.len());
        let a = DMatrix::from_fn(count, components, |j, k| places[j].row[k]);
        let mapped: Vec<[f64; 3]> = samples
            .iter()
            .zip(&places)
            .map(|(angles, place)| {
                let at = traced(HalfDifference::from_angles(angles_from_array(*angles)));
                brdf(self.network, &at)
                    .map(|brdf| (map(brdf, place.median, place.weight) - place.mean).0)
            })
            .collect();
        let normal =
            a.transpose() * &a + DMatrix::from_diagonal(&DVector::from_row_slice(precision));
        let right = a.transpose() * DMatrix::from_fn(count, 3, |j, channel| mapped[j][channel]);
        let coefficients = normal.lu().solve(&right).expect("it is regular");

        let share = Traced(1.0 / (3.0 * self.directions.len() as f64));
        let mut loss = Traced(0.0);
        for direction in self.directions {
            let index = *direction as usize;
            let angles = angles_to_f64(&self.outer[index]);
            let at = traced(HalfDifference::from_angles(angles));
            let place = place(self.basis, [angles.theta_h, angles.theta_d, angles.phi_d]);
            let modeled = [0, 1, 2].map(|channel| {
                // Training keeps these rows in single precision.
                let row = place.row.iter().map(|entry| f64::from(*entry as f32));
                let sum: f64 = row
                    .zip(coefficients.column(channel).iter())
                    .map(|(a, c)| a * c)
                    .sum();
                unmap(Traced(sum) + place.mean, place.median, place.weight)
            });
            let measured = self.values[index].map(|value| Traced(value.into()));
            loss = loss
                + cosine_weighted_log_error(measured, modeled, at.cos_theta_i(), share)
                    .error
                    .value();
        }
        loss
    }
}

/// Precisions between 0.5 and 100.
fn precisions(components: usize, random: &mut ChaCha8Rng) -> Vec<f64> {
    let range = 0.5_f64.ln()..100.0_f64.ln();
    (0..components)
        .map(|_| random.random_range(range.clone()).exp())
        .collect()
}

/// Compares the slopes of one material's loss, in double precision, for n samples and m components.
fn compare(samples: usize, components: usize) {
    let set = &*SET;
    let all: Vec<usize> = (0..set.columns.count()).collect();
    let basis = principal_components(&set.columns, &all, components);
    assert_eq!(basis.components(), components);
    let mut by_angles = Differences::new(2e-5, 1e-5);
    let mut by_precision = Differences::new(2e-4, 1e-5);
    const SEEDS: usize = 20;
    for seed in 0..SEEDS {
        let mut random = ChaCha8Rng::seed_from_u64(seed as u64);
        let index = seed % MATERIALS;
        let outer = uniform_valid(64, random.random());
        let values: Vec<[f32; 3]> = outer
            .iter()
            .map(|angles| set.materials[index].brdf(*angles))
            .collect();
        let directions: Vec<u32> = (0..64).collect();
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

        let places: Vec<Angles<f64>> = pattern.iter().copied().map(angles_from_array).collect();
        let judge = OuterBasis::new(basis.clone(), &outer);
        let judged = OuterSamples {
            basis: &judge,
            directions: &directions,
            values: &values,
        };
        let network = &set.networks[index];
        let found = task_gradient(network, &basis, &places, &precision, &judged);

        let task = Task {
            network,
            basis: &basis,
            outer: &outer,
            values: &values,
            directions: &directions,
        };
        let expected = task.loss(&pattern, &precision).0;
        assert!(
            (found.loss - expected).abs() < 1e-11,
            "{} and not {expected}",
            found.loss
        );
        let check = |outcome: Result<(), String>| {
            if let Err(error) = outcome {
                panic!("n = {samples}, m = {components}, seed {seed}, {error}");
            }
        };
        let scale = scale_of(found.by_angles.as_flattened());
        for (index, slope) in found.by_angles.as_flattened().iter().enumerate() {
            let what = format!("angle {index}");
            check(by_angles.compare(&what, *slope, scale, |offset| {
                let mut pattern = pattern.clone();
                pattern[index / 3][index % 3] += offset;
                task.loss(&pattern, &precision)
            }));
        }
        let logarithmic = found.by_precision.iter().zip(&precision);
        let slopes: Vec<f64> = logarithmic.map(|(slope, p)| slope * p).collect();
        let scale = scale_of(&slopes);
        for (index, slope) in slopes.iter().enumerate() {
            let what = format!("ln of precision {index}");
            check(by_precision.compare(&what, *slope, scale, |offset| {
                let mut precision = precision.clone();
                precision[index] *= offset.exp();
                task.loss(&pattern, &precision)
            }));
        }
    }
    let name = format!("linear, n = {samples}, m = {components}");
    by_angles.conclude(&format!("{name}, by angles"), SEEDS * 3 * samples * 9 / 10);
    by_precision.conclude(
        &format!("{name}, by precisions"),
        SEEDS * components * 9 / 10,
    );
}

#[test]
fn linear_agrees_with_differences_where_samples_are_few() {
    compare(3, 5);
    compare(8, 12);
}

#[test]
fn linear_agrees_with_differences_where_samples_are_many() {
    compare(8, 5);
    compare(20, 12);
    compare(5, 5);
}
