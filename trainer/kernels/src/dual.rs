//! Dual numbers: a value and its derivatives along `N` directions, for forward-mode differentiation of any function
//! that is generic over [`Scalar`].
//!
//! A model's *gradient*, evaluated on dual parameters with tangent v, gives the exact product of the Hessian and v, and
//! the exact mixed derivatives with respect to the sample.

use std::array::from_fn;

use glimpse_core::geometry::Angles;
use glimpse_core::model::{Model, ParameterSet};
use glimpse_core::numeric::{Scalar, Trigonometry};

use crate::operators::operators;

/// A value with `N` tangents.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<T, const N: usize = 1> {
    /// The function value.
    pub value: T,
    /// The derivatives.
    pub tangent: [T; N],
}

/// A number with its derivatives with respect to theta_h, theta_d and phi_d.
pub type AngleDual<T> = Dual<T, 3>;

impl<T: Scalar, const N: usize> Dual<T, N> {
    /// Returns a constant: all tangents are 0.
    #[inline(always)]
    pub fn from_value(value: T) -> Self {
        Self {
            value,
            tangent: [T::constant(0.0); N],
        }
    }

    /// Applies the chain rule for a function with this value and this derivative at `self`.
    #[inline(always)]
    fn chain(self, value: T, slope: T) -> Self {
        let mut tangent = self.tangent;
        for t in &mut tangent {
            *t = *t * slope;
        }
        Self { value, tangent }
    }
}

operators! {
    {T: Scalar, const N: usize} Dual<T, N>, a, b:
    Add add {
        let mut tangent = a.tangent;
        for (t, other) in tangent.iter_mut().zip(&b.tangent) {
            *t = *t + *other;
        }
        Self { value: a.value + b.value, tangent }
    },
    Sub sub {
        let mut tangent = a.tangent;
        for (t, other) in tangent.iter_mut().zip(&b.tangent) {
            *t = *t - *other;
        }
        Self { value: a.value - b.value, tangent }
    },
    Mul mul {
        let mut tangent = a.tangent;
        for (t, other) in tangent.iter_mut().zip(&b.tangent) {
            *t = (*t * b.value).plus_product(a.value, *other);
        }
        Self { value: a.value * b.value, tangent }
    },
    Div div {
        let inverse = T::constant(1.0) / b.value;
        let value = a.value * inverse;
        let mut tangent = a.tangent;
        for (t, other) in tangent.iter_mut().zip(&b.tangent) {
            *t = (*t - value * *other) * inverse;
        }
        Self { value, tangent }
    };
    Neg {
        let mut tangent = a.tangent;
        for t in &mut tangent {
            *t = -*t;
        }
        Self { value: -a.value, tangent }
    }
}

impl<T: Scalar, const N: usize> Scalar for Dual<T, N> {
    type Parameter = Dual<T::Parameter, N>;
    /// Only the tangents of a gradient are summed; the forward sweep computed its value.
    type Sum = [T::Sum; N];

    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self::from_value(T::constant(value))
    }

    #[inline(always)]
    fn broadcast(parameter: Self::Parameter) -> Self {
        let mut tangent = [T::constant(0.0); N];
        for (t, parameter) in tangent.iter_mut().zip(&parameter.tangent) {
            *t = T::broadcast(*parameter);
        }
        Self {
            value: T::broadcast(parameter.value),
            tangent,
        }
    }

    #[inline(always)]
    fn add_product(sum: &mut Self::Sum, a: Self, b: Self) {
        for ((sum, a_tangent), b_tangent) in sum.iter_mut().zip(&a.tangent).zip(&b.tangent) {
            T::add_product(sum, *a_tangent, b.value);
            T::add_product(sum, a.value, *b_tangent);
        }
    }

    #[inline(always)]
    fn add_to(sum: &mut Self::Sum, a: Self) {
        for (sum, tangent) in sum.iter_mut().zip(&a.tangent) {
            T::add_to(sum, *tangent);
        }
    }

    #[inline(always)]
    fn plus_product(self, a: Self, b: Self) -> Self {
        let mut tangent = self.tangent;
        for ((t, a_tangent), b_tangent) in tangent.iter_mut().zip(&a.tangent).zip(&b.tangent) {
            *t = t
                .plus_product(*a_tangent, b.value)
                .plus_product(a.value, *b_tangent);
        }
        Self {
            value: self.value.plus_product(a.value, b.value),
            tangent,
        }
    }

    #[inline(always)]
    fn if_positive(self, then: Self, otherwise: Self) -> Self {
        let mut tangent = then.tangent;
        for (t, otherwise) in tangent.iter_mut().zip(&otherwise.tangent) {
            *t = self.value.if_positive(*t, *otherwise);
        }
        Self {
            value: self.value.if_positive(then.value, otherwise.value),
            tangent,
        }
    }

    #[inline(always)]
    fn exp(self) -> Self {
        let value = self.value.exp();
        self.chain(value, value)
    }

    #[inline(always)]
    fn ln(self) -> Self {
        self.chain(self.value.ln(), T::constant(1.0) / self.value)
    }
}

impl<T: Trigonometry, const N: usize> Trigonometry for Dual<T, N> {
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = self.value.sin_cos();
        (self.chain(sin, cos), self.chain(cos, -sin))
    }
}

/// A real number with a square root and an arctangent, optionally with derivatives.
pub trait RealScalar: Trigonometry {
    /// Returns the value without derivatives.
    fn value(self) -> f64;
    /// Returns the square root. Its derivative at 0, which does not exist, is set to 0.
    #[must_use]
    fn sqrt(self) -> Self;
    /// Returns the angle of the point (`x`, `self`) in (-pi, pi\]. Its derivative at the origin is set to 0.
    #[must_use]
    fn atan2(self, x: Self) -> Self;
    /// Returns the larger number.
    #[must_use]
    fn max(self, other: Self) -> Self;
    /// Returns the smaller number.
    #[must_use]
    fn min(self, other: Self) -> Self {
        -(-self).max(-other)
    }
}

impl RealScalar for f64 {
    fn value(self) -> f64 {
        self
    }
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    fn atan2(self, x: Self) -> Self {
        f64::atan2(self, x)
    }
    #[inline]
    fn max(self, other: Self) -> Self {
        f64::max(self, other)
    }
}

impl<const N: usize> RealScalar for Dual<f64, N> {
    fn value(self) -> f64 {
        self.value
    }

    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.chain(root, if root > 0.0 { 0.5 / root } else { 0.0 })
    }

    fn atan2(self, x: Self) -> Self {
        let square = self.value * self.value + x.value * x.value;
        let mut angle = Self::constant(self.value.atan2(x.value));
        if square > 0.0 {
            for (tangent, (by_y, by_x)) in
                (angle.tangent.iter_mut()).zip(self.tangent.iter().zip(&x.tangent))
            {
                *tangent = (by_y * x.value - by_x * self.value) / square;
            }
        }
        angle
    }

    fn max(self, other: Self) -> Self {
        match other.value > self.value {
            true => other,
            false => self,
        }
    }
}

impl<const N: usize> Dual<f32, N> {
    /// Returns a model's parameters as constants: all tangents are 0.
    pub fn constants<M: Model>(parameters: &M::Parameters<f32>) -> M::Parameters<Self> {
        let mut constants = M::Parameters::filled(Self::constant(0.0));
        for (constant, value) in constants.iter_mut().zip(parameters.iter()) {
            constant.value = *value;
        }
        constants
    }
}

impl<T: Scalar> Dual<T, 3> {
    /// Returns angles as the three variables of differentiation.
    pub fn variables(angles: Angles<T>) -> Angles<Self> {
        let variable = |value, index| Self {
            value,
            tangent: from_fn(|i| T::constant(f64::from(u8::from(i == index)))),
        };
        Angles {
            theta_h: variable(angles.theta_h, 0),
            theta_d: variable(angles.theta_d, 1),
            phi_d: variable(angles.phi_d, 2),
        }
    }

    /// Returns the values, and the derivatives of each value.
    pub fn split<const M: usize>(duals: [Self; M]) -> ([T; M], [[T; 3]; M]) {
        (duals.map(|dual| dual.value), duals.map(|dual| dual.tangent))
    }
}
