//! Sums over samples on lanes: a model's loss, its gradient, and its Hessian-vector product.
//!
//! The width of the lanes depends on the length of the list. Each kernel is compiled only for the widths that its model
//! uses.

use std::ops::Range;

use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::loss::cosine_weighted_log_error;
use glimpse_core::model::{Model, ParameterSet, Sample, SampleGradient};
use glimpse_core::numeric::Scalar;

use crate::dual::Dual;
use crate::lanes::{Lanes, MAX_OCTETS, Octet, RegisterPair, WIDTH, coordinates_mut, kernel};
use crate::samples::{SampleOctets, entries, entries_mut};

/// Returns true if sums on lanes would fill the cache. Then sums over eight samples use narrow registers, and sums over a
/// long list add several registers each time that they load the sum.
const fn has_many_parameters<M: Model>() -> bool {
    M::PARAMETERS > 64
}

kernel! {
    on samples.instruction_set;
    /// Returns the loss over a range of octets, and computes its gradient.
    pub(crate) fn gradient<'a, L: Lanes, M: Model>(
        theta: &'a M::Parameters<f32>,
        samples: &'a SampleOctets<'a>,
        octets: Range<usize>,
        gradient: &'a mut M::Parameters<f32>,
    ) -> f32 {
        let count = octets.len();
        if const { has_many_parameters::<M>() } && count <= L::Narrow::OCTETS {
            add_gradients::<L::Narrow, M>(theta, samples, octets, gradient)
        } else if const { has_many_parameters::<M>() && L::Pair::OCTETS > L::OCTETS }
            && count > 2 * L::OCTETS
        {
            add_gradients::<RegisterPair<L::Pair>, M>(theta, samples, octets, gradient)
        } else {
            add_gradients::<L, M>(theta, samples, octets, gradient)
        }
    }
}

#[inline(always)]
fn add_gradients<L: Lanes, M: Model>(
    theta: &M::Parameters<f32>,
    samples: &SampleOctets<'_>,
    octets: Range<usize>,
    gradient: &mut M::Parameters<f32>,
) -> f32 {
    let mut loss = L::constant(0.0);
    let mut sums = M::Parameters::filled(L::zero_sum());
    for octet in octets.step_by(L::OCTETS) {
        let sample = samples.read::<L>(octet);
        let term = M::accumulate_gradient::<L, false>(theta, &sample, &mut sums);
        loss = loss + term.loss();
    }
    L::totals(sums.as_ref(), gradient.as_mut());
    loss.total()
}

kernel! {
    on samples.instruction_set;
    /// Computes the product of the Hessian and the tangent of `theta` over a range of octets. The derivatives of
    /// (gradient times tangent) with respect to the samples are *subtracted* from `derivatives`.
    pub(crate) fn product<'a, L: Lanes, M: Model>(
        theta: &'a M::Parameters<Dual<f32>>,
        samples: &'a SampleOctets<'a>,
        octets: Range<usize>,
        product: &'a mut M::Parameters<f32>,
        derivatives: Option<&'a mut [SampleGradient<Octet>]>,
    ) {
        // Derivatives of few samples are almost free, so they are always computed: one kernel serves both cases.
        let has_derivatives = derivatives.is_some();
        if const { has_many_parameters::<M>() } && octets.len() <= L::Narrow::OCTETS {
            add_products::<L::Narrow, M, true>(theta, samples, octets, product, derivatives);
        } else if const { has_many_parameters::<M>() } && has_derivatives {
            add_products::<L::Pair, M, true>(theta, samples, octets, product, derivatives);
        } else if const { has_many_parameters::<M>() } {
            add_products::<L::Pair, M, false>(theta, samples, octets, product, None);
        } else if has_derivatives {
            add_products::<L, M, true>(theta, samples, octets, product, derivatives);
        } else {
            add_products::<L, M, false>(theta, samples, octets, product, None);
        }
    }
}

#[inline(always)]
fn add_products<L: Lanes, M: Model, const SAMPLES: bool>(
    theta: &M::Parameters<Dual<f32>>,
    samples: &SampleOctets<'_>,
    octets: Range<usize>,
    product: &mut M::Parameters<f32>,
    derivatives: Option<&mut [SampleGradient<Octet>]>,
) {
    let mut sums = M::Parameters::filled([L::zero_sum()]);
    let derivatives = derivatives.unwrap_or_default();
    let mut derivatives = derivatives.chunks_mut(L::OCTETS);
    for octet in octets.step_by(L::OCTETS) {
        let sample = constant_sample(samples.read::<L>(octet));
        let term = M::accumulate_gradient::<Dual<L>, SAMPLES>(theta, &sample, &mut sums);
        if let (true, Some(derivatives)) = (SAMPLES, derivatives.next()) {
            let mut by_samples = SampleGradient::zero();
            subtract_tangent(&mut by_samples, term.gradient);
            add_to_octets(by_samples, derivatives.iter_mut());
        }
    }
    L::totals(sums.as_ref().as_flattened(), product.as_mut());
}

kernel! {
    on samples.instruction_set;
    /// Returns the loss over all samples.
    pub(crate) fn loss<'a, L: Lanes, M: Model>(
        theta: &'a M::Parameters<f32>,
        samples: &'a SampleOctets<'a>,
    ) -> f32 {
        let mut loss = L::constant(0.0);
        for octet in (0..samples.octets()).step_by(L::OCTETS) {
            let sample = samples.read::<L>(octet);
            let modeled = M::brdf::<L>(theta, &sample.at);
            let cosine = sample.at.cos_theta_i();
            let term = cosine_weighted_log_error(sample.measured, modeled, cosine, sample.weight);
            loss = loss + term.error.value();
        }
        loss.total()
    }
}

/// Converts half and difference vectors to dual numbers with tangent 0.
#[inline(always)]
pub(crate) fn constant_directions<S: Scalar>(at: HalfDifference<S>) -> HalfDifference<Dual<S>> {
    let mut constant = HalfDifference::zero();
    for (dual, value) in coordinates_mut(&mut constant)
        .into_iter()
        .zip(at.to_array())
    {
        *dual = Dual::from_value(value);
    }
    constant
}

/// Converts a sample to dual numbers with tangent 0.
#[inline(always)]
pub(crate) fn constant_sample<S: Scalar>(sample: Sample<S>) -> Sample<Dual<S>> {
    let [red, green, blue] = sample.measured;
    Sample {
        at: constant_directions(sample.at),
        measured: [
            Dual::from_value(red),
            Dual::from_value(green),
            Dual::from_value(blue),
        ],
        weight: Dual::from_value(sample.weight),
    }
}

/// Subtracts the tangents of a gradient with respect to a sample from `sum`.
#[inline(always)]
pub(crate) fn subtract_tangent<S: Scalar>(
    sum: &mut SampleGradient<S>,
    dual: SampleGradient<Dual<S>>,
) {
    for (entry, dual) in entries_mut(sum).into_iter().zip(entries(dual)) {
        *entry = *entry - dual.tangent[0];
    }
}

/// Adds the derivatives with respect to a register of samples to those of its octets.
#[inline(always)]
pub(crate) fn add_to_octets<'d, L: Lanes>(
    gradient: SampleGradient<L>,
    octets: impl Iterator<Item = &'d mut SampleGradient<Octet>>,
) {
    let mut values = [[Octet::default(); MAX_OCTETS]; 8];
    for (values, register) in values.iter_mut().zip(entries(gradient)) {
        register.store(values);
    }
    for (index, octet) in octets.enumerate() {
        for (octet, values) in entries_mut(octet).into_iter().zip(&values) {
            for lane in 0..WIDTH {
                octet.0[lane] += values[index].0[lane];
            }
        }
    }
}
