//! A block of samples that are computed together, on a processor without SIMD.
//!
//! Each parameter is loaded once for all samples of a block, and terms that depend only on parameters are computed
//! once. For models with few parameters, this saves much of the work.

use core::ops::{Add, Div, Mul, Neg, Sub};

use super::Scalar;

/// `N` numbers, one for each sample of a block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block<const N: usize>(pub [f32; N]);

macro_rules! operator {
    ($trait:ident, $method:ident, $operator:tt) => {
        impl<const N: usize> $trait for Block<N> {
            type Output = Self;
            #[inline(always)]
            fn $method(mut self, other: Self) -> Self {
                for (a, b) in self.0.iter_mut().zip(&other.0) {
                    *a $operator *b;
                }
                self
            }
        }
    };
}
operator!(Add, add, +=);
operator!(Sub, sub, -=);
operator!(Mul, mul, *=);
operator!(Div, div, /=);

impl<const N: usize> Neg for Block<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.each(|a| -a)
    }
}

impl<const N: usize> Block<N> {
    #[inline(always)]
    fn each(mut self, function: impl Fn(f32) -> f32) -> Self {
        for a in &mut self.0 {
            *a = function(*a);
        }
        self
    }
}

impl<const N: usize> Scalar for Block<N> {
    type Parameter = f32;
    type Sum = f32;

    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self([value as f32; N])
    }
    #[inline(always)]
    fn broadcast(parameter: f32) -> Self {
        Self([parameter; N])
    }
    /// Adds in the samples' order: the result equals that of single samples, bit for bit.
    #[inline(always)]
    fn add_product(sum: &mut f32, a: Self, b: Self) {
        let mut total = *sum;
        for (a, b) in a.0.iter().zip(&b.0) {
            total = total.plus_product(*a, *b);
        }
        *sum = total;
    }
    #[inline(always)]
    fn add_to(sum: &mut f32, a: Self) {
        let mut total = *sum;
        for a in &a.0 {
            total += *a;
        }
        *sum = total;
    }
    #[inline(always)]
    fn plus_product(mut self, a: Self, b: Self) -> Self {
        for ((sum, a), b) in self.0.iter_mut().zip(&a.0).zip(&b.0) {
            *sum = sum.plus_product(*a, *b);
        }
        self
    }
    #[inline(always)]
    fn if_positive(mut self, then: Self, otherwise: Self) -> Self {
        for ((a, then), otherwise) in self.0.iter_mut().zip(&then.0).zip(&otherwise.0) {
            *a = a.if_positive(*then, *otherwise);
        }
        self
    }
    #[inline(always)]
    fn relu(self) -> Self {
        self.each(Scalar::relu)
    }
    #[inline(always)]
    fn sign(self) -> Self {
        self.each(Scalar::sign)
    }
    /// Computes the sigmoid once for all samples.
    #[inline(always)]
    fn broadcast_sigmoid(parameter: f32) -> Self {
        Self::broadcast(parameter.sigmoid())
    }
    #[inline(always)]
    fn exp(self) -> Self {
        self.each(Scalar::exp)
    }
    #[inline(always)]
    fn ln(self) -> Self {
        self.each(Scalar::ln)
    }
}
