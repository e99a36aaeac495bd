//! What tests of gradients share: central differences that know where kinks are.
//!
//! A kink (of a ReLU, an absolute value, a clamp) is a branch of the model's code, and all
//! branches go through [`Scalar::if_positive`]. [`Traced`] is an f64 that records which way each
//! of them went. Where a difference's ends took the same branches as its middle, the function
//! is smooth between them and the difference must agree; elsewhere it is discarded, and counted.

pub mod cases;

use std::cell::Cell;
use std::ops::{Add, Div, Mul, Neg, Sub};

use glimpse_core::model::ParameterSet;
use glimpse_core::numeric::{Scalar, Value};

thread_local! {
    /// A fingerprint of the branches taken since the last [`traced`] began.
    static BRANCHES: Cell<u64> = const { Cell::new(0) };
}

/// An f64 that records the branches taken.
#[derive(Clone, Copy, Debug)]
pub struct Traced(pub f64);

/// Runs `computation`; its value, and a fingerprint of the branches that it took.
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
        // FNV-1a, a step for each branch.
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

/// Slopes compared with central differences.
#[derive(Debug)]
pub struct Differences {
    /// Half the distance of a difference's inner points.
    step: f64,
    /// Largest relative error that passes.
    tolerance: f64,
    /// How many agreed, and how many of those were not 0.
    compared: usize,
    sloping: usize,
    /// How many had a kink between their ends.
    discarded: usize,
    /// The largest error relative to the larger of slope and scale.
    worst: f64,
}

/// The sum of a difference's weights, each without its sign.
const WEIGHTS: f64 = 18.0 / 12.0;

/// The central difference of `function` about 0, and the largest of the values that it is of; None if
/// other `branches` are taken somewhere.
fn central(step: f64, branches: u64, function: &impl Fn(f64) -> Traced) -> Option<(f64, f64)> {
    let mut difference = 0.0;
    let mut largest: f64 = 0.0;
    for (place, weight) in [(-2.0, 1.0), (-1.0, -8.0), (1.0, 8.0), (2.0, -1.0)] {
        let (value, taken) = traced(|| function(place * step));
        if taken != branches {
            return None;
        }
        difference += weight * value;
        largest = largest.max(value.abs());
    }
    Some((difference / (12.0 * step), largest))
}

/// So many units in the last place may a function's value be off: a loss after many steps of a fit,
/// each of which rounds.
const ROUNDINGS: f64 = 8.0;

impl Differences {
    /// None yet; `step` is half the distance of a difference's inner points, `tolerance` the
    /// largest relative error that passes.
    pub fn new(step: f64, tolerance: f64) -> Self {
        Self {
            step,
            tolerance,
            compared: 0,
            sloping: 0,
            discarded: 0,
            worst: 0.0,
        }
    }

    /// Compares `slope` with the central difference (fourth order) of `function` about 0.
    ///
    /// The error is relative to the larger of `slope` and `scale`, and rounding is no error: the
    /// difference of values that carry `ROUNDINGS` each says no more than their sum over `step`.
    /// A difference that changes with the step by as much as it is off says nothing either, and is
    /// discarded: a steep function rounds worse than that.
    pub fn compare(
        &mut self,
        what: &str,
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
            let doubt = others.into_iter().fold(0.0, f64::max);
            if (slope - difference).abs() <= 2.0 * doubt {
                self.discarded += 1;
                return Ok(());
            }
            return Err(format!(
                "by {what}: the slope is {slope:e} but the central difference {difference:e}, \
                 {error:e} off relative to a scale of {scale:e}"
            ));
        }
        self.compared += 1;
        self.sloping += usize::from(slope != 0.0);
        self.worst = self.worst.max(error);
        Ok(())
    }

    /// Counts `count` differences that are not taken, because a kink is near.
    pub fn discard(&mut self, count: usize) {
        self.discarded += count;
    }

    /// Reports; fails if fewer than `least` slopes other than 0 were compared, or more than one
    /// in twenty discarded.
    pub fn conclude(&self, what: &str, least: usize) {
        let Self {
            compared,
            sloping,
            discarded,
            worst,
            ..
        } = self;
        println!(
            "{what}: {compared} compared ({sloping} not 0), {discarded} at kinks, largest error \
             {worst:.1e}"
        );
        assert!(*sloping >= least, "{what}: only {sloping} compared");
        assert!(
            20 * discarded <= compared + discarded,
            "{what}: {discarded} of {} discarded",
            compared + discarded
        );
    }
}

/// A thousandth of the largest of some slopes: the scale to judge each of them by.
pub fn scale_of(slopes: &[f64]) -> f64 {
    1e-3 * slopes
        .iter()
        .fold(1e-3, |largest: f64, slope| largest.max(slope.abs()))
}

/// A list, in the model's order, as a parameter set.
pub fn parameters<T: Value, P: ParameterSet<T>>(list: impl IntoIterator<Item = T>, zero: T) -> P {
    let mut set = P::filled(zero);
    for (entry, value) in set.as_mut_slice().iter_mut().zip(list) {
        *entry = value;
    }
    set
}
