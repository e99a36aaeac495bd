//! Evaluations on materials of other sources (paper, tables "Nielsen" and "RGLeval").

use glimpse_core::model::ModelKind;
use glimpse_trainer::report::{Cell, Column, Compare, Table};

use super::case::{Approach, Case};
use super::findings::Findings;
use super::losses::losses_on_other_source;
use super::store::{Store, TestSet};
use super::{MODELS, PaperMetrics, SAMPLES, SCHEDULE, metric_cells, metric_columns, paper, title};

/// The number of samples of the paper's comparison with Nielsen et al.
const NIELSEN_SAMPLES: usize = 2;

pub(super) fn run(store: &Store<'_>) -> anyhow::Result<Findings> {
    if store.additional.is_empty() {
        anyhow::bail!(
            "the experiment additional needs materials of other sources: give --additional with, for \
             example, the eight materials of Nielsen et al. or the RGL database"
        );
    }
    let mut findings = Findings::new(store, "Materials of other sources", &[SCHEDULE]);
    findings.text(
        "The recipes are trained on --data and evaluated on materials of other sources. The published \
         values are for the eight materials of Nielsen et al. at n = 2, and for the isotropic part of the \
         RGL database at n = 8.",
    );
    for (number, set) in (1..).zip(store.additional) {
        findings.set_test_set(store, set);
        let linear = [Approach::Njr15, Approach::Ours(SCHEDULE)].map(|approach| {
            (
                Case::new(approach, ModelKind::Linear, NIELSEN_SAMPLES),
                paper::nielsen(approach),
            )
        });
        findings.table(
            format!("{}-linear-n{NIELSEN_SAMPLES}", set.label),
            table(store, set, NIELSEN_SAMPLES, &linear)?,
        );
        for model in MODELS {
            let cases = [
                Approach::baseline(model, SCHEDULE),
                Approach::Ours(SCHEDULE),
            ]
            .map(|approach| {
                let case = Case::new(approach, model, SAMPLES);
                (case, paper::rgl(model, approach))
            });
            findings.table(
                format!("{}-{}-n{SAMPLES}", set.label, model.name()),
                table(store, set, SAMPLES, &cases)?,
            );
        }
        findings.table(
            format!("losses-{number}"),
            losses_on_other_source(store, set)?,
        );
    }
    Ok(findings)
}

fn table(
    store: &Store<'_>,
    set: &TestSet<'_>,
    samples: usize,
    cases: &[(Case, Option<PaperMetrics>)],
) -> anyhow::Result<Table> {
    let mut rows = Vec::new();
    for (case, paper) in cases {
        let evaluation = store.evaluation_on(set, case)?;
        let mut row = vec![
            Cell::Text(title(case.model).into()),
            Cell::Text(case.approach.title()),
        ];
        row.extend(metric_cells(&evaluation, *paper));
        rows.push(row);
    }
    let mut columns = vec![Column::text("Model"), Column::text("Method")];
    columns.extend(metric_columns());
    Ok(Table {
        caption: format!("n = {samples}"),
        columns,
        rows,
        compare: Compare::WithinColumn,
    })
}
