//! The coefficients of a solve.

use glimpse_core::fit::ridge::{Problem, factor_length, scratch_length};

use super::case::{Case, distance, solutions, to_f32, to_f64};
use crate::random::Random;

/// A rule for the precision of each of m components, with its name.
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

/// The solutions c and s in f64, then in f32.
fn in_both_precisions(case: &Case, lambda: &[f64]) -> [Vec<f64>; 4] {
    let Case {
        basis,
        precision,
        mapped,
        ..
    } = case;
    let (c, s) = solutions(basis, precision, mapped, lambda);
    let [basis, precision, mapped, lambda] =
        [basis, precision, mapped, lambda].map(|list: &[f64]| to_f32(list));
    let (c32, s32) = solutions(&basis, &precision, &mapped, &lambda);
    [c, s, to_f64(&c32), to_f64(&s32)]
}

#[test]
fn f32_and_f64_match_independent_solve() {
    for n in [1, 2, 8, 64, 512] {
        for m in [1, 5, 60, 240] {
            let mut worst = [0.0_f64; 4];
            for (name, precision) in PRECISIONS {
                for smooth in [false, true] {
                    let seed = (n * 1_000 + m) as u64;
                    let case = Case::new(n, m, |k| precision(k, m), smooth, seed);
                    let mut random = Random(7);
                    let lambda: Vec<f64> =
                        (0..m).map(|_| f64::from(random.normal() as f32)).collect();
                    let c = case.reference(&case.right_hand_side());
                    let s = case.reference(&lambda);
                    let actual = in_both_precisions(&case, &lambda);
                    for (index, expected) in [&c, &s, &c, &s].into_iter().enumerate() {
                        let error = distance(&actual[index], expected);
                        assert!(
                            error <= BOUNDS[index],
                            "n = {n}, m = {m}, precision {name}: {error:.1e}"
                        );
                        worst[index] = worst[index].max(error);
                    }
                }
            }
            let worst = worst.map(|error| format!("{error:.1e}")).join(" ");
            println!("n = {n}, m = {m}: {worst}");
        }
    }
}

/// Rows of zeros do not change the solution, but make n as large as m: the same problem in the primal form.
#[test]
fn primal_and_dual_agree() {
    for (n, m) in [(1, 3), (4, 5), (8, 60), (30, 40)] {
        let mut case = Case::new(n, m, |k| 4.0 + k as f64, false, 11);
        let lambda: Vec<f64> = (0..m).map(|k| 1.0 - 0.1 * k as f64).collect();
        let dual = in_both_precisions(&case, &lambda);
        case.basis.resize(m * m, 0.0);
        case.mapped.resize(m, 0.0);
        let primal = in_both_precisions(&case, &lambda);
        for (index, bound) in [1e-12, 1e-12, 1e-6, 1e-6].into_iter().enumerate() {
            assert!(distance(&dual[index], &primal[index]) < bound);
        }
    }
}

#[test]
fn reads_basis_from_unaligned_bytes() {
    let case = Case::new(8, 5, |_| 40.0, false, 5);
    let (basis, precision) = (to_f32(&case.basis), to_f32(&case.precision));
    let mapped = to_f32(&case.mapped);
    let (expected, _) = solutions(&basis, &precision, &mapped, &[0.0; 5]);
    let mut bytes = vec![0xff];
    bytes.extend(basis.iter().chain(&precision).flat_map(|x| x.to_le_bytes()));
    let (words, []) = bytes[1..].as_chunks::<4>() else {
        panic!("incomplete words")
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
