//! Elementary functions on the lanes of every instruction set of this machine.

use glimpse_kernels::lanes::{
    InstructionSet, Kernel, Lanes, MAX_OCTETS, Octet, PortableLanes, WIDTH,
};

struct ExpAndLn([f32; WIDTH]);
impl Kernel for ExpAndLn {
    type Output = ([f32; WIDTH], [f32; WIDTH]);
    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let octet = Octet(self.0);
        let x = L::load([&octet; MAX_OCTETS]);
        let [mut exp, mut ln] = [[Octet::default(); MAX_OCTETS]; 2];
        x.exp().store(&mut exp);
        x.ln().store(&mut ln);
        // All octets of a wide register were loaded with the same values.
        for result in [exp, ln] {
            assert!(result[..L::OCTETS].iter().all(|octet| *octet == result[0]));
        }
        (exp[0].0, ln[0].0)
    }
}

fn assert_close(actual: f32, expected: f64, x: f32) {
    let error = (f64::from(actual) - expected).abs();
    assert!(
        error <= 3e-7 * expected.abs().max(0.3),
        "at {x}: {actual} instead of {expected}"
    );
}

#[test]
fn exp_and_ln_are_accurate_on_all_lanes() {
    for i in 0..40_000 {
        let x: [f32; WIDTH] = std::array::from_fn(|lane| (i * WIDTH + lane) as f32 * 2.5e-4 + 1e-5);
        let results = [
            InstructionSet::detect().run(ExpAndLn(x)),
            ExpAndLn(x).run::<PortableLanes>(),
        ];
        for (exp, ln) in results {
            for lane in 0..WIDTH {
                assert_close(ln[lane], f64::from(x[lane]).ln(), x[lane]);
                if x[lane] < 80.0 {
                    assert_close(exp[lane], f64::from(x[lane]).exp(), x[lane]);
                }
            }
        }
        let negative = x.map(|x| -x);
        for lane in 0..WIDTH {
            let actual = InstructionSet::detect().run(ExpAndLn(negative)).0[lane];
            if x[lane] < 80.0 {
                let expected = f64::from(negative[lane]).exp();
                assert!((f64::from(actual) - expected).abs() <= 3e-7 * expected.max(1e-30));
            }
        }
    }
}

#[test]
fn exp_of_extreme_values_is_finite() {
    let (exp, _) =
        InstructionSet::detect().run(ExpAndLn([-1e9, 1e9, -88.0, 88.5, 0.0, -0.0, 1.0, -1.0]));
    assert!(
        exp.iter().all(|value| value.is_finite() && *value >= 0.0),
        "{exp:?}"
    );
}
