//! The ridge solve matches an independent solve in f64, in f32 and f64, for packed and plain rows, and in both of its
//! forms. Its adjoint matches forward mode. `estimator.rs` tests rows of bytes.

use glimpse_core::fit::ridge::{System, factor_length, scratch_length};
use glimpse_core::numeric::{Floats, PackedRows, Real, Rows, Stored};

use crate::random::Random;
use crate::recipes::packed;
use crate::reference::{Normal, solve};

/// A realistic problem. Singular values from 10 to 0.1 scale the components. The readings are those of materials that
/// follow the prior, with noise. All numbers are exact in f32.
struct Case {
    k: usize,
    rows: Vec<f64>,
    scales: Vec<f64>,
    precision: Vec<f64>,
    targets: Vec<f64>,
}

fn round(x: f64) -> f64 {
    f64::from(x as f32)
}

fn to_f32(values: &[f64]) -> Vec<f32> {
    values.iter().map(|x| *x as f32).collect()
}

impl Case {
    /// `smooth` makes neighboring rows similar, like those of neighboring directions. The problem is then worse
    /// conditioned.
    fn new(n: usize, k: usize, precision: impl Fn(usize) -> f64, smooth: bool) -> Self {
        let mut random = Random((n * 1_000 + k) as u64);
        let scale = |j: usize| 10.0 * 0.01_f64.powf(j as f64 / (k.max(2) - 1) as f64);
        let phases: Vec<f64> = (0..k).map(|_| 6.3 * random.uniform()).collect();
        let mut rows = Vec::new();
        for _ in 0..n {
            let position = random.uniform();
            for (j, phase) in phases.iter().enumerate() {
                let shape = match smooth {
                    true => (position * 0.3 * (j + 1) as f64 + phase).sin(),
                    false => random.normal(),
                };
                rows.push(round(scale(j) * shape));
            }
        }
        let truth: Vec<f64> = (0..k).map(|_| 0.3 * random.normal()).collect();
        let targets = rows.chunks(k).map(|row| {
            let exact: f64 = row.iter().zip(&truth).map(|(q, z)| q * z).sum();
            round(exact + 0.05 * random.normal())
        });
        let (targets, scales) = (targets.collect(), vec![1.0; n]);
        let precision = (0..k).map(|j| round(precision(j))).collect();
        Self {
            k,
            rows,
            scales,
            precision,
            targets,
        }
    }

    /// z by elimination in f64, and one refinement.
    fn reference(&self) -> Vec<f64> {
        let mut normal = Normal::new(&self.precision);
        let readings = self.rows.chunks(self.k).zip(&self.scales);
        for ((row, scale), target) in readings.zip(&self.targets) {
            normal.add(row, scale * scale, *target);
        }
        let Normal { matrix, mut right } = normal;
        let mut z = solve(matrix.clone(), right.clone());
        for (right, row) in right.iter_mut().zip(&matrix) {
            *right -= row.iter().zip(&z).map(|(a, z)| a * z).sum::<f64>();
        }
        for (z, correction) in z.iter_mut().zip(solve(matrix, right)) {
            *z += correction;
        }
        z
    }

    /// z by the crate in f32.
    fn in_f32(&self) -> Vec<f64> {
        let (scales, precision) = (to_f32(&self.scales), packed(&to_f32(&self.precision)));
        let entries = packed(&to_f32(&self.rows));
        let rows = PackedRows {
            entries: &entries,
            scales: Floats::new(&[]),
        };
        let system = System {
            rows: rows.of(self.k),
            scales: &scales,
            precision: Floats::new(&precision).words(),
        };
        let z = solution(&system, &to_f32(&self.targets)).1;
        z.into_iter().map(f64::from).collect()
    }
}

/// The factors and z. The initial content of the memory has no effect.
fn solution<S: Real, T: Stored<S>, Q: Rows<S>>(
    system: &System<'_, S, T, Q>,
    targets: &[S],
) -> (Vec<S>, Vec<S>) {
    let (n, k) = (system.scales.len(), system.precision.len());
    let filled = |length: usize| vec![S::constant(f64::NAN); length];
    let (mut factors, mut z) = (filled(factor_length(n, k)), filled(k));
    for row in 0..system.order() {
        system.factorize_row(row, &mut factors, &mut z);
    }
    system.solve(&factors, targets, &mut z, &mut filled(scratch_length(n, k)));
    (factors, z)
}

/// The relative distance |a - b| / |b|.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    let norm = |list: &mut dyn Iterator<Item = f64>| list.map(|x| x * x).sum::<f64>().sqrt();
    norm(&mut a.iter().zip(b).map(|(a, b)| a - b)) / norm(&mut b.iter().copied())
}

/// A rule for the precision of each of K components, with its name.
type Precision = (&'static str, fn(usize, usize) -> f64);

fn decades(share: f64) -> f64 {
    1e4_f64.powf(share)
}

const PRECISIONS: [Precision; 5] = [
    ("4", |_, _| 4.0),
    ("40", |_, _| 40.0),
    ("1 to 1e4", |j, k| decades(j as f64 / (k.max(2) - 1) as f64)),
    ("1e4 to 1", |j, k| {
        decades(1.0 - j as f64 / (k.max(2) - 1) as f64)
    }),
    ("1 and 1e4 mixed", |j, _| {
        decades((j as f64 * 0.618_034).fract())
    }),
];

#[test]
fn f32_solve_matches_independent_solve_in_f64() {
    for n in [1, 2, 8, 64, 512] {
        for k in [1, 5, 24, 60, 240] {
            for (name, precision) in PRECISIONS {
                for smooth in [false, true] {
                    let case = Case::new(n, k, |j| precision(j, k), smooth);
                    let error = distance(&case.in_f32(), &case.reference());
                    let is_valid = error <= bound(n, k);
                    assert!(is_valid, "n = {n}, K = {k}, precision {name}: {error:.1e}");
                }
            }
        }
    }
}

/// The bound of the relative error. The error is larger only if 512 smooth rows make components nearly dependent, and
/// they have a precision of 1; two steps of refinement are then too few. The fitted readings remain accurate to 1e-5.
fn bound(n: usize, k: usize) -> f64 {
    match (n, k) {
        (..=64, _) | (_, ..=5) => 1e-5,
        _ => 1e-3,
    }
}

#[cfg(feature = "libm")] // f64 implements `Scalar` only with the feature libm
#[test]
fn f64_solve_matches_independent_solve_and_its_adjoint_forward_mode() {
    use glimpse_core::fit::ridge::RidgeGradient;
    use glimpse_core::numeric::Matrix;
    use glimpse_gradcheck::{Forward, compare};

    for (n, k) in [(1, 1), (1, 4), (3, 5), (5, 5), (8, 5), (12, 3)] {
        let mut case = Case::new(n, k, |j| 4.0 + 3.0 * j as f64, false);
        if n > 3 {
            case.scales[2] = 0.0;
            case.scales[3] = 1.5;
        }
        let (rows, scales) = (&case.rows, &case.scales);
        let (precision, targets) = (&case.precision, &case.targets);
        let system = System {
            rows: Matrix(rows, k),
            scales,
            precision,
        };
        let (factors, z) = solution(&system, targets);
        assert!(distance(&z, &case.reference()) < 1e-11);
        let mut random = Random(3);
        let lambda: Vec<f64> = (0..k).map(|_| random.normal()).collect();
        let lengths = [n, n * k, k];
        let mut by = lengths.map(|length| vec![0.0; length]);
        // `adjoint` adds derivatives. Two equal calls double them.
        for _ in 0..2 {
            let [by_targets, by_rows, by_precision] = &mut by;
            let mut gradient = RidgeGradient {
                targets: by_targets,
                rows: by_rows,
                precision: by_precision,
            };
            let mut scratch = vec![f64::NAN; k + scratch_length(n, k)];
            system.adjoint(
                &factors,
                (targets, &z),
                &lambda,
                &mut gradient,
                &mut scratch,
            );
        }
        let at = [&targets[..], rows, precision].concat();
        let scales: Vec<Forward> = scales.iter().copied().map(Forward::fixed).collect();
        let outcome = compare(&lengths, &at, &by.concat(), |list| {
            let (targets, rest) = list.split_at(n);
            let (rows, precision) = rest.split_at(n * k);
            let system = System {
                rows: Matrix(rows, k),
                scales: &scales,
                precision,
            };
            let (_, z) = solution(&system, targets);
            let products = z.iter().zip(&lambda);
            products.fold(Forward::fixed(0.0), |sum, (z, lambda)| {
                sum + *z * Forward::fixed(2.0 * lambda)
            })
        });
        outcome.expect("the adjoint is correct");
    }
}
