//! The inner loop, unrolled, and its exact adjoint: the meta-gradient.
//!
//! Forward: theta_{k+1} = theta_k - alpha * g(theta_k), g the gradient of the mean loss over the
//! inner samples, for K steps; then the outer loss at theta_K (paper, Algorithm 1).
//!
//! Reverse: with lambda the gradient by theta_{k+1} and v = alpha * lambda, the gradient by
//! theta_k is lambda - H v, the one by alpha gains -lambda * g, and those by a sample's coordinates
//! x and measured value y gain -d(g.v)/dx and -d(g.v)/dy. The model's own gradient function,
//! evaluated once on dual numbers whose parameters carry the tangent v, gives H v and both mixed
//! derivatives. No tape: the memory is K parameter vectors, whatever the number of samples.
//!
//! What is summed over samples, the gradient and the product with the Hessian, is computed by the
//! [`SampleList`]: on lanes and threads in training, in plain f64 in tests.

use glimpse_core::model::{Model, ParameterSet, Sample, SampleGradient};
use glimpse_core::numeric::{Scalar, Value};

use crate::dual::Dual;
use crate::lanes::{Kernel, Lanes, dispatch};
use crate::sums::{constant, subtract_tangent};

/// Copies a flat list, in the model's order, into a parameter set.
pub fn unflatten<T: Value, P: ParameterSet<T>>(list: &[T], set: &mut P) {
    for (entry, value) in set.iter_mut().zip(list) {
        *entry = *value;
    }
}

/// A single real number: f32 in training, f64 in tests.
pub trait Real: Scalar<Parameter = Self, Sum = Self> {}
impl<T: Scalar<Parameter = T, Sum = T>> Real for T {}

/// Samples of a material, and sums over them.
pub trait SampleList<M: Model, R: Real> {
    /// The derivatives by some of the samples.
    type Derivatives;

    /// The mean loss at `theta`, and its gradient by `theta` into `gradient`.
    fn gradient(&self, theta: &M::Parameters<R>, gradient: &mut M::Parameters<R>) -> R;

    /// The Hessian of the mean loss times the tangent of `theta`, into `product`. With `derivatives`,
    /// the derivatives of (gradient times tangent) by the samples are *subtracted* from them.
    fn product(
        &self,
        theta: &M::Parameters<Dual<R>>,
        product: &mut M::Parameters<R>,
        derivatives: Option<&mut [Self::Derivatives]>,
    );
}

/// What the inner loop begins with: initial parameters, step sizes, and how many steps.
pub struct InnerLoop<M: Model, R: Real> {
    /// theta_0.
    pub initial: M::Parameters<R>,
    /// alpha.
    pub step_sizes: M::Parameters<R>,
    /// K.
    pub steps: usize,
}

impl<M: Model, R: Real> InnerLoop<M, R> {
    /// From flat lists, in the model's order.
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

    /// The parameters after fitting to one list; no gradient.
    pub fn fit(&self, inner: &(impl SampleList<M, R> + ?Sized)) -> M::Parameters<R> {
        let mut theta = self.initial.clone();
        let mut next = theta.clone();
        let mut gradient = M::Parameters::filled(R::constant(0.0));
        for _ in 0..self.steps {
            inner.gradient(&theta, &mut gradient);
            dispatch(DescentStep::<M, R> {
                theta: &theta,
                gradient: &gradient,
                step_sizes: &self.step_sizes,
                next: &mut next,
            });
            std::mem::swap(&mut theta, &mut next);
        }
        theta
    }
}

/// One step: theta_{k+1} = theta_k - alpha * gradient.
struct DescentStep<'a, M: Model, R: Real> {
    theta: &'a M::Parameters<R>,
    gradient: &'a M::Parameters<R>,
    step_sizes: &'a M::Parameters<R>,
    next: &'a mut M::Parameters<R>,
}

impl<M: Model, R: Real> Kernel for DescentStep<'_, M, R> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let given = self.theta.iter().zip(self.gradient.iter());
        let given = given.zip(self.step_sizes.iter());
        for (next, ((parameter, entry), step_size)) in self.next.iter_mut().zip(given) {
            *next = *parameter - *step_size * *entry;
        }
    }
}

/// One step of the reverse sweep, up to the product with the Hessian: the gradient by the step
/// sizes, and the parameters with the tangent alpha * lambda.
struct AdjointStep<'a, M: Model, R: Real> {
    step: &'a Step<M, R>,
    step_sizes: &'a M::Parameters<R>,
    lambda: &'a M::Parameters<R>,
    by_step_sizes: &'a mut M::Parameters<R>,
    dual: &'a mut M::Parameters<Dual<R>>,
}

impl<M: Model, R: Real> Kernel for AdjointStep<'_, M, R> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let entries = self.lambda.iter().zip(self.step.gradient.iter());
        for (by_step_size, (lambda, entry)) in self.by_step_sizes.iter_mut().zip(entries) {
            *by_step_size = *by_step_size - *lambda * *entry;
        }
        let values = self.step.theta.iter();
        let tangents = self.step_sizes.iter().zip(self.lambda.iter());
        for ((dual, value), (step_size, lambda)) in self.dual.iter_mut().zip(values).zip(tangents) {
            dual.value = *value;
            dual.tangent = [*step_size * *lambda];
        }
    }
}

/// lambda <- lambda - H v.
struct SubtractProduct<'a, M: Model, R: Real> {
    lambda: &'a mut M::Parameters<R>,
    product: &'a M::Parameters<R>,
}

impl<M: Model, R: Real> Kernel for SubtractProduct<'_, M, R> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for (lambda, product) in self.lambda.iter_mut().zip(self.product.iter()) {
            *lambda = *lambda - *product;
        }
    }
}

/// theta_k, and the gradient there.
struct Step<M: Model, R: Real> {
    theta: M::Parameters<R>,
    gradient: M::Parameters<R>,
}

/// The outcome of the reverse sweep, and the memory of both, which serves one task after another.
pub struct MetaGradient<M: Model, R: Real> {
    /// By the initial parameters.
    pub initial: M::Parameters<R>,
    /// By the step sizes.
    pub step_sizes: M::Parameters<R>,
    /// theta_0 to theta_{K-1}.
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
    /// Learns on `inner`, a list for each step or a single one for all of them; returns the loss
    /// over `outer` and computes its gradient by all that can be learned.
    ///
    /// With `derivatives`, which begin at 0, the gradient by the samples of a single list comes too.
    pub fn compute<I: SampleList<M, R> + ?Sized, O: SampleList<M, R> + ?Sized>(
        &mut self,
        inner_loop: &InnerLoop<M, R>,
        inner: &[&I],
        outer: &O,
        mut derivatives: Option<&mut [I::Derivatives]>,
    ) -> R {
        let list_of = |step: usize| inner[step % inner.len()];
        let zero = || M::Parameters::filled(R::constant(0.0));
        self.trajectory.resize_with(inner_loop.steps, || Step {
            theta: zero(),
            gradient: zero(),
        });
        let mut last = inner_loop.initial.clone();
        for (index, step) in self.trajectory.iter_mut().enumerate() {
            std::mem::swap(&mut step.theta, &mut last);
            list_of(index).gradient(&step.theta, &mut step.gradient);
            dispatch(DescentStep::<M, R> {
                theta: &step.theta,
                gradient: &step.gradient,
                step_sizes: &inner_loop.step_sizes,
                next: &mut last,
            });
        }
        let lambda = &mut self.initial;
        let loss = outer.gradient(&last, lambda);

        self.step_sizes = zero();
        let mut dual = M::Parameters::filled(Dual::constant(0.0));
        let mut product = zero();
        for (index, step) in self.trajectory.iter().enumerate().rev() {
            dispatch(AdjointStep::<M, R> {
                step,
                step_sizes: &inner_loop.step_sizes,
                lambda,
                by_step_sizes: &mut self.step_sizes,
                dual: &mut dual,
            });
            list_of(index).product(&dual, &mut product, derivatives.as_deref_mut());
            dispatch(SubtractProduct::<M, R> {
                lambda,
                product: &product,
            });
        }
        loss
    }
}

/// Sample by sample, on one thread: for tests, in double precision.
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
            let sample = constant(*sample);
            let found = M::accumulate_gradient::<Dual<R>, true>(theta, &sample, &mut sums);
            if let Some(derivatives) = derivatives.next() {
                subtract_tangent(derivatives, &found.gradient);
            }
        }
        for (entry, [sum]) in product.iter_mut().zip(sums.iter()) {
            *entry = *sum;
        }
    }
}
