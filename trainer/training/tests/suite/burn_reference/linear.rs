//! The model Linear in tensor operations: sigmoids of logits, trilinear lookups in the basis file, the measured
//! network, the mapping, elimination of the normal equations, the loss, and the barrier of samples below
//! the horizon.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::{LazyLock, PoisonError};

use burn::tensor::Tensor;
use burn::tensor::activation::relu;
use glimpse_core::geometry::Angles;
use glimpse_core::model::{Neural, ParameterSet};
use glimpse_materials::basis::{Basis, angles_to_f64};
use glimpse_materials::sampling::uniform_valid;
use glimpse_materials::{Material, NeuralBrdf};
use glimpse_training::linear::{self, principal_components};
use glimpse_training::meta::linear::{OuterBasis, OuterSamples};
use glimpse_training::meta::pattern::Pattern;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{
    BURN_LOCK, Matrix, Samples, TOLERANCE, TensorModel, matrix, relative_error, sigmoid, to_vec,
};
use crate::support::{angles_from_array, boxed, network, task_gradient, to_f64};

/// e, the offset of the mapping.
const EPSILON: f64 = 1e-3;
/// The ranges of theta_h, theta_d and phi_d.
const RANGES: [f64; 3] = [FRAC_PI_2, FRAC_PI_2, PI];
/// m, the number of components.
const COMPONENTS: usize = 5;
/// The number of words in a basis file before its table.
const HEADER_WORDS: usize = 6;

/// Networks and their basis.
struct NetworkBasis {
    networks: Vec<NeuralBrdf>,
    basis: Basis,
    /// The shape and the table, read from the basis file as its format is documented.
    shape: [usize; 3],
    table: Vec<f64>,
}

static NETWORK_BASIS: LazyLock<NetworkBasis> = LazyLock::new(|| {
    let mut random = ChaCha8Rng::seed_from_u64(21);
    let networks: Vec<NeuralBrdf> = (0..5).map(|_| network(&mut random)).collect();
    let columns = linear::Columns::new(&boxed(networks.clone()));
    let all: Vec<usize> = (0..columns.count()).collect();
    let basis = principal_components(&columns, &all, COMPONENTS);
    let bytes = basis.to_bytes();
    let (header, table) = bytes.split_at(4 * HEADER_WORDS);
    let header: Vec<usize> = header
        .as_chunks::<4>()
        .0
        .iter()
        .map(|word| u32::from_le_bytes(*word) as usize)
        .collect();
    assert_eq!(header[5], COMPONENTS);
    let table = table.as_chunks::<4>().0.iter();
    NetworkBasis {
        networks,
        shape: [header[2], header[3], header[4]],
        table: table
            .map(|word| f64::from(f32::from_le_bytes(*word)))
            .collect(),
        basis,
    }
});

/// Returns the angles of logits.
fn angles(logits: &Matrix) -> Matrix {
    sigmoid(logits.clone()) * matrix(&RANGES, [1, 3])
}

/// Evaluates the basis: mean, ln(median w + e) and components, one row per direction.
fn look_up(angles: &Matrix) -> [Matrix; 3] {
    let [count, _] = angles.dims();
    let [h, d, p] = NETWORK_BASIS.shape;
    // Positions along the axes in units of nodes: quadratic in theta_h, cyclic in phi_d.
    let axis = |index: usize| angles.clone().narrow(1, index, 1) * (1.0 / RANGES[index]);
    let positions = [
        axis(0).sqrt() * (h - 1) as f64,
        axis(1) * (d - 1) as f64,
        axis(2) * p as f64,
    ];
    let lower_nodes = positions.each_ref().map(|position| -> Vec<usize> {
        to_vec(position.clone())
            .iter()
            .map(|position| position.floor() as usize)
            .collect()
    });
    let fractions: [Matrix; 3] = std::array::from_fn(|axis| {
        let lower_nodes: Vec<f64> = lower_nodes[axis].iter().map(|node| *node as f64).collect();
        positions[axis].clone() - matrix(&lower_nodes, [count, 1])
    });
    let length = 2 + COMPONENTS;
    let mut sum = matrix(&vec![0.0; count * length], [count, length]);
    for corner in 0..8_usize {
        let steps = [corner & 1, corner >> 1 & 1, corner >> 2];
        let mut weight = matrix(&vec![1.0; count], [count, 1]);
        for (fraction, step) in fractions.iter().zip(steps) {
            weight = weight
                * match step {
                    1 => fraction.clone(),
                    _ => (-fraction.clone()).add_scalar(1.0),
                };
        }
        let mut values = Vec::new();
        for ((i, j), k) in lower_nodes[0]
            .iter()
            .zip(&lower_nodes[1])
            .zip(&lower_nodes[2])
        {
            let [i, j, k] = [i + steps[0], j + steps[1], k + steps[2]];
            let node = (i * d + j) * p + k % p;
            values.extend_from_slice(&NETWORK_BASIS.table[node * length..][..length]);
        }
        sum = sum + weight * matrix(&values, [count, length]);
    }
    [(0, 1), (1, 1), (2, COMPONENTS)].map(|(start, length)| sum.clone().narrow(1, start, length))
}

/// Returns cos(theta_i) cos(theta_o).
fn weight(at: &Samples) -> Matrix {
    let [hx, hz] = at.half();
    let [dx, _, dz] = at.difference();
    let (mean, half_difference) = (hz * dz, hx * dx);
    (mean.clone() - half_difference.clone()) * (mean + half_difference)
}

/// Returns samples without measured values.
fn unmeasured(angles: Matrix) -> Samples {
    Samples {
        measured: angles.zeros_like(),
        angles,
    }
}

/// Returns (A'A + diag p)^-1 A't, by Gauss-Jordan elimination without pivoting.
fn ridge(a: &Matrix, t: Matrix, precision: &Matrix) -> Matrix {
    let unit = |k: usize| -> Vec<f64> {
        (0..COMPONENTS)
            .map(|i| f64::from(u8::from(i == k)))
            .collect()
    };
    let identity: Vec<f64> = (0..COMPONENTS).flat_map(unit).collect();
    let diagonal = matrix(&identity, [COMPONENTS; 2]) * precision.clone();
    let normal = a.clone().transpose().matmul(a.clone()) + diagonal;
    let mut augmented = Tensor::cat(vec![normal, a.clone().transpose().matmul(t)], 1);
    for k in 0..COMPONENTS {
        let row = augmented.clone().narrow(0, k, 1);
        let row = row.clone() / row.narrow(1, k, 1);
        let column = augmented.clone().narrow(1, k, 1) - matrix(&unit(k), [COMPONENTS, 1]);
        augmented = augmented - column * row;
    }
    augmented.narrow(1, COMPONENTS, 3)
}

/// The directions of the outer loss, and the material's BRDF at them.
struct Outer {
    directions: Vec<Angles<f32>>,
    values: Vec<[f32; 3]>,
}

/// The loss, and its gradients with respect to the logits and the logarithms of the precisions.
struct LossGradient {
    loss: f64,
    by_logits: Vec<f64>,
    by_precision: Vec<f64>,
}

fn reference(
    network: &[Matrix],
    logits: &[f64],
    log_precision: &[f64],
    outer: &Outer,
) -> LossGradient {
    let logits = matrix(logits, [logits.len() / 3, 3]).require_grad();
    let log_precision = matrix(log_precision, [1, COMPONENTS]).require_grad();

    let at = unmeasured(angles(&logits));
    let [mean, log_median, a] = look_up(&at.angles);
    let w = weight(&at);
    let median = relu(log_median.exp().sub_scalar(EPSILON)) / w.clone();
    let measured = Neural::modeled(network, &at);
    let logarithm = |brdf: Matrix| (brdf * w.clone()).add_scalar(EPSILON).log();
    let t = logarithm(measured) - logarithm(median) - mean;
    let coefficients = ridge(&a, t, &log_precision.clone().exp());

    let outer_angles: Vec<f64> = outer
        .directions
        .iter()
        .map(angles_to_f64)
        .flat_map(|angles| [angles.theta_h, angles.theta_d, angles.phi_d])
        .collect();
    let count = outer.directions.len();
    // phi_d covers 2 pi here, and pi in the table.
    let folded: Vec<f64> = outer_angles
        .chunks(3)
        .flat_map(|angles| [angles[0], angles[1], angles[2] % PI])
        .collect();
    let [mean, log_median, rows] = look_up(&matrix(&folded, [count, 3]));
    // Training stores these rows in single precision.
    let rounded: Vec<f64> = to_vec(rows)
        .into_iter()
        .map(|entry| f64::from(entry as f32))
        .collect();
    let rows = matrix(&rounded, [count, COMPONENTS]);
    let values = to_f64(outer.values.as_flattened());
    let at = Samples {
        angles: matrix(&outer_angles, [count, 3]),
        measured: matrix(&values, [count, 3]),
    };
    let w = weight(&at);
    assert!(to_vec(w.clone()).iter().all(|w| *w > 1e-6));
    let median_term = relu(log_median.exp().sub_scalar(EPSILON)).add_scalar(EPSILON);
    let mapped = rows.matmul(coefficients) + mean;
    let modeled = relu((median_term * mapped.exp()).sub_scalar(EPSILON)) / w;
    let loss = at.loss(modeled);

    let gradients = loss.backward();
    let gradient =
        |tensor: &Matrix| to_vec(tensor.grad(&gradients).expect("the loss depends on it"));
    LossGradient {
        by_logits: gradient(&logits),
        by_precision: gradient(&log_precision),
        loss: loss.into_scalar(),
    }
}

/// Computes the loss and its gradients with the code under test, in double precision.
fn implementation(
    network: &NeuralBrdf,
    logits: &[f64],
    log_precision: &[f64],
    outer: &Outer,
) -> LossGradient {
    let basis = &NETWORK_BASIS.basis;
    let pattern: Vec<Angles<f64>> = logits
        .chunks(3)
        .map(|logits| angles_from_array([0, 1, 2].map(|i| RANGES[i] / (1.0 + (-logits[i]).exp()))))
        .collect();
    let precision: Vec<f64> = log_precision.iter().map(|log| log.exp()).collect();
    let directions: Vec<u32> = (0..outer.directions.len() as u32).collect();
    let samples = OuterSamples {
        basis: &OuterBasis::new(basis.clone(), &outer.directions),
        directions: &directions,
        values: &outer.values,
    };
    let gradient = task_gradient(network, basis, &pattern, &precision, &samples);
    let by_logits = gradient
        .by_angles
        .iter()
        .zip(&pattern)
        .flat_map(|(by_angles, at)| {
            let at = [at.theta_h, at.theta_d, at.phi_d];
            [0, 1, 2].map(|i| by_angles[i] * at[i] * (1.0 - at[i] / RANGES[i]))
        });
    let by_precision = gradient.by_precision.iter().zip(&precision);
    LossGradient {
        loss: gradient.loss,
        by_logits: by_logits.collect(),
        by_precision: by_precision.map(|(slope, p)| slope * p).collect(),
    }
}

/// Compares the gradients of many random problems of n samples.
fn compare(samples: usize) {
    let _lock = BURN_LOCK.lock().unwrap_or_else(PoisonError::into_inner);
    let mut largest = [0.0_f64; 3];
    for seed in 0..40 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let network = &NETWORK_BASIS.networks[seed as usize % NETWORK_BASIS.networks.len()];
        let directions = uniform_valid(64, random.random());
        let values = directions.iter().map(|angles| network.brdf(*angles));
        let outer = Outer {
            values: values.collect(),
            directions,
        };
        let logits: Vec<f64> = uniform_valid(samples, random.random())
            .iter()
            .map(angles_to_f64)
            .flat_map(|angles| {
                let angles = [angles.theta_h, angles.theta_d, angles.phi_d % PI];
                [0, 1, 2].map(|i| (angles[i] / (RANGES[i] - angles[i])).ln())
            })
            .collect();
        let log_precision: Vec<f64> = (0..COMPONENTS)
            .map(|_| random.random_range(0.5_f64.ln()..100.0_f64.ln()))
            .collect();
        let mut weights = network.parameters().iter().copied().map(f64::from);
        let tensors: Vec<Matrix> = Neural::SHAPES
            .iter()
            .map(|shape| {
                let values: Vec<f64> = weights.by_ref().take(shape[0] * shape[1]).collect();
                matrix(&values, *shape)
            })
            .collect();
        let actual = implementation(network, &logits, &log_precision, &outer);
        let expected = reference(&tensors, &logits, &log_precision, &outer);
        let errors = [
            (actual.loss - expected.loss).abs(),
            relative_error(&actual.by_logits, &expected.by_logits),
            relative_error(&actual.by_precision, &expected.by_precision),
        ];
        // This form also fails for NaN.
        assert!(
            errors.iter().all(|error| *error <= TOLERANCE),
            "seed {seed}: relative errors {errors:?}"
        );
        largest = std::array::from_fn(|i| largest[i].max(errors[i]));
    }
    let [loss, by_logits, by_precision] = largest;
    println!(
        "linear against burn, n = {samples}: loss {loss:.1e}, logits {by_logits:.1e}, precisions \
         {by_precision:.1e}"
    );
}

#[test]
fn linear_gradient_matches_burn_for_few_and_many_samples() {
    for samples in [3, COMPONENTS, 8] {
        compare(samples);
    }
}

#[test]
fn barrier_gradient_matches_burn() {
    let _lock = BURN_LOCK.lock().unwrap_or_else(PoisonError::into_inner);
    let (mut below_horizon, mut largest) = (0, 0.0_f64);
    for seed in 0..40 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        // About half of the samples are below the horizon.
        let logits: Vec<f32> = (0..24).map(|_| random.random_range(-2.0..3.0)).collect();
        let by_angles: Vec<[f32; 3]> = (0..8)
            .map(|_| [(); 3].map(|()| random.random_range(-0.01..0.01)))
            .collect();
        let pattern = Pattern::from_logits(&logits);

        let tensor = matrix(&to_f64(&logits), [8, 3]).require_grad();
        let angles = angles(&tensor);
        let at = unmeasured(angles.clone());
        let [hx, hz] = at.half();
        let [dx, _, dz] = at.difference();
        // Both cosines are positive if hz dz > |hx dx|.
        let valid: Vec<f64> = to_vec(hz * dz - (hx * dx).abs())
            .iter()
            .map(|lower| f64::from(u8::from(*lower > 0.0)))
            .collect();
        below_horizon += valid.iter().filter(|valid| **valid == 0.0).count();
        let invalid = (-matrix(&valid, [8, 1])).add_scalar(1.0);
        let [theta_h, theta_d] = [0, 1].map(|i| angles.clone().narrow(1, i, 1));
        let squares = theta_h.clone() * theta_h + theta_d.clone() * theta_d;
        let barrier = (squares * invalid * 0.005).sum();
        let slopes = to_f64(by_angles.as_flattened());
        let valid_terms = (angles * matrix(&slopes, [8, 3]) * matrix(&valid, [8, 1])).sum();
        let gradients = (barrier.clone() + valid_terms).backward();
        let expected = tensor.grad(&gradients).expect("the barrier depends on it");
        let expected = to_vec(expected);

        let mut queried = Vec::new();
        let actual = pattern.gradient_by_logits(|index| {
            queried.push(index);
            by_angles[index]
        });
        let valid: Vec<usize> = (0..8).filter(|index| valid[*index] == 1.0).collect();
        assert_eq!(queried, valid);
        let error = relative_error(&to_f64(&actual), &expected);
        // The code under test runs in single precision.
        assert!(error < 1e-6, "seed {seed}: {error}");
        largest = largest.max(error);
        let barrier: f64 = barrier.into_scalar();
        assert!((f64::from(pattern.barrier()) - barrier).abs() <= 1e-6 * barrier);
    }
    println!(
        "barrier against burn: {largest:.1e} of the largest slope; {below_horizon} samples below the horizon"
    );
    assert!((80..240).contains(&below_horizon), "{below_horizon} of 320");
}
