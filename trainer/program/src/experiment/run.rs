//! An experiment, and the presentation of its results.

use std::path::Path;

use anyhow::ensure;

use super::case::Case;
use super::paper::Published;
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
    /// Help text, and title of the page.
    pub(crate) title: &'static str,
    pub(super) cases: fn(&Scope) -> Vec<Case>,
    /// The evaluated test sets.
    pub(super) sets: Sets,
    pub(super) published: &'static [Published],
    /// True if records state the seconds of a scan.
    pub(super) timed: bool,
    /// Converts the records of a test set to those that the views show.
    pub(super) derive: fn(&Store<'_>, &TestSet<'_>, Vec<Record>) -> Vec<Record>,
    pub(super) views: &'static [View],
}

/// The sizes that the cases of an experiment depend on.
pub(crate) struct Scope {
    /// Largest n of experiments with several n.
    pub(crate) max_samples: usize,
    /// Number of materials to train on.
    pub(crate) training_count: usize,
}

impl Scope {
    /// Returns 1, 2, 4, ... up to the largest n.
    pub(super) fn samples(&self) -> Vec<usize> {
        let powers = std::iter::successors(Some(1), |n| Some(2 * n));
        powers.take_while(|n| *n <= self.max_samples).collect()
    }
}

/// The test sets that an experiment evaluates on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sets {
    /// Those of the option --test.
    Test,
    /// Those of the option --additional.
    Additional,
    All,
}

/// An experiment without cases.
pub(super) const NEW: Experiment = Experiment {
    name: "",
    title: "",
    cases: |_| Vec::new(),
    sets: Sets::Test,
    published: &[],
    timed: false,
    derive: |_, _, records| records,
    views: &[],
};

impl Experiment {
    /// Returns true if the experiment also evaluates on materials of --additional.
    pub(crate) fn evaluates_additional(&self) -> bool {
        self.sets != Sets::Test
    }

    /// Returns true if the experiment varies n up to --most-samples.
    pub(crate) fn varies_samples(&self) -> bool {
        let [one, two] = [1, 2].map(|max_samples| {
            (self.cases)(&Scope {
                max_samples,
                training_count: 1,
            })
        });
        one != two
    }

    /// Returns the test sets, each with the suffix of its files.
    fn sets<'m>(&self, store: &Store<'m>) -> anyhow::Result<Vec<(String, &'m TestSet<'m>)>> {
        let suffix = |set: &TestSet<'_>| format!("-{}", set.label);
        let (test, additional) = store.sets.split_at(1);
        let additional = additional.iter().map(|set| (suffix(set), set));
        let test = test.iter().map(|set| (String::new(), set));
        let sets: Vec<_> = match self.sets {
            Sets::Test => test.collect(),
            Sets::Additional => additional.collect(),
            Sets::All => test.chain(additional).collect(),
        };
        ensure!(
            !sets.is_empty(),
            "the experiment additional needs materials of other sources: give --additional with, for example, the eight \
             materials of Nielsen et al. or the RGL database"
        );
        Ok(sets)
    }

    /// Writes the results into a folder. Trains and evaluates what is not stored. Returns the tables with their names.
    pub(crate) fn write(
        &self,
        store: &Store<'_>,
        scope: &Scope,
        folder: &Path,
    ) -> anyhow::Result<Vec<(String, Table)>> {
        let cases = (self.cases)(scope);
        let mut output = Output {
            folder,
            page: Page::new(self.title),
            tables: Vec::new(),
        };
        output.page.paragraph(INTRODUCTION);
        for (suffix, set) in self.sets(store)? {
            let records = evaluate(store, set, &cases, self.published, self.timed)?;
            let table = long_table(&records);
            output.write(&format!("evaluations{suffix}.csv"), &table.to_csv())?;
            let settings = store.describe_settings(set, &cases);
            let records = (self.derive)(store, set, records);
            for view in self.views {
                view.show(store, &records, [&suffix, &settings], &mut output)?;
            }
        }
        output.page.write(folder)?;
        Ok(output.tables)
    }
}
