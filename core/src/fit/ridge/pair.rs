//! Sums in twice the working precision, from plain additions and multiplications.
//!
//! Ogita, Rump, Oishi: Accurate Sum and Dot Product (2005), Algorithms 3.1 to 3.3 and 5.3 (`Dot2`). They need neither a
//! fused multiply-add nor a wider type. The compiler must not contract a product and a sum into one operation; rustc
//! never does.
//!
//! A type without refinements (f64) needs no correction: `low` stays 0, and is not computed.

use super::Real;

/// An unevaluated sum of two numbers. The lower one is a correction of the higher one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair<S> {
    pub(super) high: S,
    pub(super) low: S,
}

impl<S: Real> Pair<S> {
    /// True if `low` is always 0.
    const PLAIN: bool = S::REFINEMENTS == 0;

    pub(super) fn new(value: S) -> Self {
        Self {
            high: value,
            low: S::constant(0.0),
        }
    }

    /// Returns the nearest single number.
    pub(super) fn value(self) -> S {
        self.high + self.low
    }

    /// Returns the same sum with the nearest single number as `high`.
    pub(super) fn normalized(self) -> Self {
        let (high, low) = two_sum(self.high, self.low);
        Self { high, low }
    }

    #[inline(always)]
    pub(super) fn add(&mut self, a: S) {
        if Self::PLAIN {
            self.high = self.high + a;
            return;
        }
        let (sum, error) = two_sum(self.high, a);
        self.high = sum;
        self.low = self.low + error;
    }

    #[inline(always)]
    pub(super) fn add_product(&mut self, a: S, b: S) {
        if Self::PLAIN {
            self.high = self.high.plus_product(a, b);
            return;
        }
        let (product, error) = two_product(a, b);
        self.add(product);
        self.low = self.low + error;
    }

    /// Adds `a` times a pair.
    #[inline(always)]
    pub(super) fn add_product_of_pair(&mut self, a: S, b: Self) {
        self.add_product(a, b.high);
        if Self::PLAIN {
            return;
        }
        self.low = self.low.plus_product(a, b.low);
    }

    /// Divides the pair by `divisor`.
    pub(super) fn divided_by(self, divisor: S) -> Self {
        let high = self.value() / divisor;
        if Self::PLAIN {
            return Self::new(high);
        }
        let mut remainder = self;
        remainder.add_product(-high, divisor);
        Self {
            high,
            low: remainder.value() / divisor,
        }
    }
}

/// Returns a + b as a rounded sum and its error (Knuth).
#[inline(always)]
fn two_sum<S: Real>(a: S, b: S) -> (S, S) {
    let sum = a + b;
    let b_part = sum - a;
    let error = (a - (sum - b_part)) + (b - b_part);
    (sum, error)
}

/// Returns a b as a rounded product and its error (Dekker, Veltkamp).
#[inline(always)]
fn two_product<S: Real>(a: S, b: S) -> (S, S) {
    let product = a * b;
    let (a_high, a_low) = split(a);
    let (b_high, b_low) = split(b);
    let error = a_low * b_low - (((product - a_high * b_high) - a_low * b_high) - a_high * b_low);
    (product, error)
}

/// Splits a number into two, each with half of the digits.
#[inline(always)]
fn split<S: Real>(a: S) -> (S, S) {
    let scaled = S::constant(S::SPLITTER) * a;
    let high = scaled - (scaled - a);
    (high, a - high)
}
