//! The meta-gradient of the model Linear against central differences: basis look-ups, measurements,
//! mapping, ridge solve and outer loss, all written once more on numbers that record their kinks.

use std::sync::LazyLock;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear::{EPSILON, map, unmap};
use glimpse_core::model::loss::cosine_weighted_log_error;
use glimpse_core::model::{Model, ModelKind, Neural, NeuralParameters, ParameterSet};
use glimpse_core::numeric::Scalar;
use glimpse_gradcheck::{Differences, Traced, parameters, scale_of};
use glimpse_materials::basis::{Basis, Grid, widened};
use glimpse_materials::sampling::uniform_valid;
use glimpse_materials::{Material, NeuralBrdf};
use glimpse_training::linear::{Columns, Prior, principal_components};
use glimpse_training::meta::linear::LinearTrainee;
use glimpse_training::meta::pattern::{Pattern, logits_of};
use glimpse_training::meta::plan::{Effort, Plan, Schedule};
use nalgebra::{DMatrix, DVector};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::pattern::{angles, barrier, is_valid, logits_with_one_below};
use crate::support::{boxed, double, named, network};

/// How many materials there are, each of three columns.
const MATERIALS: usize = 6;

/// Materials that are networks, and their columns.
struct Set {
    networks: Vec<NeuralParameters<f32>>,
    materials: Vec<Box<dyn Material>>,
    columns: Columns,
}

static SET: LazyLock<Set> = LazyLock::new(|| {
    let mut random = ChaCha8Rng::seed_from_u64(77);
    let networks: Vec<NeuralBrdf> = (0..MATERIALS).map(|_| network(&mut random)).collect();
    let weights = networks.iter().map(|network| *network.parameters());
    let weights = weights.collect();
    let materials = boxed(networks);
    Set {
        networks: weights,
        columns: Columns::new(&materials),
        materials,
    }
});

/// A network's BRDF.
fn brdf(network: &NeuralParameters<f32>, at: &HalfDifference<Traced>) -> [Traced; 3] {
    let weights = network.iter().map(|weight| Traced((*weight).into()));
    Neural::brdf(&parameters(weights, Traced(0.0)), at)
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
    record(Grid::corners(named(angles))[0].node);
    let found = basis.look_up(named(angles));
    let at = traced(HalfDifference::from_angles(named(angles)));
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
    network: &'a NeuralParameters<f32>,
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
                let at = traced(HalfDifference::from_angles(named(*angles)));
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
            let angles = widened(&self.outer[index]);
            let at = traced(HalfDifference::from_angles(angles));
            let place = place(self.basis, [angles.theta_h, angles.theta_d, angles.phi_d]);
            let modelled = [0, 1, 2].map(|channel| {
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
                + cosine_weighted_log_error(measured, modelled, at.cos_theta_i(), share)
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

fn plan(schedule: Schedule, samples: usize) -> Plan {
    Plan::new(
        schedule,
        Effort::Quick,
        ModelKind::Linear,
        samples,
        MATERIALS,
    )
}

/// What training takes its steps along: mean loss of a batch, each material with the basis of the
/// others, and the barrier of a sample below the horizon.
#[test]
fn linear_by_logits_agrees_with_differences() {
    const COMPONENTS: usize = 5;
    const SEED: u64 = 3;
    const FOLDS: usize = 5;
    const POOL: usize = 8_192;
    const SEEDS: usize = 15;
    let set = &*SET;
    let plan = plan(Schedule::Joint, 8);
    let prior = Prior {
        components: COMPONENTS,
        eta: None,
    };
    let trainee = LinearTrainee::new(&set.materials, &set.columns, prior, &plan, SEED);
    assert_eq!(trainee.components(), COMPONENTS);
    let pool = uniform_valid(POOL, SEED);
    let values: Vec<Vec<[f32; 3]>> = set
        .materials
        .iter()
        .map(|material| pool.iter().map(|angles| material.brdf(*angles)).collect())
        .collect();
    let bases: Vec<Basis> = (0..FOLDS)
        .map(|fold| {
            let others: Vec<usize> = (0..3 * MATERIALS)
                .filter(|column| column / 3 % FOLDS != fold)
                .collect();
            principal_components(&set.columns, &others, COMPONENTS)
        })
        .collect();

    // The gradient under test measures in single precision.
    let mut by_logits = Differences::new(2e-5, 1e-4);
    let mut by_precision = Differences::new(2e-4, 1e-4);
    let mut invalid = 0;
    for seed in 0..SEEDS {
        let mut random = ChaCha8Rng::seed_from_u64(100 + seed as u64);
        let count = if seed % 2 == 0 { 7 } else { 3 };
        let logits = logits_with_one_below(count, &mut random);
        let pattern = Pattern::from_logits(logits.as_flattened());
        assert_eq!(pattern.valid_angles().count(), count);
        let log_precision: Vec<f32> = precisions(COMPONENTS, &mut random)
            .into_iter()
            .map(|p| p.ln() as f32)
            .collect();
        let tasks: Vec<(usize, Vec<u32>)> = (0..3)
            .map(|_| {
                let draw = |_| random.random_range(0..POOL as u32);
                let directions = (0..32).map(draw).collect();
                (random.random_range(0..MATERIALS), directions)
            })
            .collect();
        let found = trainee.gradient_over(&pattern, &log_precision, &tasks);
        let (loss, gradient) = found.expect("it can be factorized");
        assert!(gradient.initial.is_empty());

        let wide: Vec<[f64; 3]> = logits.iter().map(|each| each.map(f64::from)).collect();
        // The place of a sample is what single precision made of its logits: near the horizon a
        // last digit matters to slopes.
        let rounded = pattern.angles().iter().map(widened);
        let rounding: Vec<[f64; 3]> = rounded
            .zip(&wide)
            .map(|(rounded, logits)| {
                let exact = angles(*logits);
                let rounded = [rounded.theta_h, rounded.theta_d, rounded.phi_d];
                [0, 1, 2].map(|i| rounded[i] - exact[i])
            })
            .collect();
        let mut errors = rounding.as_flattened().iter();
        assert!(errors.all(|error| error.abs() < 1e-6));
        let total = |logits: &[[f64; 3]], log_precision: &[f64]| {
            let mut samples = Vec::new();
            let mut below = Vec::new();
            for (logits, rounding) in logits.iter().zip(&rounding) {
                let exact = angles(*logits);
                let place = [0, 1, 2].map(|i| exact[i] + rounding[i]);
                if is_valid(*logits) {
                    samples.push(place);
                } else {
                    below.push(place);
                }
            }
            let precision: Vec<f64> = log_precision.iter().map(|log| log.exp()).collect();
            let mut sum = Traced(0.0);
            for (material, directions) in &tasks {
                let task = Task {
                    network: &set.networks[*material],
                    basis: &bases[material % FOLDS],
                    outer: &pool,
                    values: &values[*material],
                    directions,
                };
                sum = sum + task.loss(&samples, &precision);
            }
            let mean = sum / Traced(tasks.len() as f64);
            let barriers = below.into_iter().map(|place| Traced(barrier(place)));
            barriers.fold(mean, |sum, each| sum + each)
        };
        let wide_precision = double(&log_precision);
        let expected = total(&wide, &wide_precision).0;
        let error = f64::from(loss + pattern.barrier()) - expected;
        assert!(error.abs() < 1e-6, "seed {seed}: the loss is {error:e} off");

        let check = |outcome: Result<(), String>| {
            if let Err(error) = outcome {
                panic!("seed {seed}, {error}");
            }
        };
        let slopes = double(&gradient.pattern);
        let scale = 100.0 * scale_of(&slopes);
        for (index, slope) in slopes.iter().enumerate() {
            invalid += usize::from(!is_valid(wide[index / 3]));
            let what = format!("logit {index}");
            check(by_logits.compare(&what, *slope, scale, |offset| {
                let mut logits = wide.clone();
                logits[index / 3][index % 3] += offset;
                total(&logits, &wide_precision)
            }));
        }
        let slopes = double(&gradient.hyperparameters);
        let scale = 100.0 * scale_of(&slopes);
        for (index, slope) in slopes.iter().enumerate() {
            let what = format!("logarithm of precision {index}");
            check(by_precision.compare(&what, *slope, scale, |offset| {
                let mut precision = wide_precision.clone();
                precision[index] += offset;
                total(&wide, &precision)
            }));
        }
    }
    assert_eq!(invalid, 3 * SEEDS);
    let least = SEEDS / 2 * (3 * 7 + 3 * 3) * 9 / 10;
    by_logits.conclude("linear by logits", least);
    by_precision.conclude(
        "linear by logarithms of precisions",
        SEEDS * COMPONENTS * 9 / 10,
    );
}

/// A pattern of one sample may go below the horizon on its way. Nothing is measured then, and the
/// barrier alone pulls it back: no number goes missing.
#[test]
fn linear_without_a_sample_above_the_horizon_is_the_mean_and_is_pulled_back() {
    let set = &*SET;
    let plan = plan(Schedule::Paper, 1);
    let trainee = LinearTrainee::new(&set.materials, &set.columns, Prior::PAPER, &plan, 3);
    let below = Angles {
        theta_h: 1.5,
        theta_d: 1.5,
        phi_d: 0.1,
    };
    let pattern = Pattern::from_logits(&logits_of(below));
    assert_eq!(pattern.valid_angles().count(), 0);
    let log_precision = vec![1.0; trainee.components()];
    let tasks = [(0, vec![0, 1, 2]), (1, vec![3])];
    let (loss, gradient) = trainee
        .gradient_over(&pattern, &log_precision, &tasks)
        .expect("it is no error");
    assert!(loss.is_finite() && loss > 0.0, "{loss}");
    assert!(gradient.hyperparameters.iter().all(|slope| *slope == 0.0));
    let [theta_h, theta_d, phi_d] = gradient.pattern[..] else {
        panic!("one sample has three logits");
    };
    assert!(
        theta_h > 0.0 && theta_d > 0.0,
        "Adam goes down: {theta_h}, {theta_d}"
    );
    assert_eq!(phi_d, 0.0);
}
