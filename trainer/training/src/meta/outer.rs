//! The outer loop: phases of Adam steps on a objective's gradients, with checkpoints.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use glimpse_materials::sampling::{sobol_valid, uniform_valid};
use glimpse_optimizer::{Groups, Optimization};
use rayon::prelude::*;

use super::checkpoint::{Checkpoint, CheckpointError};
use super::evolution::Evolution;
use super::identity::RunIdentity;
use super::objective::{Expected, MetaObjective, RandomStreams};
use super::pattern::{Pattern, logits_of};
use super::phase::{AddedSamples, OuterStep, Phase, SearchMethod, Selection, Start};
use super::plan::Plan;
use super::start::standard_normal;
use super::state::{Best, RunState};

/// How often a phase is judged on materials that it does not train on.
const VALIDATIONS: usize = 20;

/// Standard deviation of the logits of [`AddedSamples::Jittered`] samples: a degree or two.
const JITTER: f32 = 0.05;
/// The slot that it is drawn from; batches have fewer.
const JITTER_SLOT: usize = 0xFFFF;

/// How far a run is.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// What is being trained.
    pub phase: &'static str,
    /// How many samples its pattern has.
    pub samples: usize,
    /// Outer steps done, over all phases.
    pub done: usize,
    /// Outer steps of all phases.
    pub total: usize,
    /// Outer loss as the plan [weighs](super::plan::LossWeights) it, smoothed over some fifty steps.
    pub loss: f32,
    /// The best loss so far: on materials held out, or of an epoch (see [`Selection`]).
    pub best: Option<f32>,
}

/// Is told of every outer step, and may stop the run.
pub type Observer<'a> = dyn FnMut(&Progress) -> ControlFlow<()> + Send + 'a;

/// What a run ends in.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The loss on the materials held out.
    pub expected: Expected,
    /// The best values.
    pub values: Groups<Vec<f32>>,
}

/// Where and how often a run is saved.
#[derive(Clone, Debug)]
pub struct Checkpoints {
    /// The directory.
    pub directory: PathBuf,
    /// A checkpoint is written when the last one is so old; 0 writes one after every step.
    pub every: Duration,
    /// Go on from the checkpoint, if there is one.
    pub resume: bool,
}

/// Why a run ended without a result.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// A checkpoint cannot be written or read.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// The observer asked to stop; a checkpoint was written if there is a place for it.
    #[error("stopped after {0} outer steps")]
    Stopped(usize),
}

/// A run: who is trained, and how.
pub struct Run<'a> {
    /// Who.
    pub objective: &'a dyn MetaObjective,
    /// How.
    pub plan: &'a Plan,
    /// Its identity, by which checkpoints of other runs are refused.
    pub identity: RunIdentity,
    /// Seed of the random patterns.
    pub seed: u64,
    /// Where it is saved.
    pub checkpoints: Option<Checkpoints>,
    /// Which of several runs to one end it is: each is saved in a file of its own.
    pub stage: usize,
}

/// A run under way.
struct State {
    optimization: Optimization,
    run: RunState,
}

impl State {
    fn restart(&mut self, values: Groups<Vec<f32>>) {
        self.optimization = Optimization::new(values);
    }

    /// Keeps values if their loss is less than the best so far.
    fn keep(&mut self, loss: f32, values: Groups<Vec<f32>>) {
        let best = &mut self.run.best;
        if best.as_ref().is_none_or(|best| loss < best.loss) {
            *best = Some(Best { loss, values });
        }
    }
}

impl Run<'_> {
    /// Trains, telling `observer` after every outer step; returns the best values, and their loss
    /// on the materials held out.
    ///
    /// # Errors
    /// See [`RunError`].
    pub fn finish(&self, observer: &mut Observer<'_>) -> Result<Outcome, RunError> {
        let mut state = self.begin()?;
        let total = self.plan.steps();
        let mut saved = Instant::now();
        while let Some(at) = self.plan.at(state.run.done) {
            self.advance(&mut state, at);
            let RunState {
                done, loss, best, ..
            } = &state.run;
            let stop = observer(&Progress {
                phase: at.phase.name,
                samples: at.phase.samples,
                done: *done,
                total,
                loss: *loss,
                // What is kept at a phase's end is not compared with phases before.
                best: match at.phase.keep {
                    Selection::Last => None,
                    _ => best.as_ref().map(|best| best.loss),
                },
            });
            let stop = stop.is_break() && *done < total;
            if let Some(checkpoints) = &self.checkpoints
                && (stop || *done == total || saved.elapsed() >= checkpoints.every)
            {
                self.checkpoint(&state).write(&self.file(checkpoints))?;
                saved = Instant::now();
            }
            if stop {
                return Err(RunError::Stopped(state.run.done));
            }
        }
        let values = match state.run.best {
            Some(best) => best.values,
            None => state.optimization.values(),
        };
        Ok(Outcome {
            expected: self.objective.expected(&values),
            values,
        })
    }

    /// The beginning, or where the checkpoint stands.
    fn begin(&self) -> Result<State, CheckpointError> {
        let begun = |values| State {
            optimization: Optimization::new(values),
            run: RunState::default(),
        };
        let first = self.objective.first_values(0);
        let mut state = begun(first.clone());
        if let Some(checkpoints) = &self.checkpoints {
            let path = self.file(checkpoints);
            // Patterns that are doubled end larger than they begin.
            let samples = self.plan.phases.iter().map(|phase| phase.samples).max();
            let mut largest = first;
            largest.pattern.resize(3 * samples.unwrap_or(0), 0.0);
            self.checkpoint(&begun(largest)).try_write(&path)?;
            if checkpoints.resume
                && let Some(found) = Checkpoint::read(&path, &self.identity)?
            {
                state.run = found.state;
                state.optimization =
                    state
                        .optimization
                        .restore(found.record)
                        .ok_or(CheckpointError::Damaged {
                            path,
                            what: "it has other numbers of values than the run",
                        })?;
            }
        }
        Ok(state)
    }

    fn file(&self, checkpoints: &Checkpoints) -> PathBuf {
        Checkpoint::path(&checkpoints.directory, self.stage)
    }

    fn checkpoint(&self, state: &State) -> Checkpoint {
        Checkpoint {
            run: self.identity,
            state: state.run.clone(),
            record: state.optimization.record(),
        }
    }

    /// One outer step.
    fn advance(&self, state: &mut State, at: OuterStep<'_>) {
        let OuterStep { phase, step, .. } = at;
        if step == 0 {
            self.enter(state, at);
        }
        let epoch = self.plan.tasks.div_ceil(phase.batch);
        if phase.start == Start::Patterns && step.is_multiple_of(epoch) {
            self.guess_pattern(state, phase, step / epoch);
        }

        let (loss, values) = match phase.search {
            SearchMethod::Gradient => self.descend(state, at),
            SearchMethod::Evolution(population) => self.evolve(state, at, population),
        };

        let run = &mut state.run;
        run.done += 1;
        // One loss that is no number would stay in the mean for ever.
        if loss.is_finite() {
            let share = if run.loss == 0.0 { 1.0 } else { 0.02 };
            run.loss += share * (loss - run.loss);
        }
        let last = step + 1 == phase.steps;
        match phase.keep {
            Selection::Nothing => {}
            Selection::BestValidation => {
                let period = phase.steps.div_ceil(VALIDATIONS);
                if (step + 1).is_multiple_of(period) || last {
                    let values = match phase.search {
                        SearchMethod::Gradient => state.optimization.values(),
                        SearchMethod::Evolution(_) => values,
                    };
                    state.keep(self.objective.judge(&values), values);
                }
            }
            Selection::BestEpoch => {
                run.epoch += loss + Pattern::from_logits(&values.pattern).barrier();
                if (step + 1).is_multiple_of(epoch) {
                    let loss = std::mem::take(&mut run.epoch) / epoch as f32;
                    state.keep(loss, state.optimization.values());
                }
            }
            Selection::Last if last => {
                let values = state.optimization.values();
                run.best = Some(Best { loss, values });
            }
            Selection::Fittest if last => {
                let values = state.optimization.values();
                state.keep(self.objective.fitness(&values, phase), values);
            }
            Selection::Last | Selection::Fittest => {}
        }
    }

    /// A step of Adam; returns the loss, and the values that it is of.
    fn descend(&self, state: &mut State, at: OuterStep<'_>) -> (f32, Groups<Vec<f32>>) {
        let OuterStep { phase, step, .. } = at;
        let values = state.optimization.values();
        let (loss, mut gradient) = self.objective.gradient(&values, at);
        for (gradient, values) in gradient.each_mut().into_iter().zip(values.each()) {
            clip(gradient, phase.largest_norm);
            for (entry, value) in gradient.iter_mut().zip(values) {
                *entry += phase.weight_decay * value;
            }
        }
        state.optimization.step(gradient, &phase.rates_at(step));
        (loss, values)
    }

    /// A generation; returns the least loss, and the values at the mean.
    fn evolve(
        &self,
        state: &mut State,
        at: OuterStep<'_>,
        population: usize,
    ) -> (f32, Groups<Vec<f32>>) {
        let OuterStep { phase, step, .. } = at;
        let evolution = state.run.evolution.get_or_insert_with(|| {
            Evolution::new(state.optimization.values(), phase.rates.clone())
        });
        let mut random = RandomStreams { seed: self.seed }.slot(at, 0);
        let loss = evolution.advance(population, &mut random, |candidates| {
            let losses = candidates.par_iter();
            losses
                .map(|values| self.objective.fitness(values, phase))
                .collect()
        });
        let values = evolution.values();
        // Where the phase ends it hands on its mean, as one of gradients does.
        if step + 1 == phase.steps {
            state.run.evolution = None;
            state.optimization = Optimization::new(values.clone());
        }
        (loss, values)
    }

    /// Puts meta-parameters where a phase begins.
    fn enter(&self, state: &mut State, at: OuterStep<'_>) {
        let phase = at.phase;
        match (phase.start, &state.run.best) {
            (Start::Guess(guess), _) => state.restart(self.objective.first_values(guess)),
            (Start::Best, Some(best)) => state.restart(best.values.clone()),
            (Start::BestInOrder, Some(best)) => {
                state.restart(self.objective.in_order(best.values.clone()));
            }
            _ => {}
        }
        let mut values = state.optimization.values();
        let known = values.pattern.len() / 3;
        if phase.samples > known {
            let added = 3 * (phase.samples - known);
            let again = values.pattern.iter().copied().cycle();
            let more: Vec<f32> = match phase.added {
                AddedSamples::Sobol => {
                    let sobol = sobol_valid(phase.samples, self.seed as u32);
                    sobol.into_iter().skip(known).flat_map(logits_of).collect()
                }
                AddedSamples::Repeated => again.take(added).collect(),
                AddedSamples::Jittered => {
                    let mut random = RandomStreams { seed: self.seed }.slot(at, JITTER_SLOT);
                    let beside = again.map(|logit| logit + JITTER * standard_normal(&mut random));
                    beside.take(added).collect()
                }
            };
            values.pattern.extend(more);
            // What has too few samples is no recipe, however good.
            let loss = match phase.keep {
                Selection::Fittest => Some(self.objective.fitness(&values, phase)),
                Selection::BestValidation => Some(self.objective.judge(&values)),
                _ => None,
            };
            if let Some(loss) = loss {
                let values = values.clone();
                state.run.best = Some(Best { loss, values });
            }
            state.restart(values);
        }
        if phase.keep == Selection::BestEpoch {
            // Losses of other phases are of other patterns.
            state.run.best = None;
            state.run.epoch = 0.0;
        }
    }

    /// Takes another random pattern.
    fn guess_pattern(&self, state: &mut State, phase: &Phase, guess: usize) {
        let seed = self.seed.wrapping_add((guess as u64 + 1) << 32);
        let pattern = uniform_valid(phase.samples, seed);
        let mut values = state.optimization.values();
        values.pattern = pattern.into_iter().flat_map(logits_of).collect();
        state.restart(values);
    }
}

/// Scales a gradient down to a norm; one that is not finite becomes 0.
fn clip(gradient: &mut [f32], largest_norm: f32) {
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
        norm if norm > largest_norm => largest_norm / norm,
        _ => return,
    };
    for value in gradient {
        *value *= scale;
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use glimpse_core::model::ModelKind;

    use super::*;
    use crate::meta::plan::{Effort, Schedule};

    /// Its losses are made up, a list for each phase; its pattern goes ever further.
    struct Toy {
        losses: [&'static [f32]; 2],
        seen: Mutex<Vec<Vec<f32>>>,
    }

    impl MetaObjective for Toy {
        fn first_values(&self, _: u64) -> Groups<Vec<f32>> {
            Groups {
                pattern: vec![-1.0; 3],
                ..Groups::default()
            }
        }
        fn gradient(
            &self,
            values: &Groups<Vec<f32>>,
            at: OuterStep<'_>,
        ) -> (f32, Groups<Vec<f32>>) {
            self.seen.lock().unwrap().push(values.pattern.clone());
            let gradient = Groups {
                pattern: vec![1.0; values.pattern.len()],
                ..Groups::default()
            };
            (self.losses[at.number][at.step], gradient)
        }
        fn fitness(&self, values: &Groups<Vec<f32>>, _: &Phase) -> f32 {
            self.judge(values)
        }
        fn judge(&self, _: &Groups<Vec<f32>>) -> f32 {
            0.5
        }
        fn expected(&self, values: &Groups<Vec<f32>>) -> Expected {
            Expected::new(self.judge(values), [0.0; 2].into_iter())
        }
    }

    const IDENTITY: RunIdentity = RunIdentity {
        model: ModelKind::Linear,
        samples: 2,
        schedule: glimpse_core::recipe::Schedule::Paper,
        effort: glimpse_core::recipe::Effort::Long,
        parts: glimpse_core::recipe::Parts::All,
        seed: 0,
        materials: 2,
        options_digest: 0,
        materials_digest: 0,
    };

    /// Two phases of so many steps, with one sample and with two.
    fn run(toy: &Toy, steps: usize, mut tell: impl FnMut(&Progress) + Send) -> Outcome {
        let mut plan = Plan::new(Schedule::Paper, Effort::Long, ModelKind::Linear, 2, 2);
        plan.phases.remove(0);
        for phase in &mut plan.phases {
            phase.steps = steps;
        }
        let run = Run {
            objective: toy,
            plan: &plan,
            identity: IDENTITY,
            seed: 0,
            checkpoints: None,
            stage: 0,
        };
        let outcome = run.finish(&mut |progress| {
            tell(progress);
            ControlFlow::Continue(())
        });
        outcome.unwrap()
    }

    #[test]
    fn the_best_epoch_is_kept_and_samples_are_added_to_it() {
        let toy = Toy {
            losses: [
                &[3.0, 3.0, 1.0, 1.5, 0.0, 4.0],
                &[9.0, 9.0, 5.0, 5.0, 6.0, 6.0],
            ],
            seen: Mutex::default(),
        };
        let mut bests = Vec::new();
        let best = run(&toy, 6, |progress| bests.push(progress.best));
        let seen = toy.seen.into_inner().unwrap();
        // An epoch has two steps; what it comes to is what the next one begins with.
        assert_eq!(seen[6][..3], seen[4]);
        assert_eq!(seen[6].len(), 6);
        assert_eq!(best.values.pattern, seen[10]);
        assert_eq!(best.expected.loss, 0.5);
        // The barrier is paid in none of them.
        assert_eq!(bests[..4], [None, Some(3.0), Some(3.0), Some(1.25)]);
        assert_eq!(bests[6..8], [None, Some(9.0)]);
        assert_eq!(bests[11], Some(5.0));
    }

    #[test]
    fn a_loss_that_is_no_number_does_not_enter_the_mean_that_is_shown() {
        let toy = Toy {
            losses: [&[f32::NAN, 3.0, f32::NAN, 4.0], &[4.0, f32::NAN, 4.0, 4.0]],
            seen: Mutex::default(),
        };
        let mut losses = Vec::new();
        let best = run(&toy, 4, |progress| losses.push(progress.loss));
        assert_eq!(losses[..3], [0.0, 3.0, 3.0]);
        assert!(losses[3..].iter().all(|loss| (3.0..4.0).contains(loss)));
        // An epoch with such a loss in it is none to keep.
        assert_eq!(best.values.pattern.len(), 6);
    }
}
