//! The Cook-Torrance model.

use super::{Model, ModelKind, Objective, sigmoids};
use crate::geometry::HalfDifference;
use crate::numeric::{Scalar, Value};
use core::f64::consts::PI;

/// The offset of denominators.
const EPSILON: f64 = 1e-6;

/// The Cook-Torrance model (Cook and Torrance 1982) with Beckmann's distribution, 8 parameters.
///
/// ```text
/// f = k_d / pi + k_s D G F / (pi cos_i cos_o)
/// D = exp(-tan^2 theta_h / alpha^2) / (alpha^2 cos^4 theta_h)
/// G = min(1, 2 cos theta_h min(cos_i, cos_o) / cos theta_d)
/// F = F0 + (1 - F0) (1 - cos theta_d)^5
/// ```
///
/// (Paper, "Models: Cook-Torrance".) cos_i and cos_o are the cosines of theta_i and theta_o.
///
/// The parameters are logits: of k_d for red, green and blue, of k_s for red, green and blue, of the roughness alpha,
/// and of F0, the reflectance at normal incidence.
///
/// Each denominator is offset by 1e-6. The exponent of D is computed as -sin^2 theta_h / (alpha^2 cos^2 theta_h +
/// 1e-6). Cosines below the horizon count as 0. D and 1 / (pi cos_i cos_o) therefore stay below 1e6 for all parameters
/// and directions.
#[derive(Clone, Copy, Debug)]
pub struct CookTorrance;

/// A value for each parameter of Cook-Torrance: the logits of k_d per channel, the logits of k_s per channel, and the
/// logits of the roughness alpha and of the reflectance at normal incidence F0.
pub type CookTorranceParameters<T> = [T; 8];

/// Terms that evaluation and gradient share. Denominators are offset by [`EPSILON`].
struct Terms<S> {
    /// k_d of each channel.
    diffuse: [S; 3],
    /// k_s of each channel.
    specular: [S; 3],
    /// alpha.
    roughness: S,
    /// F0.
    reflectance: S,
    /// max(cos_i, 0).
    incoming: S,
    /// max(cos_o, 0).
    outgoing: S,
    /// The smaller of `incoming` and `outgoing`.
    smaller_cosine: S,
    /// alpha^2.
    squared_roughness: S,
    /// cos^2 theta_h.
    squared_cosine: S,
    /// alpha^2 cos^2 theta_h.
    product: S,
    /// 1 / (alpha^2 cos^2 theta_h).
    inverse_product: S,
    /// tan^2 theta_h / alpha^2.
    exponent: S,
    /// 1 / (alpha^2 cos^4 theta_h).
    normalization: S,
    /// 1 / cos theta_d.
    inverse_dz: S,
    /// 2 cos theta_h / cos theta_d.
    g_by_smaller_cosine: S,
    /// G before the minimum with 1.
    unclamped_g: S,
    /// (1 - cos theta_d)^4.
    fourth_power: S,
    /// (1 - cos theta_d)^5.
    fifth_power: S,
    /// 1 / (pi cos_i cos_o).
    inverse_cosines: S,
    /// D / (pi cos_i cos_o).
    scaled_d: S,
    /// G.
    g: S,
    /// F.
    fresnel: S,
    /// D G F / (pi cos_i cos_o).
    lobe: S,
}

impl<S: Scalar> Terms<S> {
    #[inline(always)]
    fn new(parameters: &CookTorranceParameters<S::Parameter>, at: &HalfDifference<S>) -> Self {
        let one = S::constant(1.0);
        let epsilon = S::constant(EPSILON);
        let [kd_r, kd_g, kd_b, ks_r, ks_g, ks_b, roughness, reflectance] = *parameters;
        let roughness = S::broadcast(roughness).sigmoid();
        let reflectance = S::broadcast(reflectance).sigmoid();
        let incoming = at.cos_theta_i().relu();
        let outgoing = at.cos_theta_o().relu();
        let smaller_cosine = (outgoing - incoming).if_positive(incoming, outgoing);

        let squared_roughness = roughness * roughness;
        let squared_cosine = at.hz * at.hz;
        let product = squared_roughness * squared_cosine;
        let inverse_product = one / (product + epsilon);
        let exponent = at.hx * at.hx * inverse_product;
        let normalization = one / epsilon.plus_product(product, squared_cosine);

        let inverse_dz = one / (at.dz + epsilon);
        let g_by_smaller_cosine = (at.hz + at.hz) * inverse_dz;
        let unclamped_g = g_by_smaller_cosine * smaller_cosine;
        let g = (one - unclamped_g).if_positive(unclamped_g, one);

        let one_minus_dz = one - at.dz;
        let square = one_minus_dz * one_minus_dz;
        let fourth_power = square * square;
        let fifth_power = fourth_power * one_minus_dz;
        let fresnel = fifth_power.plus_product(reflectance, one - fifth_power);

        let inverse_cosines = one / epsilon.plus_product(S::constant(PI) * incoming, outgoing);
        let scaled_d = (-exponent).exp() * normalization * inverse_cosines;
        Self {
            diffuse: sigmoids(&[kd_r, kd_g, kd_b]),
            specular: sigmoids(&[ks_r, ks_g, ks_b]),
            roughness,
            reflectance,
            incoming,
            outgoing,
            smaller_cosine,
            squared_roughness,
            squared_cosine,
            product,
            inverse_product,
            exponent,
            normalization,
            inverse_dz,
            g_by_smaller_cosine,
            unclamped_g,
            fourth_power,
            fifth_power,
            inverse_cosines,
            scaled_d,
            g,
            fresnel,
            lobe: scaled_d * g * fresnel,
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

    /// Returns the derivatives of the loss with respect to the sample's coordinates.
    ///
    /// `by_lobe` is the derivative of the loss with respect to the lobe, and `by_cosine` that with respect to the
    /// cosine by which the loss multiplies BRDFs.
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

        // D, through ln D = -sin^2 theta_h / p - ln(p cos^2 theta_h) with p = alpha^2 cos^2 theta_h.
        let by_hx = -(twice * at.hx * self.inverse_product);
        let log_d_by_product = self.exponent * self.inverse_product
            - (self.squared_cosine + self.squared_cosine) * self.normalization;
        let by_hz = twice * (self.squared_roughness * at.hz) * log_d_by_product;

        // G = 2 hz min(cos_i, cos_o) / dz, if that is below 1.
        let by_g = by_lobe * self.scaled_d * self.fresnel;
        let by_unclamped_g = (one - self.unclamped_g).if_positive(by_g, zero);
        let by_smaller_cosine = by_unclamped_g * self.g_by_smaller_cosine;
        let half_g_by_hz = self.smaller_cosine * self.inverse_dz;
        let by_hz = by_hz.plus_product(by_unclamped_g, half_g_by_hz + half_g_by_hz);
        let by_dz = -(by_unclamped_g * self.unclamped_g * self.inverse_dz);

        // F = F0 + (1 - F0) (1 - dz)^5.
        let by_fresnel = by_lobe * self.scaled_d * self.g;
        let fresnel_by_dz = (one - self.reflectance) * self.fourth_power * S::constant(-5.0);
        let by_dz = by_dz.plus_product(by_fresnel, fresnel_by_dz);

        // 1 / (pi cos_i cos_o), and the smaller cosine in G.
        let by_cosine_product = -(by_log_lobe * S::constant(PI) * self.inverse_cosines);
        let incoming_is_smaller = self.outgoing - self.incoming;
        let by_incoming = by_cosine_product * self.outgoing
            + incoming_is_smaller.if_positive(by_smaller_cosine, zero);
        let by_outgoing = by_cosine_product * self.incoming
            + incoming_is_smaller.if_positive(zero, by_smaller_cosine);
        let by_incoming = self.incoming.if_positive(by_incoming, zero) + by_cosine;
        let by_outgoing = self.outgoing.if_positive(by_outgoing, zero);

        // cos_i = hz dz - hx dx, cos_o = hz dz + hx dx.
        let sum = by_outgoing + by_incoming;
        let difference = by_outgoing - by_incoming;
        HalfDifference {
            hx: by_hx.plus_product(difference, at.dx),
            hz: by_hz.plus_product(sum, at.dz),
            dx: difference * at.hx,
            dy: zero,
            dz: by_dz.plus_product(sum, at.hz),
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
    fn accumulate_objective<S: Scalar, F: Objective<S>, const SAMPLE: bool>(
        parameters: &CookTorranceParameters<S::Parameter>,
        at: &HalfDifference<S>,
        objective: &mut F,
        gradient: &mut CookTorranceParameters<S::Sum>,
    ) -> HalfDifference<S> {
        let one = S::constant(1.0);
        let terms = Terms::new(parameters, at);
        let (by_modeled, by_cosine) = objective.derivatives(terms.brdf(), at.cos_theta_i());

        // f = k_d / pi + k_s lobe, channel by channel.
        let lambert = S::constant(1.0 / PI);
        let mut by_lobe = S::constant(0.0);
        let [kd_r, kd_g, kd_b, ks_r, ks_g, ks_b, roughness, reflectance] = gradient;
        let entries = [kd_r, kd_g, kd_b].into_iter().zip([ks_r, ks_g, ks_b]);
        let values = terms.diffuse.into_iter().zip(terms.specular);
        for (((diffuse_entry, specular_entry), (diffuse, specular)), by_f) in
            entries.zip(values).zip(by_modeled)
        {
            S::add_product(diffuse_entry, by_f * lambert, diffuse * (one - diffuse));
            let by_specular = by_f * specular;
            S::add_product(specular_entry, by_specular * terms.lobe, one - specular);
            by_lobe = by_lobe + by_specular;
        }
        // The derivative of ln D with respect to the logit of alpha is 2 (1 - alpha) (e - 1), e = tan^2 theta_h /
        // alpha^2. The offsets of the denominators multiply both e and 1 by factors below 1, so that the derivative
        // stays finite as alpha or cos theta_h approaches 0.
        let exponent_minus_one = terms.exponent * (terms.product * terms.inverse_product)
            - terms.product * terms.squared_cosine * terms.normalization;
        let one_minus_roughness = one - terms.roughness;
        S::add_product(
            roughness,
            by_lobe * terms.lobe,
            (one_minus_roughness + one_minus_roughness) * exponent_minus_one,
        );
        // F = F0 + (1 - F0) (1 - cos theta_d)^5.
        S::add_product(
            reflectance,
            by_lobe * terms.scaled_d * terms.g,
            (one - terms.fifth_power) * terms.reflectance * (one - terms.reflectance),
        );

        match SAMPLE {
            true => terms.by_coordinates(at, by_lobe, by_cosine),
            false => HalfDifference::zero(),
        }
    }
}
