//! The unrolled inner loop and its exact adjoint: the meta-gradient.
//!
//! Forward: theta_{k+1} = theta_k - alpha * g(theta_k) for K steps, where g is the gradient of the mean loss over the
//! inner samples. Then the outer loss is computed at theta_K (paper, Algorithm 1).
//!
//! Reverse: let lambda be the gradient with respect to theta_{k+1}, and v = alpha * lambda. The gradient with respect
//! to theta_k is lambda - H v. Each step adds -lambda * g to the gradient with respect to alpha. It adds -d(g.v)/dx and
//! -d(g.v)/dy to the gradients with respect to a sample's coordinates x and measured value y. One evaluation of the
//! model's gradient on dual parameters with tangent v gives H v and both mixed derivatives. It needs no tape: the
//! memory is 2 K parameter vectors (theta_k and g) for any number of samples.
//!
//! A [`SampleList`] computes the gradient and the Hessian-vector product over its samples. Training uses lanes and
//! threads, and tests use scalar f64.

use glimpse_core::model::{Model, ParameterSet, Sample, SampleGradient};
use glimpse_core::numeric::{Real, Scalar, Value};

use crate::dual::Dual;
use crate::lanes::{InstructionSet, Lanes, kernel};
use crate::sums::{constant_sample, subtract_tangent};

/// Returns a list in the model's order as a parameter set.
pub(crate) fn set<M: Model, T: Value>(list: &[T]) -> &M::Parameters<T> {
    M::Parameters::view(list).expect("a model has a fixed number of parameters")
}

/// Returns a list in the model's order as a parameter set.
pub(crate) fn set_mut<M: Model, T: Value>(list: &mut [T]) -> &mut M::Parameters<T> {
    M::Parameters::view_mut(list).expect("a model has a fixed number of parameters")
}

/// Samples of a material, with sums over them. Parameters, gradients and products are lists in the model's order.
pub trait SampleList<M: Model, R: Real> {
    /// The derivatives with respect to one or several samples.
    type Derivatives;

    /// Returns the mean loss at `theta`, and writes its gradient with respect to `theta` to `gradient`.
    fn gradient(&self, theta: &[R], gradient: &mut [R]) -> R;

    /// Writes the product of the mean loss's Hessian and the tangent of `theta` to `product`. The derivatives of
    /// (gradient times tangent) with respect to the samples are *subtracted* from `derivatives`.
    fn product(
        &self,
        theta: &[Dual<R>],
        product: &mut [R],
        derivatives: Option<&mut [Self::Derivatives]>,
    );
}

/// The inner loop's initial parameters, step sizes and number of steps. The lists are in the model's order.
#[derive(Clone, Copy, Debug)]
pub struct InnerLoop<'a, R> {
    /// theta_0, the initial parameters.
    pub initial: &'a [R],
    /// alpha, one step size per parameter.
    pub step_sizes: &'a [R],
    /// K, the number of steps.
    pub steps: usize,
}

/// The outer loss after an inner loop, and its gradient.
#[derive(Clone, Debug)]
pub struct MetaGradient<R> {
    /// The outer loss.
    pub loss: R,
    /// The gradient with respect to the initial parameters.
    pub initial: Vec<R>,
    /// The gradient with respect to the step sizes.
    pub step_sizes: Vec<R>,
}

/// The gradient at theta_k, and theta_{k+1}.
struct Step<R> {
    gradient: Vec<R>,
    next: Vec<R>,
}

impl<R: Real> InnerLoop<'_, R> {
    /// Takes one step from theta_k.
    fn step<M: Model>(&self, theta: &[R], inner: &(impl SampleList<M, R> + ?Sized)) -> Step<R> {
        let mut gradient = vec![R::constant(0.0); theta.len()];
        inner.gradient(theta, &mut gradient);
        let mut next = theta.to_vec();
        descend(&mut next, &gradient, self.step_sizes);
        Step { gradient, next }
    }

    /// Returns the parameters after K steps on one list, without the meta-gradient.
    pub fn fit<M: Model>(&self, inner: &(impl SampleList<M, R> + ?Sized)) -> Vec<R> {
        let steps = 0..self.steps;
        steps.fold(self.initial.to_vec(), |theta, _| {
            self.step(&theta, inner).next
        })
    }

    /// Fits to `inner`, one list for each step or a single list for all steps. Returns the loss over `outer`, and its
    /// gradient with respect to the initial parameters and the step sizes.
    ///
    /// If `inner` is a single list, the gradient with respect to its samples is added to `derivatives`.
    pub fn meta_gradient<M: Model, I: SampleList<M, R> + ?Sized, O: SampleList<M, R> + ?Sized>(
        &self,
        inner: &[&I],
        outer: &O,
        mut derivatives: Option<&mut [I::Derivatives]>,
    ) -> MetaGradient<R> {
        let list_at = |step: usize| inner[step % inner.len()];
        let mut trajectory: Vec<Step<R>> = Vec::with_capacity(self.steps);
        for index in 0..self.steps {
            let theta = trajectory.last().map_or(self.initial, |step| &step.next);
            trajectory.push(self.step(theta, list_at(index)));
        }
        let fitted = trajectory.last().map_or(self.initial, |step| &step.next);
        let zeros = vec![R::constant(0.0); self.initial.len()];
        let mut lambda = zeros.clone();
        let loss = outer.gradient(fitted, &mut lambda);

        let mut by_step_sizes = zeros.clone();
        let mut dual = vec![Dual::constant(0.0); zeros.len()];
        let mut product = zeros;
        while let Some(Step { gradient, .. }) = trajectory.pop() {
            let theta = trajectory.last().map_or(self.initial, |step| &step.next);
            let forward = [theta, &gradient, self.step_sizes];
            ascend(forward, &lambda, &mut by_step_sizes, &mut dual);
            let list = list_at(trajectory.len());
            list.product(&dual, &mut product, derivatives.as_deref_mut());
            for (lambda, product) in lambda.iter_mut().zip(&product) {
                *lambda = *lambda - *product;
            }
        }
        MetaGradient {
            loss,
            initial: lambda,
            step_sizes: by_step_sizes,
        }
    }
}

kernel! {
    on InstructionSet::detect();
    /// Takes one step of descent: subtracts alpha * gradient from theta.
    fn descend<'a, L: Lanes, R: Real>(theta: &'a mut [R], gradient: &'a [R], step_sizes: &'a [R]) {
        for (parameter, (entry, step_size)) in theta.iter_mut().zip(gradient.iter().zip(step_sizes))
        {
            *parameter = *parameter - *step_size * *entry;
        }
    }
}

kernel! {
    on InstructionSet::detect();
    /// Begins one step of the reverse sweep, of which `forward` has theta, the gradient and the step sizes: updates the
    /// gradient with respect to the step sizes, and writes the dual parameters with tangent alpha * lambda.
    fn ascend<'a, L: Lanes, R: Real>(
        forward: [&'a [R]; 3],
        lambda: &'a [R],
        by_step_sizes: &'a mut [R],
        dual: &'a mut [Dual<R>],
    ) {
        let [theta, gradient, step_sizes] = forward;
        let entries = lambda.iter().zip(gradient);
        let entries = entries.zip(theta.iter().zip(step_sizes));
        let outputs = by_step_sizes.iter_mut().zip(dual);
        for ((by_step_size, dual), ((lambda, entry), (value, step_size))) in outputs.zip(entries) {
            *by_step_size = *by_step_size - *lambda * *entry;
            dual.value = *value;
            dual.tangent = [*step_size * *lambda];
        }
    }
}

/// Sums sample by sample on one thread.
impl<M: Model, R: Real> SampleList<M, R> for [Sample<R>] {
    type Derivatives = SampleGradient<R>;

    fn gradient(&self, theta: &[R], gradient: &mut [R]) -> R {
        let zero = R::constant(0.0);
        gradient.fill(zero);
        let (theta, gradient) = (set::<M, R>(theta), set_mut::<M, R>(gradient));
        self.iter().fold(zero, |sum, sample| {
            sum + M::accumulate_gradient::<R, false>(theta, sample, gradient).loss()
        })
    }

    fn product(
        &self,
        theta: &[Dual<R>],
        product: &mut [R],
        derivatives: Option<&mut [SampleGradient<R>]>,
    ) {
        let theta = set::<M, Dual<R>>(theta);
        let mut sums = M::Parameters::filled([R::constant(0.0)]);
        let mut derivatives = derivatives.into_iter().flatten();
        for sample in self {
            let sample = constant_sample(*sample);
            let sample_gradient =
                M::accumulate_gradient::<Dual<R>, true>(theta, &sample, &mut sums);
            if let Some(derivatives) = derivatives.next() {
                subtract_tangent(derivatives, sample_gradient.gradient);
            }
        }
        product.copy_from_slice(sums.as_ref().as_flattened());
    }
}
