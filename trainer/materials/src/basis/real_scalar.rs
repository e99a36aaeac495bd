//! Square root and arctangent for numbers and dual numbers.

use glimpse_core::numeric::{Scalar, Trigonometry};
use glimpse_kernels::Dual;

/// A real number, optionally with derivatives.
pub trait RealScalar: Trigonometry {
    /// Returns the value without derivatives.
    fn value(self) -> f64;
    /// Returns the square root. Its derivative at 0, which does not exist, is set to 0.
    fn sqrt(self) -> Self;
    /// Returns the angle of the point (`x`, `self`) in (-pi, pi\]. Its derivative at the origin is set to 0.
    fn atan2(self, x: Self) -> Self;
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
}

impl<const N: usize> RealScalar for Dual<f64, N> {
    fn value(self) -> f64 {
        self.value
    }

    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        if root > 0.0 {
            let slope = 0.5 / root;
            Self {
                value: root,
                tangent: self.tangent.map(|t| t * slope),
            }
        } else {
            Self::constant(root)
        }
    }

    fn atan2(self, x: Self) -> Self {
        let square = self.value * self.value + x.value * x.value;
        let mut angle = Self::constant(self.value.atan2(x.value));
        if square > 0.0 {
            for (tangent, (tangent_y, tangent_x)) in angle
                .tangent
                .iter_mut()
                .zip(self.tangent.iter().zip(&x.tangent))
            {
                *tangent = (tangent_y * x.value - tangent_x * self.value) / square;
            }
        }
        angle
    }
}
