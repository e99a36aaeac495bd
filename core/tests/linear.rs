//! The ridge solve agrees with an independent one in f64, in both of its forms and on every scalar,
//! and its adjoint with finite differences.

// f64 is a scalar with libm only. The solve has no elementary functions: the others say no more.
#![cfg(feature = "libm")]

use glimpse_core::linear::{
    Factors, Part, Problem, Real, RidgeError, RidgeGradient, factor_length, scratch_length,
};

/// SplitMix64, and sums of twelve for normal numbers.
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) as f64 / u64::MAX as f64
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// A realistic problem: components scaled by singular values that fall from 10 to 0.1, measurements
/// of materials that follow the prior, and noise. All numbers are f32 exactly.
struct Case {
    n: usize,
    m: usize,
    basis: Vec<f64>,
    precision: Vec<f64>,
    mapped: Vec<f64>,
}

impl Case {
    /// `smooth` makes neighbouring rows alike, as neighbouring directions are: worse conditioned.
    fn new(n: usize, m: usize, precision: impl Fn(usize) -> f64, smooth: bool, seed: u64) -> Self {
        let mut random = Random(seed);
        let round = |x: f64| f64::from(x as f32);
        let scale = |k: usize| 10.0 * 0.01_f64.powf(k as f64 / (m.max(2) - 1) as f64);
        let phases: Vec<f64> = (0..m).map(|_| 6.3 * random.uniform()).collect();
        let places: Vec<f64> = (0..n).map(|_| random.uniform()).collect();
        let mut basis = Vec::new();
        for place in &places {
            for (k, phase) in phases.iter().enumerate() {
                let shape = if smooth {
                    (place * 0.3 * (k + 1) as f64 + phase).sin()
                } else {
                    random.normal()
                };
                basis.push(round(scale(k) * shape));
            }
        }
        let precision: Vec<f64> = (0..m).map(|k| round(precision(k))).collect();
        let truth: Vec<f64> = (0..m).map(|_| 0.3 * random.normal()).collect();
        let mapped = basis
            .chunks(m)
            .map(|row| {
                let exact: f64 = row.iter().zip(&truth).map(|(a, c)| a * c).sum();
                round(exact + 0.05 * random.normal())
            })
            .collect();
        Self {
            n,
            m,
            basis,
            precision,
            mapped,
        }
    }

    /// (A'A + P)^-1 b, written once more: Gauss and Jordan with pivoting, in f64, then refined.
    fn reference(&self, right: &[f64]) -> Vec<f64> {
        let (n, m) = (self.n, self.m);
        let product = |k: usize, l: usize| -> f64 {
            let columns = (0..n).map(|j| self.basis[j * m + k] * self.basis[j * m + l]);
            let diagonal = if k == l { self.precision[k] } else { 0.0 };
            columns.sum::<f64>() + diagonal
        };
        let matrix: Vec<Vec<f64>> = (0..m)
            .map(|k| (0..m).map(|l| product(k, l)).collect())
            .collect();
        let mut solution = eliminate(&matrix, right);
        let left: Vec<f64> = (0..m)
            .map(|k| right[k] - (0..m).map(|l| matrix[k][l] * solution[l]).sum::<f64>())
            .collect();
        for (x, correction) in solution.iter_mut().zip(eliminate(&matrix, &left)) {
            *x += correction;
        }
        solution
    }

    /// A't.
    fn right_side(&self) -> Vec<f64> {
        (0..self.m)
            .map(|k| {
                (0..self.n)
                    .map(|j| self.basis[j * self.m + k] * self.mapped[j])
                    .sum()
            })
            .collect()
    }
}

fn eliminate(matrix: &[Vec<f64>], right: &[f64]) -> Vec<f64> {
    let order = right.len();
    let mut rows: Vec<Vec<f64>> = matrix.to_vec();
    for (row, b) in rows.iter_mut().zip(right) {
        row.push(*b);
    }
    for column in 0..order {
        let best = (column..order)
            .max_by(|a, b| rows[*a][column].abs().total_cmp(&rows[*b][column].abs()))
            .unwrap();
        rows.swap(column, best);
        let pivot = rows[column].clone();
        for row in rows.iter_mut().skip(column + 1) {
            let factor = row[column] / pivot[column];
            for (entry, above) in row.iter_mut().zip(&pivot).skip(column) {
                *entry -= factor * above;
            }
        }
    }
    let mut solution = vec![0.0; order];
    for k in (0..order).rev() {
        let sum: f64 = (k + 1..order).map(|l| rows[k][l] * solution[l]).sum();
        solution[k] = (rows[k][order] - sum) / rows[k][k];
    }
    solution
}

fn single(values: &[f64]) -> Vec<f32> {
    values.iter().map(|x| *x as f32).collect()
}

/// Factorizes and hands the factors over, with scratch.
fn with_factors<S: Real, R>(
    basis: &[S],
    precision: &[S],
    then: impl FnOnce(&Factors<'_, '_, S, S>, &mut [S]) -> R,
) -> Result<R, RidgeError> {
    let problem = Problem::new(basis, precision)?;
    let (n, m) = (problem.samples(), problem.components());
    let mut memory = vec![S::constant(f64::NAN); factor_length(n, m)];
    let mut scratch = vec![S::constant(f64::NAN); scratch_length(n, m)];
    let factors = problem.factorize(&mut memory, &mut scratch)?;
    Ok(then(&factors, &mut scratch))
}

/// Coefficients for t, and the solution for lambda.
fn solutions<S: Real>(
    basis: &[S],
    precision: &[S],
    mapped: &[S],
    lambda: &[S],
) -> (Vec<S>, Vec<S>) {
    with_factors(basis, precision, |factors, scratch| {
        let mut coefficients = vec![S::constant(f64::NAN); precision.len()];
        let mut solution = coefficients.clone();
        factors
            .coefficients(mapped, &mut coefficients, scratch)
            .unwrap();
        factors.solve(lambda, &mut solution, scratch).unwrap();
        (coefficients, solution)
    })
    .unwrap()
}

/// |a - b| / |b|.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    let norm = |list: &mut dyn Iterator<Item = f64>| list.map(|x| x * x).sum::<f64>().sqrt();
    norm(&mut a.iter().zip(b).map(|(a, b)| a - b)) / norm(&mut b.iter().copied())
}

fn double(values: &[f32]) -> Vec<f64> {
    values.iter().copied().map(f64::from).collect()
}

/// The name of a rule that gives each of m components its precision.
type Precision = (&'static str, fn(usize, usize) -> f64);

/// The largest relative errors of c and s in f64, then in f32.
const BOUNDS: [f64; 4] = [1e-10, 1e-11, 1e-6, 1e-6];

const PRECISIONS: [Precision; 5] = [
    ("4", |_, _| 4.0),
    ("40", |_, _| 40.0),
    ("1 to 1e4", |k, m| {
        1e4_f64.powf(k as f64 / (m.max(2) - 1) as f64)
    }),
    ("1e4 to 1", |k, m| {
        1e4_f64.powf(1.0 - k as f64 / (m.max(2) - 1) as f64)
    }),
    ("1 and 1e4 mixed", |k, _| {
        1e4_f64.powf((k as f64 * 0.618_034).fract())
    }),
];

#[test]
fn both_precisions_agree_with_an_independent_solve() {
    let mut worst = [0.0_f64; 4];
    for n in [1, 2, 8, 64, 512] {
        for m in [1, 5, 60, 240] {
            let mut worst_here = [0.0_f64; 4];
            for (name, precision) in PRECISIONS {
                for smooth in [false, true] {
                    let seed = (n * 1_000 + m) as u64;
                    let case = Case::new(n, m, |k| precision(k, m), smooth, seed);
                    let mut random = Random(7);
                    let lambda: Vec<f64> =
                        (0..m).map(|_| f64::from(random.normal() as f32)).collect();
                    let c = case.reference(&case.right_side());
                    let s = case.reference(&lambda);
                    let (c64, s64) = solutions(&case.basis, &case.precision, &case.mapped, &lambda);
                    let (c32, s32) = solutions(
                        &single(&case.basis),
                        &single(&case.precision),
                        &single(&case.mapped),
                        &single(&lambda),
                    );
                    let errors = [
                        distance(&c64, &c),
                        distance(&s64, &s),
                        distance(&double(&c32), &c),
                        distance(&double(&s32), &s),
                    ];
                    for ((worst, error), bound) in worst_here.iter_mut().zip(errors).zip(BOUNDS) {
                        assert!(
                            error <= bound,
                            "n = {n}, m = {m}, precision {name}: {error:.1e}"
                        );
                        *worst = worst.max(error);
                    }
                }
            }
            println!(
                "n = {n}, m = {m}: {}",
                worst_here.map(|e| format!("{e:.1e}")).join(" ")
            );
            for (worst, here) in worst.iter_mut().zip(worst_here) {
                *worst = worst.max(here);
            }
        }
    }
    let [c64, s64, c32, s32] = worst;
    println!("f64: c {c64:.1e}, s {s64:.1e}; f32: c {c32:.1e}, s {s32:.1e}");
}

/// Rows of zeros change nothing, but make n larger than m: the same problem in the primal form.
#[test]
fn primal_and_dual_are_the_same() {
    for (n, m) in [(1, 3), (4, 5), (8, 60), (30, 40)] {
        let case = Case::new(n, m, |k| 4.0 + k as f64, false, 11);
        let lambda: Vec<f64> = (0..m).map(|k| 1.0 - 0.1 * k as f64).collect();
        let (c, s) = solutions(&case.basis, &case.precision, &case.mapped, &lambda);
        let mut basis = case.basis.clone();
        basis.resize(m * m, 0.0);
        let mut mapped = case.mapped.clone();
        mapped.resize(m, 0.0);
        let (c_primal, s_primal) = solutions(&basis, &case.precision, &mapped, &lambda);
        assert!(distance(&c, &c_primal) < 1e-12);
        assert!(distance(&s, &s_primal) < 1e-12);
        let (c, s) = solutions(
            &single(&case.basis),
            &single(&case.precision),
            &single(&case.mapped),
            &single(&lambda),
        );
        let (c_primal, s_primal) = solutions(
            &single(&basis),
            &single(&case.precision),
            &single(&mapped),
            &single(&lambda),
        );
        assert!(distance(&double(&c), &double(&c_primal)) < 1e-6);
        assert!(distance(&double(&s), &double(&s_primal)) < 1e-6);
    }
}

#[test]
fn the_basis_is_read_from_unaligned_bytes() {
    let case = Case::new(8, 5, |_| 40.0, false, 5);
    let (basis, precision) = (single(&case.basis), single(&case.precision));
    let mapped = single(&case.mapped);
    let (expected, _) = solutions(&basis, &precision, &mapped, &[0.0; 5]);
    let mut bytes = vec![0xff];
    bytes.extend(basis.iter().chain(&precision).flat_map(|x| x.to_le_bytes()));
    let (words, []) = bytes[1..].as_chunks::<4>() else {
        panic!("whole words")
    };
    let (basis, precision) = words.split_at(40);
    let problem = Problem::new(basis, precision).unwrap();
    assert_eq!(
        (problem.samples(), problem.components(), problem.order()),
        (8, 5, 5)
    );
    let mut memory = [f32::NAN; factor_length(8, 5)];
    let mut scratch = [f32::NAN; scratch_length(8, 5)];
    let factors = problem.factorize(&mut memory, &mut scratch).unwrap();
    let mut coefficients = [f32::NAN; 5];
    factors
        .coefficients(&mapped, &mut coefficients, &mut scratch)
        .unwrap();
    assert_eq!(coefficients[..], expected);
}

/// A loss that weighs the coefficients, so that its derivative by them is `lambda`.
fn weighted(basis: &[f64], precision: &[f64], mapped: &[f64], lambda: &[f64]) -> f64 {
    let (c, _) = solutions(basis, precision, mapped, lambda);
    c.iter().zip(lambda).map(|(c, lambda)| c * lambda).sum()
}

/// Compares each slope with a central difference of fourth order.
fn compare(
    what: &str,
    slopes: &[f64],
    at: &[f64],
    step: f64,
    function: impl Fn(&[f64]) -> f64,
) -> f64 {
    let scale = slopes.iter().fold(0.0_f64, |s, x| s.max(x.abs()));
    assert!(scale > 0.0);
    let mut worst = 0.0_f64;
    for (index, slope) in slopes.iter().enumerate() {
        let mut difference = 0.0;
        for (place, weight) in [(-2.0, 1.0), (-1.0, -8.0), (1.0, 8.0), (2.0, -1.0)] {
            let mut moved = at.to_vec();
            moved[index] += place * step;
            difference += weight * function(&moved);
        }
        difference /= 12.0 * step;
        let error = (slope - difference).abs() / scale;
        assert!(
            error < 1e-7,
            "{what} {index}: the slope is {slope:e}, the difference {difference:e}"
        );
        worst = worst.max(error);
    }
    worst
}

#[test]
fn the_adjoint_agrees_with_differences() {
    for (n, m) in [(1, 1), (1, 4), (3, 5), (5, 5), (8, 5), (12, 3)] {
        let Case {
            basis,
            precision,
            mapped,
            ..
        } = Case::new(n, m, |k| 4.0 + 3.0 * k as f64, false, (100 * n + m) as u64);
        let mut random = Random(3);
        let lambda: Vec<f64> = (0..m).map(|_| random.normal()).collect();
        let mut by_mapped = vec![0.0; n];
        let mut by_basis = vec![0.0; n * m];
        let mut by_precision = vec![0.0; m];
        let mut twice = 0.0;
        for _ in 0..2 {
            with_factors(&basis, &precision, |factors, scratch| {
                let mut coefficients = vec![0.0; m];
                factors
                    .coefficients(&mapped, &mut coefficients, scratch)
                    .unwrap();
                let mut gradient = RidgeGradient {
                    mapped: &mut by_mapped,
                    basis: &mut by_basis,
                    precision: &mut by_precision,
                };
                factors
                    .adjoint(&mapped, &coefficients, &lambda, &mut gradient, scratch)
                    .unwrap();
            })
            .unwrap();
            twice += 1.0;
        }
        // It adds: here the same twice.
        for slope in by_mapped
            .iter_mut()
            .chain(&mut by_basis)
            .chain(&mut by_precision)
        {
            *slope /= twice;
        }
        let worst = [
            compare("t", &by_mapped, &mapped, 1e-3, |t| {
                weighted(&basis, &precision, t, &lambda)
            }),
            compare("A", &by_basis, &basis, 1e-3, |a| {
                weighted(a, &precision, &mapped, &lambda)
            }),
            compare("p", &by_precision, &precision, 1e-3, |p| {
                weighted(&basis, p, &mapped, &lambda)
            }),
        ];
        println!("n = {n}, m = {m}: {worst:?}");
    }
}

#[test]
fn what_does_not_fit_is_refused_by_name() {
    let length = |part, found| RidgeError::Length { part, found };
    let refused = |basis: &[f32], precision: &[f32]| Problem::new(basis, precision).err();
    assert_eq!(refused(&[1.0], &[]), Some(length(Part::Precision, 0)));
    assert_eq!(refused(&[], &[1.0]), Some(length(Part::Basis, 0)));
    assert_eq!(refused(&[1.0; 5], &[1.0; 2]), Some(length(Part::Basis, 5)));

    for (n, m) in [(8, 5), (5, 8)] {
        let basis: Vec<f32> = single(&Case::new(n, m, |_| 1.0, false, 1).basis);
        let precision = vec![1.0_f32; m];
        let problem = Problem::new(&basis[..], &precision[..]).unwrap();
        let (needed, working) = (factor_length(n, m), scratch_length(n, m));
        assert_eq!((needed, working), (15, 2 * m + 15));
        for found in 0..needed {
            let (mut memory, mut scratch) = (vec![0.0; found], vec![0.0; working]);
            let error = problem.factorize(&mut memory, &mut scratch);
            let part = Part::Factors;
            assert_eq!(
                error.err(),
                Some(RidgeError::Buffer {
                    part,
                    needed,
                    found
                })
            );
        }
        let mut memory = vec![0.0; needed];
        let small = RidgeError::Buffer {
            part: Part::Scratch,
            needed: working,
            found: working - 1,
        };
        let mut scratch = vec![0.0; working];
        let cut = working - 1;
        let error = problem.factorize(&mut memory, &mut scratch[..cut]).err();
        assert_eq!(error, Some(small));

        let factors = problem.factorize(&mut memory, &mut scratch).unwrap();
        let (t, c) = (vec![0.1; n + 1], vec![0.1; m + 1]);
        let mut out = vec![0.0; m + 1];
        let mut solve =
            |t: usize, out_length: usize, scratch_length: usize, values: &[f32]| -> RidgeError {
                factors
                    .coefficients(
                        &values[..t],
                        &mut out[..out_length],
                        &mut scratch[..scratch_length],
                    )
                    .unwrap_err()
            };
        assert_eq!(solve(n + 1, m, working, &t), length(Part::Mapped, n + 1));
        assert_eq!(
            solve(n, m + 1, working, &t),
            length(Part::Coefficients, m + 1)
        );
        assert_eq!(solve(n, m, cut, &t), small);
        let error = factors.solve(&c, &mut out[..m], &mut scratch).unwrap_err();
        assert_eq!(error, length(Part::Coefficients, m + 1));
        let error = factors.solve(&c[..m], &mut out, &mut scratch).unwrap_err();
        assert_eq!(error, length(Part::Coefficients, m + 1));
        let error = factors
            .solve(&c[..m], &mut out[..m], &mut scratch[..cut])
            .unwrap_err();
        assert_eq!(error, small);

        // One list after the other is one too short.
        let parts = [
            Part::Mapped,
            Part::Coefficients,
            Part::Coefficients,
            Part::Mapped,
            Part::Basis,
            Part::Precision,
        ];
        for (which, part) in parts.into_iter().enumerate() {
            let lengths = [n, m, m, n, n * m, m];
            let found = lengths[which] - 1;
            let lists: Vec<Vec<f32>> = (0..6)
                .map(|list| vec![0.5; lengths[list] - usize::from(list == which)])
                .collect();
            let (mut a, mut b, mut p) = (lists[3].clone(), lists[4].clone(), lists[5].clone());
            let mut gradient = RidgeGradient {
                mapped: &mut a,
                basis: &mut b,
                precision: &mut p,
            };
            let error = factors
                .adjoint(&lists[0], &lists[1], &lists[2], &mut gradient, &mut scratch)
                .unwrap_err();
            assert_eq!(error, length(part, found));
            assert!(a.iter().chain(&b).chain(&p).all(|x| *x == 0.5));
        }
    }
}

#[test]
fn a_pivot_that_is_not_positive_is_refused() {
    let refused = |basis: &[f32], precision: &[f32]| {
        with_factors(basis, precision, |_, _| ()).expect_err("it has no factors")
    };
    for bad in [0.0, -1.0, f32::NAN] {
        assert_eq!(refused(&[1.0; 4], &[1.0, bad]), RidgeError::Precision(1));
        // In the dual form no pivot would show it.
        assert_eq!(refused(&[1.0; 2], &[1.0, bad]), RidgeError::Precision(1));
    }
    // Two equal components, and a prior that is lost in rounding.
    assert_eq!(refused(&[1e4; 6], &[1e-3; 2]), RidgeError::Pivot(1));
    assert_eq!(refused(&[1e5; 6], &[1e-3; 3]), RidgeError::Pivot(1));
    for bad in [f32::NAN, f32::INFINITY] {
        assert_eq!(
            refused(&[bad, 1.0, 1.0, 1.0], &[1.0; 2]),
            RidgeError::Pivot(0)
        );
    }
}
