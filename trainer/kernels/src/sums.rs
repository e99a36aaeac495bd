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
use crate::lanes::{
    Kernel, Lanes, MAX_OCTETS, Narrowest, Octet, OctetDirections, ScalarSums, WIDTH, has_narrower,
    has_two_narrower,
};
use crate::samples::SampleOctets;

/// Returns true if sums over lists that fit in one register are scalar. With many parameters, sums on lanes would fill
/// the cache.
const fn sums_are_scalar<M: Model>() -> bool {
    M::PARAMETERS > 64
}

/// Returns true if sums over few samples use narrower lanes.
const fn uses_narrower<M: Model, Wide: Lanes>() -> bool {
    !sums_are_scalar::<M>() && has_narrower::<Wide>()
}

/// Returns the loss over a range of octets, and computes its gradient.
pub(crate) fn gradient<M: Model>(
    theta: &M::Parameters<f32>,
    samples: &SampleOctets<'_>,
    octets: Range<usize>,
    gradient: &mut M::Parameters<f32>,
) -> f32 {
    samples.instruction_set.run(Gradient::<M> {
        theta,
        samples,
        octets,
        gradient,
    })
}

/// Computes the product of the Hessian and the tangent of `theta` over a range of octets. The derivatives of (gradient
/// times tangent) with respect to the samples are *subtracted* from `derivatives`.
pub(crate) fn product<M: Model>(
    theta: &M::Parameters<Dual<f32>>,
    samples: &SampleOctets<'_>,
    octets: Range<usize>,
    product: &mut M::Parameters<f32>,
    derivatives: Option<&mut [SampleGradient<Octet>]>,
) {
    samples.instruction_set.run(Product::<M> {
        theta,
        samples,
        octets,
        product,
        derivatives,
    });
}

/// Returns the loss over all samples.
pub(crate) fn loss<M: Model>(theta: &M::Parameters<f32>, samples: &SampleOctets<'_>) -> f32 {
    samples.instruction_set.run(LossSum::<M> { theta, samples })
}

/// Returns the loss of a black material, f = 0. It is larger for brighter materials.
#[must_use]
pub fn loss_of_black(samples: &SampleOctets<'_>) -> f32 {
    samples.instruction_set.run(LossOfBlack { samples })
}

/// Converts a sample to dual numbers with tangent 0.
#[inline(always)]
pub(crate) fn constant_sample<S: Scalar>(sample: Sample<S>) -> Sample<Dual<S>> {
    let [red, green, blue] = sample.measured;
    Sample {
        at: HalfDifference {
            hx: Dual::from_value(sample.at.hx),
            hz: Dual::from_value(sample.at.hz),
            dx: Dual::from_value(sample.at.dx),
            dy: Dual::from_value(sample.at.dy),
            dz: Dual::from_value(sample.at.dz),
        },
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
    dual: &SampleGradient<Dual<S>>,
) {
    let HalfDifference { hx, hz, dx, dy, dz } = &mut sum.at;
    let [red, green, blue] = &mut sum.measured;
    let at = &dual.at;
    let [by_red, by_green, by_blue] = dual.measured;
    for (entry, dual) in [
        (hx, at.hx),
        (hz, at.hz),
        (dx, at.dx),
        (dy, at.dy),
        (dz, at.dz),
        (red, by_red),
        (green, by_green),
        (blue, by_blue),
    ] {
        *entry = *entry - dual.tangent[0];
    }
}

/// The kernel of [`gradient`].
struct Gradient<'a, M: Model> {
    theta: &'a M::Parameters<f32>,
    samples: &'a SampleOctets<'a>,
    octets: Range<usize>,
    gradient: &'a mut M::Parameters<f32>,
}

impl<M: Model> Kernel for Gradient<'_, M> {
    type Output = f32;

    #[inline(always)]
    fn run<Wide: Lanes>(self) -> f32 {
        let octets = self.octets.len();
        if const { sums_are_scalar::<M>() } && octets <= Narrowest::<Wide>::OCTETS {
            self.compute::<ScalarSums<Narrowest<Wide>>>()
        } else if const { uses_narrower::<M, Wide>() } && octets <= Narrowest::<Wide>::OCTETS {
            self.compute::<Narrowest<Wide>>()
        } else if const { has_two_narrower::<Wide>() } && octets <= Wide::Narrow::OCTETS {
            self.compute::<Wide::Narrow>()
        } else {
            self.compute::<Wide>()
        }
    }
}

impl<M: Model> Gradient<'_, M> {
    #[inline(always)]
    fn compute<L: Lanes>(self) -> f32 {
        let mut loss = L::constant(0.0);
        let mut sums = M::Parameters::filled(L::zero_sum());
        for octet in self.octets.step_by(L::OCTETS) {
            let sample = self.samples.read::<L>(octet);
            let term = M::accumulate_gradient::<L, false>(self.theta, &sample, &mut sums);
            loss = loss + term.loss();
        }
        L::totals(sums.as_slice(), self.gradient.as_mut_slice());
        loss.total()
    }
}

/// The kernel of [`product`].
struct Product<'a, M: Model> {
    theta: &'a M::Parameters<Dual<f32>>,
    samples: &'a SampleOctets<'a>,
    octets: Range<usize>,
    product: &'a mut M::Parameters<f32>,
    derivatives: Option<&'a mut [SampleGradient<Octet>]>,
}

impl<M: Model> Kernel for Product<'_, M> {
    type Output = ();

    #[inline(always)]
    fn run<Wide: Lanes>(self) {
        let octets = self.octets.len();
        // Derivatives of few samples are almost free, so they are always computed: one kernel serves both cases.
        if const { sums_are_scalar::<M>() } && octets <= Narrowest::<Wide>::OCTETS {
            self.compute::<ScalarSums<Narrowest<Wide>>, true>();
        } else if const { uses_narrower::<M, Wide>() } && octets <= Narrowest::<Wide>::OCTETS {
            self.compute::<Narrowest<Wide>, true>();
        } else if self.derivatives.is_some() {
            self.compute::<Wide, true>();
        } else {
            self.compute::<Wide, false>();
        }
    }
}

impl<M: Model> Product<'_, M> {
    #[inline(always)]
    fn compute<L: Lanes, const SAMPLES: bool>(self) {
        let mut sums = M::Parameters::filled([L::zero_sum()]);
        let derivatives = self.derivatives.unwrap_or_default();
        let mut derivatives = derivatives.chunks_mut(L::OCTETS);
        for octet in self.octets.step_by(L::OCTETS) {
            let sample = constant_sample(self.samples.read::<L>(octet));
            let term = M::accumulate_gradient::<Dual<L>, SAMPLES>(self.theta, &sample, &mut sums);
            if let (true, Some(derivatives)) = (SAMPLES, derivatives.next()) {
                let mut by_samples = SampleGradient::zero();
                subtract_tangent(&mut by_samples, &term.gradient);
                add_to_octets(&by_samples, derivatives);
            }
        }
        L::totals(sums.as_slice().as_flattened(), self.product.as_mut_slice());
    }
}

/// Adds the derivatives with respect to a register of samples to those of its octets.
#[inline(always)]
pub(crate) fn add_to_octets<L: Lanes>(
    gradient: &SampleGradient<L>,
    octets: &mut [SampleGradient<Octet>],
) {
    let at = &gradient.at;
    let [red, green, blue] = gradient.measured;
    let registers = [at.hx, at.hz, at.dx, at.dy, at.dz, red, green, blue];
    for (index, register) in registers.into_iter().enumerate() {
        let mut values = [Octet::default(); MAX_OCTETS];
        register.store(&mut values);
        for (octet, values) in octets.iter_mut().zip(&values) {
            let OctetDirections { hx, hz, dx, dy, dz } = &mut octet.at;
            let [red, green, blue] = &mut octet.measured;
            let entries = [hx, hz, dx, dy, dz, red, green, blue];
            for lane in 0..WIDTH {
                entries[index].0[lane] += values.0[lane];
            }
        }
    }
}

/// The kernel of [`loss`].
struct LossSum<'a, M: Model> {
    theta: &'a M::Parameters<f32>,
    samples: &'a SampleOctets<'a>,
}

impl<M: Model> Kernel for LossSum<'_, M> {
    type Output = f32;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f32 {
        let mut loss = L::constant(0.0);
        for octet in (0..self.samples.octets()).step_by(L::OCTETS) {
            let sample = self.samples.read::<L>(octet);
            let modeled = M::brdf::<L>(self.theta, &sample.at);
            let cosine = sample.at.cos_theta_i();
            let term = cosine_weighted_log_error(sample.measured, modeled, cosine, sample.weight);
            loss = loss + term.error.value();
        }
        loss.total()
    }
}

/// The kernel of [`loss_of_black`].
struct LossOfBlack<'a> {
    samples: &'a SampleOctets<'a>,
}

impl Kernel for LossOfBlack<'_> {
    type Output = f32;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f32 {
        let black = [L::constant(0.0); 3];
        let mut loss = L::constant(0.0);
        for octet in (0..self.samples.octets()).step_by(L::OCTETS) {
            let sample = self.samples.read::<L>(octet);
            let cosine = sample.at.cos_theta_i();
            let term = cosine_weighted_log_error(sample.measured, black, cosine, sample.weight);
            loss = loss + term.error.value();
        }
        loss.total()
    }
}
