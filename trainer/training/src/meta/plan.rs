//! The choices of a training run: schedule, effort and trained parts.

use serde::{Deserialize, Serialize};

/// The training schedule.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Schedule {
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
    /// 10 to 120 seconds on two cores, for experiments; 1/100 of the paper's steps with schedule paper.
    Quick,
    /// 1 to 5 minutes on two cores, for regular use; 1/10 of the paper's steps with schedule paper.
    Standard,
    /// 15 minutes to hours, for a loss a few percent lower; all of the paper's steps with schedule paper.
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

/// Pretrained initial parameters and step sizes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PretrainedInit {
    /// The initial parameters, theta_0.
    pub initial: Vec<f32>,
    /// The step sizes, alpha.
    pub step_sizes: Vec<f32>,
}

/// The parts of a recipe that are trained. Schedule prior has no such choice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TrainedParts {
    /// Initial parameters, step sizes and pattern.
    All,
    /// All parts, then initial parameters and step sizes again, then the pattern again.
    AllTwice,
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
            Self::PatternOnly => "pattern-only",
        }
    }
}
