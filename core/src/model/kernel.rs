//! Loss and gradient of a model, generic over the scalar.

use core::slice;

use super::kind::ModelKind;
use super::loss::{LogError, Loss, cosine_weighted_log_error};
use super::samples::Sample;
use crate::geometry::HalfDifference;
use crate::numeric::{Scalar, Value};

/// A number for each parameter of a model, such as the parameters, their gradient or their step sizes. It is an array
/// in the order of recipes and exports.
pub trait ParameterSet<T: Value>: AsRef<[T]> + AsMut<[T]> + Clone + Send + Sync + 'static {
    /// Returns a set whose entries all equal `value`.
    fn filled(value: T) -> Self;
    /// A view of a list; None if the list has another length.
    fn view(list: &[T]) -> Option<&Self>;
    /// A view of a list; None if the list has another length.
    fn view_mut(list: &mut [T]) -> Option<&mut Self>;

    /// Iterates over the entries, in order.
    #[inline(always)]
    fn iter(&self) -> slice::Iter<'_, T> {
        self.as_ref().iter()
    }

    /// Iterates over the entries, in order.
    #[inline(always)]
    fn iter_mut(&mut self) -> slice::IterMut<'_, T> {
        self.as_mut().iter_mut()
    }
}

impl<T: Value, const N: usize> ParameterSet<T> for [T; N] {
    #[inline(always)]
    fn filled(value: T) -> Self {
        [value; N]
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

/// A function of the modeled BRDF at a sample and of cos(theta_i), whose gradient a model computes.
pub trait Objective<S> {
    /// False for the BRDF without the clamp of negative values, [`Model::unclamped_brdf`].
    const CLAMPED: bool = true;

    /// Returns the derivatives with respect to the channels of the modeled BRDF (sr^-1, not times the cosine), and the
    /// derivative with respect to cos(theta_i).
    fn derivatives(&mut self, modeled: [S; 3], cos_theta_i: S) -> ([S; 3], S);
}

/// The weighted loss of a sample.
pub(super) struct SampleLoss<'s, S> {
    sample: &'s Sample<S>,
    loss: Loss<S>,
}

impl<'s, S: Scalar> SampleLoss<'s, S> {
    #[inline(always)]
    pub(super) fn new(sample: &'s Sample<S>) -> Self {
        let zero = S::constant(0.0);
        Self {
            sample,
            loss: cosine_weighted_log_error([zero; 3], [zero; 3], zero, zero),
        }
    }
}

impl<S: Scalar> Objective<S> for SampleLoss<'_, S> {
    #[inline(always)]
    fn derivatives(&mut self, modeled: [S; 3], cos_theta_i: S) -> ([S; 3], S) {
        let Sample {
            measured, weight, ..
        } = *self.sample;
        self.loss = cosine_weighted_log_error(measured, modeled, cos_theta_i, weight);
        (self.loss.by_modeled, self.loss.by_cosine)
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
    /// The loss, times the sample's weight.
    #[inline(always)]
    pub fn loss(&self) -> S {
        self.error.value()
    }
}

/// A channel of the modeled BRDF. It keeps the BRDF.
struct Channel<S> {
    index: usize,
    modeled: [S; 3],
}

impl<S: Scalar> Objective<S> for Channel<S> {
    #[inline(always)]
    fn derivatives(&mut self, modeled: [S; 3], _: S) -> ([S; 3], S) {
        let zero = S::constant(0.0);
        self.modeled = modeled;
        let mut by_modeled = [zero; 3];
        if let Some(entry) = by_modeled.get_mut(self.index) {
            *entry = S::constant(1.0);
        }
        (by_modeled, zero)
    }
}

/// The parameters that a Gauss-Newton step changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Active {
    /// All parameters, which the channels share.
    All(usize),
    /// `count` parameters of each channel. Parameter k of channel c has the index `first` + 3 k + c.
    PerChannel {
        /// The index of the first one.
        first: usize,
        /// The number of parameters of a channel.
        count: usize,
    },
}

impl Active {
    /// The number of parameters in a row of the Jacobian.
    #[must_use]
    pub const fn count(self) -> usize {
        match self {
            Self::All(count) | Self::PerChannel { count, .. } => count,
        }
    }

    /// The number of independent systems: one, or one for each channel.
    #[must_use]
    pub const fn systems(self) -> usize {
        match self {
            Self::All(_) => 1,
            Self::PerChannel { .. } => 3,
        }
    }

    /// The index of parameter `k` of a system.
    #[must_use]
    pub const fn index(self, system: usize, k: usize) -> usize {
        match self {
            Self::All(_) => k,
            Self::PerChannel { first, .. } => first
                .saturating_add(k.saturating_mul(3))
                .saturating_add(system),
        }
    }
}

/// A reflectance model: f_r(x; theta), differentiable in theta and x.
pub trait Model: Sync {
    /// The model's kind.
    const KIND: ModelKind;
    /// Number of parameters.
    const PARAMETERS: usize;
    /// A `T` for each parameter.
    type Parameters<T: Value>: ParameterSet<T>;

    /// The parameters that a Gauss-Newton step changes.
    const ACTIVE: Active = Active::All(Self::PARAMETERS);

    /// The BRDF in linear RGB, sr^-1, not times the cosine.
    fn brdf<S: Scalar>(
        parameters: &Self::Parameters<S::Parameter>,
        at: &HalfDifference<S>,
    ) -> [S; 3];

    /// The BRDF without the clamp of negative values, above -1 sr^-1: where the BRDF of Neural is clamped to 0, it has no
    /// derivative. Gauss-Newton steps use it.
    #[inline(always)]
    fn unclamped_brdf<S: Scalar>(
        parameters: &Self::Parameters<S::Parameter>,
        at: &HalfDifference<S>,
    ) -> [S; 3] {
        Self::brdf(parameters, at)
    }

    /// Adds the gradient of an objective with respect to the parameters to `gradient`.
    ///
    /// With `SAMPLE`, the result is the gradient with respect to the half and difference vectors, as if their five
    /// coordinates were independent. Otherwise it is 0.
    fn accumulate_objective<S: Scalar, F: Objective<S>, const SAMPLE: bool>(
        parameters: &Self::Parameters<S::Parameter>,
        at: &HalfDifference<S>,
        objective: &mut F,
        gradient: &mut Self::Parameters<S::Sum>,
    ) -> HalfDifference<S>;

    /// Returns the weighted loss at one sample, and adds its gradient with respect to the parameters to `gradient`.
    ///
    /// With `SAMPLE`, the result includes the gradient with respect to the sample's coordinates and measured value.
    /// (For the trainer; not part of this crate's stable API.)
    #[inline(always)]
    fn accumulate_gradient<S: Scalar, const SAMPLE: bool>(
        parameters: &Self::Parameters<S::Parameter>,
        sample: &Sample<S>,
        gradient: &mut Self::Parameters<S::Sum>,
    ) -> Evaluation<S> {
        let zero = S::constant(0.0);
        let mut objective = SampleLoss::new(sample);
        let at = Self::accumulate_objective::<S, _, SAMPLE>(
            parameters,
            &sample.at,
            &mut objective,
            gradient,
        );
        let measured = match SAMPLE {
            true => objective.loss.by_measured,
            false => [zero; 3],
        };
        Evaluation {
            error: objective.loss.error,
            gradient: SampleGradient { at, measured },
        }
    }

    /// Returns the [unclamped](Self::unclamped_brdf) BRDF, and writes the derivatives of each channel with respect to its [active](Self::ACTIVE)
    /// parameters to `rows`.
    #[inline(always)]
    fn jacobian<S: Scalar<Sum = S>>(
        parameters: &Self::Parameters<S::Parameter>,
        at: &HalfDifference<S>,
        rows: [&mut [S]; 3],
    ) -> [S; 3] {
        let mut modeled = [S::constant(0.0); 3];
        for (index, row) in rows.into_iter().enumerate() {
            let mut channel = Channel { index, modeled };
            let mut gradient = Self::Parameters::filled(S::constant(0.0));
            Self::accumulate_objective::<S, _, false>(parameters, at, &mut channel, &mut gradient);
            for (entry, value) in row.iter_mut().zip(gradient.iter()) {
                *entry = *value;
            }
            modeled = channel.modeled;
        }
        modeled
    }
}

/// The sigmoid of each channel's logit.
#[inline(always)]
pub(super) fn sigmoids<S: Scalar>(logits: &[S::Parameter; 3]) -> [S; 3] {
    // Not by `map`, whose closure would be compiled without the kernels' instruction sets.
    let [red, green, blue] = *logits;
    [
        S::broadcast(red).sigmoid(),
        S::broadcast(green).sigmoid(),
        S::broadcast(blue).sigmoid(),
    ]
}
