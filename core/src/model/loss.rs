//! The cosine-weighted logarithmic error, the paper's `Loss`.

use crate::numeric::Scalar;

/// The weighted error at one sample, and its partial derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Loss<S> {
    /// The error.
    pub error: LogError<S>,
    /// Derivative with respect to the modeled BRDF f, channel by channel.
    pub by_modeled: [S; 3],
    /// Derivative with respect to the measured BRDF y, channel by channel.
    pub by_measured: [S; 3],
    /// Derivative with respect to the cosine c.
    pub by_cosine: S,
}

/// A weighted error before its logarithms are taken. Descent needs only the derivatives, and logarithms take much of
/// the time on a device.
#[derive(Clone, Copy, Debug)]
pub struct LogError<S> {
    /// 1 + y c, channel by channel.
    shifted_y: [S; 3],
    /// 1 + f c, channel by channel.
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
/// `measured` (y) and `modeled` (f) are BRDF values in sr^-1, not times the cosine. The paper's mean over n samples and
/// three channels has weight 1 / (3 n). The derivatives at an error of 0 are 0. (The paper clamps c to \[0, 1\]; as a
/// cosine, it never exceeds 1.)
#[inline(always)]
pub fn cosine_weighted_log_error<S: Scalar>(
    measured: [S; 3],
    modeled: [S; 3],
    cos_theta_i: S,
    weight: S,
) -> Loss<S> {
    let cosine = cos_theta_i.relu();
    // The channels are written out, so that the compiler removes the results that a caller does not read. It does not
    // do so for a loop over an array.
    let [y_red, y_green, y_blue] = measured;
    let [f_red, f_green, f_blue] = modeled;
    let red = Channel::new(y_red, f_red, cosine, weight);
    let green = Channel::new(y_green, f_green, cosine, weight);
    let blue = Channel::new(y_blue, f_blue, cosine, weight);
    let by_cosine = red.by_cosine + green.by_cosine + blue.by_cosine;
    Loss {
        error: LogError {
            shifted_y: [red.shifted_y, green.shifted_y, blue.shifted_y],
            shifted_f: [red.shifted_f, green.shifted_f, blue.shifted_f],
            signed: [red.signed, green.signed, blue.signed],
        },
        by_modeled: [red.by_modeled, green.by_modeled, blue.by_modeled],
        by_measured: [red.by_measured, green.by_measured, blue.by_measured],
        by_cosine: cos_theta_i.if_positive(by_cosine, S::constant(0.0)),
    }
}

/// The [`Loss`] of one channel.
struct Channel<S> {
    shifted_y: S,
    shifted_f: S,
    signed: S,
    by_modeled: S,
    by_measured: S,
    by_cosine: S,
}

impl<S: Scalar> Channel<S> {
    #[inline(always)]
    fn new(y: S, f: S, cosine: S, weight: S) -> Self {
        let one = S::constant(1.0);
        let shifted_y = one + y * cosine;
        let shifted_f = one + f * cosine;
        let signed = (shifted_f - shifted_y).sign() * weight;
        let signed_inverse_y = signed / shifted_y;
        let signed_inverse_f = signed / shifted_f;
        Self {
            shifted_y,
            shifted_f,
            signed,
            by_modeled: signed_inverse_f * cosine,
            by_measured: -(signed_inverse_y * cosine),
            by_cosine: signed_inverse_f * f - signed_inverse_y * y,
        }
    }
}
