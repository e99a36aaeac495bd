//! The loss and the color difference of each material, sorted by the loss of Ours (paper, figure
//! "Zipfplots").

use glimpse_trainer::metrics::Metrics;
use glimpse_trainer::report::{Axis, Cell, Column, Compare, Highlight, Plot, Scale, Table};

use super::case::{Approach, Case};
use super::findings::Findings;
use super::plots::{metric_axis, series};
use super::store::Store;
use super::{METRICS, MODELS, SAMPLES, SCHEDULE, title};

pub(super) fn run(store: &Store<'_>) -> anyhow::Result<Findings> {
    let mut findings = Findings::new(store, "Loss of each material at n = 8", &[SCHEDULE]);
    for model in MODELS {
        let approaches = Approach::compared(model, SCHEDULE);
        let mut losses = Vec::new();
        let mut color_differences = Vec::new();
        let mut names = Vec::new();
        for approach in approaches {
            let evaluation = store.evaluation(&Case::new(approach, model, SAMPLES))?;
            names = evaluation
                .materials
                .iter()
                .map(|material| material.name.clone())
                .collect();
            let values_of = |metric: fn(&Metrics) -> f64| -> Vec<f64> {
                let materials = evaluation.materials.iter();
                materials
                    .map(|material| metric(&material.metrics))
                    .collect()
            };
            losses.push(values_of(|metrics| metrics.loss));
            color_differences.push(values_of(|metrics| metrics.delta_e));
        }
        let [.., baseline, ours] = &losses[..] else {
            continue;
        };
        let mut order: Vec<usize> = (0..ours.len()).collect();
        order.sort_by(|a, b| ours[*b].total_cmp(&ours[*a]));
        let better = order
            .iter()
            .filter(|index| ours[**index] < baseline[**index]);
        findings.text(format!(
            "{}: {} is better than {} on {} of {} materials.",
            title(model),
            approaches[2].title(),
            approaches[1].title(),
            better.count(),
            order.len()
        ));
        let series = approaches.iter().zip(&losses).map(|(approach, losses)| {
            let points = order.iter().enumerate();
            let points = points.map(|(rank, index)| [rank as f64 + 1.0, losses[*index]]);
            series(*approach, points.collect())
        });
        findings.plot(
            model.name(),
            Plot {
                title: format!("{}: loss of each material", title(model)),
                x: Axis {
                    title: format!("material, sorted by the loss of {}", approaches[2].title()),
                    scale: Scale::Categories(
                        order.iter().map(|index| names[*index].clone()).collect(),
                    ),
                },
                y: metric_axis(METRICS[0].0),
                series: series.collect(),
            },
        );
        let table = |metric: &str, decimals: usize, values: &[Vec<f64>]| {
            let value_columns = approaches
                .map(|approach| Column::number(approach.title(), decimals, Highlight::Lowest));
            let rows = order.iter().map(|index| {
                let values = values.iter().map(|values| Cell::Number(values[*index]));
                [Cell::Text(names[*index].clone())]
                    .into_iter()
                    .chain(values)
                    .collect()
            });
            Table {
                caption: format!("{}, {metric} at n = {SAMPLES}", title(model)),
                columns: [Column::text("Material")]
                    .into_iter()
                    .chain(value_columns)
                    .collect(),
                rows: rows.collect(),
                compare: Compare::WithinRow,
            }
        };
        findings.table(model.name(), table("loss", 4, &losses));
        findings.table(
            format!("{}-delta-e", model.name()),
            table("Delta E (CIEDE2000)", 2, &color_differences),
        );
    }
    Ok(findings)
}
