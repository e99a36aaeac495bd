//! The cosine-weighted logarithmic error, the paper's `Loss`.

use crate::scalar::Scalar;

/// The weighted error at one sample and its partial derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Loss<S> {
    /// weight * sum over the channels of |ln(1 + y c) - ln(1 + f c)|.
    pub value: S,
    /// Derivative by the modelled BRDF f, channel by channel.
    pub by_modelled: [S; 3],
    /// Derivative by the measured BRDF y, channel by channel.
    pub by_measured: [S; 3],
    /// Derivative by the cosine c.
    pub by_cosine: S,
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
        value: zero,
        by_modelled: [zero; 3],
        by_measured: [zero; 3],
        by_cosine: zero,
    };
    for (channel, (y, f)) in measured.into_iter().zip(modelled).enumerate() {
        let shifted_y = one + y * cosine;
        let shifted_f = one + f * cosine;
        let error = shifted_f.ln() - shifted_y.ln();
        let signed = error.sign() * weight;
        let slope_y = signed / shifted_y;
        let slope_f = signed / shifted_f;
        loss.value = loss.value.plus_product(signed, error);
        if let (Some(by_f), Some(by_y)) = (
            loss.by_modelled.get_mut(channel),
            loss.by_measured.get_mut(channel),
        ) {
            *by_f = slope_f * cosine;
            *by_y = -(slope_y * cosine);
        }
        loss.by_cosine = loss.by_cosine + slope_f * f - slope_y * y;
    }
    loss.by_cosine = cos_theta_i.if_positive(loss.by_cosine, zero);
    loss
}
