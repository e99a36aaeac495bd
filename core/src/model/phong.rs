//! The Phong model.

use super::{Model, ModelKind, Objective, sigmoids};
use crate::geometry::HalfDifference;
use crate::numeric::{Scalar, Value};
use core::f64::consts::PI;

/// The energy-conserving Phong model (Lafortune and Willems 1994), 7 parameters.
///
/// ```text
/// f = k_d / pi + k_s (q + 2) / (2 pi) (max(w_o . r, 0) + 1e-5)^q
/// ```
///
/// (Paper, "Models: Phong".) r is the mirror direction of w_i. With s = k_d + k_s and t = k_d / s, k_d = s t and
/// k_s = s (1 - t).
///
/// The parameters are the logits of s for red, green and blue, the logits of t for red, green and blue, and ln(q).
#[derive(Clone, Copy, Debug)]
pub struct Phong;

/// A value for each parameter of Phong: the logits of k_d + k_s per channel, the logits of k_d / (k_d + k_s) per
/// channel, and the logarithm of the glossiness q.
pub type PhongParameters<T> = [T; 7];

/// Terms that evaluation and gradient share.
struct Terms<S> {
    /// s of each channel.
    sum: [S; 3],
    /// t of each channel.
    ratio: [S; 3],
    /// w_o . r.
    dot: S,
    /// max(w_o . r, 0) + 1e-5.
    base: S,
    /// q.
    exponent: S,
    /// ln(base).
    log_base: S,
    /// base^q.
    power: S,
    /// (q + 2) / (2 pi) base^q.
    lobe: S,
}

impl<S: Scalar> Terms<S> {
    #[inline(always)]
    fn new(parameters: &PhongParameters<S::Parameter>, at: &HalfDifference<S>) -> Self {
        let [sum_r, sum_g, sum_b, ratio_r, ratio_g, ratio_b, exponent] = *parameters;
        // w_o . r = -o_x i_x - o_y i_y + o_z i_z, written in half and difference vectors.
        let dot = (at.dz * at.dz + at.dx * at.dx) * (at.hz * at.hz - at.hx * at.hx) + at.dy * at.dy;
        let base = dot.relu() + S::constant(1e-5);
        let exponent = S::broadcast(exponent).exp();
        let log_base = base.ln();
        let normalization = (exponent + S::constant(2.0)) * S::constant(0.5 / PI);
        let power = (exponent * log_base).exp();
        Self {
            sum: sigmoids(&[sum_r, sum_g, sum_b]),
            ratio: sigmoids(&[ratio_r, ratio_g, ratio_b]),
            dot,
            base,
            exponent,
            log_base,
            power,
            lobe: normalization * power,
        }
    }

    #[inline(always)]
    fn brdf(&self) -> [S; 3] {
        let lambert = S::constant(1.0 / PI);
        let mut brdf = self.sum;
        for (f, ratio) in brdf.iter_mut().zip(self.ratio) {
            *f = *f * (self.lobe + ratio * (lambert - self.lobe));
        }
        brdf
    }
}

impl Model for Phong {
    const KIND: ModelKind = ModelKind::Phong;
    const PARAMETERS: usize = 7;
    type Parameters<T: Value> = PhongParameters<T>;
    #[inline(always)]
    fn brdf<S: Scalar>(
        parameters: &PhongParameters<S::Parameter>,
        at: &HalfDifference<S>,
    ) -> [S; 3] {
        Terms::new(parameters, at).brdf()
    }

    #[inline(always)]
    fn accumulate_objective<S: Scalar, F: Objective<S>, const SAMPLE: bool>(
        parameters: &PhongParameters<S::Parameter>,
        at: &HalfDifference<S>,
        objective: &mut F,
        gradient: &mut PhongParameters<S::Sum>,
    ) -> HalfDifference<S> {
        let zero = S::constant(0.0);
        let one = S::constant(1.0);
        let terms = Terms::new(parameters, at);
        let (by_modeled, by_cosine) = objective.derivatives(terms.brdf(), at.cos_theta_i());

        // f = s (lobe + t (1/pi - lobe)), channel by channel.
        let lambert_minus_lobe = S::constant(1.0 / PI) - terms.lobe;
        let mut by_lobe = zero;
        let [sum_r, sum_g, sum_b, ratio_r, ratio_g, ratio_b, exponent] = gradient;
        let sums = [sum_r, sum_g, sum_b]
            .into_iter()
            .zip([ratio_r, ratio_g, ratio_b]);
        let values = terms.sum.into_iter().zip(terms.ratio);
        for (((sum_entry, ratio_entry), (sum, ratio)), by_f) in sums.zip(values).zip(by_modeled) {
            let f_by_sum = terms.lobe + ratio * lambert_minus_lobe;
            S::add_product(sum_entry, by_f * f_by_sum, sum * (one - sum));
            S::add_product(
                ratio_entry,
                by_f * sum * lambert_minus_lobe,
                ratio * (one - ratio),
            );
            by_lobe = by_lobe + by_f * sum * (one - ratio);
        }
        // lobe = (q + 2) / (2 pi) base^q, and dq = q d(exponent).
        let lobe_by_q = terms.power * S::constant(0.5 / PI) + terms.lobe * terms.log_base;
        S::add_product(exponent, by_lobe * lobe_by_q, terms.exponent);

        if SAMPLE {
            let by_base = by_lobe * terms.exponent * terms.lobe / terms.base;
            let twice_by_dot = terms.dot.if_positive(by_base + by_base, zero);
            let horizontal = at.hz * at.hz - at.hx * at.hx;
            let vertical = at.dz * at.dz + at.dx * at.dx;
            return HalfDifference {
                hx: -(twice_by_dot * vertical * at.hx) - by_cosine * at.dx,
                hz: twice_by_dot * vertical * at.hz + by_cosine * at.dz,
                dx: twice_by_dot * horizontal * at.dx - by_cosine * at.hx,
                dy: twice_by_dot * at.dy,
                dz: twice_by_dot * horizontal * at.dz + by_cosine * at.hz,
            };
        }
        HalfDifference::zero()
    }
}
