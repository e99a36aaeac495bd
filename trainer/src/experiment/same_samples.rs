//! The main table: all methods for all models at n = 8 (paper, table "SameSampleCount"), and
//! spheres of two materials (figure "MethodsModels").

use glimpse_core::model::ModelKind;
use glimpse_trainer::metrics::Metrics;
use glimpse_trainer::report::{Best, Cell, Column, Compare, Table};
use glimpse_training::linear::Prior;

use super::case::{Approach, Case};
use super::findings::Findings;
use super::store::Store;
use super::{
    METRICS, MODELS, SAMPLES, SCHEDULE, cells_beside_the_paper_s, columns_beside_the_paper_s,
    metrics, paper, spheres, title,
};

pub(super) fn run(store: &Store<'_>) -> anyhow::Result<Findings> {
    let mut findings = Findings::new(store, "Same number of samples: n = 8", &[SCHEDULE]);
    findings.text(
        "Means over the materials judged; Random and Meta over several seeds too (a material's PSNR \
         is that of its mean L2 then). The standard \
         error is over the materials. The paper's figures are on its own 20 materials of MERL.",
    );
    findings.text(
        "Random of Phong and of Cook-Torrance begins at standard normal parameters, and 20 steps of \
         Adam at a rate of 0.001 move none of them by more than 0.02: its loss is that of its start. \
         The paper does not say where it begins. Cook-Torrance's logits of about 0 are a half of each \
         color reflected diffusely and as much specularly, far brighter than most materials: on 16 \
         networks of MERL's materials its loss is .274 before the first step and .271 after 20, and \
         would be .100 from logits of -2, beside the paper's .098. Methods that learn their start are \
         not concerned.",
    );
    let mut orders = Vec::new();
    for model in MODELS {
        let mut rows = Vec::new();
        let mut scores = Vec::new();
        for approach in Approach::rivals(model, SCHEDULE) {
            let evaluation = store.evaluation(&Case::new(approach, model, SAMPLES))?;
            let paper = paper::same_samples(model, approach);
            let mut row = vec![Cell::Text(approach.title())];
            row.extend(cells_beside_the_paper_s(&evaluation, paper));
            rows.push(row);
            scores.push((approach, evaluation.scores));
        }
        if model == ModelKind::Linear {
            let learned = Case {
                prior: Prior::LEARNED,
                ..Case::new(Approach::Ours(SCHEDULE), model, SAMPLES)
            };
            let evaluation = store.evaluation(&learned)?;
            let mut row = vec![Cell::Text(format!(
                "{}, 60 components, learned precisions",
                learned.approach.title()
            ))];
            row.extend(cells_beside_the_paper_s(&evaluation, None));
            rows.push(row);
        }
        let mut columns = vec![Column::text("Method")];
        columns.extend(columns_beside_the_paper_s());
        findings.table(
            model.name(),
            Table {
                caption: format!("{}, n = {SAMPLES}", title(model)),
                columns,
                rows,
                compare: Compare::Down,
            },
        );
        orders.extend(order_rows(model, &scores));
    }
    findings.table(
        "order",
        Table {
            caption: "The order of the methods, best first, here and in the paper".into(),
            columns: ["Model", "Metric", "here", "in the paper", "same"]
                .map(Column::text)
                .into(),
            rows: orders,
            compare: Compare::Down,
        },
    );

    let order = store.by_glossiness(store.test.materials);
    if let (Some(diffuse), Some(glossy)) = (order.first(), order.last()) {
        for index in [*diffuse, *glossy] {
            findings.gallery(spheres::by_model(store, index, SAMPLES)?);
        }
    }
    Ok(findings)
}

/// For each metric: who is better than whom.
fn order_rows(model: ModelKind, scores: &[(Approach, Metrics)]) -> Vec<Vec<Cell>> {
    let order = |of: &dyn Fn(&(Approach, Metrics)) -> Option<f64>, best: Best| {
        let mut ranked: Vec<(f64, &str)> = scores
            .iter()
            .filter_map(|entry| Some((of(entry)?, entry.0.name())))
            .collect();
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        if best == Best::Greatest {
            ranked.reverse();
        }
        let names: Vec<&str> = ranked.into_iter().map(|(_, name)| name).collect();
        names.join(", ")
    };
    METRICS
        .iter()
        .enumerate()
        .map(|(index, (metric, _, best))| {
            let here = order(&|(_, scores)| Some(metrics(scores)[index]), *best);
            let paper = order(
                &|(approach, _)| paper::same_samples(model, *approach)?.get(index).copied(),
                *best,
            );
            // The paper has no color difference.
            let same = match paper.is_empty() {
                true => "",
                false if here == paper => "yes",
                false => "no",
            };
            [title(model), metric, &here, &paper, same]
                .map(|text| Cell::Text(text.into()))
                .into()
        })
        .collect()
}
