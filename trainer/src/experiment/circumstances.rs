//! Settings that every table, picture and page states.

use std::fmt;

use glimpse_training::meta::plan::{Effort, Schedule};
use serde_json::{Value, json};

use super::case::name_of;

/// A set of materials: its source and size.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct MaterialSet {
    /// The source's name without the directories that lead to it.
    pub(crate) source: String,
    /// The number of materials.
    pub(crate) materials: usize,
}

/// Settings under which figures were found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct RunSettings {
    /// Schedules that trained, each with its effort.
    pub(crate) trainings: Vec<(Schedule, Effort)>,
    /// Seed of all random numbers.
    pub(crate) seed: u64,
    /// Seeds that methods with random directions are averaged over.
    pub(crate) seeds: u64,
    /// Materials that were trained on.
    pub(crate) training_set: MaterialSet,
    /// Materials that were judged.
    pub(crate) test_set: MaterialSet,
}

impl RunSettings {
    /// The same as data.
    pub(super) fn to_json(&self) -> Value {
        let trainings = self.trainings.iter().map(|(schedule, effort)| {
            json!({"schedule": name_of(*schedule), "effort": name_of(*effort)})
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
            let before = if index == 0 { "Schedule" } else { ", schedule" };
            let (name, length) = (name_of(*schedule), name_of(*effort));
            write!(f, "{before} {name} at effort {length}")?;
            match (schedule, effort.divisor_of_the_paper_s_steps()) {
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
