//! Each model on lanes, in a module of its own, so that they are compiled side by side.

use std::ops::Range;

use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::{CookTorrance, Model, Neural, Phong, SampleGradient};

use crate::dual::Dual;
use crate::inner_loop::{InnerLoop, MetaGradient};
use crate::lane_model::LaneModel;
use crate::lanes::Octet;
use crate::samples::SampleOctets;
use crate::{brdf, parallel, sums};

macro_rules! lane_model {
    ($Model:ident, $module:ident) => {
        mod $module {
            use super::*;

            type Parameters<T> = <$Model as Model>::Parameters<T>;

            impl LaneModel for $Model {
                fn gradient_of(
                    theta: &Parameters<f32>,
                    samples: &SampleOctets<'_>,
                    octets: Range<usize>,
                    gradient: &mut Parameters<f32>,
                ) -> f32 {
                    sums::gradient::<$Model>(theta, samples, octets, gradient)
                }
                fn product_of(
                    theta: &Parameters<Dual<f32>>,
                    samples: &SampleOctets<'_>,
                    octets: Range<usize>,
                    product: &mut Parameters<f32>,
                    derivatives: Option<&mut [SampleGradient<Octet>]>,
                ) {
                    product::product(theta, samples, octets, product, derivatives);
                }
                fn gradient(
                    theta: &Parameters<f32>,
                    samples: &SampleOctets<'_>,
                    gradient: &mut Parameters<f32>,
                ) -> f32 {
                    parallel::gradient::<$Model>(theta, samples, gradient)
                }
                fn product(
                    theta: &Parameters<Dual<f32>>,
                    samples: &SampleOctets<'_>,
                    product: &mut Parameters<f32>,
                    derivatives: Option<&mut [SampleGradient<Octet>]>,
                ) {
                    parallel::product::<$Model>(theta, samples, product, derivatives);
                }
                fn loss(theta: &Parameters<f32>, samples: &SampleOctets<'_>) -> f32 {
                    sums::loss::<$Model>(theta, samples)
                }
                fn evaluate(
                    theta: &Parameters<f32>,
                    at: &[HalfDifference<f32>],
                    brdf: &mut [[f32; 3]],
                ) {
                    brdf::evaluate::<$Model>(theta, at, brdf);
                }
                fn fit(
                    inner_loop: &InnerLoop<$Model, f32>,
                    samples: &SampleOctets<'_>,
                ) -> Parameters<f32> {
                    inner_loop.fit(samples)
                }
                fn meta_gradient(
                    found: &mut MetaGradient<$Model, f32>,
                    inner_loop: &InnerLoop<$Model, f32>,
                    inner: &[&SampleOctets<'_>],
                    outer: &SampleOctets<'_>,
                    derivatives: Option<&mut [SampleGradient<Octet>]>,
                ) -> f32 {
                    found.compute(inner_loop, inner, outer, derivatives)
                }
            }

            /// The largest of the kernels, apart from the others.
            mod product {
                use super::*;

                pub(super) fn product(
                    theta: &Parameters<Dual<f32>>,
                    samples: &SampleOctets<'_>,
                    octets: Range<usize>,
                    product: &mut Parameters<f32>,
                    derivatives: Option<&mut [SampleGradient<Octet>]>,
                ) {
                    sums::product::<$Model>(theta, samples, octets, product, derivatives);
                }
            }
        }
    };
}
lane_model!(Phong, phong);
lane_model!(Neural, neural);
lane_model!(CookTorrance, cook_torrance);

/// Runs `$body` with `$M` standing for the model of a [`ModelKind`](glimpse_core::model::ModelKind),
/// or `$other` for Linear, which is not a [`Model`] that descends.
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
            glimpse_core::model::ModelKind::Linear => $other,
        }
    };
}
