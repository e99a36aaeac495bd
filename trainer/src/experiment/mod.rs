//! The paper's tables and figures, one file each.
//!
//! An experiment asks the [`Store`] for recipes and judgments and turns them into
//! [`Findings`]: tables, plots, pictures. It draws, trains and judges nothing by itself.

mod additional;
mod again;
mod bases;
mod case;
mod circumstances;
mod convergence;
mod curves;
mod findings;
mod importance;
mod kept;
mod losses;
mod needed;
mod paper;
mod patterns;
mod per_material;
mod plots;
mod robustness;
mod same_samples;
mod seeds;
mod spheres;
mod store;
mod subsets;
mod tables;

use std::time::Instant;

use anyhow::Context;
use clap::ValueEnum;
use glimpse_trainer::report::Page;

use case::name_of;
pub(crate) use findings::Findings;
pub(crate) use needed::{Needed, Notes, Purpose, Wanted};
pub(crate) use store::{Settings, Store, TestSet};
use tables::{
    METRICS, MODELS, PAPER_METRICS, PaperMetrics, SAMPLES, SCHEDULE, cells_beside_the_paper_s,
    columns_beside_the_paper_s, doublings, metrics, title,
};

/// A table or figure of the paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Experiment {
    /// The main table: all methods for all models at n = 8, by all four metrics.
    SameSamples,
    /// The loss at n = 8 of all models by all methods and schedules, and of black.
    Losses,
    /// How many more samples other methods need for what Ours does with 8.
    SameQuality,
    /// Loss and DSSIM by n, with the optimum as a dot.
    Curves,
    /// The loss of each material, sorted.
    PerMaterial,
    /// Other sources (--additional): Linear at n = 2, Meta or NJR15 against Ours at n = 8.
    Additional,
    /// Two or four of eight learned samples replaced by random ones.
    Robustness,
    /// Five trainings with seeds of their own: the spread.
    Seeds,
    /// Both stages trained once more.
    Again,
    /// 20 steps by each method, then 10,000 more on random samples.
    Convergence,
    /// Samples drawn by the importance of the mean BRDF.
    Importance,
    /// Patterns trained and judged on diffuse and on glossy materials.
    Subsets,
    /// Linear with 5 components and with 240.
    Bases,
    /// The learned patterns, drawn.
    Patterns,
    /// Spheres of some materials by each method, Neural at n = 64.
    Teaser,
    /// Spheres of a glossy material by each model, for growing n.
    Increasing,
    /// All of them, but for `additional` where no --additional is given.
    All,
}

impl Experiment {
    /// The experiments that this one stands for.
    pub(crate) fn each(self, additional: bool) -> Vec<Self> {
        match self {
            Self::All => Self::value_variants()
                .iter()
                .copied()
                .filter(|each| *each != Self::All && (additional || *each != Self::Additional))
                .collect(),
            one => vec![one],
        }
    }

    /// True if it judges on further materials than those of the test set.
    pub(crate) fn evaluates_additional(self) -> bool {
        matches!(self, Self::Additional | Self::All)
    }

    /// True if n grows in it.
    pub(crate) fn grows(self) -> bool {
        matches!(
            self,
            Self::SameQuality | Self::Curves | Self::Importance | Self::Increasing | Self::All
        )
    }

    /// True if it trains by the paper's schedule.
    pub(crate) fn trains_as_the_paper(self) -> bool {
        matches!(self, Self::Losses | Self::Again | Self::All)
    }

    /// As on the command line; also the folder's name.
    pub(crate) fn name(self) -> String {
        name_of(self)
    }

    /// Makes the experiment, writes it down and returns what it found; where the store is for listing, or
    /// for one thing only, nothing is written but that.
    pub(crate) fn run(self, store: &Store<'_>, most_samples: usize) -> anyhow::Result<Findings> {
        let begin = Instant::now();
        let findings = match self {
            Self::SameSamples => same_samples::run(store),
            Self::Losses => losses::run(store),
            Self::SameQuality => curves::same_quality(store, most_samples),
            Self::Curves => curves::run(store, most_samples),
            Self::PerMaterial => per_material::run(store),
            Self::Additional => additional::run(store),
            Self::Robustness => robustness::run(store),
            Self::Seeds => seeds::run(store),
            Self::Again => again::run(store),
            Self::Convergence => convergence::run(store),
            Self::Importance => importance::run(store, most_samples),
            Self::Subsets => subsets::run(store),
            Self::Bases => bases::run(store),
            Self::Patterns => patterns::run(store),
            Self::Teaser => spheres::teaser(store),
            Self::Increasing => spheres::increasing(store, most_samples),
            Self::All => anyhow::bail!("all is not one experiment"),
        }?;
        if !matches!(store.purpose, Purpose::Everything) {
            return Ok(findings);
        }
        findings.write(&self.name(), &store.settings.out, begin.elapsed())?;
        Ok(findings)
    }
}

/// Writes the page over all experiments that the folder holds.
pub(crate) fn write_index(settings: &Settings) -> anyhow::Result<()> {
    let mut page = Page::new("Glimpse: the paper's experiments").paragraph(
        "Learning to Learn and Sample BRDFs (Liu, Fischer, Ritschel 2023), made again. The best \
         of what competes is marked; arrows say which way is better; click a sphere to enlarge \
         its row. Tables lie beside this page as CSV and JSON, drawings as SVG.",
    );
    for experiment in Experiment::All.each(true) {
        page = page
            .part(&settings.out.join(experiment.name()))
            .with_context(|| format!("cannot read what {} left", experiment.name()))?;
    }
    Ok(page.write(&settings.out)?)
}
