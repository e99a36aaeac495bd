//! The outer loop: phases of Adam steps on the gradient of an objective, with checkpoints.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use glimpse_fitting::recipe::identity::RunIdentity;
use glimpse_materials::lists::add_scaled;
pub use glimpse_optimizer::MetaValues;
use glimpse_optimizer::{Groups, Optimizer};

use super::checkpoint::TrainingState;
use super::pattern::Reach;
use super::result::TrainError;
use super::scan_budget::{Motion, REORDER_INTERVAL};

/// The number of validations per phase.
const VALIDATIONS: usize = 20;

/// An outer step. Phase and step select its random numbers.
#[derive(Clone, Copy, Debug)]
pub struct OuterStep {
    /// The index of the phase.
    pub phase_index: usize,
    /// The index of the step in the phase.
    pub step: usize,
    /// The number of tasks.
    pub batch: usize,
}

/// Returns the meta-parameters that a phase starts with, given the best ones so far, or the present ones without
/// them.
pub type PhaseStart<'a> = Box<dyn Fn(MetaValues) -> MetaValues + 'a>;
/// Returns the loss of a step, and its gradient, which includes the [barrier](super::pattern::SamplePattern::barrier).
pub type Gradient<'a> = Box<dyn Fn(&MetaValues, OuterStep) -> (f32, MetaValues) + 'a>;
/// Returns a loss, by which the best meta-parameters are selected.
pub type SelectionLoss<'a> = Box<dyn Fn(&MetaValues) -> f32 + 'a>;

/// The criterion for storing meta-parameters of a phase as the best so far.
pub enum Criterion<'a> {
    /// The smallest loss on validation materials, if it is below the best so far.
    BestValidation(SelectionLoss<'a>),
    /// The smallest training loss over an epoch of this many steps, including the
    /// [barrier](super::pattern::SamplePattern::barrier). Results of earlier phases are discarded.
    BestEpoch(usize),
    /// The final meta-parameters.
    Last,
}

/// One phase of meta-training.
pub struct Phase<'a> {
    /// The name in progress reports.
    pub name: &'static str,
    /// The number of samples of the pattern.
    pub samples: usize,
    /// The first meta-parameters, with new moments of Adam; None to continue the previous phase.
    pub start: Option<PhaseStart<'a>>,
    /// The objective.
    pub gradient: Gradient<'a>,
    /// The selection of the best meta-parameters.
    pub selection: Criterion<'a>,
    /// The number of outer steps.
    pub steps: usize,
    /// The number of tasks per outer step.
    pub batch: usize,
    /// The initial learning rate of each group; 0 freezes a group.
    pub rates: Groups<f64>,
    /// The final learning rates, as a share of the initial ones (cosine annealing).
    pub final_rate_ratio: f64,
    /// The number of steps of linear warm-up.
    pub warm_up_steps: usize,
    /// The maximum norm of the gradient of each group; longer gradients are scaled down.
    pub max_gradient_norm: f32,
    /// The weight decay of Adam with L2 regularization: the share of a value added to its gradient.
    pub weight_decay: f32,
    /// The initial multiple of the budget for the time of a scan. Patterns spread before they contract.
    pub initial_allowance: f64,
}

/// The share of a phase after which the budget for the time of a scan is the given one.
const CONTRACTION: f64 = 0.4;

impl Phase<'_> {
    /// Returns the learning rates at a step.
    #[must_use]
    pub fn rates_at(&self, step: usize) -> Groups<f64> {
        let progress = step as f64 / self.steps as f64;
        let cosine = 0.5 * (1.0 + (std::f64::consts::PI * progress).cos());
        let annealed = self.final_rate_ratio + (1.0 - self.final_rate_ratio) * cosine;
        let warm_up = ((step + 1) as f64 / self.warm_up_steps.max(1) as f64).min(1.0);
        let share = annealed * warm_up;
        self.rates.map(|rate| rate * share)
    }

    /// Returns the budget for the time of a scan at a step, as a multiple of the given one.
    #[must_use]
    pub fn allowance_at(&self, step: usize) -> f64 {
        let progress = step as f64 / self.steps as f64;
        1.0 + (self.initial_allowance - 1.0) * (1.0 - progress / CONTRACTION).max(0.0)
    }
}

/// Returns the sum of losses and gradients in their order, multiplied by `share`.
#[must_use]
pub fn scaled_sum(share: f32, tasks: &[(f32, MetaValues)]) -> (f32, MetaValues) {
    let mut loss = 0.0;
    let mut sum = MetaValues::default();
    for (task_loss, gradients) in tasks {
        loss += share * task_loss;
        for (sum, gradient) in sum.each_mut().into_iter().zip(gradients.each()) {
            sum.resize(gradient.len(), 0.0);
            add_scaled(sum, share, gradient);
        }
    }
    (loss, sum)
}

/// The progress of a run.
#[derive(Clone, Copy, Debug)]
pub struct TrainingProgress {
    /// The name of the phase.
    pub phase: &'static str,
    /// The number of samples of the pattern.
    pub samples: usize,
    /// Completed outer steps of all phases.
    pub done: usize,
    /// Outer steps of all phases.
    pub total: usize,
    /// The outer loss, smoothed over about 50 steps. NaN in a phase without steps.
    pub loss: f32,
    /// The smallest loss so far, on validation materials or over an epoch (see [`Criterion`]).
    pub best: Option<f32>,
}

/// A callback after each outer step, which may stop the run.
pub type StepObserver<'a> = dyn FnMut(&TrainingProgress) -> ControlFlow<()> + Send + 'a;

/// The location of checkpoints.
#[derive(Clone, Debug)]
pub struct Checkpoints {
    /// The directory of all checkpoint files.
    pub directory: PathBuf,
    /// True to resume from an existing checkpoint.
    pub resume: bool,
}

/// The order of a pattern's samples as a path.
pub struct PathOfSamples<'a> {
    /// The motion.
    pub motion: &'a Motion,
    /// Returns meta-parameters, or their moments, with the samples in another order, given as indices.
    pub permute: &'a dyn Fn(MetaValues, &[usize]) -> MetaValues,
}

/// The smallest and the largest time between two checkpoints. Each one waits for the disk.
const INTERVALS: [Duration; 2] = [Duration::from_millis(100), Duration::from_secs(10)];

/// Returns true if a checkpoint is due: the first one, and those without which a killed run would lose a fifth of its time,
/// or 10 s.
fn is_due(begin: Instant, last_saved: Option<Instant>) -> bool {
    let [shortest, longest] = INTERVALS;
    let interval = (begin.elapsed() / 5).clamp(shortest, longest);
    last_saved.is_none_or(|last_saved| last_saved.elapsed() >= interval)
}

/// The runs of a training. The observer sees their steps as those of one run.
pub struct Session<'s, 'o> {
    /// The identity of the training. Checkpoints of other trainings are rejected.
    pub identity: RunIdentity,
    /// The checkpoints, one file for each run; None disables them.
    pub checkpoints: Option<&'s Checkpoints>,
    /// The observer.
    pub observer: &'s mut StepObserver<'o>,
    /// The number of outer steps of all runs; 0 for a single run.
    pub total: usize,
    /// The number of outer steps of the completed runs.
    pub done: usize,
    /// The number of completed runs.
    pub completed: usize,
}

impl<'s, 'o> Session<'s, 'o> {
    /// Creates the session of a training before its first run.
    pub fn new(
        identity: RunIdentity,
        checkpoints: Option<&'s Checkpoints>,
        observer: &'s mut StepObserver<'o>,
    ) -> Self {
        Self {
            identity,
            checkpoints,
            observer,
            total: 0,
            done: 0,
            completed: 0,
        }
    }

    /// Runs all phases from initial meta-parameters, and calls the observer after each outer step. Returns the best values.
    /// `path` is the motion of a scan, if its time has a budget.
    ///
    /// # Errors
    /// If the run is stopped, a checkpoint cannot be read or written, or no pattern within the budget is found.
    pub fn run(
        &mut self,
        initial: MetaValues,
        phases: &[Phase<'_>],
        path: Option<PathOfSamples<'_>>,
    ) -> Result<MetaValues, TrainError> {
        let steps: usize = phases.iter().map(|phase| phase.steps).sum();
        let file = self
            .checkpoints
            .map(|checkpoints| TrainingState::path(&checkpoints.directory, self.completed));
        let may_resume = self.checkpoints.is_some_and(|all| all.resume);
        let resumed = match &file {
            Some(file) if may_resume => TrainingState::read(file, &self.identity)?,
            _ => None,
        };
        let mut state = resumed.unwrap_or_else(|| TrainingState::new(self.identity, initial));
        let begin = Instant::now();
        let mut last_saved = None;
        for (phase, outer_step) in outer_steps(phases).skip(state.done) {
            advance(&mut state, phase, outer_step, path.as_ref());
            let stop = (self.observer)(&TrainingProgress {
                phase: phase.name,
                samples: phase.samples,
                done: self.done + state.done,
                total: self.total.max(self.done + steps),
                loss: state.smoothed_loss.unwrap_or(f32::NAN),
                // With `Criterion::Last` the best loss of earlier phases is not comparable.
                best: match phase.selection {
                    Criterion::Last => None,
                    _ => state.best.as_ref().map(|(loss, _)| *loss),
                },
            });
            let stop = stop.is_break() && state.done < steps;
            if let Some(file) = &file
                && (stop || state.done == steps || is_due(begin, last_saved))
            {
                state.write(file)?;
                last_saved = Some(Instant::now());
            }
            if stop {
                return Err(TrainError::Stopped(self.done + state.done));
            }
        }
        self.done += steps;
        self.completed += 1;
        let mut values = state.best_values();
        if let Some(path) = path {
            path.motion.shorten(&mut values.pattern)?;
        }
        Ok(values)
    }
}

/// Returns the outer steps of all phases.
fn outer_steps<'p>(phases: &'p [Phase<'p>]) -> impl Iterator<Item = (&'p Phase<'p>, OuterStep)> {
    phases.iter().enumerate().flat_map(|(phase_index, phase)| {
        let outer_step = move |step| OuterStep {
            phase_index,
            step,
            batch: phase.batch,
        };
        (0..phase.steps).map(move |step| (phase, outer_step(step)))
    })
}

/// Runs one outer step.
fn advance(
    state: &mut TrainingState,
    phase: &Phase<'_>,
    outer_step: OuterStep,
    path: Option<&PathOfSamples<'_>>,
) {
    let step = outer_step.step;
    if step == 0 {
        if let Some(start) = &phase.start {
            state.optimizer = Optimizer::new(start(state.best_values()));
        }
        if let Criterion::BestEpoch(_) = phase.selection {
            // Losses of earlier phases are not comparable: their patterns have other sizes.
            state.best = None;
            state.epoch_loss = 0.0;
        }
    }
    let (loss, values) = descend(state, phase, outer_step, path);

    state.done += 1;
    // A non-finite loss would make all later smoothed losses non-finite.
    if loss.is_finite() {
        let smoothed = state.smoothed_loss.unwrap_or(loss);
        state.smoothed_loss = Some(smoothed + 0.02 * (loss - smoothed));
    }
    let is_last = step + 1 == phase.steps;
    match &phase.selection {
        Criterion::BestValidation(validation_loss) => {
            let period = phase.steps.div_ceil(VALIDATIONS);
            if (step + 1).is_multiple_of(period) || is_last {
                state.store_if_better(validation_loss(&state.optimizer.values));
            }
        }
        Criterion::BestEpoch(epoch_steps) => {
            state.epoch_loss += loss + Reach::ANY.pattern(&values.pattern).barrier();
            if (step + 1).is_multiple_of(*epoch_steps) {
                let loss = std::mem::take(&mut state.epoch_loss) / *epoch_steps as f32;
                state.store_if_better(loss);
            }
        }
        Criterion::Last if is_last => state.best = Some((loss, state.optimizer.values.clone())),
        Criterion::Last => {}
    }
}

/// Runs a step of Adam. Returns the loss of the values before the step, and these values.
fn descend(
    state: &mut TrainingState,
    phase: &Phase<'_>,
    outer_step: OuterStep,
    path: Option<&PathOfSamples<'_>>,
) -> (f32, MetaValues) {
    let step = outer_step.step;
    let path = path.filter(|_| phase.rates.pattern > 0.0);
    if let Some(PathOfSamples { motion, permute }) = path
        && step.is_multiple_of(REORDER_INTERVAL)
        && let Some(order) = motion.faster_order(&state.optimizer.values.pattern, step == 0)
    {
        state.optimizer.rearrange(|values| permute(values, &order));
    }
    let allowance = phase.allowance_at(step);
    let values = state.optimizer.values.clone();
    let (loss, mut gradient) = (phase.gradient)(&values, outer_step);
    if let Some(PathOfSamples { motion, .. }) = path {
        let weight = &mut state.motion_weight;
        let by_logits = motion.weighted_gradient(&values.pattern, allowance, weight);
        add_scaled(&mut gradient.pattern, 1.0, &by_logits);
    }
    for (gradient, values) in gradient.each_mut().into_iter().zip(values.each()) {
        clip(gradient, phase.max_gradient_norm);
        add_scaled(gradient, phase.weight_decay, values);
    }
    state.optimizer.step(gradient, &phase.rates_at(step));
    if let Some(PathOfSamples { motion, .. }) = path {
        motion.project(&mut state.optimizer.values.pattern, allowance);
    }
    (loss, values)
}

/// Scales a gradient down to a maximum norm. A non-finite gradient becomes 0.
fn clip(gradient: &mut [f32], max_norm: f32) {
    let squares = gradient.iter().map(|value| value * value);
    let norm = squares.sum::<f32>().sqrt();
    if !norm.is_finite() {
        gradient.fill(0.0);
    } else if norm > max_norm {
        let scale = max_norm / norm;
        gradient.iter_mut().for_each(|value| *value *= scale);
    }
}

#[cfg(test)]
mod tests;
