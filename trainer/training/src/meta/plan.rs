//! A plan: what is trained when, for how long, at which rates. [`schedules`](super::schedules) make
//! them.

use glimpse_core::model::ModelKind;
use glimpse_core::recipe;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use super::phase::{OuterStep, Phase, StepSizeForm};
use glimpse_kernels::samples::SampleOctets;
use glimpse_kernels::sums::loss_of_black;

/// How the parts of a recipe are trained.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Schedule {
    /// Start, step sizes and pattern together, for the n at hand, from the best of several tries.
    Joint,
    /// The paper's two stages: initialization and step sizes on fresh samples, then the pattern
    /// alone.
    Paper,
    /// A learned prior: readings are completed by a small map, which is trained together with where
    /// they are taken; a descent starts from what they are completed to.
    Prior,
}

impl From<Schedule> for recipe::Schedule {
    fn from(schedule: Schedule) -> Self {
        match schedule {
            Schedule::Joint => Self::Joint,
            Schedule::Paper => Self::Paper,
            Schedule::Prior => Self::Prior,
        }
    }
}

/// How long to train.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Effort {
    /// Seconds: for a first look. (Schedule paper: 1/500 of the paper's steps.)
    Brief,
    /// A minute or so: to try things out. (Schedule paper: 1/100.)
    Quick,
    /// Minutes: for use. (Schedule paper: 1/10.)
    Standard,
    /// An hour or so: for the last few per cent. (Schedule paper: all of the paper's steps.)
    Long,
}

impl From<Effort> for recipe::Effort {
    fn from(effort: Effort) -> Self {
        match effort {
            Effort::Brief => Self::Brief,
            Effort::Quick => Self::Quick,
            Effort::Standard => Self::Standard,
            Effort::Long => Self::Long,
        }
    }
}

/// What the losses of materials count for in their mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LossWeights {
    /// As much as any other, as in the paper.
    Equal,
    /// About as much as they are a share of what black, f = 0, loses: a dark material, whose loss
    /// is never large, has a shade of its own to be learned too, and in pictures it shows.
    Relative,
}

impl LossWeights {
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
            Self::Relative => self.weight(loss_of_black(samples)),
        }
    }
}

/// A start and step sizes that are trained already.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PretrainedInit {
    /// theta_0.
    pub initial: Vec<f32>,
    /// alpha.
    pub step_sizes: Vec<f32>,
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
    pub weighing: LossWeights,
    /// Start and step sizes that are known already, instead of the first guess.
    pub known: Option<PretrainedInit>,
}

impl Plan {
    /// Outer steps of all phases.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.phases.iter().map(|phase| phase.steps).sum()
    }

    /// The step that comes after so many outer steps; None at the end.
    #[must_use]
    pub fn at(&self, done: usize) -> Option<OuterStep<'_>> {
        let mut step = done;
        for (number, phase) in self.phases.iter().enumerate() {
            if step < phase.steps {
                return Some(OuterStep {
                    phase,
                    number,
                    step,
                });
            }
            step -= phase.steps;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_loss_of_a_dark_material_counts_for_more_but_not_without_limit() {
        let weights = [0.0, 0.005, 0.06, 0.5].map(|black| LossWeights::Relative.weight(black));
        assert!(weights.is_sorted_by(|a, b| a > b));
        assert!((weights[2] - 1.0).abs() < 1e-6 && weights[0] < 20.0);
        assert_eq!(LossWeights::Equal.weight(0.001), 1.0);
    }
}
