//! 20 steps by each method, then many more on random samples (paper, "Convergence").

use glimpse_core::model::ModelKind;
use glimpse_trainer::report::{Best, Cell, Column, Compare, Table};

use super::case::{Approach, Case};
use super::findings::Findings;
use super::store::Store;
use super::{SCHEDULE, paper};

/// n of the first 20 steps of the learned methods, and that of Random.
const LEARNED_SAMPLES: usize = 32;
const RANDOM_SAMPLES: usize = 512;
/// Steps after those.
const STEPS: usize = 10_000;

pub(super) fn run(store: &Store<'_>) -> anyhow::Result<Findings> {
    let mut findings = Findings::new(
        store,
        "Does a learned start hinder convergence?",
        &[SCHEDULE],
    );
    let mut rows = Vec::new();
    for approach in Approach::rivals(ModelKind::Neural, SCHEDULE) {
        let samples = match approach {
            Approach::Random => RANDOM_SAMPLES,
            _ => LEARNED_SAMPLES,
        };
        let case = Case::new(approach, ModelKind::Neural, samples);
        let before = store.evaluation(&case)?.scores.loss;
        let name = format!("neural-{}-then-{STEPS}", approach.name().to_lowercase());
        let after = store.kept_evaluation(store.test, &name, 1, |judge| {
            store.with_method(&case, |method| judge(&method.clone().then_steps(STEPS)))
        })?;
        rows.push(vec![
            Cell::Text(approach.title()),
            Cell::Number(samples as f64),
            Cell::Number(before),
            Cell::Number(after.scores.loss),
            paper::convergence(approach).map_or(Cell::Missing, Cell::Number),
        ]);
    }
    findings.table(
        "convergence",
        Table {
            caption: format!(
                "Neural: loss after 20 steps, and after {STEPS} more on 512 fresh random samples \
                 each"
            ),
            columns: vec![
                Column::text("Method"),
                Column::number("n of the 20 steps", 0, Best::None),
                Column::number("after 20 steps", 4, Best::Least),
                Column::number("after all", 4, Best::Least),
                Column::number("paper: after all", 4, Best::None),
            ],
            rows,
            compare: Compare::Down,
        },
    );
    Ok(findings)
}
