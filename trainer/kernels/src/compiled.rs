//! The kernels, instantiated for each model. No other crate compiles them.

use std::ops::Range;

use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::{CookTorrance, Neural, Phong, SampleGradient};

use crate::dual::Dual;
use crate::gauss_newton::{FitGradient, GaussNewton, OctetAdjoint, Step};
use crate::inner_loop::{InnerLoop, MetaGradient};
use crate::lane_model::LaneModel;
use crate::lanes::Octet;
use crate::samples::SampleOctets;
use crate::{brdf, parallel, sums};

macro_rules! lane_model {
    ($($Model:ident),*) => {$(
        impl LaneModel for $Model {
            fn partial_gradient(
                theta: &Self::Parameters<f32>,
                samples: &SampleOctets<'_>,
                octets: Range<usize>,
                gradient: &mut Self::Parameters<f32>,
            ) -> f32 {
                sums::gradient::<Self>(theta, samples, octets, gradient)
            }
            fn partial_product(
                theta: &Self::Parameters<Dual<f32>>,
                samples: &SampleOctets<'_>,
                octets: Range<usize>,
                product: &mut Self::Parameters<f32>,
                derivatives: Option<&mut [SampleGradient<Octet>]>,
            ) {
                sums::product::<Self>(theta, samples, octets, product, derivatives);
            }
            fn gradient(
                theta: &Self::Parameters<f32>,
                samples: &SampleOctets<'_>,
                gradient: &mut Self::Parameters<f32>,
            ) -> f32 {
                parallel::gradient::<Self>(theta, samples, gradient)
            }
            fn product(
                theta: &Self::Parameters<Dual<f32>>,
                samples: &SampleOctets<'_>,
                product: &mut Self::Parameters<f32>,
                derivatives: Option<&mut [SampleGradient<Octet>]>,
            ) {
                parallel::product::<Self>(theta, samples, product, derivatives);
            }
            fn loss(theta: &Self::Parameters<f32>, samples: &SampleOctets<'_>) -> f32 {
                sums::loss::<Self>(theta, samples)
            }
            fn evaluate(
                theta: &Self::Parameters<f32>,
                at: &[HalfDifference<f32>],
                brdf: &mut [[f32; 3]],
            ) {
                brdf::evaluate::<Self>(theta, at, brdf);
            }
            fn fit(
                inner_loop: &InnerLoop<Self, f32>,
                samples: &SampleOctets<'_>,
            ) -> Self::Parameters<f32> {
                inner_loop.fit(samples)
            }
            fn take_steps(
                fit: &GaussNewton<'_, Self, f32>,
                readings: &SampleOctets<'_>,
            ) -> (Self::Parameters<f32>, Vec<Step<Self, f32>>) {
                fit.fit(readings)
            }
            fn steps_adjoint(
                fit: &GaussNewton<'_, Self, f32>,
                steps: &[Step<Self, f32>],
                readings: &SampleOctets<'_>,
                gradient: &mut FitGradient<Self, f32>,
                derivatives: &mut [OctetAdjoint],
            ) {
                fit.adjoint(steps, readings, gradient, derivatives);
            }
            fn meta_gradient(
                meta_gradient: &mut MetaGradient<Self, f32>,
                inner_loop: &InnerLoop<Self, f32>,
                inner: &[&SampleOctets<'_>],
                outer: &SampleOctets<'_>,
                derivatives: Option<&mut [SampleGradient<Octet>]>,
            ) -> f32 {
                meta_gradient.compute(inner_loop, inner, outer, derivatives)
            }
        }
    )*};
}
lane_model!(Phong, CookTorrance, Neural);

/// Evaluates `$body` with `$M` as the type of a [`ModelKind`](glimpse_core::model::ModelKind). Evaluates `$other` for
/// Linear, which does not implement [`Model`](glimpse_core::model::Model).
#[macro_export]
macro_rules! with_model {
    ($kind:expr, $M:ident => $body:expr, _ => $other:expr $(,)?) => {
        match $kind {
            glimpse_core::model::ModelKind::Phong => {
                type $M = glimpse_core::model::Phong;
                $body
            }
            glimpse_core::model::ModelKind::Neural => {
                type $M = glimpse_core::model::Neural;
                $body
            }
            glimpse_core::model::ModelKind::CookTorrance => {
                type $M = glimpse_core::model::CookTorrance;
                $body
            }
            _ => $other, // Linear
        }
    };
}
