//! The kernels of each model, as a table of functions on flat lists: callers are not generic over models.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::{CookTorrance, Model, ModelKind, Neural, Phong, Sample, SampleGradient};

use crate::brdf::{self, BrdfWithDerivative};
use crate::crew::Crew;
use crate::dual::Dual;
use crate::gauss_newton::{FitGradient, GaussNewtonSteps, OctetAdjoint, Step};
use crate::inner_loop::{InnerLoop, MetaGradient, SampleList, set};
use crate::lanes::Octet;
use crate::parallel::{SharedList, chunks};
use crate::samples::SampleOctets;
use crate::sums;

/// The kernels of a model. Parameters and gradients are lists in the model's order, with an entry for each parameter.
#[allow(clippy::type_complexity)] // signatures read better than their names
pub struct ModelKernels {
    /// The model.
    pub model: ModelKind,
    /// The number of active parameters of a system of Gauss-Newton steps.
    pub active: usize,
    /// Computes the BRDF in linear RGB, sr^-1 (not times the cosine), at many directions.
    pub evaluate: fn(&[f32], &[HalfDifference<f32>], &mut [[f32; 3]]),
    /// Returns the BRDF at angles in radians, and the derivatives of each channel with respect to theta_h, theta_d and
    /// phi_d.
    pub brdf_with_derivative: fn(&[f32], Angles<f32>) -> BrdfWithDerivative,
    /// Returns the loss over all samples.
    pub loss: fn(&[f32], &SampleOctets<'_>) -> f32,
    /// Returns the loss over all samples, and computes its gradient.
    pub gradient: fn(&[f32], &SampleOctets<'_>, &mut [f32]) -> f32,
    /// Returns the same sum as `gradient`, computed sample by sample as on a device.
    pub gradient_by_sample: fn(&[f32], &[Sample<f32>], &mut [f32]) -> f32,
    /// Computes the product of the Hessian and the tangent of parameters over all samples; see [`SampleList::product`].
    pub product:
        fn(&[Dual<f32>], &SampleOctets<'_>, &mut [f32], Option<&mut [SampleGradient<Octet>]>),
    /// Calls [`InnerLoop::fit`].
    pub descend: fn(&InnerLoop<'_, f32>, &SampleOctets<'_>) -> Vec<f32>,
    /// Calls [`InnerLoop::meta_gradient`].
    pub meta_gradient: fn(
        &InnerLoop<'_, f32>,
        &[SampleOctets<'_>],
        &SampleOctets<'_>,
        Option<&mut [SampleGradient<Octet>]>,
    ) -> MetaGradient<f32>,
    /// Calls [`GaussNewtonSteps::fit`].
    pub take_steps: fn(&GaussNewtonSteps<'_, f32>, &SampleOctets<'_>) -> (Vec<f32>, Vec<Step<f32>>),
    /// Calls [`GaussNewtonSteps::adjoint`].
    pub steps_adjoint: fn(
        &GaussNewtonSteps<'_, f32>,
        &[Step<f32>],
        &SampleOctets<'_>,
        &mut FitGradient<f32>,
        &mut [OctetAdjoint],
    ),
}

/// The kernels of the model Neural.
pub static NEURAL: ModelKernels = ModelKernels::new::<Neural>();
static PHONG: ModelKernels = ModelKernels::new::<Phong>();
static COOK_TORRANCE: ModelKernels = ModelKernels::new::<CookTorrance>();

impl ModelKernels {
    /// Returns the kernels of a model; None for Linear, which has no parameters.
    #[must_use]
    pub fn of(model: ModelKind) -> Option<&'static Self> {
        match model {
            ModelKind::Phong => Some(&PHONG),
            ModelKind::CookTorrance => Some(&COOK_TORRANCE),
            ModelKind::Neural => Some(&NEURAL),
            _ => None,
        }
    }

    const fn new<M: Model>() -> Self {
        Self {
            model: M::KIND,
            active: M::ACTIVE.count(),
            evaluate: |theta, at, brdf| brdf::evaluate::<M>(set::<M, f32>(theta), at, brdf),
            brdf_with_derivative: |theta, angles| {
                brdf::with_derivative::<M>(set::<M, f32>(theta), angles)
            },
            loss: |theta, samples| sums::loss::<M>(set::<M, f32>(theta), samples),
            gradient: |theta, samples, gradient| {
                SharedList::<M>::alone(samples).gradient(theta, gradient)
            },
            gradient_by_sample: |theta, samples, gradient| {
                SampleList::<M, f32>::gradient(samples, theta, gradient)
            },
            product: |theta, samples, product, derivatives| {
                SharedList::<M>::alone(samples).product(theta, product, derivatives);
            },
            descend: |inner_loop, samples| inner_loop.fit(&SharedList::<M>::alone(samples)),
            meta_gradient: meta_gradient::<M>,
            take_steps: |fit, readings| fit.fit::<M>(readings),
            steps_adjoint: |fit, steps, readings, gradient, derivatives| {
                fit.adjoint::<M, _>(steps, readings, gradient, derivatives);
            },
        }
    }
}

fn meta_gradient<M: Model>(
    inner_loop: &InnerLoop<'_, f32>,
    inner: &[SampleOctets<'_>],
    outer: &SampleOctets<'_>,
    derivatives: Option<&mut [SampleGradient<Octet>]>,
) -> MetaGradient<f32> {
    let lists = inner.iter().chain([outer]);
    let count = lists.map(|list| chunks(list).len()).max();
    Crew::run(count.unwrap_or(1), |crew| {
        let share = |samples| SharedList::<M> {
            samples,
            crew: Some(crew),
        };
        let inner: Vec<_> = inner.iter().map(share).collect();
        let inner: Vec<_> = inner.iter().collect();
        inner_loop.meta_gradient(&inner, &share(outer), derivatives)
    })
}
