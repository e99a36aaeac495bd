//! Schedules: what is trained when, for how long, at which rates.

mod changes;
mod joint;
mod linear;
mod paper;
mod small;

use glimpse_core::model::ModelKind;
use rand_chacha::ChaCha8Rng;

pub use self::changes::Known;
use super::gradient::SampleOctets;
pub use super::phase::{Added, InnerSamples, Keep, Phase, Search, Start, StepSizeForm};

/// How the parts of a recipe are trained.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Schedule {
    /// Start, step sizes and pattern together, for the n at hand, from the best of several tries.
    Joint,
    /// The paper's two stages: initialisation and step sizes on fresh samples, then the pattern
    /// alone.
    Paper,
}

/// How long to train.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Effort {
    /// Seconds: to try things out. (Schedule paper: 1/100 of the paper's steps.)
    Quick,
    /// Minutes: for use. (Schedule paper: 1/10.)
    Standard,
    /// An hour or so: for the last few per cent. (Schedule paper: all of the paper's steps.)
    Long,
}

/// What the losses of materials count for in their mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weighing {
    /// As much as any other, as in the paper.
    Equal,
    /// About as much as they are a share of what black, f = 0, loses: a dark material, whose loss
    /// is never large, has a shade of its own to be learned too, and in pictures it shows.
    Relative,
}

impl Weighing {
    /// What a material counts for, on which black has this loss.
    #[must_use]
    pub fn weight(self, loss_of_black: f32) -> f32 {
        /// Below it the loss of black is as good as none.
        const DARK: f32 = 0.005;
        /// About the mean loss of black: weights are about 1.
        const USUAL: f32 = 0.06;
        match self {
            Self::Equal => 1.0,
            Self::Relative => (USUAL + DARK) / (loss_of_black + DARK),
        }
    }

    /// What samples that were just drawn count for.
    #[must_use]
    pub fn weight_of(self, samples: &SampleOctets<'_>) -> f32 {
        match self {
            Self::Equal => 1.0,
            Self::Relative => self.weight(samples.loss_of_black()),
        }
    }
}

/// A whole training run, but for the materials.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The phases, in order. The last one trains for the n at hand.
    pub phases: Vec<Phase>,
    /// How many materials there are to train on.
    pub tasks: usize,
    /// Where initial parameters begin.
    pub first_guess: fn(ModelKind, &mut ChaCha8Rng) -> Vec<f32>,
    /// What is optimized for the step sizes.
    pub step_size_form: StepSizeForm,
    /// The step size that all parameters begin with.
    pub first_step_size: f32,
    /// What the losses of materials count for in their mean.
    pub weighing: Weighing,
    /// Start and step sizes that are known already, instead of the first guess.
    pub known: Option<Known>,
}

impl Plan {
    /// The plan for a model and a number of samples; `tasks` is the number of materials.
    #[must_use]
    pub fn new(
        schedule: Schedule,
        effort: Effort,
        model: ModelKind,
        samples: usize,
        tasks: usize,
    ) -> Self {
        match schedule {
            Schedule::Joint if model == ModelKind::Linear => linear::plan(effort, samples, tasks),
            Schedule::Joint if model == ModelKind::Neural => joint::plan(effort, samples, tasks),
            Schedule::Joint => small::plan(effort, samples, tasks),
            Schedule::Paper => paper::plan(effort, model, samples, tasks),
        }
    }

    /// Outer steps of all phases.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.phases.iter().map(|phase| phase.steps).sum()
    }

    /// The phase, and the step in it, that come after so many outer steps; None at the end.
    #[must_use]
    pub fn at(&self, done: usize) -> Option<(usize, usize)> {
        let mut step = done;
        for (index, phase) in self.phases.iter().enumerate() {
            if step < phase.steps {
                return Some((index, step));
            }
            step -= phase.steps;
        }
        None
    }
}

/// Patterns of more samples are doubled from those.
const UNDOUBLED: usize = 16;

/// How many samples there are after each doubling, from `first` until there are those `wanted`.
fn doubled(first: usize, wanted: usize) -> impl Iterator<Item = usize> {
    std::iter::successors(Some(first), move |n| {
        (*n < wanted).then_some((2 * n).min(wanted))
    })
    .skip(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_paper_s_stages() {
        let tasks = 80;
        let plan = Plan::new(Schedule::Paper, Effort::Long, ModelKind::Neural, 5, tasks);
        let [first, guesses, patterns @ ..] = &plan.phases[..] else {
            panic!("{plan:?}");
        };
        assert_eq!(
            (first.steps, first.inner),
            (800_000, InnerSamples::Fresh(512))
        );
        assert_eq!((guesses.steps, guesses.samples), (50 * tasks, 1));
        let samples: Vec<_> = patterns.iter().map(|phase| phase.samples).collect();
        assert_eq!(samples, [1, 2, 4, 5]);
        for phase in patterns {
            assert_eq!((phase.start, phase.keep), (Start::Best, Keep::BestEpoch));
            assert_eq!(phase.steps, 500 * tasks);
            assert!(phase.rates_at(0).pattern == 5e-4 && phase.rates.initial == 0.0);
            let last = phase.rates_at(phase.steps).pattern;
            assert!((last - 1e-4).abs() < 1e-9, "{last}");
        }
        assert_eq!(plan.at(0), Some((0, 0)));
        assert_eq!(plan.at(800_000), Some((1, 0)));
        assert_eq!(plan.at(plan.steps() - 1), Some((5, 500 * tasks - 1)));
        assert_eq!(plan.at(plan.steps()), None);
        assert_eq!(plan.clone().without_pattern(5).phases.len(), 1);

        // Both stages once more: the first one on the pattern, and no guesses.
        let [.., again, pattern] = &plan.clone().twice().phases[..] else {
            panic!("{plan:?}");
        };
        assert_eq!(
            (again.start, again.inner),
            (Start::Best, InnerSamples::Pattern)
        );
        assert_eq!((again.steps, again.samples), (800_000, 5));
        assert!(again.rates.initial > 0.0 && again.rates.pattern == 0.0);
        assert_eq!(
            (pattern.start, pattern.keep),
            (Start::Best, Keep::BestEpoch)
        );
        assert!(pattern.rates.initial == 0.0 && pattern.rates.pattern > 0.0);

        let known = Known {
            initial: vec![1.0],
            step_sizes: vec![0.5],
        };
        let alone = plan.pattern_only(known);
        assert_eq!(alone.phases.len(), 5);
        assert!(alone.phases.iter().all(|phase| phase.rates.initial == 0.0));

        // Nothing of Linear is learned but the pattern; a tenth of the steps.
        let plan = Plan::new(
            Schedule::Paper,
            Effort::Standard,
            ModelKind::Linear,
            1,
            tasks,
        );
        let steps: Vec<_> = plan.phases.iter().map(|phase| phase.steps).collect();
        assert_eq!(steps, [50 * tasks, 50 * tasks]);
    }

    #[test]
    fn the_loss_of_a_dark_material_counts_for_more_but_not_without_limit() {
        let weights = [0.0, 0.005, 0.06, 0.5].map(|black| Weighing::Relative.weight(black));
        assert!(weights.is_sorted_by(|a, b| a > b));
        assert!((weights[2] - 1.0).abs() < 1e-6 && weights[0] < 20.0);
        assert_eq!(Weighing::Equal.weight(0.001), 1.0);
    }

    #[test]
    fn many_samples_of_neural_come_from_doubling() {
        let plan = Plan::new(Schedule::Joint, Effort::Quick, ModelKind::Neural, 100, 64);
        let few = Plan::new(
            Schedule::Joint,
            Effort::Quick,
            ModelKind::Neural,
            UNDOUBLED,
            64,
        );
        let samples: Vec<_> = plan.phases.iter().map(|phase| phase.samples).collect();
        let (same, doubled) = samples.split_at(few.phases.len());
        assert!(same.iter().all(|samples| *samples == UNDOUBLED));
        assert_eq!(doubled, [32, 64, 100]);
        assert!(few.phases.iter().all(|phase| phase.samples == UNDOUBLED));
    }
}
