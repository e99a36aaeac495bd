//! The outer loop: phases of Adam on an objective, with checkpoints.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use glimpse_fitting::recipe::identity::RunIdentity;
use glimpse_optimizer::Optimizer;

use super::checkpoint::{Checkpoint, CheckpointError};
use super::pattern::Pattern;
use super::phase::{OuterStep, Phase, Selection, Values};
use super::scan_budget::{Motion, REORDER_INTERVAL, ScanBudgetError};

/// The number of validations per phase.
const VALIDATIONS: usize = 20;

/// The progress of a run.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
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
    /// The smallest loss so far, on validation materials or over an epoch (see [`Selection`]).
    pub best: Option<f32>,
}

/// A callback after each outer step, which may stop the run.
pub type Observer<'a> = dyn FnMut(&Progress) -> ControlFlow<()> + Send + 'a;

/// The location of checkpoints.
#[derive(Clone, Debug)]
pub struct Checkpoints {
    /// The directory of all checkpoint files.
    pub directory: PathBuf,
    /// True to resume from an existing checkpoint.
    pub resume: bool,
}

/// A reason why the outer loop ended without a result.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// A checkpoint cannot be written or read.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// No pattern within the budget for the time of a scan was found.
    #[error(transparent)]
    ScanBudget(#[from] ScanBudgetError),
    /// The observer stopped the run. With checkpoints, the state was saved.
    #[error("stopped after {0} outer steps")]
    Stopped(usize),
}

/// The order of a pattern's samples as a path.
pub struct PathOfSamples<'a> {
    /// The motion.
    pub motion: &'a Motion,
    /// Returns meta-parameters, or their moments, with the samples in another order, given as indices. A list may be
    /// empty.
    pub permute: &'a dyn Fn(Values, &[usize]) -> Values,
}

/// The maximum time between two checkpoints.
const MAX_INTERVAL: Duration = Duration::from_secs(10);

/// Returns true if a checkpoint is due: a killed run loses at most a twentieth of its time, and 10 s.
fn is_due(begin: Instant, last_saved: Instant) -> bool {
    last_saved.elapsed() >= MAX_INTERVAL.min(begin.elapsed() / 20)
}

/// The outer loop of one run.
pub struct OuterLoop<'a> {
    /// The first meta-parameters.
    pub initial: Values,
    /// The phases.
    pub phases: &'a [Phase<'a>],
    /// The motion of a scan, if its time has a budget.
    pub path: Option<PathOfSamples<'a>>,
    /// The identity of the run. Checkpoints of other runs are rejected.
    pub identity: RunIdentity,
    /// The checkpoints; None disables them.
    pub checkpoints: Option<&'a Checkpoints>,
    /// The index of this run in the training. Each run has its own checkpoint file.
    pub stage: usize,
}

impl OuterLoop<'_> {
    /// Runs all phases, calling `observer` after each outer step. Returns the best values.
    ///
    /// # Errors
    /// See [`RunError`].
    pub fn run(&self, observer: &mut Observer<'_>) -> Result<Values, RunError> {
        let mut state = self.initial_state()?;
        let total = self.phases.iter().map(|phase| phase.steps).sum();
        let begin = Instant::now();
        let mut last_saved = begin;
        while let Some((phase, outer_step)) = self.outer_step(state.done) {
            self.advance(&mut state, phase, outer_step);
            let stop = observer(&Progress {
                phase: phase.name,
                samples: phase.samples,
                done: state.done,
                total,
                loss: state.smoothed_loss.unwrap_or(f32::NAN),
                // With `Selection::Last` the best loss of earlier phases is not comparable.
                best: match phase.selection {
                    Selection::Last => None,
                    _ => state.best.as_ref().map(|(loss, _)| *loss),
                },
            });
            let stop = stop.is_break() && state.done < total;
            if let Some(checkpoints) = self.checkpoints
                && (stop || state.done == total || is_due(begin, last_saved))
            {
                state.write(&self.checkpoint_path(checkpoints))?;
                last_saved = Instant::now();
            }
            if stop {
                return Err(RunError::Stopped(state.done));
            }
        }
        let mut values = state.best_values();
        if let Some(path) = &self.path {
            path.motion.shorten(&mut values.pattern)?;
        }
        Ok(values)
    }

    /// Returns an outer step and its phase, given its index over all phases; None after the last step.
    fn outer_step(&self, index: usize) -> Option<(&Phase<'_>, OuterStep)> {
        let mut step = index;
        for (phase_index, phase) in self.phases.iter().enumerate() {
            if step < phase.steps {
                let outer_step = OuterStep {
                    phase_index,
                    step,
                    batch: phase.batch,
                };
                return Some((phase, outer_step));
            }
            step -= phase.steps;
        }
        None
    }

    /// Returns the initial state, or the state of the checkpoint.
    fn initial_state(&self) -> Result<Checkpoint, CheckpointError> {
        if let Some(checkpoints) = self.checkpoints {
            let path = self.checkpoint_path(checkpoints);
            if checkpoints.resume
                && let Some(checkpoint) = Checkpoint::read(&path, &self.identity)?
            {
                return Ok(checkpoint);
            }
        }
        Ok(Checkpoint::new(self.identity, self.initial.clone()))
    }

    fn checkpoint_path(&self, checkpoints: &Checkpoints) -> PathBuf {
        Checkpoint::path(&checkpoints.directory, self.stage)
    }

    /// Runs one outer step.
    fn advance(&self, state: &mut Checkpoint, phase: &Phase<'_>, outer_step: OuterStep) {
        let step = outer_step.step;
        if step == 0 {
            start_phase(state, phase);
        }
        let (loss, values) = self.descend(state, phase, outer_step);

        state.done += 1;
        // A non-finite loss would make all later smoothed losses non-finite.
        if loss.is_finite() {
            let smoothed = state.smoothed_loss.unwrap_or(loss);
            state.smoothed_loss = Some(smoothed + 0.02 * (loss - smoothed));
        }
        let is_last = step + 1 == phase.steps;
        match &phase.selection {
            Selection::BestValidation(validation_loss) => {
                let period = phase.steps.div_ceil(VALIDATIONS);
                if (step + 1).is_multiple_of(period) || is_last {
                    state.store_if_better(validation_loss(&state.optimizer.values()));
                }
            }
            Selection::BestEpoch(epoch_steps) => {
                state.epoch_loss += loss + Pattern::from_logits(&values.pattern).barrier();
                if (step + 1).is_multiple_of(*epoch_steps) {
                    let loss = std::mem::take(&mut state.epoch_loss) / *epoch_steps as f32;
                    state.store_if_better(loss);
                }
            }
            Selection::Last if is_last => state.best = Some((loss, state.optimizer.values())),
            Selection::Last => {}
        }
    }

    /// Runs a step of Adam. Returns the loss of the values before the step, and these values.
    fn descend(
        &self,
        state: &mut Checkpoint,
        phase: &Phase<'_>,
        outer_step: OuterStep,
    ) -> (f32, Values) {
        let step = outer_step.step;
        let path = self.path.as_ref().filter(|_| phase.rates.pattern > 0.0);
        if let Some(PathOfSamples { motion, permute }) = path
            && step.is_multiple_of(REORDER_INTERVAL)
            && let Some(order) = motion.faster_order(&state.optimizer.values().pattern, step == 0)
        {
            state.optimizer.rearrange(|values| permute(values, &order));
        }
        let allowance = phase.allowance_at(step);
        let values = state.optimizer.values();
        let (loss, mut gradient) = (phase.gradient)(&values, outer_step);
        if let Some(PathOfSamples { motion, .. }) = path {
            let weight = &mut state.motion_weight;
            let by_logits = motion.weighted_gradient(&values.pattern, allowance, weight);
            for (sum, derivative) in gradient.pattern.iter_mut().zip(by_logits) {
                *sum += derivative;
            }
        }
        for (gradient, values) in gradient.each_mut().into_iter().zip(values.each()) {
            clip(gradient, phase.max_gradient_norm);
            for (entry, value) in gradient.iter_mut().zip(values) {
                *entry += phase.weight_decay * value;
            }
        }
        state.optimizer.step(gradient, &phase.rates_at(step));
        if let Some(PathOfSamples { motion, .. }) = path {
            motion.project(state.optimizer.pattern_mut(), allowance);
        }
        (loss, values)
    }
}

/// Sets the meta-parameters to the first ones of a phase.
fn start_phase(state: &mut Checkpoint, phase: &Phase<'_>) {
    if let Some(start) = &phase.start {
        state.optimizer = Optimizer::new(start(state.best_values()));
    }
    if let Selection::BestEpoch(_) = phase.selection {
        // Losses of earlier phases are not comparable: their patterns have other sizes.
        state.best = None;
        state.epoch_loss = 0.0;
    }
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
