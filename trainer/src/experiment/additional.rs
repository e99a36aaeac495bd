//! Other sources than the one trained on (paper, tables "Nielsen" and "RGLeval").

use glimpse_core::model::ModelKind;
use glimpse_trainer::report::{Cell, Column, Compare, Table};

use super::case::{Approach, Case};
use super::findings::Findings;
use super::losses::on_others;
use super::store::{Store, TestSet};
use super::{
    MODELS, PaperMetrics, SAMPLES, SCHEDULE, cells_beside_the_paper_s, columns_beside_the_paper_s,
    paper, title,
};

/// n of the paper's comparison with Nielsen et al.
const FEW: usize = 2;

pub(super) fn run(store: &Store<'_>) -> anyhow::Result<Findings> {
    if store.additional.is_empty() {
        anyhow::bail!(
            "additional judges on other sources than --test: give them by --additional, such as \
             the eight materials of Nielsen et al. or RGL's"
        );
    }
    let mut findings = Findings::new(store, "Other sources of materials", &[SCHEDULE]);
    findings.text(
        "Trained as before, judged on materials of other origin. The paper's figures are of the \
         eight materials of Nielsen et al. at n = 2, and of the RGL database's isotropic part at \
         n = 8.",
    );
    for (number, set) in (1..).zip(store.additional) {
        findings.judged_on(store, set);
        let linear = [Approach::Njr15, Approach::Ours(SCHEDULE)].map(|approach| {
            (
                Case::new(approach, ModelKind::Linear, FEW),
                paper::nielsen(approach),
            )
        });
        findings.table(
            format!("{}-linear-n{FEW}", set.label),
            table(store, set, FEW, &linear)?,
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
        findings.table(format!("losses-{number}"), on_others(store, set)?);
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
        row.extend(cells_beside_the_paper_s(&evaluation, *paper));
        rows.push(row);
    }
    let mut columns = vec![Column::text("Model"), Column::text("Method")];
    columns.extend(columns_beside_the_paper_s());
    Ok(Table {
        caption: format!("n = {samples}"),
        columns,
        rows,
        compare: Compare::Down,
    })
}
