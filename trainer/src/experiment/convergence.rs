//! 20 steps of each method, then many more on random samples (paper, "Convergence").

use glimpse_core::model::ModelKind;
use glimpse_trainer::report::{Cell, Column, Compare, Highlight, Table};

use super::case::{Approach, Case};
use super::findings::Findings;
use super::store::Store;
use super::{SCHEDULE, paper};

/// Number of samples of the first 20 steps with learned methods.
const LEARNED_SAMPLES: usize = 32;
/// Number of samples of the first 20 steps with Random.
const RANDOM_SAMPLES: usize = 512;
/// Number of further steps.
const REFINEMENT_STEPS: usize = 10_000;

pub(super) fn run(store: &Store<'_>) -> anyhow::Result<Findings> {
    let mut findings = Findings::new(
        store,
        "Convergence from learned initial parameters",
        &[SCHEDULE],
    );
    let mut rows = Vec::new();
    for approach in Approach::compared(ModelKind::Neural, SCHEDULE) {
        let samples = match approach {
            Approach::Random => RANDOM_SAMPLES,
            _ => LEARNED_SAMPLES,
        };
        let case = Case::new(approach, ModelKind::Neural, samples);
        let before = store.evaluation(&case)?.metrics.loss;
        let name = format!(
            "neural-{}-then-{REFINEMENT_STEPS}",
            approach.name().to_lowercase()
        );
        let after = store.cached_evaluation(store.test, &name, 1, |evaluate| {
            store.with_method(&case, |method| {
                evaluate(&method.clone().with_refinement(REFINEMENT_STEPS))
            })
        })?;
        rows.push(vec![
            Cell::Text(approach.title()),
            Cell::Number(samples as f64),
            Cell::Number(before),
            Cell::Number(after.metrics.loss),
            paper::convergence(approach).map_or(Cell::Missing, Cell::Number),
        ]);
    }
    findings.table(
        "convergence",
        Table {
            caption: format!(
                "Neural: loss after 20 steps, and after {REFINEMENT_STEPS} more on 512 fresh random \
                 samples each"
            ),
            columns: vec![
                Column::text("Method"),
                Column::number("n of the 20 steps", 0, Highlight::None),
                Column::number("after 20 steps", 4, Highlight::Lowest),
                Column::number("after all", 4, Highlight::Lowest),
                Column::number("paper: after all", 4, Highlight::None),
            ],
            rows,
            compare: Compare::WithinColumn,
        },
    );
    Ok(findings)
}
