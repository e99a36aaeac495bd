//! The gradient through the solve.

use glimpse_core::fit::ridge::RidgeGradient;

use super::case::{Case, Random, solutions, with_factors};

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
