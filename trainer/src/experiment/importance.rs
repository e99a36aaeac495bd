//! Importance sampling of the mean BRDF (paper, "Mean-BRDF importance sampling").

use anyhow::Context;
use glimpse_core::model::ModelKind;
use glimpse_materials::sampling::MeanBrdf;
use glimpse_trainer::evaluation::Method;
use glimpse_trainer::report::{
    Cell, Column, Compare, Highlight, Marker, Series, SeriesColor, Table,
};

use super::case::{Approach, Case, TrainingRun};
use super::findings::Findings;
use super::plots::{plot_over_samples, series};
use super::store::Store;
use super::{METRICS, SCHEDULE, powers_of_two};

pub(super) fn run(store: &Store<'_>, max_samples: usize) -> anyhow::Result<Findings> {
    let mut findings = Findings::new(store, "Importance sampling of the mean BRDF", &[SCHEDULE]);
    findings.text(
        "A Sobol sequence is mapped through the inverse cumulative distribution of the logarithmic mean \
         of the training materials. Initial parameters and step sizes are those of Meta. In the paper, \
         the loss is more than four times that of Ours on average.",
    );
    let mean_brdf = MeanBrdf::new(&store.settings.data.load()?);
    let mut rows = Vec::new();
    let [_, meta, ours] = Approach::compared(ModelKind::Neural, SCHEDULE);
    let mut curves = [Vec::new(), Vec::new(), Vec::new()];
    for n in powers_of_two(max_samples) {
        let meta_case = Case::new(meta, ModelKind::Neural, n);
        let ours_case = Case::new(ours, ModelKind::Neural, n);
        let name = format!("neural-n{n}-importance");
        let importance = store.cached_evaluation(store.test, &name, 1, |evaluate| {
            let training =
                TrainingRun::for_case(&meta_case).context("a case of Meta has no training run")?;
            let learned = store.recipe(&training)?;
            let recipe = learned.file.recipe();
            let pattern = mean_brdf.samples(n, store.settings.seed as u32);
            evaluate(&Method::at_directions(
                "importance",
                &recipe,
                None,
                pattern,
            )?)
        })?;
        let losses = [
            importance.metrics.loss,
            store.evaluation(&meta_case)?.metrics.loss,
            store.evaluation(&ours_case)?.metrics.loss,
        ];
        for (curve, loss) in curves.iter_mut().zip(losses) {
            curve.push([n as f64, loss]);
        }
        let mut row = vec![Cell::Number(n as f64)];
        row.extend(losses.map(Cell::Number));
        row.push(Cell::Number(losses[0] / losses[2]));
        rows.push(row);
    }
    let names = ["Importance".to_owned(), meta.title(), ours.title()];
    let [importance_points, meta_points, ours_points] = curves;
    let importance = Series {
        name: names[0].clone(),
        color: SeriesColor::Green,
        marker: Marker::Ring,
        points: importance_points,
    };
    let series = vec![
        importance,
        series(meta, meta_points),
        series(ours, ours_points),
    ];
    findings.plot(
        "importance",
        plot_over_samples(
            "Neural: importance sampling of the mean BRDF".into(),
            METRICS[0].0,
            series,
        ),
    );
    let mut columns = vec![Column::number("n", 0, Highlight::None)];
    columns.extend(names.map(|name| Column::number(name, 4, Highlight::Lowest)));
    columns.push(Column::number(
        format!("Importance / {}", ours.title()),
        2,
        Highlight::None,
    ));
    findings.table(
        "importance",
        Table {
            caption: "Neural, loss".into(),
            columns,
            rows,
            compare: Compare::WithinRow,
        },
    );
    Ok(findings)
}
