//! Loss and gradient of a model, generic over the scalar.

use core::slice;

use super::kind::ModelKind;
use super::loss::{LogError, cosine_weighted_log_error};
use super::samples::{Sample, Samples};
use crate::geometry::HalfDifference;
use crate::numeric::{Scalar, Value};

/// A number for each parameter of a model, such as the parameters, their gradient or their step sizes. It is an array
/// in the order of recipes and exports.
pub trait ParameterSet<T: Value>: Clone + Send + Sync {
    /// Returns a set whose entries all equal `value`.
    fn filled(value: T) -> Self;
    /// The entries, in order.
    fn as_slice(&self) -> &[T];
    /// The entries, in order.
    fn as_mut_slice(&mut self) -> &mut [T];
    /// A view of a list; None if the list has another length.
    fn view(list: &[T]) -> Option<&Self>;
    /// A view of a list; None if the list has another length.
    fn view_mut(list: &mut [T]) -> Option<&mut Self>;

    /// Iterates over the entries, in order.
    #[inline(always)]
    fn iter(&self) -> slice::Iter<'_, T> {
        self.as_slice().iter()
    }

    /// Iterates over the entries, in order.
    #[inline(always)]
    fn iter_mut(&mut self) -> slice::IterMut<'_, T> {
        self.as_mut_slice().iter_mut()
    }
}

impl<T: Value, const N: usize> ParameterSet<T> for [T; N] {
    #[inline(always)]
    fn filled(value: T) -> Self {
        [value; N]
    }

    #[inline(always)]
    fn as_slice(&self) -> &[T] {
        self
    }

    #[inline(always)]
    fn as_mut_slice(&mut self) -> &mut [T] {
        self
    }

    #[inline(always)]
    fn view(list: &[T]) -> Option<&Self> {
        list.try_into().ok()
    }

    #[inline(always)]
    fn view_mut(list: &mut [T]) -> Option<&mut Self> {
        list.try_into().ok()
    }
}

/// The derivatives of the loss with respect to a sample.
#[derive(Clone, Copy, Debug)]
pub struct SampleGradient<S> {
    /// With respect to the half and difference vectors, as if their five coordinates were independent.
    pub at: HalfDifference<S>,
    /// With respect to the measured BRDF.
    pub measured: [S; 3],
}

impl<S: Scalar> SampleGradient<S> {
    /// Returns a gradient of 0.
    #[inline(always)]
    pub fn zero() -> Self {
        Self {
            at: HalfDifference::zero(),
            measured: [S::constant(0.0); 3],
        }
    }
}

/// The weighted loss of a sample, and its derivatives with respect to the sample.
#[derive(Clone, Copy, Debug)]
pub struct Evaluation<S> {
    /// The error.
    pub error: LogError<S>,
    /// The gradient; 0 unless requested.
    pub gradient: SampleGradient<S>,
}

impl<S: Scalar> Evaluation<S> {
    /// The evaluation of a sample of weight 0.
    #[inline(always)]
    pub(crate) fn zero() -> Self {
        let zero = S::constant(0.0);
        Self {
            error: cosine_weighted_log_error([zero; 3], [zero; 3], zero, zero).error,
            gradient: SampleGradient::zero(),
        }
    }

    /// The loss, times the sample's weight.
    #[inline(always)]
    pub fn loss(&self) -> S {
        self.error.value()
    }
}

/// Number of samples that are computed together. Four would take a fifth fewer instructions, but 1.8 kB more flash for
/// each model.
const BLOCK: usize = 2;

/// A reflectance model: f_r(x; theta), differentiable in theta and x.
pub trait Model: Sync {
    /// The model's kind.
    const KIND: ModelKind;
    /// Number of parameters.
    const PARAMETERS: usize;
    /// A `T` for each parameter.
    type Parameters<T: Value>: ParameterSet<T>;

    /// The BRDF in linear RGB, sr^-1, not times the cosine.
    fn brdf<S: Scalar>(
        parameters: &Self::Parameters<S::Parameter>,
        at: &HalfDifference<S>,
    ) -> [S; 3];

    /// Returns the weighted loss at one sample, and adds its gradient with respect to the parameters to `gradient`.
    ///
    /// With `SAMPLE`, the result includes the gradient with respect to the sample's coordinates and measured value.
    /// (For the trainer; not part of this crate's stable API.)
    fn accumulate_gradient<S: Scalar, const SAMPLE: bool>(
        parameters: &Self::Parameters<S::Parameter>,
        sample: &Sample<S>,
        gradient: &mut Self::Parameters<S::Sum>,
    ) -> Evaluation<S>;

    /// Adds the gradients of all `samples` with respect to the parameters to `gradient`. Descent calls this.
    ///
    /// The default takes blocks of samples. A model overrides it if single samples are faster.
    #[inline(always)]
    fn accumulate_gradients(
        parameters: &Self::Parameters<f32>,
        samples: Samples<'_>,
        gradient: &mut Self::Parameters<f32>,
    ) {
        let mut samples = samples;
        while !samples.is_empty() {
            let block = samples.take(BLOCK).gather::<BLOCK>();
            Self::accumulate_gradient::<_, false>(parameters, &block, gradient);
        }
    }
}

/// The sigmoid of each channel's logit.
#[inline(always)]
pub(super) fn sigmoids<S: Scalar>(logits: &[S::Parameter; 3]) -> [S; 3] {
    let [red, green, blue] = *logits;
    [
        S::broadcast_sigmoid(red),
        S::broadcast_sigmoid(green),
        S::broadcast_sigmoid(blue),
    ]
}
