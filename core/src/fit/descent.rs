//! Descent: a few steps of SGD with a step size per parameter, in bounded slices of work.
//!
//! theta <- theta - alpha * grad(loss), the loss being the mean over all samples (paper,
//! Algorithm 1, `Learn`). A unit of work is the gradient of one sample; after the last sample of
//! each round comes a step.

use core::ops::Range;

use super::algorithm::{Algorithm, Channels, ModelMismatch, is_finite};
use super::completed::{Completed, InitNet, STARTED, Target};
use super::learned::Descent;
use super::method::{COMPLETION, FitMethod};
use crate::geometry::HalfDifference;
use crate::model::linear::Basis;
use crate::model::{Model, ParameterSet, Samples};
use crate::numeric::Floats;

/// Numbers that a descent works in: the parameters, their gradient, and the predicted loss. The gradient is
/// idle until the descent begins, so that readings are completed in its place.
pub(crate) const fn descent_words(parameters: usize, completion: usize) -> usize {
    let gradient = if completion > parameters {
        completion
    } else {
        parameters
    };
    parameters.saturating_add(gradient).saturating_add(1)
}

/// The words of a descent, taken apart.
struct Parts<'w> {
    parameters: &'w mut [f32],
    /// The gradient, or what readings are completed in.
    rest: &'w mut [f32],
    predicted: &'w mut f32,
}

impl<'w> Parts<'w> {
    fn of(words: &'w mut [f32], parameters: usize) -> Option<Self> {
        let (parameters, rest) = words.split_at_mut_checked(parameters)?;
        let (predicted, rest) = rest.split_last_mut()?;
        Some(Self {
            parameters,
            rest,
            predicted,
        })
    }
}

/// The parameters among the words of a descent.
fn parameters_of<M: Model>(words: &[f32]) -> Option<&M::Parameters<f32>> {
    M::Parameters::view(words.get(..M::PARAMETERS)?)
}

impl Descent<'_> {
    /// Gradients of one sample that the whole fit takes: samples times steps.
    pub(super) fn gradients(&self, samples: usize) -> u32 {
        u32::from(self.inner_steps).saturating_mul(samples as u32)
    }
}

impl<M: Model> Algorithm for M {
    fn words(method: &FitMethod<'_>, _: usize) -> Result<usize, ModelMismatch> {
        let (firmware, recipe) = (M::KIND, method.model());
        if firmware != recipe {
            return Err(ModelMismatch { firmware, recipe });
        }
        let completion = match method {
            FitMethod::Completed(completed) => completed.words(),
            _ => 0,
        };
        Ok(descent_words(M::PARAMETERS, completion))
    }

    fn total(method: &FitMethod<'_>, samples: usize) -> u32 {
        total(method, samples)
    }

    fn start(words: &mut [f32], method: &FitMethod<'_>, channels: Channels) {
        start(words, method, channels);
    }

    fn advance(
        words: &mut [f32],
        method: &FitMethod<'_>,
        samples: Samples<'_>,
        channels: Channels,
        done: u32,
        budget: u32,
    ) -> u32 {
        let accumulate = accumulate_gradients::<M>;
        advance(
            words,
            method,
            samples,
            channels,
            done..done.saturating_add(budget),
            accumulate,
        )
    }

    fn values<'w>(words: &'w [f32], _: &FitMethod<'_>) -> [&'w [f32]; 3] {
        [words.get(..M::PARAMETERS).unwrap_or_default(), &[], &[]]
    }

    fn predicted_loss(words: &[f32], method: &FitMethod<'_>) -> Option<f32> {
        predicted_loss(words, method)
    }

    fn at_sample(words: &[f32], _: &FitMethod<'_>, _: usize, at: &HalfDifference<f32>) -> [f32; 3] {
        parameters_of::<M>(words).map_or([0.0; 3], |parameters| brdf::<M>(parameters, at))
    }

    fn brdf(
        words: &[f32],
        _: &FitMethod<'_>,
        _: Option<&Basis<'_>>,
        at: &HalfDifference<f32>,
    ) -> Option<[f32; 3]> {
        parameters_of::<M>(words).map(|parameters| brdf::<M>(parameters, at))
    }
}

// The rest depends on the model only through the gradient, so that firmware has it once and not for each model.

/// Adds the gradients of samples by the parameters to a gradient.
type Accumulate = fn(&[f32], Samples<'_>, &mut [f32]);

fn total(method: &FitMethod<'_>, samples: usize) -> u32 {
    match descent_of(method) {
        Some(descent) => before(method, samples).saturating_add(descent.gradients(samples)),
        None => 0,
    }
}

fn predicted_loss(words: &[f32], method: &FitMethod<'_>) -> Option<f32> {
    let FitMethod::Completed(completed) = method else {
        return None;
    };
    let predicted = words.last().copied();
    predicted.filter(|loss| loss.is_nan() || !completed.prediction.is_empty())
}

#[inline(never)]
fn start(words: &mut [f32], method: &FitMethod<'_>, channels: Channels) {
    words.fill(0.0);
    if let Some(descent) = descent_of(method) {
        for (parameter, value) in words.iter_mut().zip(descent.initial.iter()) {
            *parameter = value;
        }
        keep_gray(words, descent, channels);
    }
}

/// Does units of work; returns how many are done then.
#[inline(never)]
fn advance(
    words: &mut [f32],
    method: &FitMethod<'_>,
    samples: Samples<'_>,
    channels: Channels,
    units: Range<u32>,
    accumulate: Accumulate,
) -> u32 {
    let Range { start: done, end } = units;
    let Some(descent) = descent_of(method) else {
        return done;
    };
    let parameters = descent.initial.len();
    let before = before(method, samples.len());
    let end = end.min(before.saturating_add(descent.gradients(samples.len())));
    let mut done = done;
    if COMPLETION && let FitMethod::Completed(completed) = method {
        while done < end.min(before) {
            start_unit(words, completed, samples, done);
            done = done.saturating_add(1);
            if done == before {
                keep_gray(words, descent, channels);
            }
        }
    }
    // The place of the next sample in its round; without samples a round is empty.
    let round = samples.len() as u32;
    let next = done.saturating_sub(before).checked_rem(round);
    let mut next = next.unwrap_or(0) as usize;
    while done < end {
        let todo = samples.skip(next).take((end - done) as usize);
        let Some(parts) = Parts::of(words, parameters).filter(|_| !todo.is_empty()) else {
            break;
        };
        let Some(gradient) = parts.rest.get_mut(..parameters) else {
            break;
        };
        accumulate(parts.parameters, todo, gradient);
        done = done.saturating_add(todo.len() as u32);
        next = next.saturating_add(todo.len());
        if next >= samples.len() {
            next = 0;
            step(parts.parameters, gradient, descent.step_sizes);
            keep_gray(words, descent, channels);
        }
    }
    done
}

/// Gives the three channels of gray readings the same parameters: the mean of each triple.
fn keep_gray(words: &mut [f32], descent: &Descent<'_>, channels: Channels) {
    if channels == Channels::Color {
        return;
    }
    let colors = words.get_mut(descent.model.colors()).unwrap_or_default();
    for triple in colors.as_chunks_mut().0 {
        let [red, green, blue] = *triple;
        *triple = [(red + green + blue) * (1.0 / 3.0); 3];
    }
}

/// The descent of a method, if it has one.
fn descent_of<'l, 'a>(method: &'l FitMethod<'a>) -> Option<&'l Descent<'a>> {
    match method {
        FitMethod::Descent(descent) => Some(descent),
        FitMethod::Completed(Completed {
            target: Target::Descent(descent, _),
            ..
        }) => Some(descent),
        _ => None,
    }
}

/// Units of work before the descent: those of a completion, one for the start's units, and one for
/// every few parameters.
fn before(method: &FitMethod<'_>, samples: usize) -> u32 {
    let FitMethod::Completed(completed) = method else {
        return 0;
    };
    let Target::Descent(descent, _) = &completed.target else {
        return 0;
    };
    let started = descent.initial.len().div_ceil(STARTED);
    let units = completed.units(samples);
    units.saturating_add(1).saturating_add(started as u32)
}

/// A unit of work before the descent.
fn start_unit(words: &mut [f32], completed: &Completed<'_>, samples: Samples<'_>, unit: u32) {
    let Target::Descent(descent, start) = &completed.target else {
        return;
    };
    let count = descent.initial.len();
    let Some(parts) = Parts::of(words, count) else {
        return;
    };
    let state = completed.coefficient_net.words();
    let Some((state, rest)) = parts.rest.split_at_mut_checked(state) else {
        return;
    };
    let Some(units) = rest.get_mut(..start.units()) else {
        return;
    };
    let completion = completed.units(samples.len());
    match unit.checked_sub(completion) {
        None => completed.advance(unit, samples, state),
        Some(0) => {
            *parts.predicted = activate(completed, start, state, units);
        }
        Some(later) => {
            let first = (later as usize).saturating_sub(1).saturating_mul(STARTED);
            let parameters = parts.parameters.get_mut(first..).unwrap_or_default();
            start_parameters(parameters, start, first, units);
            if first.saturating_add(STARTED) >= count {
                parts.rest.fill(0.0); // from now on the gradient
            }
        }
    }
}

/// Puts up to [`STARTED`] parameters, from the `first` on, to where the descent begins.
#[inline(never)]
fn start_parameters(parameters: &mut [f32], start: &InitNet<'_>, first: usize, units: &[f32]) {
    let mut offsets = [0.0; STARTED];
    start.offsets(first, units, &mut offsets);
    for (parameter, offset) in parameters.iter_mut().zip(offsets) {
        *parameter += offset;
    }
}

/// Returns the loss that is predicted by the coefficients, as those are gone once the descent begins; NaN if
/// something is not finite, because as integers units are numbers whatever they were, and an infinite
/// coefficient makes some of them 1. Out of line, as all that takes time: what it takes of the stack is given
/// back between slices.
#[inline(never)]
fn activate(
    completed: &Completed<'_>,
    start: &InitNet<'_>,
    state: &[f32],
    units: &mut [f32],
) -> f32 {
    let coefficients = completed.coefficient_net.coefficients(state);
    start.activate(coefficients, units);
    if !(coefficients.into_iter().all(is_finite) && is_finite(units)) {
        return f32::NAN;
    }
    completed.predicted_loss(coefficients).unwrap_or_default()
}

/// One step, after which the gradient is 0. Out of line, so that firmware has it once and not for each model.
#[inline(never)]
fn step(parameters: &mut [f32], gradient: &mut [f32], step_sizes: Floats<'_>) {
    // Three at a time, which all runs of Neural are multiples of: to go round takes a third of the
    // time that an entry does.
    let (parameters, last_parameters) = parameters.as_chunks_mut();
    let (gradient, last_gradient) = gradient.as_chunks_mut();
    let (step_sizes, last_step_sizes) = step_sizes.words().as_chunks();
    let threes = parameters.iter_mut().zip(gradient).zip(step_sizes);
    for (([p, q, r], [by_p, by_q, by_r]), [alpha_p, alpha_q, alpha_r]) in threes {
        step_one(p, by_p, *alpha_p);
        step_one(q, by_q, *alpha_q);
        step_one(r, by_r, *alpha_r);
    }
    let last = last_parameters.iter_mut().zip(last_gradient);
    for ((parameter, entry), step_size) in last.zip(last_step_sizes) {
        step_one(parameter, entry, *step_size);
    }
}

#[inline(always)]
fn step_one(parameter: &mut f32, entry: &mut f32, step_size: [u8; 4]) {
    *parameter -= f32::from_le_bytes(step_size) * *entry;
    *entry = 0.0;
}

/// Kept out of line: its temporaries are off the stack between slices of work.
#[inline(never)]
fn accumulate_gradients<M: Model>(parameters: &[f32], samples: Samples<'_>, gradient: &mut [f32]) {
    let views = M::Parameters::view(parameters).zip(M::Parameters::view_mut(gradient));
    if let Some((parameters, gradient)) = views {
        M::accumulate_gradients(parameters, samples, gradient);
    }
}

/// The model's BRDF, sr^-1 (not times the cosine). Out of line for the same reason.
#[inline(never)]
fn brdf<M: Model>(parameters: &M::Parameters<f32>, at: &HalfDifference<f32>) -> [f32; 3] {
    M::brdf::<f32>(parameters, at)
}
