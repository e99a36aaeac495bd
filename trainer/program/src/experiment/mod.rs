//! The paper's tables and figures.
//!
//! An experiment is data: cases, and views of their results. The [`Store`] trains and evaluates the cases. The results are
//! one long table, which the views show as tables, plots and pictures.

mod case;
mod definitions;
mod derived;
mod glossiness;
mod paper;
mod record;
mod run;
mod store;
mod view;

use clap::builder::PossibleValue;

use definitions::EXPERIMENTS;
use run::Sets;

pub(crate) use run::Experiment;
pub(crate) use store::{Settings, Store, TestSet};

/// The name of all experiments together.
const ALL: &str = "all";

/// Returns the names of all experiments for the command line, with help.
pub(crate) fn names() -> Vec<PossibleValue> {
    let names = EXPERIMENTS.iter();
    let names = names.map(|one| PossibleValue::new(one.name).help(&*one.presentation().title));
    let all = PossibleValue::new(ALL);
    let all = all.help("All experiments; `additional` only with --additional");
    names.chain([all]).collect()
}

/// Returns the experiments of a name.
pub(crate) fn named(name: &str, has_additional: bool) -> Vec<&'static Experiment> {
    let is_selected = |experiment: &&Experiment| {
        experiment.name == name
            || name == ALL && (has_additional || experiment.presentation().sets != Sets::Additional)
    };
    EXPERIMENTS.iter().filter(is_selected).collect()
}
