//! The paper's tables and figures.
//!
//! An experiment is a [`Plan`]: cases, and their presentation as tables, plots and pictures. The engine lists the
//! trainings and evaluations of a plan, and presents their results as [`Findings`]. The [`Store`] trains and evaluates.

mod any;
mod case;
mod curves;
mod engine;
mod findings;
mod glossiness;
mod paper;
mod pictures;
mod shared;
mod store;
mod studies;
mod tables;

use clap::ValueEnum;

pub(crate) use engine::Plan;
pub(crate) use findings::Findings;
pub(crate) use store::{Settings, Store, TestSet};

/// A table or figure of the paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Experiment {
    /// The main table: all methods for all models at n = 8, with all metrics.
    SameSamples,
    /// The loss at n = 8 for all models and methods, and the loss of black (f = 0).
    Losses,
    /// The number of samples that other methods need to match the quality of the paper's at n = 8.
    SameQuality,
    /// Loss and DSSIM over n, with the optimum as a dot.
    Curves,
    /// The loss of each material, sorted.
    PerMaterial,
    /// Materials of --additional: Linear at n = 2, and Meta or NJR15, the paper's and Glimpse at n = 8.
    Additional,
    /// The loss with two or four of eight learned samples replaced by random ones.
    Robustness,
    /// The spread of the loss over five trainings with different seeds.
    Seeds,
    /// The loss after both training stages are repeated.
    #[value(name = "again")]
    RepeatedStages,
    /// The loss after 20 steps of each method, and after 10,000 more on random samples.
    Convergence,
    /// The loss with samples drawn by importance of the mean BRDF.
    Importance,
    /// The loss of patterns trained and evaluated on diffuse and on glossy materials.
    Subsets,
    /// The metrics of Linear with 5 and with 240 components.
    Bases,
    /// Quality over the seconds of a scan, for patterns trained with and without a budget for motion.
    Frontier,
    /// Losses of readings at the directions of common instruments, without a learned pattern.
    Any,
    /// Drawings of the learned patterns.
    Patterns,
    /// Spheres of some materials with each method, for Neural at n = 64.
    Teaser,
    /// Spheres of a glossy material with each model, for increasing n.
    Increasing,
    /// All experiments; `additional` only with --additional.
    All,
}

impl Experiment {
    /// Returns this experiment, or for `All` the list of all experiments.
    pub(crate) fn expand(self, has_additional: bool) -> Vec<Self> {
        match self {
            Self::All => Self::value_variants()
                .iter()
                .copied()
                .filter(|experiment| match experiment {
                    Self::All => false,
                    Self::Additional => has_additional,
                    _ => true,
                })
                .collect(),
            single => vec![single],
        }
    }

    /// Returns true if the experiment also evaluates on materials of --additional.
    pub(crate) fn evaluates_additional(self) -> bool {
        matches!(
            self,
            Self::Additional | Self::Frontier | Self::Any | Self::All
        )
    }

    /// Returns true if the experiment varies n up to --most-samples.
    pub(crate) fn varies_samples(self) -> bool {
        matches!(
            self,
            Self::SameQuality
                | Self::Curves
                | Self::Importance
                | Self::Increasing
                | Self::Frontier
                | Self::All
        )
    }

    /// Returns the cases of the experiment and their presentation, for n up to `max_samples`.
    pub(crate) fn plan(self, store: &Store<'_>, max_samples: usize) -> anyhow::Result<Plan> {
        Ok(match self {
            Self::SameSamples => tables::same_samples(store),
            Self::Losses => tables::losses(),
            Self::SameQuality => curves::same_quality(max_samples),
            Self::Curves => curves::curves(store, max_samples),
            Self::PerMaterial => tables::per_material(),
            Self::Additional => tables::additional(store)?,
            Self::Robustness => studies::robustness(),
            Self::Seeds => studies::seeds(store),
            Self::RepeatedStages => studies::repeated_stages(),
            Self::Convergence => studies::convergence(),
            Self::Importance => curves::importance(max_samples),
            Self::Subsets => studies::subsets(store)?,
            Self::Bases => tables::bases(store),
            Self::Frontier => curves::frontier(store, max_samples),
            Self::Any => any::any(store),
            Self::Patterns => pictures::patterns(),
            Self::Teaser => pictures::teaser(store),
            Self::Increasing => pictures::increasing(store, max_samples),
            Self::All => anyhow::bail!("all is not a single experiment: expand it first"),
        })
    }
}
