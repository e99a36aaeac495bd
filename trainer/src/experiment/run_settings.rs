//! Settings that are listed in every caption.

use std::fmt;

use glimpse_training::meta::plan::{Effort, Schedule};
use serde_json::{Value, json};

use super::case::value_name;

/// A set of materials: its source and size.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct MaterialSet {
    /// Name of the source without its directories.
    pub(crate) source: String,
    /// Number of materials.
    pub(crate) materials: usize,
}

/// The settings of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct RunSettings {
    /// Training schedules, each with its effort.
    pub(crate) trainings: Vec<(Schedule, Effort)>,
    /// Seed of all random numbers.
    pub(crate) seed: u64,
    /// Number of seeds that methods with random directions are averaged over.
    pub(crate) seeds: u64,
    /// Materials for training.
    pub(crate) training_set: MaterialSet,
    /// Materials for evaluation.
    pub(crate) test_set: MaterialSet,
}

impl RunSettings {
    /// Converts the settings to JSON.
    pub(super) fn to_json(&self) -> Value {
        let trainings = self.trainings.iter().map(|(schedule, effort)| {
            json!({"schedule": value_name(*schedule), "effort": value_name(*effort)})
        });
        let set = |set: &MaterialSet| json!({"source": set.source, "materials": set.materials});
        json!({
            "trainings": trainings.collect::<Vec<_>>(),
            "seed": self.seed,
            "seeds_of_random_methods": self.seeds,
            "training_set": set(&self.training_set),
            "test_set": set(&self.test_set),
        })
    }
}

impl fmt::Display for MaterialSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({} materials)", self.source, self.materials)
    }
}

impl fmt::Display for RunSettings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, (schedule, effort)) in self.trainings.iter().enumerate() {
            let prefix = if index == 0 { "Schedule" } else { ", schedule" };
            let (name, effort_name) = (value_name(*schedule), value_name(*effort));
            write!(f, "{prefix} {name} at effort {effort_name}")?;
            match (schedule, effort.paper_step_divisor()) {
                (Schedule::Paper, 1) => write!(f, " (all of the paper's steps)")?,
                (Schedule::Paper, divisor) => write!(f, " (1/{divisor} of the paper's steps)")?,
                (Schedule::Joint | Schedule::Prior, _) => {}
            }
        }
        let Self {
            seed,
            seeds,
            training_set,
            test_set,
            ..
        } = self;
        write!(
            f,
            "; seed {seed}, {seeds} seeds of random directions. Training set: {training_set}. Test \
             set: {test_set}."
        )
    }
}
