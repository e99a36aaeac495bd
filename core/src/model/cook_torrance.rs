//! The Cook-Torrance model (Cook and Torrance 1982) with Beckmann's distribution, 8 parameters.
//!
//! f = k_d / pi + k_s D G F / (pi cos_i cos_o). k_d, k_s (per channel), the roughness alpha and the reflectance at
//! normal incidence F0 are the sigmoids of the parameters, and
//!
//! - D = exp(-tan^2 theta_h / alpha^2) / (alpha^2 cos^4 theta_h),
//! - G = min(1, 2 cos theta_h min(cos_i, cos_o) / cos theta_d),
//! - F = F0 + (1 - F0) (1 - cos theta_d)^5.
//!
//! (Paper, "Models: Cook-Torrance".) The four denominators have an offset of 1e-6; that of the exponent is as in sin^2
//! theta_h / (alpha^2 cos^2 theta_h + 1e-6). Cosines below the horizon count as 0. D and 1 / (pi cos_i cos_o) therefore
//! stay below 1e6 for all parameters and directions.

use super::{Evaluation, Model, ModelKind, Sample, SampleGradient, sigmoids};
use crate::geometry::HalfDifference;
use crate::model::loss::cosine_weighted_log_error;
use crate::numeric::{Scalar, Value};
use core::f64::consts::PI;

/// The offset of denominators.
const EPSILON: f64 = 1e-6;

/// The Cook-Torrance model. The formula is at the top of its source file.
#[derive(Clone, Copy, Debug)]
pub struct CookTorrance;

/// A value for each parameter of Cook-Torrance: the logits of k_d per channel, the logits of k_s per channel, and the
/// logits of the roughness alpha and of the reflectance at normal incidence F0.
pub type CookTorranceParameters<T> = [T; 8];

/// Terms that evaluation and gradient share.
struct Terms<S> {
    /// k_d and k_s of each channel, alpha, F0.
    diffuse: [S; 3],
    specular: [S; 3],
    roughness: S,
    reflectance: S,
    /// cos_i and cos_o, clamped to 0, and the lower of the two.
    incoming: S,
    outgoing: S,
    lower: S,
    /// alpha^2, cos^2 theta_h, and their product.
    squared_roughness: S,
    squared_cosine: S,
    product: S,
    /// 1 / (alpha^2 cos^2 theta_h), tan^2 theta_h / alpha^2, 1 / (alpha^2 cos^4 theta_h).
    inverse_product: S,
    exponent: S,
    normalization: S,
    /// 1 / cos theta_d, 2 cos theta_h / cos theta_d, and G before the minimum with 1.
    inverse_dz: S,
    per_lower: S,
    unclamped_g: S,
    /// Powers of 1 - cos theta_d.
    fourth_power: S,
    fifth_power: S,
    /// 1 / (pi cos_i cos_o).
    inverse_cosines: S,
    /// D / (pi cos_i cos_o), G, F, and the product of the three.
    d: S,
    g: S,
    f: S,
    lobe: S,
}

impl<S: Scalar> Terms<S> {
    #[inline(always)]
    fn new(parameters: &CookTorranceParameters<S::Parameter>, at: &HalfDifference<S>) -> Self {
        let one = S::constant(1.0);
        let epsilon = S::constant(EPSILON);
        let [kd_r, kd_g, kd_b, ks_r, ks_g, ks_b, roughness, reflectance] = *parameters;
        let roughness = S::broadcast_sigmoid(roughness);
        let reflectance = S::broadcast_sigmoid(reflectance);
        let incoming = at.cos_theta_i().relu();
        let outgoing = at.cos_theta_o().relu();
        let lower = (outgoing - incoming).if_positive(incoming, outgoing);

        let squared_roughness = roughness * roughness;
        let squared_cosine = at.hz * at.hz;
        let product = squared_roughness * squared_cosine;
        let inverse_product = one / (product + epsilon);
        let exponent = at.hx * at.hx * inverse_product;
        let normalization = one / epsilon.plus_product(product, squared_cosine);

        let inverse_dz = one / (at.dz + epsilon);
        let per_lower = (at.hz + at.hz) * inverse_dz;
        let unclamped_g = per_lower * lower;
        let g = (one - unclamped_g).if_positive(unclamped_g, one);

        let opposite = one - at.dz;
        let squared_opposite = opposite * opposite;
        let fourth_power = squared_opposite * squared_opposite;
        let fifth_power = fourth_power * opposite;
        let f = fifth_power.plus_product(reflectance, one - fifth_power);

        let inverse_cosines = one / epsilon.plus_product(S::constant(PI) * incoming, outgoing);
        let d = (-exponent).exp() * normalization * inverse_cosines;
        Self {
            diffuse: sigmoids(&[kd_r, kd_g, kd_b]),
            specular: sigmoids(&[ks_r, ks_g, ks_b]),
            roughness,
            reflectance,
            incoming,
            outgoing,
            lower,
            squared_roughness,
            squared_cosine,
            product,
            inverse_product,
            exponent,
            normalization,
            inverse_dz,
            per_lower,
            unclamped_g,
            fourth_power,
            fifth_power,
            inverse_cosines,
            d,
            g,
            f,
            lobe: d * g * f,
        }
    }

    #[inline(always)]
    fn brdf(&self) -> [S; 3] {
        let lambert = S::constant(1.0 / PI);
        let mut brdf = self.diffuse;
        for (f, specular) in brdf.iter_mut().zip(self.specular) {
            *f = (*f * lambert).plus_product(specular, self.lobe);
        }
        brdf
    }

    /// The derivatives with respect to the sample's coordinates: those of the lobe, times `by_lobe`, plus those of the
    /// loss through its own cosine, times `by_cosine`.
    #[inline(always)]
    fn by_coordinates(
        &self,
        at: &HalfDifference<S>,
        by_lobe: S,
        by_cosine: S,
    ) -> HalfDifference<S> {
        let zero = S::constant(0.0);
        let one = S::constant(1.0);
        let by_log_lobe = by_lobe * self.lobe;
        let twice = by_log_lobe + by_log_lobe;

        // D: the logarithm's derivatives, as in `accumulate_gradient`.
        let by_hx = -(twice * at.hx * self.inverse_product);
        let narrowing = self.exponent * self.inverse_product
            - (self.squared_cosine + self.squared_cosine) * self.normalization;
        let by_hz = twice * (self.squared_roughness * at.hz) * narrowing;

        // G = 2 hz lower / dz, if that is below 1.
        let by_g = by_lobe * self.d * self.f;
        let by_unclamped_g = (one - self.unclamped_g).if_positive(by_g, zero);
        let by_lower = by_unclamped_g * self.per_lower;
        let lower_per_dz = self.lower * self.inverse_dz;
        let by_hz = by_hz.plus_product(by_unclamped_g, lower_per_dz + lower_per_dz);
        let by_dz = -(by_unclamped_g * self.unclamped_g * self.inverse_dz);

        // F = F0 + (1 - F0) (1 - dz)^5.
        let by_f = by_lobe * self.d * self.g;
        let slope = (one - self.reflectance) * self.fourth_power * S::constant(-5.0);
        let by_dz = by_dz.plus_product(by_f, slope);

        // 1 / (pi cos_i cos_o), and the lower cosine within G.
        let steepness = -(by_log_lobe * S::constant(PI) * self.inverse_cosines);
        let incoming_is_lower = self.outgoing - self.incoming;
        let by_incoming = steepness * self.outgoing + incoming_is_lower.if_positive(by_lower, zero);
        let by_outgoing = steepness * self.incoming + incoming_is_lower.if_positive(zero, by_lower);
        let by_incoming = self.incoming.if_positive(by_incoming, zero) + by_cosine;
        let by_outgoing = self.outgoing.if_positive(by_outgoing, zero);

        // cos_i = hz dz - hx dx, cos_o = hz dz + hx dx.
        let both = by_outgoing + by_incoming;
        let apart = by_outgoing - by_incoming;
        HalfDifference {
            hx: by_hx.plus_product(apart, at.dx),
            hz: by_hz.plus_product(both, at.dz),
            dx: apart * at.hx,
            dy: zero,
            dz: by_dz.plus_product(both, at.hz),
        }
    }
}

impl Model for CookTorrance {
    const KIND: ModelKind = ModelKind::CookTorrance;
    const PARAMETERS: usize = 8;
    type Parameters<T: Value> = CookTorranceParameters<T>;
    #[inline(always)]
    fn brdf<S: Scalar>(
        parameters: &CookTorranceParameters<S::Parameter>,
        at: &HalfDifference<S>,
    ) -> [S; 3] {
        Terms::new(parameters, at).brdf()
    }

    #[inline(always)]
    fn accumulate_gradient<S: Scalar, const SAMPLE: bool>(
        parameters: &CookTorranceParameters<S::Parameter>,
        sample: &Sample<S>,
        gradient: &mut CookTorranceParameters<S::Sum>,
    ) -> Evaluation<S> {
        let one = S::constant(1.0);
        let at = &sample.at;
        let terms = Terms::new(parameters, at);
        let cos_theta_i = at.cos_theta_i();
        let loss =
            cosine_weighted_log_error(sample.measured, terms.brdf(), cos_theta_i, sample.weight);

        // f = k_d / pi + k_s lobe, channel by channel.
        let lambert = S::constant(1.0 / PI);
        let mut by_lobe = S::constant(0.0);
        let [kd_r, kd_g, kd_b, ks_r, ks_g, ks_b, roughness, reflectance] = gradient;
        let entries = [kd_r, kd_g, kd_b].into_iter().zip([ks_r, ks_g, ks_b]);
        let values = terms.diffuse.into_iter().zip(terms.specular);
        for (((diffuse_entry, specular_entry), (diffuse, specular)), by_f) in
            entries.zip(values).zip(loss.by_modeled)
        {
            S::add_product(diffuse_entry, by_f * lambert, diffuse * (one - diffuse));
            let by_specular = by_f * specular;
            S::add_product(specular_entry, by_specular * terms.lobe, one - specular);
            by_lobe = by_lobe + by_specular;
        }
        // With e = tan^2 / alpha^2 and the derivative 2 alpha^2 (1 - alpha) of alpha^2 with respect to the logit, d(ln
        // D) = 2 (1 - alpha) (e - 1). The offsets scale each term by a factor below 1, so that nothing diverges as
        // alpha or cos theta_h vanishes.
        let narrowing = terms.exponent * (terms.product * terms.inverse_product)
            - terms.product * terms.squared_cosine * terms.normalization;
        let smoothness = one - terms.roughness;
        S::add_product(
            roughness,
            by_lobe * terms.lobe,
            (smoothness + smoothness) * narrowing,
        );
        // F = F0 + (1 - F0) (1 - cos theta_d)^5.
        S::add_product(
            reflectance,
            by_lobe * terms.d * terms.g,
            (one - terms.fifth_power) * terms.reflectance * (one - terms.reflectance),
        );

        let mut by_sample = SampleGradient::zero();
        if SAMPLE {
            by_sample.at = terms.by_coordinates(at, by_lobe, loss.by_cosine);
            by_sample.measured = loss.by_measured;
        }
        Evaluation {
            error: loss.error,
            gradient: by_sample,
        }
    }
}
