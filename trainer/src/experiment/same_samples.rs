//! The main tables: all methods for all models at n = 8 (paper, table "SameSampleCount"), and spheres of two materials
//! (figure "MethodsModels").

use glimpse_core::model::ModelKind;
use glimpse_trainer::metrics::Metrics;
use glimpse_trainer::report::{Cell, Column, Compare, Highlight, Table};
use glimpse_training::linear::Prior;

use super::case::{Approach, Case};
use super::findings::Findings;
use super::glossiness::by_glossiness;
use super::store::Store;
use super::{
    METRICS, MODELS, SAMPLES, SCHEDULE, metric_cells, metric_columns, metric_values, paper,
    spheres, title,
};

pub(super) fn run(store: &Store<'_>) -> anyhow::Result<Findings> {
    let mut findings = Findings::new(store, "Same number of samples: n = 8", &[SCHEDULE]);
    findings.text(
        "All values are means over the test materials. For Random and Meta, they are also means over \
         several seeds, and the PSNR of a material is that of its mean L2. The standard error is over the \
         materials. The published values are for the paper's 20 test materials of MERL.",
    );
    findings.text(
        "For Phong and Cook-Torrance, Random starts at standard normal parameters. 20 steps of Adam at \
         a rate of 0.001 change no parameter by more than 0.02, so the loss is that of the initial \
         parameters. The paper does not state its initial parameters. Cook-Torrance logits of about 0 \
         reflect half of each color diffusely and half specularly, far brighter than most materials. On \
         16 networks of MERL materials, the loss is 0.274 before the first step and 0.271 after 20 steps. \
         From logits of -2, the loss would be 0.100; in the paper it is 0.098. Methods with learned initial \
         parameters are not affected.",
    );
    let mut rows_of_orders = Vec::new();
    for model in MODELS {
        let mut rows = Vec::new();
        let mut metrics_by_method = Vec::new();
        for approach in Approach::compared(model, SCHEDULE) {
            let evaluation = store.evaluation(&Case::new(approach, model, SAMPLES))?;
            let paper = paper::same_samples(model, approach);
            let mut row = vec![Cell::Text(approach.title())];
            row.extend(metric_cells(&evaluation, paper));
            rows.push(row);
            metrics_by_method.push((approach, evaluation.metrics));
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
            row.extend(metric_cells(&evaluation, None));
            rows.push(row);
        }
        let mut columns = vec![Column::text("Method")];
        columns.extend(metric_columns());
        findings.table(
            model.name(),
            Table {
                caption: format!("{}, n = {SAMPLES}", title(model)),
                columns,
                rows,
                compare: Compare::WithinColumn,
            },
        );
        rows_of_orders.extend(order_rows(model, &metrics_by_method));
    }
    findings.table(
        "order",
        Table {
            caption: "The order of the methods, best first, here and in the paper".into(),
            columns: ["Model", "Metric", "here", "in the paper", "same"]
                .map(Column::text)
                .into(),
            rows: rows_of_orders,
            compare: Compare::WithinColumn,
        },
    );

    let by_glossiness = by_glossiness(store.test.materials, store.settings.seed);
    if let (Some(diffuse), Some(glossy)) = (by_glossiness.first(), by_glossiness.last()) {
        for index in [*diffuse, *glossy] {
            findings.gallery(spheres::gallery_by_model(store, index, SAMPLES)?);
        }
    }
    Ok(findings)
}

/// Returns a row for each metric with the order of the methods, best first: here and in the paper.
fn order_rows(model: ModelKind, metrics_by_method: &[(Approach, Metrics)]) -> Vec<Vec<Cell>> {
    let order = |value: &dyn Fn(&(Approach, Metrics)) -> Option<f64>, highlight: Highlight| {
        let mut ranked: Vec<(f64, &str)> = metrics_by_method
            .iter()
            .filter_map(|entry| Some((value(entry)?, entry.0.name())))
            .collect();
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        if highlight == Highlight::Highest {
            ranked.reverse();
        }
        let names: Vec<&str> = ranked.into_iter().map(|(_, name)| name).collect();
        names.join(", ")
    };
    METRICS
        .iter()
        .enumerate()
        .map(|(index, (metric, _, highlight))| {
            let here = order(
                &|(_, metrics)| Some(metric_values(metrics)[index]),
                *highlight,
            );
            let paper = order(
                &|(approach, _)| paper::same_samples(model, *approach)?.get(index).copied(),
                *highlight,
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
