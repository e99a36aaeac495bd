//! Linear with 5 and with 240 components (paper, "Same-quality").

use glimpse_core::model::ModelKind;
use glimpse_trainer::report::{Cell, Column, Compare, Highlight, Table};
use glimpse_training::linear::Prior;

use super::case::{Approach, Case};
use super::findings::Findings;
use super::store::Store;
use super::{METRICS, SAMPLES, SCHEDULE, metric_values};

/// The numbers of components in the paper.
const COMPONENTS: [usize; 2] = [5, 240];

pub(super) fn run(store: &Store<'_>) -> anyhow::Result<Findings> {
    let mut findings = Findings::new(store, "Linear with 5 and with 240 components", &[SCHEDULE]);
    findings.text(
        "The paper found similar results with both numbers of components. Here the number is smaller \
         if there are too few training columns, three for each material.",
    );
    let training = store.settings.data.load()?.len();
    let mut rows = Vec::new();
    for components in COMPONENTS {
        // Subtracting the mean leaves one component fewer than columns.
        let components = components.min((3 * training).saturating_sub(1)).max(1);
        let approaches = [
            (Approach::Random, Some(40.0)),
            (Approach::Njr15, Some(40.0)),
            (Approach::Ours(SCHEDULE), Some(40.0)),
            (Approach::Ours(SCHEDULE), None),
        ];
        for (approach, eta) in approaches {
            let case = Case {
                prior: Prior { components, eta },
                ..Case::new(approach, ModelKind::Linear, SAMPLES)
            };
            let evaluation = store.evaluation(&case)?;
            let eta = eta.map_or_else(|| "learned".to_owned(), |eta| eta.to_string());
            let mut row = vec![
                Cell::Number(components as f64),
                Cell::Text(approach.title()),
                Cell::Text(eta),
            ];
            row.extend(metric_values(&evaluation.metrics).map(Cell::Number));
            rows.push(row);
        }
    }
    let mut columns = vec![
        Column::number("components", 0, Highlight::None),
        Column::text("Method"),
        Column::text("eta"),
    ];
    columns.extend(
        METRICS.map(|(title, decimals, highlight)| Column::number(title, decimals, highlight)),
    );
    findings.table(
        "bases",
        Table {
            caption: format!("Linear, n = {SAMPLES}"),
            columns,
            rows,
            compare: Compare::WithinColumn,
        },
    );
    Ok(findings)
}
