//! The outer loop: phases of Adam or evolution on an objective, with checkpoints.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use glimpse_materials::sampling::{sobol_valid, uniform_valid};
use glimpse_optimizer::{Groups, Optimizer};
use rayon::prelude::*;

use super::checkpoint::{Checkpoint, CheckpointError};
use super::evolution::Evolution;
use super::identity::RunIdentity;
use super::initialization::standard_normal;
use super::objective::{LossEstimate, MetaObjective, RandomStreams};
use super::pattern::{Pattern, logits_from_angles};
use super::phase::{AddedSamples, Initialization, OuterStep, Phase, SearchMethod, Selection};
use super::plan::Plan;
use super::scan_budget::{REORDER_INTERVAL, ScanBudgetError};
use super::state::{BestValues, RunState};

/// The number of validations per phase.
const VALIDATIONS: usize = 20;

/// The standard deviation of the jitter that [`AddedSamples::Jittered`] adds to logits; one or two degrees.
const JITTER: f32 = 0.05;
/// The random number slot of the jitter, above all slots of a batch.
const JITTER_SLOT: usize = 0xFFFF;

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
    /// The [weighted](super::plan::LossWeights) outer loss, smoothed over about 50 steps.
    pub loss: f32,
    /// The smallest loss so far, on validation materials or over an epoch (see [`Selection`]).
    pub best: Option<f32>,
}

/// A callback after each outer step, which may stop the run.
pub type Observer<'a> = dyn FnMut(&Progress) -> ControlFlow<()> + Send + 'a;

/// The result of an outer loop.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The loss of the best values on the validation materials.
    pub expected_loss: LossEstimate,
    /// The best values.
    pub values: Groups<Vec<f32>>,
}

/// The location and interval of checkpoints.
#[derive(Clone, Debug)]
pub struct CheckpointOptions {
    /// The directory of all checkpoint files.
    pub directory: PathBuf,
    /// The time between two checkpoints; 0 writes one after every step.
    pub interval: Duration,
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

/// The outer loop of one run.
pub struct OuterLoop<'a> {
    /// The objective.
    pub objective: &'a dyn MetaObjective,
    /// The phases.
    pub plan: &'a Plan,
    /// The identity of the run. Checkpoints of other runs are rejected.
    pub identity: RunIdentity,
    /// The seed of random patterns.
    pub seed: u64,
    /// The options of checkpoints; None disables them.
    pub checkpoints: Option<CheckpointOptions>,
    /// The index of this run in the training. Each run has its own checkpoint file.
    pub stage: usize,
}

/// The optimizer, and the rest of a run's state.
struct State {
    optimizer: Optimizer,
    run: RunState,
}

impl State {
    fn restart(&mut self, values: Groups<Vec<f32>>) {
        self.optimizer = Optimizer::new(values);
    }

    /// Stores values if their loss is below the smallest so far.
    fn store_if_better(&mut self, loss: f32, values: Groups<Vec<f32>>) {
        let best = &mut self.run.best;
        if best.as_ref().is_none_or(|best| loss < best.loss) {
            *best = Some(BestValues { loss, values });
        }
    }
}

impl OuterLoop<'_> {
    /// Runs all phases, calling `observer` after each outer step. Returns the best values, and their loss on the
    /// validation materials.
    ///
    /// # Errors
    /// See [`RunError`].
    pub fn run(&self, observer: &mut Observer<'_>) -> Result<Outcome, RunError> {
        let mut state = self.initial_state()?;
        let total = self.plan.steps();
        let mut last_saved = Instant::now();
        while let Some(outer_step) = self.plan.outer_step(state.run.done) {
            self.advance(&mut state, outer_step);
            let RunState {
                done,
                smoothed_loss,
                best,
                ..
            } = &state.run;
            let stop = observer(&Progress {
                phase: outer_step.phase.name,
                samples: outer_step.phase.samples,
                done: *done,
                total,
                loss: *smoothed_loss,
                // With `Selection::Last` the best loss of earlier phases is not comparable.
                best: match outer_step.phase.selection {
                    Selection::Last => None,
                    _ => best.as_ref().map(|best| best.loss),
                },
            });
            let stop = stop.is_break() && *done < total;
            if let Some(checkpoints) = &self.checkpoints
                && (stop || *done == total || last_saved.elapsed() >= checkpoints.interval)
            {
                self.checkpoint(&state)
                    .write(&self.checkpoint_path(checkpoints))?;
                last_saved = Instant::now();
            }
            if stop {
                return Err(RunError::Stopped(state.run.done));
            }
        }
        let mut values = match state.run.best {
            Some(best) => best.values,
            None => state.optimizer.values(),
        };
        if let Some(motion) = self.objective.motion() {
            motion.shorten(&mut values.pattern)?;
        }
        Ok(Outcome {
            expected_loss: self.objective.expected_loss(&values),
            values,
        })
    }

    /// Returns the initial state, or the state of the checkpoint.
    fn initial_state(&self) -> Result<State, CheckpointError> {
        let new_state = |values| State {
            optimizer: Optimizer::new(values),
            run: RunState::default(),
        };
        let initial_values = self.objective.initial_values(0);
        let mut state = new_state(initial_values.clone());
        if let Some(checkpoints) = &self.checkpoints {
            let path = self.checkpoint_path(checkpoints);
            // The pattern may grow from phase to phase; check the space for the largest one.
            let samples = self.plan.phases.iter().map(|phase| phase.samples).max();
            let mut largest = initial_values;
            largest.pattern.resize(3 * samples.unwrap_or(0), 0.0);
            self.checkpoint(&new_state(largest)).check_writable(&path)?;
            if checkpoints.resume
                && let Some(checkpoint) = Checkpoint::read(&path, &self.identity)?
            {
                state.run = checkpoint.state;
                state.optimizer = state.optimizer.restore(checkpoint.record).ok_or(
                    CheckpointError::Damaged {
                        path,
                        reason: "the sizes of its parameter groups differ from those of this run",
                    },
                )?;
            }
        }
        Ok(state)
    }

    fn checkpoint_path(&self, checkpoints: &CheckpointOptions) -> PathBuf {
        Checkpoint::path(&checkpoints.directory, self.stage)
    }

    fn checkpoint(&self, state: &State) -> Checkpoint {
        Checkpoint {
            identity: self.identity,
            state: state.run.clone(),
            record: state.optimizer.record(),
        }
    }

    /// Runs one outer step.
    fn advance(&self, state: &mut State, outer_step: OuterStep<'_>) {
        let OuterStep { phase, step, .. } = outer_step;
        if step == 0 {
            self.initialize_phase(state, outer_step);
        }
        let epoch_steps = self.plan.tasks.div_ceil(phase.batch);
        if phase.initialization == Initialization::RandomPatterns
            && step.is_multiple_of(epoch_steps)
        {
            self.randomize_pattern(state, phase, step / epoch_steps);
        }

        let (loss, values) = match phase.search {
            SearchMethod::Gradient => self.descend(state, outer_step),
            SearchMethod::Evolution(population) => self.evolve(state, outer_step, population),
        };

        let run = &mut state.run;
        run.done += 1;
        // A non-finite loss would make all later smoothed losses non-finite.
        if loss.is_finite() {
            let share = match run.smoothed_loss == 0.0 {
                true => 1.0,
                false => 0.02,
            };
            run.smoothed_loss += share * (loss - run.smoothed_loss);
        }
        let is_last = step + 1 == phase.steps;
        match phase.selection {
            Selection::Unchanged => {}
            Selection::BestValidation => {
                let period = phase.steps.div_ceil(VALIDATIONS);
                if (step + 1).is_multiple_of(period) || is_last {
                    let values = match phase.search {
                        SearchMethod::Gradient => state.optimizer.values(),
                        SearchMethod::Evolution(_) => values,
                    };
                    let factor = match self.objective.motion() {
                        Some(motion) => motion.selection_factor(&values.pattern),
                        None => 1.0,
                    };
                    let loss = factor * self.objective.validation_loss(&values);
                    state.store_if_better(loss, values);
                }
            }
            Selection::BestEpoch => {
                run.epoch_loss += loss + Pattern::from_logits(&values.pattern).barrier();
                if (step + 1).is_multiple_of(epoch_steps) {
                    let loss = std::mem::take(&mut run.epoch_loss) / epoch_steps as f32;
                    state.store_if_better(loss, state.optimizer.values());
                }
            }
            Selection::Last if is_last => {
                let values = state.optimizer.values();
                run.best = Some(BestValues { loss, values });
            }
            Selection::BestFitness if is_last => {
                let values = state.optimizer.values();
                state.store_if_better(self.objective.fitness(&values, phase), values);
            }
            Selection::Last | Selection::BestFitness => {}
        }
    }

    /// Runs a step of Adam. Returns the loss of the values before the step, and these values.
    fn descend(&self, state: &mut State, outer_step: OuterStep<'_>) -> (f32, Groups<Vec<f32>>) {
        let OuterStep { phase, step, .. } = outer_step;
        let motion = self
            .objective
            .motion()
            .filter(|_| phase.rates.pattern > 0.0);
        if let Some(motion) = motion
            && step.is_multiple_of(REORDER_INTERVAL)
            && let Some(order) = motion.faster_order(&state.optimizer.values().pattern, step == 0)
        {
            let permute = |values| self.objective.permute_samples(values, &order);
            state.optimizer.rearrange(permute);
        }
        let values = state.optimizer.values();
        let (loss, mut gradient) = self.objective.gradient(&values, outer_step);
        if let Some(motion) = motion {
            let weight = &mut state.run.motion_weight;
            let by_logits = motion.weighted_gradient(&values.pattern, outer_step, weight);
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
        if let Some(motion) = motion {
            motion.project(state.optimizer.pattern_mut(), outer_step);
        }
        (loss, values)
    }

    /// Runs one generation of evolution. Returns the smallest loss, and the mean of the search distribution.
    fn evolve(
        &self,
        state: &mut State,
        outer_step: OuterStep<'_>,
        population: usize,
    ) -> (f32, Groups<Vec<f32>>) {
        let OuterStep { phase, step, .. } = outer_step;
        let evolution = state
            .run
            .evolution
            .get_or_insert_with(|| Evolution::new(state.optimizer.values(), phase.rates.clone()));
        let mut random = RandomStreams { seed: self.seed }.slot(outer_step, 0);
        let loss = evolution.advance(population, &mut random, |candidates| {
            let losses = candidates.par_iter();
            losses
                .map(|values| self.objective.fitness(values, phase))
                .collect()
        });
        let values = evolution.values();
        // The next phase starts from the mean of the distribution.
        if step + 1 == phase.steps {
            state.run.evolution = None;
            state.optimizer = Optimizer::new(values.clone());
        }
        (loss, values)
    }

    /// Sets the meta-parameters to the initialization of a phase.
    fn initialize_phase(&self, state: &mut State, outer_step: OuterStep<'_>) {
        let phase = outer_step.phase;
        match (phase.initialization, &state.run.best) {
            (Initialization::Guess(guess), _) => {
                state.restart(self.objective.initial_values(guess))
            }
            (Initialization::Best, Some(best)) => state.restart(best.values.clone()),
            (Initialization::BestRedrawn, Some(best)) => {
                state.restart(self.objective.choose_initial(best.values.clone()));
            }
            (Initialization::BestReordered, Some(best)) => {
                state.restart(self.objective.reorder_samples(best.values.clone()));
            }
            _ => {}
        }
        let mut values = state.optimizer.values();
        let existing = values.pattern.len() / 3;
        if phase.samples > existing {
            let added_count = 3 * (phase.samples - existing);
            let copies = values.pattern.iter().copied().cycle();
            let added_logits: Vec<f32> = match phase.added_samples {
                AddedSamples::Sobol => {
                    let sobol = sobol_valid(phase.samples, self.seed as u32);
                    sobol
                        .into_iter()
                        .skip(existing)
                        .flat_map(logits_from_angles)
                        .collect()
                }
                AddedSamples::Repeated => copies.take(added_count).collect(),
                AddedSamples::Jittered => {
                    let mut random =
                        RandomStreams { seed: self.seed }.slot(outer_step, JITTER_SLOT);
                    let jittered =
                        copies.map(|logit| logit + JITTER * standard_normal(&mut random));
                    jittered.take(added_count).collect()
                }
            };
            values.pattern.extend(added_logits);
            // The best values of earlier phases have fewer samples. Replace them even if their loss is smaller.
            let loss = match phase.selection {
                Selection::BestFitness => Some(self.objective.fitness(&values, phase)),
                Selection::BestValidation => Some(self.objective.validation_loss(&values)),
                _ => None,
            };
            if let Some(loss) = loss {
                let values = values.clone();
                state.run.best = Some(BestValues { loss, values });
            }
            state.restart(values);
        }
        if phase.selection == Selection::BestEpoch {
            // Losses of earlier phases are not comparable: their patterns have other sizes.
            state.run.best = None;
            state.run.epoch_loss = 0.0;
        }
    }

    /// Replaces the pattern with a random one.
    fn randomize_pattern(&self, state: &mut State, phase: &Phase, guess: usize) {
        let seed = self.seed.wrapping_add((guess as u64 + 1) << 32);
        let pattern = uniform_valid(phase.samples, seed);
        let mut values = state.optimizer.values();
        values.pattern = pattern.into_iter().flat_map(logits_from_angles).collect();
        state.restart(values);
    }
}

/// Scales a gradient down to a maximum norm. A non-finite gradient becomes 0.
fn clip(gradient: &mut [f32], max_norm: f32) {
    let norm = gradient
        .iter()
        .map(|value| value * value)
        .sum::<f32>()
        .sqrt();
    let scale = match norm {
        norm if !norm.is_finite() => {
            gradient.fill(0.0);
            return;
        }
        norm if norm > max_norm => max_norm / norm,
        _ => return,
    };
    for value in gradient {
        *value *= scale;
    }
}

#[cfg(test)]
mod tests;
