//! The loss of each material, sorted by that of Ours (paper, figure "Zipfplots").

use glimpse_trainer::report::{Axis, Best, Cell, Column, Compare, Plot, Scale, Series, Table};

use super::case::{Approach, Case};
use super::curves::look;
use super::findings::Findings;
use super::store::Store;
use super::{MODELS, SAMPLES, SCHEDULE, title};

pub(super) fn run(store: &Store<'_>) -> anyhow::Result<Findings> {
    let mut findings = Findings::new(store, "Each material: n = 8", &[SCHEDULE]);
    for model in MODELS {
        let approaches = Approach::rivals(model, SCHEDULE);
        let mut losses = Vec::new();
        let mut names = Vec::new();
        for approach in approaches {
            let evaluation = store.evaluation(&Case::new(approach, model, SAMPLES))?;
            names = evaluation
                .materials
                .iter()
                .map(|each| each.name.clone())
                .collect();
            losses.push(
                evaluation
                    .materials
                    .iter()
                    .map(|each| each.scores.loss)
                    .collect::<Vec<_>>(),
            );
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
            let (hue, mark) = look(*approach);
            let points = order.iter().enumerate();
            Series {
                name: approach.title(),
                hue,
                mark,
                points: points
                    .map(|(rank, index)| [rank as f64 + 1.0, losses[*index]])
                    .collect(),
            }
        });
        findings.plot(
            model.name(),
            Plot {
                title: format!("{}: loss of each material", title(model)),
                x: Axis {
                    title: format!("material, by the loss of {}", approaches[2].title()),
                    scale: Scale::Names(order.iter().map(|index| names[*index].clone()).collect()),
                },
                y: Axis {
                    title: "Loss (less is better)".into(),
                    scale: Scale::Decades,
                },
                series: series.collect(),
            },
        );
        let mut columns = vec![Column::text("Material")];
        columns.extend(approaches.map(|each| Column::number(each.title(), 4, Best::Least)));
        let rows = order.iter().map(|index| {
            let losses = losses.iter().map(|losses| Cell::Number(losses[*index]));
            [Cell::Text(names[*index].clone())]
                .into_iter()
                .chain(losses)
                .collect()
        });
        findings.table(
            model.name(),
            Table {
                caption: format!("{}, loss at n = {SAMPLES}", title(model)),
                columns,
                rows: rows.collect(),
                compare: Compare::Across,
            },
        );
    }
    Ok(findings)
}
