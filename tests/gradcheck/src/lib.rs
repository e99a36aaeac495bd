//! Derivatives in forward mode and double precision, as the independent witness of all reverse sweeps.
//!
//! [`Forward`] is a number with its derivative along one direction. The code under test runs on it, and the derivative of
//! the result must equal the product of the gradient, which a reverse sweep computed, and the direction. Both take the same
//! branches, so they agree at kinks, too.

pub mod cases;
#[allow(dead_code)] // core's tests use all of it
#[path = "../../../core/tests/suite/random.rs"]
mod random;

use std::cmp::Ordering;
use std::ops::{Add, Div, Mul, Neg, Sub};

use glimpse_core::model::ParameterSet;
use glimpse_core::numeric::{Real, Scalar, Value};
use random::Random;

/// A number with its derivative along one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forward {
    /// The number.
    pub value: f64,
    /// Its derivative.
    pub slope: f64,
}

impl Forward {
    /// Returns a number that does not change.
    #[must_use]
    pub const fn fixed(value: f64) -> Self {
        Self { value, slope: 0.0 }
    }
}

impl Add for Forward {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            slope: self.slope + other.slope,
        }
    }
}

impl Sub for Forward {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Forward {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            slope: self.slope * other.value + self.value * other.slope,
        }
    }
}

impl Div for Forward {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        Self {
            value,
            slope: (self.slope - value * other.slope) / other.value,
        }
    }
}

impl Neg for Forward {
    type Output = Self;
    fn neg(self) -> Self {
        Self {
            value: -self.value,
            slope: -self.slope,
        }
    }
}

impl Scalar for Forward {
    type Parameter = Self;
    type Sum = Self;

    fn constant(value: f64) -> Self {
        Self::fixed(value)
    }
    fn broadcast(parameter: Self) -> Self {
        parameter
    }
    fn add_product(sum: &mut Self, a: Self, b: Self) {
        *sum = *sum + a * b;
    }
    fn add_to(sum: &mut Self, a: Self) {
        *sum = *sum + a;
    }
    fn plus_product(self, a: Self, b: Self) -> Self {
        self + a * b
    }
    fn if_positive(self, then: Self, otherwise: Self) -> Self {
        if self.value > 0.0 { then } else { otherwise }
    }
    fn exp(self) -> Self {
        let value = self.value.exp();
        Self {
            value,
            slope: value * self.slope,
        }
    }
    fn ln(self) -> Self {
        Self {
            value: self.value.ln(),
            slope: self.slope / self.value,
        }
    }
}

impl PartialOrd for Forward {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        self.value.partial_cmp(&other.value)
    }
}

impl Real for Forward {
    const REFINEMENTS: usize = 0;
}

/// The largest permitted error of a derivative along a direction, relative to the sum of its absolute terms.
const TOLERANCE: f64 = 1e-9;

/// Compares a gradient with the derivatives of `function` along one random direction for each group of variables. `groups`
/// are the lengths of the groups in `at`.
///
/// # Errors
/// Names the first group whose derivative differs.
pub fn compare(
    groups: &[usize],
    at: &[f64],
    gradient: &[f64],
    function: impl Fn(&[Forward]) -> Forward,
) -> Result<(), String> {
    assert_eq!(at.len(), gradient.len());
    assert_eq!(at.len(), groups.iter().sum::<usize>());
    let mut random = Random(1);
    let mut first = 0;
    for (group, length) in groups.iter().enumerate() {
        let range = first..first + length;
        first = range.end;
        let mut terms = (0.0, 0.0_f64);
        let moving = at.iter().enumerate().map(|(index, value)| {
            let slope = match range.contains(&index) {
                true => f64::from(random.number()),
                false => 0.0,
            };
            let term = slope * gradient[index];
            terms = (terms.0 + term, terms.1 + term.abs());
            Forward {
                value: *value,
                slope,
            }
        });
        let moving: Vec<Forward> = moving.collect();
        let (expected, scale) = terms;
        let slope = function(&moving).slope;
        let error = (slope - expected).abs();
        if error.is_nan() || error > TOLERANCE * scale.max(1e-6) {
            return Err(format!(
                "group {group}: the derivative is {slope:e} forward, and {expected:e} by the gradient, with terms of \
                 {scale:e}"
            ));
        }
    }
    Ok(())
}

/// Converts a list in the model's order to a parameter set.
pub fn parameters<T: Value, P: ParameterSet<T>>(list: impl IntoIterator<Item = T>, zero: T) -> P {
    let mut set = P::filled(zero);
    for (entry, value) in set.iter_mut().zip(list) {
        *entry = value;
    }
    set
}
