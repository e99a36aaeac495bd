//! The paper's tables and figures, one file each.
//!
//! An experiment requests recipes and evaluations from the [`Store`] and arranges them as [`Findings`]: tables, plots
//! and pictures. The store trains and evaluates.

mod additional;
mod bases;
mod case;
mod convergence;
mod curves;
mod findings;
mod frontier;
mod glossiness;
mod importance;
mod losses;
mod paper;
mod patterns;
mod per_material;
mod plots;
mod repeated_stages;
mod robustness;
mod run_mode;
mod run_settings;
mod same_samples;
mod seeds;
mod spheres;
mod store;
mod stored;
mod subsets;
mod tables;

use std::time::Instant;

use anyhow::Context;
use clap::ValueEnum;
use glimpse_trainer::report::Page;

use case::value_name;
pub(crate) use findings::Findings;
pub(crate) use run_mode::{CellPlan, PlannedCell, RunMode, TargetCell};
pub(crate) use store::{Settings, Store, TestSet};
use tables::{
    METRICS, MODELS, PAPER_METRICS, PaperMetrics, SAMPLES, SCHEDULE, metric_cells, metric_columns,
    metric_values, powers_of_two, title,
};

/// A table or figure of the paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Experiment {
    /// The main table: all methods for all models at n = 8, with all metrics.
    SameSamples,
    /// The loss at n = 8 for all models, methods and schedules, and the loss of black (f = 0).
    Losses,
    /// The number of samples that other methods need to match the quality of Ours at n = 8.
    SameQuality,
    /// Loss and DSSIM over n, with the optimum as a dot.
    Curves,
    /// The loss of each material, sorted.
    PerMaterial,
    /// Materials of --additional: Linear at n = 2, and Meta or NJR15 against Ours at n = 8.
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
        matches!(self, Self::Additional | Self::Frontier | Self::All)
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

    /// Returns true if the experiment trains with the paper's schedule.
    pub(crate) fn uses_paper_schedule(self) -> bool {
        matches!(self, Self::Losses | Self::RepeatedStages | Self::All)
    }

    /// Returns the name on the command line, which is also the folder's name.
    pub(crate) fn name(self) -> String {
        value_name(self)
    }

    /// Runs the experiment and returns its findings. Writes them only in [`RunMode::All`].
    pub(crate) fn run(self, store: &Store<'_>, max_samples: usize) -> anyhow::Result<Findings> {
        let begin = Instant::now();
        let findings = match self {
            Self::SameSamples => same_samples::run(store),
            Self::Losses => losses::run(store),
            Self::SameQuality => curves::same_quality(store, max_samples),
            Self::Curves => curves::run(store, max_samples),
            Self::PerMaterial => per_material::run(store),
            Self::Additional => additional::run(store),
            Self::Robustness => robustness::run(store),
            Self::Seeds => seeds::run(store),
            Self::RepeatedStages => repeated_stages::run(store),
            Self::Convergence => convergence::run(store),
            Self::Importance => importance::run(store, max_samples),
            Self::Subsets => subsets::run(store),
            Self::Bases => bases::run(store),
            Self::Frontier => frontier::run(store, max_samples),
            Self::Patterns => patterns::run(store),
            Self::Teaser => spheres::teaser(store),
            Self::Increasing => spheres::increasing(store, max_samples),
            Self::All => anyhow::bail!("all is not a single experiment: expand it first"),
        }?;
        if !matches!(store.mode, RunMode::All) {
            return Ok(findings);
        }
        findings.write(&self.name(), &store.settings.out, begin.elapsed())?;
        Ok(findings)
    }
}

/// Writes the index page of all experiments in the output folder.
pub(crate) fn write_index(settings: &Settings) -> anyhow::Result<()> {
    let mut page = Page::new("Glimpse: the paper's experiments").paragraph(
        "Reproduction of Learning to Learn and Sample BRDFs (Liu, Fischer, Ritschel 2023). The best \
         of the compared numbers is marked. An arrow shows whether higher or lower values are better. Click \
         a sphere to enlarge its row. The folder of this page has the tables as CSV and JSON, and drawings \
         as SVG.",
    );
    for experiment in Experiment::All.expand(true) {
        page = page
            .section(&settings.out.join(experiment.name()))
            .with_context(|| format!("cannot read the section of {}", experiment.name()))?;
    }
    Ok(page.write(&settings.out)?)
}
