//! Lists of wrong lengths and invalid precisions are rejected.

use glimpse_core::fit::ridge::{
    Part, Problem, RidgeError, RidgeGradient, factor_length, scratch_length,
};

use super::case::{Case, solutions, to_f32, with_factors};

fn length(part: Part, found: usize) -> RidgeError {
    RidgeError::Length { part, found }
}

#[test]
fn rejects_problems_of_wrong_lengths() {
    let parse_error = |basis: &[f32], precision: &[f32]| Problem::new(basis, precision).err();
    assert_eq!(parse_error(&[1.0], &[]), Some(length(Part::Precision, 0)));
    assert_eq!(parse_error(&[], &[1.0]), Some(length(Part::Basis, 0)));
    assert_eq!(
        parse_error(&[1.0; 5], &[1.0; 2]),
        Some(length(Part::Basis, 5))
    );
}

#[test]
fn rejects_lists_and_buffers_of_wrong_lengths() {
    for (n, m) in [(8, 5), (5, 8)] {
        let basis = to_f32(&Case::new(n, m, |_| 1.0, false, 1).basis);
        let precision = vec![1.0_f32; m];
        let problem = Problem::new(&basis[..], &precision[..]).unwrap();
        let (needed, working) = (factor_length(n, m), scratch_length(n, m));
        assert_eq!((needed, working), (15, 2 * m + 15));
        let (mut memory, mut scratch) = (vec![0.0; needed], vec![0.0; working]);
        for found in 0..needed {
            let error = problem.factorize(&mut memory[..found], &mut scratch).err();
            let part = Part::Factors;
            let expected = RidgeError::Buffer {
                part,
                needed,
                found,
            };
            assert_eq!(error, Some(expected));
        }
        let cut = working - 1;
        let small = RidgeError::Buffer {
            part: Part::Scratch,
            needed: working,
            found: cut,
        };
        let error = problem.factorize(&mut memory, &mut scratch[..cut]).err();
        assert_eq!(error, Some(small));

        let factors = problem.factorize(&mut memory, &mut scratch).unwrap();
        let (coefficients, mapped) = (Part::Coefficients, Part::Mapped);
        let (t, c, mut out) = (vec![0.1; n + 1], vec![0.1; m + 1], vec![0.0; m + 1]);
        for (t_length, out_length, scratch_length, error) in [
            (n + 1, m, working, length(mapped, n + 1)),
            (n, m + 1, working, length(coefficients, m + 1)),
            (n, m, cut, small),
        ] {
            let scratch = &mut scratch[..scratch_length];
            let actual = factors.coefficients(&t[..t_length], &mut out[..out_length], scratch);
            assert_eq!(actual, Err(error));
        }
        for (c_length, out_length, scratch_length, error) in [
            (m + 1, m, working, length(coefficients, m + 1)),
            (m, m + 1, working, length(coefficients, m + 1)),
            (m, m, cut, small),
        ] {
            let scratch = &mut scratch[..scratch_length];
            let actual = factors.solve(&c[..c_length], &mut out[..out_length], scratch);
            assert_eq!(actual, Err(error));
        }

        // Each list in turn is too short by one.
        let lengths = [n, m, m, n, n * m, m];
        let (basis, precision) = (Part::Basis, Part::Precision);
        let parts = [mapped, coefficients, coefficients, mapped, basis, precision];
        for (which, part) in parts.into_iter().enumerate() {
            let mut short = lengths;
            short[which] -= 1;
            let [t, c, lambda, mut a, mut b, mut p] = short.map(|length| vec![0.5; length]);
            let mut gradient = RidgeGradient {
                mapped: &mut a,
                basis: &mut b,
                precision: &mut p,
            };
            let actual = factors.adjoint(&t, &c, &lambda, &mut gradient, &mut scratch);
            assert_eq!(actual, Err(length(part, short[which])));
            assert!(a.iter().chain(&b).chain(&p).all(|x| *x == 0.5));
        }
    }
}

#[test]
fn rejects_non_positive_precision() {
    for bad in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        // In the dual form, with fewer samples than components, no pivot would show the fault.
        for basis in [&[1.0; 4][..], &[1.0; 2]] {
            let actual = with_factors(basis, &[1.0, bad], |_, _| ());
            assert_eq!(actual, Err(RidgeError::Precision(1)));
        }
    }
}

/// Version 0.1 rejected pivots that rounding had made 0 or negative. Here components are equal, and the prior is lost
/// in rounding. Their sum still explains t = 1.
#[test]
fn solves_ill_conditioned_problem() {
    for (entry, precision, n, m) in [(1e4, 1e-3, 3, 2), (1e5, 1e-3, 2, 3), (1e5, 1e-3, 3, 3)] {
        let (basis, precision) = (vec![entry; n * m], vec![precision; m]);
        let (c, _) = solutions::<f32>(&basis, &precision, &vec![1.0; n], &vec![1.0; m]);
        let sum: f32 = c.iter().sum();
        assert!((sum * entry - 1.0).abs() < 1e-3, "{c:?}");
    }
}
