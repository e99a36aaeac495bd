//! The trait of a model's kernels for training, and its implementations.
//!
//! This crate compiles the kernels once for each model and instruction set; the crates that use them do not.

use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::{CookTorrance, Model, Neural, Phong, SampleGradient};

use crate::crew::Crew;
use crate::dual::Dual;
use crate::gauss_newton::{FitGradient, GaussNewton, OctetAdjoint, Step};
use crate::inner_loop::{InnerLoop, MetaGradient, SampleList};
use crate::lanes::Octet;
use crate::parallel::{SharedList, chunks};
use crate::samples::SampleOctets;
use crate::{brdf, sums};

/// Defines a trait from functions with bodies, and implements it for each model. The bodies are not default methods,
/// which other crates would compile again.
macro_rules! lane_model {
    ($(
        $(#[$documentation:meta])*
        fn $name:ident($($argument:ident: $type:ty),* $(,)?) $(-> $output:ty)? $body:block
    )*) => {
        /// A model with sums over samples on lanes and threads.
        pub trait LaneModel: Model + Sized {$(
            $(#[$documentation])*
            fn $name($($argument: $type),*) $(-> $output)?;
        )*}
        lane_model!(@implement Phong {$(fn $name($($argument: $type),*) $(-> $output)? $body)*});
        lane_model!(@implement CookTorrance {$(fn $name($($argument: $type),*) $(-> $output)? $body)*});
        lane_model!(@implement Neural {$(fn $name($($argument: $type),*) $(-> $output)? $body)*});
    };
    (@implement $Model:ident {$($functions:tt)*}) => {
        impl LaneModel for $Model {
            $($functions)*
        }
    };
}

lane_model! {
    /// Returns the mean loss over all samples, and computes its gradient.
    fn gradient(
        theta: &Self::Parameters<f32>,
        samples: &SampleOctets<'_>,
        gradient: &mut Self::Parameters<f32>,
    ) -> f32 {
        SharedList::<Self> { samples, crew: None }.gradient(theta, gradient)
    }
    /// Computes the product of the Hessian and the tangent of `theta` over all samples; see [`SampleList::product`].
    fn product(
        theta: &Self::Parameters<Dual<f32>>,
        samples: &SampleOctets<'_>,
        product: &mut Self::Parameters<f32>,
        derivatives: Option<&mut [SampleGradient<Octet>]>,
    ) {
        SharedList::<Self> { samples, crew: None }.product(theta, product, derivatives);
    }
    /// Returns the loss over all samples.
    fn loss(theta: &Self::Parameters<f32>, samples: &SampleOctets<'_>) -> f32 {
        sums::loss::<Self>(theta, samples)
    }
    /// Computes the BRDF in linear RGB, sr^-1 (not times the cosine), at many directions.
    fn evaluate(theta: &Self::Parameters<f32>, at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]) {
        brdf::evaluate::<Self>(theta, at, brdf);
    }
    /// Calls [`InnerLoop::fit`].
    fn fit(inner_loop: &InnerLoop<Self, f32>, samples: &SampleOctets<'_>) -> Self::Parameters<f32> {
        inner_loop.fit(&SharedList::<Self> { samples, crew: None })
    }
    /// Calls [`GaussNewton::fit`].
    fn take_steps(
        fit: &GaussNewton<'_, Self, f32>,
        readings: &SampleOctets<'_>,
    ) -> (Self::Parameters<f32>, Vec<Step<Self, f32>>) {
        fit.fit(readings)
    }
    /// Calls [`GaussNewton::adjoint`].
    fn steps_adjoint(
        fit: &GaussNewton<'_, Self, f32>,
        steps: &[Step<Self, f32>],
        readings: &SampleOctets<'_>,
        gradient: &mut FitGradient<Self, f32>,
        derivatives: &mut [OctetAdjoint],
    ) {
        fit.adjoint(steps, readings, gradient, derivatives);
    }
    /// Calls [`MetaGradient::compute`].
    fn meta_gradient(
        meta_gradient: &mut MetaGradient<Self, f32>,
        inner_loop: &InnerLoop<Self, f32>,
        inner: &[SampleOctets<'_>],
        outer: &SampleOctets<'_>,
        derivatives: Option<&mut [SampleGradient<Octet>]>,
    ) -> f32 {
        let lists = inner.iter().chain([outer]);
        Crew::run(lists.map(|list| chunks(list).len()).max().unwrap_or(1), |crew| {
            let share = |samples| SharedList::<Self> { samples, crew: Some(crew) };
            let inner: Vec<_> = inner.iter().map(share).collect();
            let inner: Vec<_> = inner.iter().collect();
            meta_gradient.compute(inner_loop, &inner, &share(outer), derivatives)
        })
    }
}

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
