//! The trait of a model's kernels for training.
//!
//! This crate compiles the kernels once for each model and instruction set; the crates that use them do not.

use std::ops::Range;

use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::{Model, SampleGradient};

use crate::dual::Dual;
use crate::gauss_newton::{FitGradient, GaussNewton, OctetAdjoint, Step};
use crate::inner_loop::{InnerLoop, MetaGradient, SampleList};
use crate::lanes::Octet;
use crate::samples::SampleOctets;

/// A model with sums over samples on lanes and threads.
pub trait LaneModel: Model + Sized {
    /// Returns the loss over a range of octets, and computes its gradient, on one thread.
    fn partial_gradient(
        theta: &Self::Parameters<f32>,
        samples: &SampleOctets<'_>,
        octets: Range<usize>,
        gradient: &mut Self::Parameters<f32>,
    ) -> f32;
    /// Computes the product of the Hessian and the tangent of `theta` over a range of octets, on one thread; see
    /// [`SampleList::product`].
    fn partial_product(
        theta: &Self::Parameters<Dual<f32>>,
        samples: &SampleOctets<'_>,
        octets: Range<usize>,
        product: &mut Self::Parameters<f32>,
        derivatives: Option<&mut [SampleGradient<Octet>]>,
    );
    /// Returns the mean loss over all samples, and computes its gradient.
    fn gradient(
        theta: &Self::Parameters<f32>,
        samples: &SampleOctets<'_>,
        gradient: &mut Self::Parameters<f32>,
    ) -> f32;
    /// Computes the product of the Hessian and the tangent of `theta` over all samples; see [`SampleList::product`].
    fn product(
        theta: &Self::Parameters<Dual<f32>>,
        samples: &SampleOctets<'_>,
        product: &mut Self::Parameters<f32>,
        derivatives: Option<&mut [SampleGradient<Octet>]>,
    );
    /// Returns the loss over all samples.
    fn loss(theta: &Self::Parameters<f32>, samples: &SampleOctets<'_>) -> f32;
    /// Computes the BRDF in linear RGB, sr^-1 (not times the cosine), at many directions.
    fn evaluate(theta: &Self::Parameters<f32>, at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]);
    /// Calls [`InnerLoop::fit`].
    fn fit(inner_loop: &InnerLoop<Self, f32>, samples: &SampleOctets<'_>) -> Self::Parameters<f32>;
    /// Calls [`GaussNewton::fit`].
    fn take_steps(
        fit: &GaussNewton<'_, Self, f32>,
        readings: &SampleOctets<'_>,
    ) -> (Self::Parameters<f32>, Vec<Step<Self, f32>>);
    /// Calls [`GaussNewton::adjoint`].
    fn steps_adjoint(
        fit: &GaussNewton<'_, Self, f32>,
        steps: &[Step<Self, f32>],
        readings: &SampleOctets<'_>,
        gradient: &mut FitGradient<Self, f32>,
        derivatives: &mut [OctetAdjoint],
    );
    /// Calls [`MetaGradient::compute`].
    fn meta_gradient(
        meta_gradient: &mut MetaGradient<Self, f32>,
        inner_loop: &InnerLoop<Self, f32>,
        inner: &[&SampleOctets<'_>],
        outer: &SampleOctets<'_>,
        derivatives: Option<&mut [SampleGradient<Octet>]>,
    ) -> f32;
}

impl<M: LaneModel> SampleList<M, f32> for SampleOctets<'_> {
    type Derivatives = SampleGradient<Octet>;

    fn gradient(&self, theta: &M::Parameters<f32>, gradient: &mut M::Parameters<f32>) -> f32 {
        M::gradient(theta, self, gradient)
    }

    fn product(
        &self,
        theta: &M::Parameters<Dual<f32>>,
        product: &mut M::Parameters<f32>,
        derivatives: Option<&mut [SampleGradient<Octet>]>,
    ) {
        M::product(theta, self, product, derivatives);
    }
}
