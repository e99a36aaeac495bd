//! Gradient checks for tests: central differences that detect kinks.
//!
//! A kink (of a ReLU, an absolute value, a clamp) is a branch of the model's code, and all branches go through
//! [`Scalar::if_positive`]. [`Traced`] is an f64 that records all branches taken. If all points of a difference take
//! the branches of its center, the function is smooth between them, and the difference must agree. Otherwise the
//! difference is discarded and counted.

pub mod cases;

use std::cell::Cell;
use std::ops::{Add, Div, Mul, Neg, Sub};

use glimpse_core::model::ParameterSet;
use glimpse_core::numeric::{Scalar, Value};

thread_local! {
    /// A fingerprint of the branches taken since the start of the last [`traced`].
    static BRANCHES: Cell<u64> = const { Cell::new(0) };
}

/// An f64 that records the branches taken.
#[derive(Clone, Copy, Debug)]
pub struct Traced(pub f64);

/// Runs `computation` and returns its value and a fingerprint of the branches taken.
fn traced(computation: impl FnOnce() -> Traced) -> (f64, u64) {
    BRANCHES.set(0xcbf2_9ce4_8422_2325);
    let value = computation().0;
    (value, BRANCHES.get())
}

macro_rules! operator {
    ($trait:ident, $method:ident, $operator:tt) => {
        impl $trait for Traced {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                Self(self.0 $operator other.0)
            }
        }
    };
}
operator!(Add, add, +);
operator!(Sub, sub, -);
operator!(Mul, mul, *);
operator!(Div, div, /);

impl Neg for Traced {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl Scalar for Traced {
    type Parameter = Self;
    type Sum = Self;

    fn constant(value: f64) -> Self {
        Self(value)
    }
    fn broadcast(parameter: Self) -> Self {
        parameter
    }
    fn add_product(sum: &mut Self, a: Self, b: Self) {
        sum.0 += a.0 * b.0;
    }
    fn add_to(sum: &mut Self, a: Self) {
        sum.0 += a.0;
    }
    fn plus_product(self, a: Self, b: Self) -> Self {
        Self(self.0 + a.0 * b.0)
    }
    fn if_positive(self, then: Self, otherwise: Self) -> Self {
        let positive = self.0 > 0.0;
        // FNV-1a, one step for each branch.
        let mixed = BRANCHES.get() ^ u64::from(positive) ^ 0x55;
        BRANCHES.set(mixed.wrapping_mul(0x0100_0000_01b3));
        if positive { then } else { otherwise }
    }
    fn exp(self) -> Self {
        Self(self.0.exp())
    }
    fn ln(self) -> Self {
        Self(self.0.ln())
    }
}

/// A comparison of slopes with central differences.
#[derive(Debug)]
pub struct Differences {
    /// Half the distance between a difference's inner points.
    step: f64,
    /// Largest allowed relative error.
    tolerance: f64,
    /// Number of slopes that agreed.
    compared: usize,
    /// Number of those that are not 0.
    nonzero: usize,
    /// Number of differences that were discarded, most of them because of a kink.
    discarded: usize,
    /// Largest error relative to the larger of slope and scale.
    max_error: f64,
}

/// Sum of the absolute weights of a difference.
const WEIGHTS: f64 = 18.0 / 12.0;

/// Returns the central difference of `function` at 0, and the largest absolute value in it. Returns None if a point
/// takes other `branches`.
fn central(step: f64, branches: u64, function: &impl Fn(f64) -> Traced) -> Option<(f64, f64)> {
    let mut difference = 0.0;
    let mut largest: f64 = 0.0;
    for (offset, weight) in [(-2.0, 1.0), (-1.0, -8.0), (1.0, 8.0), (2.0, -1.0)] {
        let (value, branches_taken) = traced(|| function(offset * step));
        if branches_taken != branches {
            return None;
        }
        difference += weight * value;
        largest = largest.max(value.abs());
    }
    Some((difference / (12.0 * step), largest))
}

/// Assumed rounding error of a function's value, in units of the last place. The value is a loss after many steps of a
/// fit, and each step rounds.
const ROUNDINGS: f64 = 8.0;

impl Differences {
    /// An empty comparison. `step` is half the distance between a difference's inner points, and `tolerance` the
    /// largest allowed relative error.
    pub fn new(step: f64, tolerance: f64) -> Self {
        Self {
            step,
            tolerance,
            compared: 0,
            nonzero: 0,
            discarded: 0,
            max_error: 0.0,
        }
    }

    /// Compares `slope` with the central difference (fourth order) of `function` at 0.
    ///
    /// The error is relative to the larger of `slope` and `scale`. Rounding errors of `ROUNDINGS` units per value are
    /// subtracted. A difference that changes with the step by half its error is not reliable and is discarded: a steep
    /// function rounds worse than assumed.
    pub fn compare(
        &mut self,
        variable: &str,
        slope: f64,
        scale: f64,
        function: impl Fn(f64) -> Traced,
    ) -> Result<(), String> {
        let (_, branches) = traced(|| function(0.0));
        let Some((difference, largest)) = central(self.step, branches, &function) else {
            self.discarded += 1;
            return Ok(());
        };
        let rounding = ROUNDINGS * f64::EPSILON * WEIGHTS / self.step * largest;
        let error = ((slope - difference).abs() - rounding).max(0.0) / slope.abs().max(scale);
        if error.is_nan() || error > self.tolerance {
            let others = [0.7, 1.4, 2.0].map(|factor| {
                let other = central(factor * self.step, branches, &function);
                other.map_or(0.0, |(other, _)| (other - difference).abs())
            });
            let uncertainty = others.into_iter().fold(0.0, f64::max);
            if (slope - difference).abs() <= 2.0 * uncertainty {
                self.discarded += 1;
                return Ok(());
            }
            return Err(format!(
                "along {variable}: the slope is {slope:e}, but the central difference is {difference:e}; \
                 the relative error is {error:e} with a scale of {scale:e}"
            ));
        }
        self.compared += 1;
        self.nonzero += usize::from(slope != 0.0);
        self.max_error = self.max_error.max(error);
        Ok(())
    }

    /// Counts `count` differences as discarded, because a kink is near.
    pub fn discard(&mut self, count: usize) {
        self.discarded += count;
    }

    /// Prints the counts, and asserts that enough differences were compared.
    ///
    /// # Panics
    /// If fewer than `min_nonzero` nonzero slopes were compared, or more than 5 % were discarded.
    pub fn assert_enough_compared(&self, name: &str, min_nonzero: usize) {
        let Self {
            compared,
            nonzero,
            discarded,
            max_error,
            ..
        } = self;
        println!(
            "{name}: {compared} compared ({nonzero} nonzero), {discarded} discarded, largest error \
             {max_error:.1e}"
        );
        assert!(
            *nonzero >= min_nonzero,
            "{name}: {nonzero} nonzero slopes compared, fewer than {min_nonzero}"
        );
        assert!(
            20 * discarded <= compared + discarded,
            "{name}: {discarded} of {} discarded",
            compared + discarded
        );
    }
}

/// Returns the scale for errors of some slopes: a thousandth of the largest of them.
pub fn gradient_scale(slopes: &[f64]) -> f64 {
    1e-3 * slopes
        .iter()
        .fold(1e-3, |largest: f64, slope| largest.max(slope.abs()))
}

/// Converts a list in the model's order to a parameter set.
pub fn parameters<T: Value, P: ParameterSet<T>>(list: impl IntoIterator<Item = T>, zero: T) -> P {
    let mut set = P::filled(zero);
    for (entry, value) in set.as_mut_slice().iter_mut().zip(list) {
        *entry = value;
    }
    set
}
