//! A training plan: the phases of a run and its initial values. [`schedules`](super::schedules) create plans.

use glimpse_core::model::ModelKind;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::phase::{OuterStep, Phase, StepSizeEncoding};
use glimpse_kernels::samples::SampleOctets;
use glimpse_kernels::sums::loss_of_black;

/// The training schedule.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Schedule {
    /// Initial parameters, step sizes and pattern, trained together for one number of samples n. Starts from the best
    /// of several initializations.
    Joint,
    /// The two stages of the paper: initial parameters and step sizes on random samples, then the pattern alone.
    Paper,
    /// A learned prior: a small network maps readings to coefficients, and is trained jointly with the pattern. Except
    /// for Linear, a second network maps the coefficients to the start of a descent.
    Prior,
}

impl Schedule {
    /// Returns the name on the command line and in JSON.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Joint => "joint",
            Self::Paper => "paper",
            Self::Prior => "prior",
        }
    }
}

/// The training effort.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Effort {
    /// A few seconds, for a first look; 1/500 of the paper's steps with schedule paper.
    Brief,
    /// About a minute, for experiments; 1/100 of the paper's steps with schedule paper.
    Quick,
    /// Several minutes, for regular use; 1/10 of the paper's steps with schedule paper.
    Standard,
    /// About an hour, for a loss a few percent lower; all of the paper's steps with schedule paper.
    Long,
}

impl Effort {
    /// Returns the name on the command line and in JSON.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Brief => "brief",
            Self::Quick => "quick",
            Self::Standard => "standard",
            Self::Long => "long",
        }
    }
}

/// The weighting of material losses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LossWeights {
    /// Equal weights, as in the paper.
    Equal,
    /// Weights approximately inverse to the loss of black (f = 0) on the material. The loss of a dark material is
    /// always small, but its errors are visible in pictures.
    Relative,
}

impl LossWeights {
    /// Returns the weight of a material, given the loss of black on it.
    #[must_use]
    pub fn weight(self, loss_of_black: f32) -> f32 {
        /// Limits the weight of a black material to (`MEAN` + `OFFSET`) / `OFFSET` = 13.
        const OFFSET: f32 = 0.005;
        /// The approximate mean loss of black over materials, so that a typical weight is 1.
        const MEAN: f32 = 0.06;
        match self {
            Self::Equal => 1.0,
            Self::Relative => (MEAN + OFFSET) / (loss_of_black + OFFSET),
        }
    }

    /// Returns the weight of a task, given its samples.
    #[must_use]
    pub fn task_weight(self, samples: &SampleOctets<'_>) -> f32 {
        match self {
            Self::Equal => 1.0,
            Self::Relative => self.weight(loss_of_black(samples)),
        }
    }
}

/// Pretrained initial parameters and step sizes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PretrainedInit {
    /// The initial parameters, theta_0.
    pub initial: Vec<f32>,
    /// The step sizes, alpha.
    pub step_sizes: Vec<f32>,
}

/// The phases of a training run, and its initial values.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The phases, in order. The last one has the requested number of samples.
    pub phases: Vec<Phase>,
    /// The number of training materials.
    pub tasks: usize,
    /// The function that draws initial parameters.
    pub initial_parameters: fn(ModelKind, &mut ChaCha8Rng) -> Vec<f32>,
    /// The encoding of the step sizes in the meta-parameters.
    pub step_size_encoding: StepSizeEncoding,
    /// The initial step size of all parameters.
    pub initial_step_size: f32,
    /// The weighting of material losses.
    pub loss_weights: LossWeights,
    /// Pretrained initial parameters and step sizes, in place of random ones.
    pub pretrained: Option<PretrainedInit>,
}

impl Plan {
    /// Returns the number of outer steps of all phases.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.phases.iter().map(|phase| phase.steps).sum()
    }

    /// Returns an outer step, given its index over all phases; None after the last step.
    #[must_use]
    pub fn outer_step(&self, index: usize) -> Option<OuterStep<'_>> {
        let mut step = index;
        for (phase_index, phase) in self.phases.iter().enumerate() {
            if step < phase.steps {
                return Some(OuterStep {
                    phase,
                    phase_index,
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
    fn relative_weights_favor_dark_materials() {
        let weights = [0.0, 0.005, 0.06, 0.5].map(|black| LossWeights::Relative.weight(black));
        assert!(weights.is_sorted_by(|a, b| a > b));
        assert!((weights[2] - 1.0).abs() < 1e-6 && weights[0] < 20.0);
        assert_eq!(LossWeights::Equal.weight(0.001), 1.0);
    }
}

/// The parts of a recipe that are trained.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TrainedParts {
    /// Initial parameters, step sizes and pattern.
    All,
    /// All parts, then initial parameters and step sizes again, then the pattern again.
    AllTwice,
    /// Initial parameters and step sizes only, as in the method Meta.
    WithoutPattern,
    /// The pattern only, for pretrained initial parameters and step sizes. (Linear: same as
    /// [`TrainedParts::All`].)
    PatternOnly,
}

impl TrainedParts {
    /// Returns the name in text and JSON.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::All => "all",
            Self::AllTwice => "all-twice",
            Self::WithoutPattern => "without-pattern",
            Self::PatternOnly => "pattern-only",
        }
    }
}
