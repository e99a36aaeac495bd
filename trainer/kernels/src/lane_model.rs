//! All that training computes with a model, compiled here, once for each model and instruction set,
//! and not in every crate that trains.

use std::ops::Range;

use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::{Model, SampleGradient};

use crate::dual::Dual;
use crate::inner_loop::{InnerLoop, MetaGradient, SampleList};
use crate::lanes::Octet;
use crate::samples::SampleOctets;

/// A model with its sums over samples, on lanes and threads.
pub trait LaneModel: Model + Sized {
    /// The loss over some octets, and its gradient, on one thread.
    fn gradient_of(
        theta: &Self::Parameters<f32>,
        samples: &SampleOctets<'_>,
        octets: Range<usize>,
        gradient: &mut Self::Parameters<f32>,
    ) -> f32;
    /// The product of Hessian and tangent over some octets, on one thread; see
    /// [`SampleList::product`].
    fn product_of(
        theta: &Self::Parameters<Dual<f32>>,
        samples: &SampleOctets<'_>,
        octets: Range<usize>,
        product: &mut Self::Parameters<f32>,
        derivatives: Option<&mut [SampleGradient<Octet>]>,
    );
    /// The mean loss over all samples, and its gradient.
    fn gradient(
        theta: &Self::Parameters<f32>,
        samples: &SampleOctets<'_>,
        gradient: &mut Self::Parameters<f32>,
    ) -> f32;
    /// The product of Hessian and tangent over all samples; see [`SampleList::product`].
    fn product(
        theta: &Self::Parameters<Dual<f32>>,
        samples: &SampleOctets<'_>,
        product: &mut Self::Parameters<f32>,
        derivatives: Option<&mut [SampleGradient<Octet>]>,
    );
    /// The loss over all samples.
    fn loss(theta: &Self::Parameters<f32>, samples: &SampleOctets<'_>) -> f32;
    /// The BRDF in linear RGB, sr^-1 (not times the cosine), at many places.
    fn evaluate(theta: &Self::Parameters<f32>, at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]);
    /// [`InnerLoop::fit`]
    fn fit(inner_loop: &InnerLoop<Self, f32>, samples: &SampleOctets<'_>) -> Self::Parameters<f32>;
    /// [`MetaGradient::compute`]
    fn meta_gradient(
        found: &mut MetaGradient<Self, f32>,
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
