//! The gradient of the solve.

use glimpse_core::fit::ridge::RidgeGradient;

use super::case::{Case, solutions, with_factors};
use crate::finite_differences::assert_derivatives;
use crate::random::Random;

#[test]
fn adjoint_matches_differences() {
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
        // `adjoint` adds derivatives. Two equal calls double them.
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
        }
        // The derivative of this loss with respect to the coefficients is 2 `lambda`.
        let loss = |basis: &[f64], precision: &[f64], mapped: &[f64]| {
            let (c, _) = solutions(basis, precision, mapped, &lambda);
            let terms = c.iter().zip(&lambda).map(|(c, lambda)| c * lambda);
            2.0 * terms.sum::<f64>()
        };
        let bound = 1e-7;
        assert_derivatives("t", &by_mapped, &mapped, bound, |t| {
            loss(&basis, &precision, &t)
        });
        assert_derivatives("A", &by_basis, &basis, bound, |a| {
            loss(&a, &precision, &mapped)
        });
        assert_derivatives("p", &by_precision, &precision, bound, |p| {
            loss(&basis, &p, &mapped)
        });
    }
}
