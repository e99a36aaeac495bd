//! Descent: a few steps of SGD with a step size per parameter, in bounded slices of work.
//!
//! theta <- theta - alpha * grad(loss), the loss being the mean over all samples (paper,
//! Algorithm 1, `Learn`). A unit of work is the gradient of one sample; after the last sample of
//! each round comes a step.

use super::completed::{Completed, InitNet, MAX_UNITS, MAX_WORDS, STARTED, Target};
use super::fitter::{Fitter, FitterError, is_finite};
use super::{Descent, FitMethod};
use crate::geometry::HalfDifference;
use crate::model::linear::Basis;
use crate::model::{Model, ParameterSet, SCRATCH, Sample};
use crate::numeric::Floats;

const _: () = assert!(MAX_WORDS + MAX_UNITS <= SCRATCH);

/// What a descent works in: parameters and their gradient.
#[derive(Clone, Debug)]
pub struct Workspace<M: Model> {
    parameters: M::Parameters<f32>,
    gradient: M::Parameters<f32>,
    /// What readings are completed in, where the gradient is too small for it.
    scratch: M::Scratch,
    /// The loss that completed readings predict.
    predicted: f32,
}

impl<M: Model> Workspace<M> {
    /// All zeros.
    pub const EMPTY: Self = Self {
        parameters: M::ZEROS,
        gradient: M::ZEROS,
        scratch: M::NO_SCRATCH,
        predicted: 0.0,
    };
}

impl Descent<'_> {
    /// Gradients of one sample that the whole fit takes: samples times steps.
    pub(super) fn gradients(&self, samples: usize) -> u32 {
        u32::from(self.inner_steps).saturating_mul(samples as u32)
    }
}

impl<M: Model> Fitter for M {
    type Workspace = Workspace<M>;
    const EMPTY: Workspace<M> = Workspace::EMPTY;

    fn accept(method: &FitMethod<'_>, _: usize) -> Result<(), FitterError> {
        let (firmware, recipe) = (M::KIND, method.model());
        if firmware == recipe {
            Ok(())
        } else {
            Err(FitterError::Model { firmware, recipe })
        }
    }

    fn total(method: &FitMethod<'_>, samples: usize) -> u32 {
        match descent_of(method) {
            Some(descent) => before(method, samples).saturating_add(descent.gradients(samples)),
            None => 0,
        }
    }

    fn start(workspace: &mut Workspace<M>, method: &FitMethod<'_>) {
        if let Some(descent) = descent_of(method) {
            let initial = descent.initial.iter();
            for (parameter, value) in workspace.parameters.iter_mut().zip(initial) {
                *parameter = value;
            }
        }
        workspace.gradient.iter_mut().for_each(|entry| *entry = 0.0);
        workspace.scratch.as_mut().fill(0.0);
        workspace.predicted = 0.0;
    }

    fn advance(
        workspace: &mut Workspace<M>,
        method: &FitMethod<'_>,
        samples: &[Sample<f32>],
        done: u32,
        budget: u32,
    ) -> u32 {
        let Some(descent) = descent_of(method) else {
            return done;
        };
        let before = before(method, samples.len());
        let all = before.saturating_add(descent.gradients(samples.len()));
        let end = done.saturating_add(budget).min(all);
        let mut done = done;
        if let FitMethod::Completed(completed) = method {
            while done < end.min(before) {
                start_unit(workspace, completed, samples, done);
                done = done.saturating_add(1);
                if done == before {
                    // The gradient may have been worked in.
                    scratch_of(workspace).1.fill(0.0);
                }
            }
        }
        // Where in its round the next sample is; there is no round without samples.
        let round = samples.len() as u32;
        let next = done.saturating_sub(before).checked_rem(round);
        let mut next = next.unwrap_or(0) as usize;
        while done < end {
            let todo = samples.get(next..).unwrap_or_default();
            let todo = todo.get(..(end - done) as usize).unwrap_or(todo);
            if todo.is_empty() {
                break;
            }
            accumulate_gradients::<M>(&workspace.parameters, todo, &mut workspace.gradient);
            done = done.saturating_add(todo.len() as u32);
            next = next.saturating_add(todo.len());
            if next >= samples.len() {
                next = 0;
                update(workspace, descent.step_sizes);
            }
        }
        done
    }

    fn values<'w>(workspace: &'w Workspace<M>, _: FitMethod<'w>) -> impl Iterator<Item = f32> + 'w {
        workspace.parameters.iter().copied()
    }

    fn is_finite(workspace: &Workspace<M>, _: &FitMethod<'_>) -> bool {
        !workspace.predicted.is_nan() && workspace.parameters.runs().all(is_finite)
    }

    fn predicted_loss(workspace: &Workspace<M>, method: &FitMethod<'_>) -> Option<f32> {
        match method {
            FitMethod::Completed(completed) if !completed.prediction.is_empty() => {
                Some(workspace.predicted)
            }
            _ => None,
        }
    }

    fn at_sample(
        workspace: &Workspace<M>,
        _: &FitMethod<'_>,
        _: usize,
        at: &HalfDifference<f32>,
    ) -> [f32; 3] {
        brdf::<M>(&workspace.parameters, at)
    }

    fn brdf(
        workspace: &Workspace<M>,
        _: &FitMethod<'_>,
        _: Option<&Basis<'_>>,
        at: &HalfDifference<f32>,
    ) -> Option<[f32; 3]> {
        Some(brdf::<M>(&workspace.parameters, at))
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
fn start_unit<M: Model>(
    workspace: &mut Workspace<M>,
    completed: &Completed<'_>,
    samples: &[Sample<f32>],
    unit: u32,
) {
    let Target::Descent(_, start) = &completed.target else {
        return;
    };
    let (parameters, scratch, predicted) = scratch_of(workspace);
    let Some((state, units)) = scratch.split_at_mut_checked(MAX_WORDS) else {
        return;
    };
    let completion = completed.units(samples.len());
    match unit.checked_sub(completion) {
        None => completed.advance(unit, samples, state),
        Some(0) => {
            *predicted = activate(completed, start, state, units);
        }
        Some(later) => {
            let first = (later as usize).saturating_sub(1).saturating_mul(STARTED);
            start_parameters::<M>(parameters, start, first, units);
        }
    }
}

/// The parameters, what readings are completed in, and the loss that they predict.
fn scratch_of<M: Model>(
    workspace: &mut Workspace<M>,
) -> (&mut M::Parameters<f32>, &mut [f32], &mut f32) {
    let own = workspace.scratch.as_mut();
    let scratch = match own.len() >= SCRATCH {
        true => own,
        // The gradient is idle until the descent begins.
        false => workspace
            .gradient
            .runs_mut()
            .find(|run| run.len() >= SCRATCH)
            .unwrap_or_default(),
    };
    (&mut workspace.parameters, scratch, &mut workspace.predicted)
}

/// Puts the parameters from the `first` on to where the descent begins.
#[inline(never)]
fn start_parameters<M: Model>(
    parameters: &mut M::Parameters<f32>,
    start: &InitNet<'_>,
    first: usize,
    units: &[f32],
) {
    let mut offsets = [0.0; STARTED];
    start.offsets(first, units, &mut offsets);
    let (mut first, mut offsets) = (first, &offsets[..]);
    for run in parameters.runs_mut() {
        (first, offsets) = start_run(run, first, offsets);
    }
}

/// Adds to the parameters of a run from the `first` on; returns where in the next run, and by what, it
/// goes on. Out of line: the code is there once and not for each run.
#[inline(never)]
fn start_run<'o>(run: &mut [f32], first: usize, offsets: &'o [f32]) -> (usize, &'o [f32]) {
    let started = run.get_mut(first..).unwrap_or_default();
    for (parameter, offset) in started.iter_mut().zip(offsets) {
        *parameter += offset;
    }
    let left = offsets.get(started.len()..).unwrap_or_default();
    (first.saturating_sub(run.len()), left)
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
    let coefficients = completed.completion.coefficients(state);
    start.activate(coefficients, units);
    if !(coefficients.into_iter().all(is_finite) && is_finite(units)) {
        return f32::NAN;
    }
    completed.predicted_loss(coefficients).unwrap_or_default()
}

fn update<M: Model>(workspace: &mut Workspace<M>, step_sizes: Floats<'_>) {
    // Run by run: a loop over plain slices takes a fifth of a flattened iterator's time.
    let mut step_sizes = step_sizes;
    let runs = workspace.parameters.runs_mut();
    for (parameters, gradient) in runs.zip(workspace.gradient.runs_mut()) {
        step(parameters, gradient, step_sizes.take(parameters.len()));
    }
}

/// One step, after which the gradient is 0. Out of line: the code is there once and not for each run.
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
///
/// Parameters and gradient come one by one, though a workspace holds both: as parts of one whole
/// they are addressed from one pointer, which their distance is too large for.
#[inline(never)]
fn accumulate_gradients<M: Model>(
    parameters: &M::Parameters<f32>,
    samples: &[Sample<f32>],
    gradient: &mut M::Parameters<f32>,
) {
    M::accumulate_gradients(parameters, samples, gradient);
}

/// The model's BRDF, sr^-1 (not times the cosine). Out of line for the same reason.
#[inline(never)]
pub fn brdf<M: Model>(parameters: &M::Parameters<f32>, at: &HalfDifference<f32>) -> [f32; 3] {
    M::brdf::<f32>(parameters, at)
}
