//! The cosine-weighted logarithmic error, the paper's `Loss`.

use crate::scalar::Scalar;

/// The weighted error at one sample, and its partial derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Loss<S> {
    /// The error.
    pub error: LogError<S>,
    /// Derivative by the modelled BRDF f, channel by channel.
    pub by_modelled: [S; 3],
    /// Derivative by the measured BRDF y, channel by channel.
    pub by_measured: [S; 3],
    /// Derivative by the cosine c.
    pub by_cosine: S,
}

/// A weighted error whose logarithms are yet to be taken: descent needs its derivatives only, and
/// on the device logarithms are a good part of the time.
#[derive(Clone, Copy, Debug)]
pub struct LogError<S> {
    /// 1 + y c, channel by channel.
    shifted_y: [S; 3],
    /// 1 + f c.
    shifted_f: [S; 3],
    /// The weight, with the sign of the error.
    signed: [S; 3],
}

impl<S: Scalar> LogError<S> {
    /// weight * sum over the channels of |ln(1 + y c) - ln(1 + f c)|.
    #[inline(always)]
    pub fn value(&self) -> S {
        let mut value = S::constant(0.0);
        let shifted = self.shifted_y.iter().zip(&self.shifted_f);
        for ((y, f), signed) in shifted.zip(&self.signed) {
            value = value.plus_product(*signed, f.ln() - y.ln());
        }
        value
    }
}

/// weight * sum over the channels of |ln(1 + y c) - ln(1 + f c)|, c = max(cos(theta_i), 0).
///
/// `measured` (y) and `modelled` (f) are BRDF values in sr^-1, not yet times the cosine. The
/// paper's mean over n samples and three channels has weight 1 / (3 n). Where the error is 0 the
/// derivatives are taken as 0. (Of the paper's clamp to \[0, 1\] the upper end is never reached:
/// c is the cosine of an angle.)
#[inline(always)]
pub fn cosine_weighted_log_error<S: Scalar>(
    measured: [S; 3],
    modelled: [S; 3],
    cos_theta_i: S,
    weight: S,
) -> Loss<S> {
    let zero = S::constant(0.0);
    let one = S::constant(1.0);
    let cosine = cos_theta_i.relu();
    let mut loss = Loss {
        error: LogError {
            shifted_y: measured,
            shifted_f: modelled,
            signed: [zero; 3],
        },
        by_modelled: [zero; 3],
        by_measured: [zero; 3],
        by_cosine: zero,
    };
    let error = &mut loss.error;
    let shifted = error.shifted_y.iter_mut().zip(&mut error.shifted_f);
    let slopes = loss.by_modelled.iter_mut().zip(&mut loss.by_measured);
    for (((y, f), signed), (by_f, by_y)) in shifted.zip(&mut error.signed).zip(slopes) {
        let shifted_y = one + *y * cosine;
        let shifted_f = one + *f * cosine;
        *signed = (shifted_f - shifted_y).sign() * weight;
        let slope_y = *signed / shifted_y;
        let slope_f = *signed / shifted_f;
        *by_f = slope_f * cosine;
        *by_y = -(slope_y * cosine);
        loss.by_cosine = loss.by_cosine + slope_f * *f - slope_y * *y;
        *y = shifted_y;
        *f = shifted_f;
    }
    loss.by_cosine = cos_theta_i.if_positive(loss.by_cosine, zero);
    loss
}
