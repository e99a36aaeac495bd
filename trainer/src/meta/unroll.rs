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

use glimpse_core::angles::HalfDifference;
use glimpse_core::model::{Model, ParameterSet, Sample, SampleGradient};
use glimpse_core::scalar::Scalar;

use crate::dual::Dual;

/// A scalar of one or more samples side by side, and what a single one of them is.
pub trait Batch: Scalar<Sum = Self> {
    /// The sum over the samples.
    fn total(self) -> Self::Parameter;
}

impl Batch for f64 {
    #[inline(always)]
    fn total(self) -> Self {
        self
    }
}

/// A single real number: f32 in training, f64 in tests.
pub trait Real: Scalar<Parameter = Self, Sum = Self> {}
impl<T: Scalar<Parameter = T, Sum = T>> Real for T {}

/// A list of samples, in batches.
pub trait Samples<S> {
    /// How many batches there are.
    fn batches(&self) -> usize;
    /// One batch.
    fn batch(&self, index: usize) -> Sample<S>;
}

impl<S: Scalar> Samples<S> for [Sample<S>] {
    #[inline(always)]
    fn batches(&self) -> usize {
        self.len()
    }
    #[inline(always)]
    fn batch(&self, index: usize) -> Sample<S> {
        self[index]
    }
}

/// What is learned on.
pub struct Inner<'a, L: ?Sized> {
    /// The samples of each step; a single list serves all steps.
    pub samples: &'a [&'a L],
    /// K.
    pub steps: usize,
}

/// The outcome of an inner loop: the outer loss and its gradients.
#[derive(Clone, Debug)]
pub struct MetaGradient<R, S> {
    /// The outer loss at theta_K.
    pub loss: R,
    /// By the initial parameters.
    pub initial: Vec<R>,
    /// By the step sizes.
    pub step_sizes: Vec<R>,
    /// By the inner samples, batch by batch; empty unless asked for.
    pub samples: Vec<SampleGradient<S>>,
}

/// Theta and gradient of every step: the memory of the reverse sweep.
struct Trajectory<M: Model, R: Real> {
    parameters: Vec<M::Parameters<R>>,
    gradients: Vec<M::Parameters<R>>,
}

/// Runs the inner loop; `keep` is told parameters and gradient of each step.
#[inline(always)]
fn forward<M: Model, S: Batch, L: Samples<S> + ?Sized>(
    theta: &mut M::Parameters<S::Parameter>,
    step_sizes: &[S::Parameter],
    inner: &Inner<'_, L>,
    mut trajectory: Option<&mut Trajectory<M, S::Parameter>>,
) where
    S::Parameter: Real,
{
    let zero = S::constant(0.0);
    let mut gradient = M::Parameters::<S::Parameter>::filled(S::Parameter::constant(0.0));
    for step in 0..inner.steps {
        let samples = inner.samples[step % inner.samples.len()];
        let mut sums = M::Parameters::<S>::filled(zero);
        for index in 0..samples.batches() {
            M::accumulate_gradient::<S, false>(theta, &samples.batch(index), &mut sums);
        }
        for (entry, sum) in gradient.iter_mut().zip(sums.iter()) {
            *entry = sum.total();
        }
        if let Some(trajectory) = &mut trajectory {
            trajectory.parameters.push(theta.clone());
            trajectory.gradients.push(gradient.clone());
        }
        for ((parameter, entry), step_size) in theta.iter_mut().zip(gradient.iter()).zip(step_sizes)
        {
            *parameter = *parameter - *step_size * *entry;
        }
    }
}

/// The parameters after the inner loop.
#[inline(always)]
pub fn learn<M: Model, S: Batch, L: Samples<S> + ?Sized>(
    initial: &[S::Parameter],
    step_sizes: &[S::Parameter],
    inner: &Inner<'_, L>,
) -> M::Parameters<S::Parameter>
where
    S::Parameter: Real,
{
    let mut theta = M::Parameters::filled(S::Parameter::constant(0.0));
    super::unflatten(initial, &mut theta);
    forward::<M, S, L>(&mut theta, step_sizes, inner, None);
    theta
}

/// The outer loss after the inner loop, and its gradient by all that can be learned.
///
/// With `SAMPLES` the gradient by the inner samples comes too; `inner.samples` is then one list.
#[inline(always)]
pub fn meta_gradient<
    M: Model,
    S: Batch,
    I: Samples<S> + ?Sized,
    O: Samples<S> + ?Sized,
    const SAMPLES: bool,
>(
    initial: &[S::Parameter],
    step_sizes: &[S::Parameter],
    inner: &Inner<'_, I>,
    outer: &O,
) -> MetaGradient<S::Parameter, S>
where
    S::Parameter: Real,
{
    let zero = S::constant(0.0);
    let nil = S::Parameter::constant(0.0);
    let mut theta = M::Parameters::filled(nil);
    super::unflatten(initial, &mut theta);
    let mut trajectory = Trajectory::<M, S::Parameter> {
        parameters: Vec::with_capacity(inner.steps),
        gradients: Vec::with_capacity(inner.steps),
    };
    forward::<M, S, I>(&mut theta, step_sizes, inner, Some(&mut trajectory));

    let mut loss = zero;
    let mut sums = M::Parameters::<S>::filled(zero);
    for index in 0..outer.batches() {
        let sample = outer.batch(index);
        loss = loss + M::accumulate_gradient::<S, false>(&theta, &sample, &mut sums).loss;
    }
    let mut lambda: Vec<S::Parameter> = Vec::with_capacity(M::PARAMETERS);
    for sum in sums.iter() {
        lambda.push(sum.total());
    }

    let mut by_step_sizes = vec![nil; M::PARAMETERS];
    let none = SampleGradient::zero();
    let first = inner.samples.first();
    let mut by_samples = vec![none; first.filter(|_| SAMPLES).map_or(0, |list| list.batches())];
    let mut dual = M::Parameters::<Dual<S::Parameter>>::filled(Dual::constant(0.0));
    let steps = trajectory.parameters.iter().zip(&trajectory.gradients);
    for (step, (theta, gradient)) in steps.enumerate().rev() {
        let entries = theta.iter().zip(gradient.iter()).zip(step_sizes);
        let learned = lambda.iter().zip(&mut by_step_sizes).zip(dual.iter_mut());
        for (((value, entry), step_size), ((lambda, by_step_size), dual)) in entries.zip(learned) {
            *by_step_size = *by_step_size - *lambda * *entry;
            dual.value = *value;
            dual.tangent = [*step_size * *lambda];
        }
        let samples = inner.samples[step % inner.samples.len()];
        let mut sums = M::Parameters::<[S; 1]>::filled([zero]);
        let mut by_batches = by_samples.iter_mut();
        for index in 0..samples.batches() {
            let sample = constant(samples.batch(index));
            let found = M::accumulate_gradient::<Dual<S>, SAMPLES>(&dual, &sample, &mut sums);
            if let Some(by_batch) = by_batches.next() {
                subtract_tangent(by_batch, &found.gradient);
            }
        }
        for (lambda, [product]) in lambda.iter_mut().zip(sums.iter()) {
            *lambda = *lambda - product.total();
        }
    }
    MetaGradient {
        loss: loss.total(),
        initial: lambda,
        step_sizes: by_step_sizes,
        samples: by_samples,
    }
}

/// A sample whose tangents are 0.
#[inline(always)]
fn constant<S: Scalar>(sample: Sample<S>) -> Sample<Dual<S>> {
    let [red, green, blue] = sample.measured;
    Sample {
        at: HalfDifference {
            hx: Dual::from_value(sample.at.hx),
            hz: Dual::from_value(sample.at.hz),
            dx: Dual::from_value(sample.at.dx),
            dy: Dual::from_value(sample.at.dy),
            dz: Dual::from_value(sample.at.dz),
        },
        measured: [
            Dual::from_value(red),
            Dual::from_value(green),
            Dual::from_value(blue),
        ],
        weight: Dual::from_value(sample.weight),
    }
}

#[inline(always)]
fn subtract_tangent<S: Scalar>(sum: &mut SampleGradient<S>, dual: &SampleGradient<Dual<S>>) {
    let HalfDifference { hx, hz, dx, dy, dz } = &mut sum.at;
    let [red, green, blue] = &mut sum.measured;
    let at = &dual.at;
    let [by_red, by_green, by_blue] = dual.measured;
    for (entry, dual) in [
        (hx, at.hx),
        (hz, at.hz),
        (dx, at.dx),
        (dy, at.dy),
        (dz, at.dz),
        (red, by_red),
        (green, by_green),
        (blue, by_blue),
    ] {
        *entry = *entry - dual.tangent[0];
    }
}
