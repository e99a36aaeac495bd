//! The meta-gradient of the model Linear over a batch of materials. `burn_reference` and `linear_finite_differences`
//! test the gradient of one material.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::LazyLock;

use glimpse_core::geometry::Angles;
use glimpse_core::model::ModelKind;
use glimpse_materials::basis::angles_to_f64;
use glimpse_materials::sampling::uniform_valid;
use glimpse_materials::{Material, NeuralBrdf};
use glimpse_training::linear::{Columns, Prior, principal_components};
use glimpse_training::meta::linear::{LinearObjective, OuterBasis, OuterSamples};
use glimpse_training::meta::pattern::{Pattern, logits_from_angles};
use glimpse_training::meta::plan::{Effort, Plan, Schedule};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::pattern::{BARRIER, logits_with_one_below_horizon};
use crate::support::{boxed, network, task_gradient, to_f64};

/// The number of materials; each has three columns.
pub(super) const MATERIAL_COUNT: usize = 6;

/// Networks, the same networks as materials, and their columns.
pub(super) struct TestMaterials {
    pub(super) networks: Vec<NeuralBrdf>,
    pub(super) materials: Vec<Box<dyn Material>>,
    pub(super) columns: Columns,
}

pub(super) static MATERIALS: LazyLock<TestMaterials> = LazyLock::new(|| {
    let mut random = ChaCha8Rng::seed_from_u64(77);
    let networks: Vec<NeuralBrdf> = (0..MATERIAL_COUNT).map(|_| network(&mut random)).collect();
    let materials = boxed(networks.clone());
    TestMaterials {
        columns: Columns::new(&materials),
        networks,
        materials,
    }
});

fn plan(schedule: Schedule, samples: usize) -> Plan {
    let (effort, model) = (Effort::Quick, ModelKind::Linear);
    Plan::new(schedule, effort, model, samples, MATERIAL_COUNT)
}

/// Asserts that a gradient in single precision matches the expected one.
fn assert_close(name: &str, actual: &[f32], expected: &[f64]) {
    assert_eq!(actual.len(), expected.len(), "{name}");
    let largest = expected
        .iter()
        .fold(0.0_f64, |max, entry| max.max(entry.abs()));
    for (index, (actual, expected)) in to_f64(actual).iter().zip(expected).enumerate() {
        // This form also fails for NaN.
        let is_close = (actual - expected).abs() <= 1e-4 * largest;
        assert!(is_close, "{name} {index}: {actual} instead of {expected}");
    }
}

/// Each task uses the basis of the other folds' materials. A sample below the horizon has the gradient of the barrier.
#[test]
fn batch_gradient_is_the_mean_of_its_tasks_plus_the_barrier() {
    const COMPONENTS: usize = 5;
    const SEED: u64 = 3;
    const FOLDS: usize = 5;
    const POOL: usize = 8_192;
    let plan = plan(Schedule::Joint, 8);
    let prior = Prior {
        components: COMPONENTS,
        eta: None,
    };
    let objective =
        LinearObjective::new(&MATERIALS.materials, &MATERIALS.columns, prior, &plan, SEED);
    assert_eq!(objective.components(), COMPONENTS);
    let pool = uniform_valid(POOL, SEED);
    let values_of = |network: &NeuralBrdf| -> Vec<[f32; 3]> {
        pool.iter().map(|angles| network.brdf(*angles)).collect()
    };
    let values: Vec<_> = MATERIALS.networks.iter().map(values_of).collect();
    let folds = [0, 1, 2, 3, 4].map(|fold| {
        let columns = 0..3 * MATERIAL_COUNT;
        let others: Vec<usize> = columns
            .filter(|column| column / 3 % FOLDS != fold)
            .collect();
        let basis = principal_components(&MATERIALS.columns, &others, COMPONENTS);
        (OuterBasis::new(basis.clone(), &pool), basis)
    });

    for seed in 0..15 {
        let mut random = ChaCha8Rng::seed_from_u64(100 + seed);
        let count = if seed % 2 == 0 { 7 } else { 3 };
        let logits = logits_with_one_below_horizon(count, &mut random);
        let pattern = Pattern::from_logits(logits.as_flattened());
        let valid_angles: Vec<Angles<f64>> = pattern
            .valid_angles()
            .map(|at| angles_to_f64(&at))
            .collect();
        assert_eq!(valid_angles.len(), count);
        let range = 0.5_f32.ln()..100.0_f32.ln();
        let log_precision = [0.0; COMPONENTS].map(|_| random.random_range(range.clone()));
        let precision = log_precision.map(|log| f64::from(log).exp());
        let tasks: Vec<(usize, Vec<u32>)> = (0..3)
            .map(|_| {
                let draw = |_| random.random_range(0..POOL as u32);
                let directions = (0..32).map(draw).collect();
                (random.random_range(0..MATERIAL_COUNT), directions)
            })
            .collect();
        let (batch_loss, gradient) = objective.batch_gradient(&pattern, &log_precision, &tasks);
        assert!(gradient.initial.is_empty());

        let (mut loss, mut by_precision) = (0.0, [0.0; COMPONENTS]);
        let mut by_angles = vec![[0.0; 3]; count];
        for (material, directions) in &tasks {
            let (outer_basis, basis) = &folds[material % FOLDS];
            let outer = OuterSamples {
                basis: outer_basis,
                directions,
                values: &values[*material],
            };
            let network = &MATERIALS.networks[*material];
            let task = task_gradient(network, basis, &valid_angles, &precision, &outer);
            let weight = 1.0 / tasks.len() as f64;
            loss += weight * task.loss;
            for ((sum, slope), p) in by_precision
                .iter_mut()
                .zip(task.by_precision)
                .zip(precision)
            {
                *sum += weight * slope * p;
            }
            let by_task = task.by_angles.as_flattened();
            for (sum, slope) in by_angles.as_flattened_mut().iter_mut().zip(by_task) {
                *sum += weight * slope;
            }
        }
        let error = f64::from(batch_loss) - loss;
        assert!(
            error.abs() < 1e-6,
            "seed {seed}: the error of the loss is {error:e}"
        );
        let name = format!("seed {seed}, logarithm of precision");
        assert_close(&name, &gradient.hyperparameters, &by_precision);

        // theta = range sigmoid(logit)
        let mut valid_gradients = by_angles.into_iter();
        let all = pattern.angles().iter().zip(pattern.valid());
        let by_logits: Vec<[f64; 3]> = all
            .map(|(angles, is_valid)| {
                let at = [angles.theta_h, angles.theta_d, angles.phi_d].map(f64::from);
                let by_angles = match is_valid {
                    true => valid_gradients
                        .next()
                        .expect("one gradient per valid sample"),
                    false => [2.0 * BARRIER * at[0], 2.0 * BARRIER * at[1], 0.0],
                };
                let ranges = [FRAC_PI_2, FRAC_PI_2, PI];
                [0, 1, 2].map(|i| by_angles[i] * at[i] * (1.0 - at[i] / ranges[i]))
            })
            .collect();
        let name = format!("seed {seed}, logit");
        assert_close(&name, &gradient.pattern, by_logits.as_flattened());
    }
}

/// A pattern of one sample may move below the horizon during training. Without a measurement, the fit is the mean, and
/// the barrier is the only gradient.
#[test]
fn batch_gradient_without_valid_samples_is_the_barrier() {
    let plan = plan(Schedule::Paper, 1);
    let objective = LinearObjective::new(
        &MATERIALS.materials,
        &MATERIALS.columns,
        Prior::PAPER,
        &plan,
        3,
    );
    let below_horizon = Angles {
        theta_h: 1.5,
        theta_d: 1.5,
        phi_d: 0.1,
    };
    let pattern = Pattern::from_logits(&logits_from_angles(below_horizon));
    assert_eq!(pattern.valid_angles().count(), 0);
    let log_precision = vec![1.0; objective.components()];
    let tasks = [(0, vec![0, 1, 2]), (1, vec![3])];
    let (loss, gradient) = objective.batch_gradient(&pattern, &log_precision, &tasks);
    assert!(loss.is_finite() && loss > 0.0, "{loss}");
    assert!(gradient.hyperparameters.iter().all(|slope| *slope == 0.0));
    let [theta_h, theta_d, phi_d] = gradient.pattern[..] else {
        panic!("one sample must have three logits");
    };
    assert!(
        theta_h > 0.0 && theta_d > 0.0,
        "descent must reduce both angles: {theta_h}, {theta_d}"
    );
    assert_eq!(phi_d, 0.0);
}
