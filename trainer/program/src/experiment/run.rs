//! An experiment, and the presentation of its results.

use std::collections::HashMap;
use std::path::Path;
use std::ptr;
use std::sync::LazyLock;

use anyhow::ensure;
use serde::Deserialize;

use super::case::Case;
use super::paper::published;
use super::record::{Record, evaluate, long_table};
use super::store::{Store, TestSet};
use super::view::{Output, View};
use crate::report::{Page, Table};

/// The first paragraph of every page.
const INTRODUCTION: &str = "An experiment of Learning to Learn and Sample BRDFs (Liu, Fischer, Ritschel 2023). The best of \
    the compared numbers is marked. An arrow shows whether higher or lower values are better. Click a sphere to enlarge \
    its row. The folder of this page has the tables as CSV, evaluations.csv with all numbers, and drawings as SVG.";
/// A table or figure of the paper, as data.
pub(crate) struct Experiment {
    /// Name on the command line, and of the folder.
    pub(crate) name: &'static str,
    /// The cases for a list of n, 1, 2, 4, ...
    pub(super) cases: fn(&[usize]) -> Vec<Case>,
    /// Converts the records of a test set to those that the views show.
    derive: Derive,
}

/// A function of the records of a test set.
type Derive = fn(&Store<'_>, &TestSet<'_>, Vec<Record>) -> Vec<Record>;

/// The presentation of an experiment.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Presentation {
    /// Help text, and title of the page.
    pub(super) title: String,
    /// The evaluated test sets.
    #[serde(default)]
    pub(super) sets: Sets,
    /// True if records state the seconds of a scan.
    #[serde(default)]
    timed: bool,
    views: Vec<View>,
}

/// The presentations of all experiments by their names.
static PRESENTATIONS: LazyLock<HashMap<&str, Presentation>> = LazyLock::new(|| {
    let presentations = serde_json::from_str(include_str!("views.json"));
    presentations.expect("an entry has the fields of a presentation")
});

/// The test sets that an experiment evaluates on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Sets {
    /// Those of the option --test.
    #[default]
    Test,
    /// Those of the option --additional.
    Additional,
    All,
}

impl Experiment {
    /// Creates an experiment whose views show the records of the evaluations.
    pub(super) const fn new(name: &'static str, cases: fn(&[usize]) -> Vec<Case>) -> Self {
        Self {
            name,
            cases,
            derive: |_, _, records| records,
        }
    }

    /// Converts the records that the views show.
    pub(super) const fn deriving(self, derive: Derive) -> Self {
        Self { derive, ..self }
    }

    /// Returns the presentation of the results.
    pub(super) fn presentation(&self) -> &'static Presentation {
        &PRESENTATIONS[self.name]
    }

    /// Returns true if the experiment also evaluates on materials of --additional.
    pub(crate) fn evaluates_additional(&self) -> bool {
        self.presentation().sets != Sets::Test
    }

    /// Returns true if the experiment varies n up to --most-samples.
    pub(crate) fn varies_samples(&self) -> bool {
        (self.cases)(&[1]) != (self.cases)(&[1, 2])
    }

    /// Writes the results into a folder, for n up to `max_samples`. Trains and evaluates what is not stored. Returns the tables
    /// with their names.
    pub(crate) fn write(
        &self,
        store: &Store<'_>,
        max_samples: usize,
        folder: &Path,
    ) -> anyhow::Result<Vec<(String, Table)>> {
        let powers = std::iter::successors(Some(1), |n| Some(2 * n));
        let samples = powers.take_while(|n| *n <= max_samples);
        let cases = (self.cases)(&samples.collect::<Vec<_>>());
        let presentation = self.presentation();
        let mut output = Output {
            folder,
            page: Page::new(&presentation.title),
            tables: Vec::new(),
        };
        output.page.paragraph(INTRODUCTION);
        let sets = match presentation.sets {
            Sets::Test => &store.sets[..1],
            Sets::Additional => &store.sets[1..],
            Sets::All => store.sets,
        };
        ensure!(
            !sets.is_empty(),
            "the experiment additional needs materials of other sources: give --additional with, for example, the eight \
             materials of Nielsen et al. or the RGL database"
        );
        for set in sets {
            let suffix = if ptr::eq(set, &store.sets[0]) {
                String::new()
            } else {
                format!("-{}", set.label)
            };
            let mut records = evaluate(store, set, &cases, presentation.timed)?;
            records.extend(published(self.name, &cases)?);
            let table = long_table(&records);
            output.write(&format!("evaluations{suffix}.csv"), &table.to_csv())?;
            let settings = store.describe_settings(set, &cases);
            let records = (self.derive)(store, set, records);
            for view in &presentation.views {
                view.show(store, &records, [&suffix, &settings], &mut output)?;
            }
        }
        output.page.write(folder)?;
        Ok(output.tables)
    }
}

#[cfg(test)]
mod tests {
    use super::super::definitions::EXPERIMENTS;
    use super::*;

    #[test]
    fn every_experiment_has_a_presentation() {
        let names = EXPERIMENTS.iter().map(|one| one.name);
        let presented = names.filter(|name| !PRESENTATIONS[name].views.is_empty());
        assert_eq!(presented.count(), PRESENTATIONS.len());
    }
}
