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
use glimpse_core::numeric::{Scalar, Value};

use crate::dual::Dual;
use crate::lanes::{InstructionSet, Lanes, kernel};
use crate::sums::{constant_sample, subtract_tangent};

/// Copies a flat list in the model's order into a parameter set.
pub fn unflatten<T: Value, P: ParameterSet<T>>(list: &[T], set: &mut P) {
    for (entry, value) in set.iter_mut().zip(list) {
        *entry = *value;
    }
}

/// A single real number: f32 in training, f64 in tests.
pub trait Real: Scalar<Parameter = Self, Sum = Self> {}
impl<T: Scalar<Parameter = T, Sum = T>> Real for T {}

/// Samples of a material, with sums over them.
pub trait SampleList<M: Model, R: Real> {
    /// The derivatives with respect to one or several samples.
    type Derivatives;

    /// Returns the mean loss at `theta`, and writes its gradient with respect to `theta` to `gradient`.
    fn gradient(&self, theta: &M::Parameters<R>, gradient: &mut M::Parameters<R>) -> R;

    /// Writes the product of the mean loss's Hessian and the tangent of `theta` to `product`. The derivatives of
    /// (gradient times tangent) with respect to the samples are *subtracted* from `derivatives`.
    fn product(
        &self,
        theta: &M::Parameters<Dual<R>>,
        product: &mut M::Parameters<R>,
        derivatives: Option<&mut [Self::Derivatives]>,
    );
}

/// The inner loop's initial parameters, step sizes and number of steps.
pub struct InnerLoop<M: Model, R: Real> {
    /// theta_0, the initial parameters.
    pub initial: M::Parameters<R>,
    /// alpha, one step size per parameter.
    pub step_sizes: M::Parameters<R>,
    /// K, the number of steps.
    pub steps: usize,
}

impl<M: Model, R: Real> InnerLoop<M, R> {
    /// Creates an inner loop from flat lists in the model's order.
    #[must_use]
    pub fn new(initial: &[R], step_sizes: &[R], steps: usize) -> Self {
        let mut inner_loop = Self {
            initial: M::Parameters::filled(R::constant(0.0)),
            step_sizes: M::Parameters::filled(R::constant(0.0)),
            steps,
        };
        unflatten(initial, &mut inner_loop.initial);
        unflatten(step_sizes, &mut inner_loop.step_sizes);
        inner_loop
    }

    /// Returns the parameters after K steps on one list, without the meta-gradient.
    pub fn fit(&self, inner: &(impl SampleList<M, R> + ?Sized)) -> M::Parameters<R> {
        let mut theta = self.initial.clone();
        let mut gradient = M::Parameters::filled(R::constant(0.0));
        for _ in 0..self.steps {
            inner.gradient(&theta, &mut gradient);
            descend(
                theta.as_mut_slice(),
                gradient.as_slice(),
                self.step_sizes.as_slice(),
            );
        }
        theta
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

/// The gradient at theta_k, and theta_{k+1}.
struct Step<M: Model, R: Real> {
    gradient: M::Parameters<R>,
    next: M::Parameters<R>,
}

/// The meta-gradient, and the memory of both sweeps, which is reused from task to task.
pub struct MetaGradient<M: Model, R: Real> {
    /// The gradient with respect to the initial parameters.
    pub initial: M::Parameters<R>,
    /// The gradient with respect to the step sizes.
    pub step_sizes: M::Parameters<R>,
    trajectory: Vec<Step<M, R>>,
}

impl<M: Model, R: Real> Default for MetaGradient<M, R> {
    fn default() -> Self {
        Self {
            initial: M::Parameters::filled(R::constant(0.0)),
            step_sizes: M::Parameters::filled(R::constant(0.0)),
            trajectory: Vec::new(),
        }
    }
}

impl<M: Model, R: Real> MetaGradient<M, R> {
    /// Fits to `inner`, one list for each step or a single list for all steps. Returns the loss over `outer`, and
    /// computes its gradient with respect to the initial parameters and the step sizes.
    ///
    /// If `inner` is a single list, the gradient with respect to its samples is added to `derivatives`.
    pub fn compute<I: SampleList<M, R> + ?Sized, O: SampleList<M, R> + ?Sized>(
        &mut self,
        inner_loop: &InnerLoop<M, R>,
        inner: &[&I],
        outer: &O,
        mut derivatives: Option<&mut [I::Derivatives]>,
    ) -> R {
        let list_at = |step: usize| inner[step % inner.len()];
        let zero = || M::Parameters::filled(R::constant(0.0));
        self.trajectory.resize_with(inner_loop.steps, || Step {
            gradient: zero(),
            next: zero(),
        });
        let step_sizes = inner_loop.step_sizes.as_slice();
        let mut theta = &inner_loop.initial;
        for (index, step) in self.trajectory.iter_mut().enumerate() {
            list_at(index).gradient(theta, &mut step.gradient);
            step.next.clone_from(theta);
            descend(
                step.next.as_mut_slice(),
                step.gradient.as_slice(),
                step_sizes,
            );
            theta = &step.next;
        }
        let lambda = &mut self.initial;
        let loss = outer.gradient(theta, lambda);

        self.step_sizes = zero();
        let mut dual = M::Parameters::filled(Dual::constant(0.0));
        let mut product = zero();
        for (index, step) in self.trajectory.iter().enumerate().rev() {
            let theta = match index.checked_sub(1) {
                Some(last) => &self.trajectory[last].next,
                None => &inner_loop.initial,
            };
            ascend(
                [theta.as_slice(), step.gradient.as_slice(), step_sizes],
                lambda.as_slice(),
                self.step_sizes.as_mut_slice(),
                dual.as_mut_slice(),
            );
            list_at(index).product(&dual, &mut product, derivatives.as_deref_mut());
            for (lambda, product) in lambda.iter_mut().zip(product.iter()) {
                *lambda = *lambda - *product;
            }
        }
        loss
    }
}

/// Sums sample by sample on one thread, for tests in double precision.
impl<M: Model, R: Real> SampleList<M, R> for [Sample<R>] {
    type Derivatives = SampleGradient<R>;

    fn gradient(&self, theta: &M::Parameters<R>, gradient: &mut M::Parameters<R>) -> R {
        let zero = R::constant(0.0);
        gradient.iter_mut().for_each(|entry| *entry = zero);
        self.iter().fold(zero, |sum, sample| {
            sum + M::accumulate_gradient::<R, false>(theta, sample, gradient).loss()
        })
    }

    fn product(
        &self,
        theta: &M::Parameters<Dual<R>>,
        product: &mut M::Parameters<R>,
        derivatives: Option<&mut [SampleGradient<R>]>,
    ) {
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
        for (entry, [sum]) in product.iter_mut().zip(sums.iter()) {
            *entry = *sum;
        }
    }
}
