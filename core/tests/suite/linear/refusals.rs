//! What is refused, and by which name.

use glimpse_core::fit::ridge::{
    Part, Problem, RidgeError, RidgeGradient, factor_length, scratch_length,
};

use super::case::{Case, single, solutions, with_factors};

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

/// Version 0.1 refused pivots that rounding had brought to 0 or below. They have lower bounds now: only
/// what no precision may be is refused.
#[test]
fn an_ill_conditioned_problem_is_solved() {
    let refused = |basis: &[f32], precision: &[f32]| {
        with_factors(basis, precision, |_, _| ()).expect_err("it has no factors")
    };
    for bad in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        assert_eq!(refused(&[1.0; 4], &[1.0, bad]), RidgeError::Precision(1));
        // In the dual form no pivot would show it.
        assert_eq!(refused(&[1.0; 2], &[1.0, bad]), RidgeError::Precision(1));
    }
    // Equal components, and a prior that is lost in rounding: their sum still explains t = 1, each by
    // the same in exact arithmetic.
    for (entry, precision, n, m) in [(1e4, 1e-3, 3, 2), (1e5, 1e-3, 2, 3), (1e5, 1e-3, 3, 3)] {
        let (basis, precision) = (vec![entry; n * m], vec![precision; m]);
        let (c, _) = solutions::<f32>(&basis, &precision, &vec![1.0; n], &vec![1.0; m]);
        let sum: f32 = c.iter().sum();
        assert!((sum * entry - 1.0).abs() < 1e-3, "{c:?}");
    }
}
