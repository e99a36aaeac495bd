//! Descent: a few steps of SGD with a step size per parameter, in bounded slices of work.
//!
//! theta <- theta - alpha * grad(loss), where the loss is the mean over all samples (paper, Algorithm 1, `Learn`). A
//! unit of work is the gradient of one sample. After a round over all samples, a step changes the parameters.

use core::ops::Range;

use super::algorithm::{Algorithm, Channels, wrong_model};
use super::completed::{Completed, PARAMETERS_PER_UNIT, Target};
use super::gauss_newton;
use super::learned::Descent;
use super::method::{COMPLETION, FitMethod};
use super::refined::{Refined, refined_words};
use super::start::{activate, add_offsets, keep_gray};
use crate::error::Error;
use crate::geometry::HalfDifference;
use crate::model::linear::Basis;
use crate::model::{Model, ParameterSet, Samples};
use crate::numeric::Floats;

/// Returns the memory of a descent in words: the parameters, their gradient, and the predicted loss.
///
/// The completion of readings precedes the descent, and uses the memory of the gradient. If it has a correction, its
/// innovation is in the last word of that memory, after the gradient.
pub(crate) const fn descent_words(
    parameters: usize,
    completion: usize,
    has_correction: bool,
) -> usize {
    let gradient = parameters.saturating_add(has_correction as usize);
    let gradient = if completion > gradient {
        completion
    } else {
        gradient
    };
    parameters.saturating_add(gradient).saturating_add(1)
}

/// The memory of a descent, split into its parts.
struct Parts<'w> {
    parameters: &'w mut [f32],
    /// The memory of a completion, then the gradient and the innovation.
    completion_or_gradient: &'w mut [f32],
    predicted_loss: &'w mut f32,
}

impl<'w> Parts<'w> {
    fn split(words: &'w mut [f32], parameters: usize) -> Option<Self> {
        let (parameters, rest) = words.split_at_mut_checked(parameters)?;
        let (predicted_loss, completion_or_gradient) = rest.split_last_mut()?;
        Some(Self {
            parameters,
            completion_or_gradient,
            predicted_loss,
        })
    }
}

/// Returns the parameters of a descent's memory.
fn parameters_of<M: Model>(words: &[f32]) -> Option<&M::Parameters<f32>> {
    M::Parameters::view(words.get(..M::PARAMETERS)?)
}

impl Descent<'_> {
    /// The number of gradients of one sample in the whole fit: samples times steps.
    pub(super) fn gradients(&self, samples: usize) -> u32 {
        u32::from(self.inner_steps).saturating_mul(samples as u32)
    }
}

impl<M: Model> Algorithm for M {
    fn words(method: &FitMethod<'_>, _: usize) -> Result<usize, Error> {
        if M::KIND != method.model() {
            return Err(wrong_model(M::KIND, method.model()));
        }
        let (completion, has_correction) = match method {
            FitMethod::Completed(completed) => (completed.words(), completed.correction.is_some()),
            _ => (0, false),
        };
        Ok(match Refined::of(method) {
            Some(_) => refined_words(M::PARAMETERS, M::ACTIVE, completion),
            None => descent_words(M::PARAMETERS, completion, has_correction),
        })
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
        let units = done..done.saturating_add(budget);
        if let Some(refined) = Refined::of(method) {
            return refined.advance(words, samples, channels, units, add_reading::<M>);
        }
        let accumulate = accumulate_gradients::<M>;
        advance(words, method, samples, channels, units, accumulate)
    }

    fn values<'w>(words: &'w [f32], _: &FitMethod<'_>) -> [&'w [f32]; 3] {
        [words.get(..M::PARAMETERS).unwrap_or_default(), &[], &[]]
    }

    fn predicted_loss(words: &[f32], method: &FitMethod<'_>) -> Option<f32> {
        predicted_loss(words, method)
    }

    fn innovation(words: &[f32], method: &FitMethod<'_>) -> Option<f32> {
        innovation(words, method)
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

// The rest depends on the model only through the gradient, so firmware contains it once and not for each model.

/// Adds the loss gradients of samples to a gradient, given the parameters.
type Accumulate = fn(&[f32], Samples<'_>, &mut [f32]);

fn total(method: &FitMethod<'_>, samples: usize) -> u32 {
    if let Some(refined) = Refined::of(method) {
        return refined.total(samples);
    }
    match descent_of(method) {
        Some(descent) => {
            units_before_descent(method, samples).saturating_add(descent.gradients(samples))
        }
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

fn innovation(words: &[f32], method: &FitMethod<'_>) -> Option<f32> {
    if let Some(refined) = Refined::of(method) {
        return refined.innovation(words);
    }
    match method {
        FitMethod::Completed(completed) if COMPLETION => {
            completed.correction.as_ref()?;
            let (_, before) = words.split_last()?;
            before.last().copied()
        }
        _ => None,
    }
}

#[inline(never)]
fn start(words: &mut [f32], method: &FitMethod<'_>, channels: Channels) {
    words.fill(0.0);
    let (initial, model) = match (descent_of(method), Refined::of(method)) {
        (Some(descent), _) => (descent.initial, descent.model),
        (None, Some(refined)) => (refined.steps.initial, refined.steps.model),
        (None, None) => return,
    };
    for (parameter, value) in words.iter_mut().zip(initial.iter()) {
        *parameter = value;
    }
    keep_gray(words, model, channels);
}

/// Does the given units of work, and returns the new number of completed units.
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
    let before = units_before_descent(method, samples.len());
    let end = end.min(before.saturating_add(descent.gradients(samples.len())));
    let mut done = done;
    if COMPLETION && let FitMethod::Completed(completed) = method {
        while done < end.min(before) {
            advance_completion(words, completed, samples, done);
            done = done.saturating_add(1);
            if done == before {
                keep_gray(words, descent.model, channels);
            }
        }
    }
    // The index of the next sample in its round. `checked_rem` returns None if `round` is 0.
    let round = samples.len() as u32;
    let next = done.saturating_sub(before).checked_rem(round);
    let mut next = next.unwrap_or(0) as usize;
    while done < end {
        let batch = samples.skip(next).take((end - done) as usize);
        let Some(parts) = Parts::split(words, parameters).filter(|_| !batch.is_empty()) else {
            break;
        };
        let Some(gradient) = parts.completion_or_gradient.get_mut(..parameters) else {
            break;
        };
        accumulate(parts.parameters, batch, gradient);
        done = done.saturating_add(batch.len() as u32);
        next = next.saturating_add(batch.len());
        if next >= samples.len() {
            next = 0;
            step(parts.parameters, gradient, descent.step_sizes);
            keep_gray(words, descent.model, channels);
        }
    }
    done
}

/// Returns the descent of a method, if it has one.
fn descent_of<'m, 'a>(method: &'m FitMethod<'a>) -> Option<&'m Descent<'a>> {
    match method {
        FitMethod::Descent(descent) => Some(descent),
        FitMethod::Completed(Completed {
            target: Target::Descent(descent, _),
            ..
        }) => Some(descent),
        _ => None,
    }
}

/// Returns the number of units of work before the descent.
///
/// These are the units of the completion, one for the units of the init net, and one for each
/// [`PARAMETERS_PER_UNIT`] initial parameters.
fn units_before_descent(method: &FitMethod<'_>, samples: usize) -> u32 {
    let FitMethod::Completed(completed) = method else {
        return 0;
    };
    let Target::Descent(descent, _) = &completed.target else {
        return 0;
    };
    let parameters = descent.initial.len().div_ceil(PARAMETERS_PER_UNIT);
    let coefficients = completed.units(samples);
    coefficients
        .saturating_add(1)
        .saturating_add(parameters as u32)
}

/// Does a unit of work before the descent.
fn advance_completion(
    words: &mut [f32],
    completed: &Completed<'_>,
    samples: Samples<'_>,
    unit: u32,
) {
    let Target::Descent(descent, init_net) = &completed.target else {
        return;
    };
    let count = descent.initial.len();
    let Some(parts) = Parts::split(words, count) else {
        return;
    };
    let state = completed.coefficient_words();
    let Some((state, rest)) = parts.completion_or_gradient.split_at_mut_checked(state) else {
        return;
    };
    let Some(activations) = rest.get_mut(..init_net.units()) else {
        return;
    };
    match unit.checked_sub(completed.units(samples.len())) {
        None => completed.advance(unit, samples, state),
        Some(0) => {
            *parts.predicted_loss = activate(completed, init_net, state, activations);
        }
        Some(index) => {
            let first = (index as usize)
                .saturating_sub(1)
                .saturating_mul(PARAMETERS_PER_UNIT);
            let parameters = parts.parameters.get_mut(first..).unwrap_or_default();
            add_offsets(parameters, init_net, first, activations);
            if first.saturating_add(PARAMETERS_PER_UNIT) >= count {
                let innovation = completed.innovation(state);
                // From here on, it is the gradient and the innovation.
                parts.completion_or_gradient.fill(0.0);
                if let Some((last, innovation)) =
                    parts.completion_or_gradient.last_mut().zip(innovation)
                {
                    *last = innovation;
                }
            }
        }
    }
}

/// Takes one step, and sets the gradient to 0. Not inlined, so firmware contains it once and not for each model.
#[inline(never)]
fn step(parameters: &mut [f32], gradient: &mut [f32], step_sizes: Floats<'_>) {
    // Three entries per iteration, because the loop itself takes a third of the time of an entry. Neural's parameters
    // have no remainder.
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
    for ((parameter, gradient), step_size) in last.zip(last_step_sizes) {
        step_one(parameter, gradient, *step_size);
    }
}

#[inline(always)]
fn step_one(parameter: &mut f32, gradient: &mut f32, step_size: [u8; 4]) {
    *parameter -= f32::from_le_bytes(step_size) * *gradient;
    *gradient = 0.0;
}

/// Adds the loss gradients of samples. Not inlined, so that its stack is released between slices of work.
#[inline(never)]
fn accumulate_gradients<M: Model>(parameters: &[f32], samples: Samples<'_>, gradient: &mut [f32]) {
    let views = M::Parameters::view(parameters).zip(M::Parameters::view_mut(gradient));
    if let Some((parameters, gradient)) = views {
        M::accumulate_gradients(parameters, samples, gradient);
    }
}

/// Adds a reading to the systems of a Gauss-Newton step. Not inlined, so that its stack is released between slices of
/// work.
#[inline(never)]
fn add_reading<M: Model>(
    parameters: &[f32],
    at: &HalfDifference<f32>,
    measured: [f32; 3],
    weights: [f32; 2],
    systems: &mut [f32],
) {
    if let Some(parameters) = M::Parameters::view(parameters) {
        gauss_newton::add_reading::<M, f32>(parameters, at, measured, weights, systems);
    }
}

/// Returns the model's BRDF, sr^-1 (not times the cosine). Not inlined, so that its stack is released after the call.
#[inline(never)]
fn brdf<M: Model>(parameters: &M::Parameters<f32>, at: &HalfDifference<f32>) -> [f32; 3] {
    M::brdf::<f32>(parameters, at)
}
