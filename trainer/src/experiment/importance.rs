//! Samples drawn by the importance of the mean BRDF (paper, "Mean-BRDF importance sampling").

use anyhow::Context;
use glimpse_core::model::ModelKind;
use glimpse_materials::sampling::MeanBrdf;
use glimpse_trainer::evaluation::Method;
use glimpse_trainer::report::{Best, Cell, Column, Compare, Hue, Mark, Series, Table};

use super::case::{Approach, Case, TrainingRun};
use super::findings::Findings;
use super::plots::{by_samples, series};
use super::store::Store;
use super::{METRICS, SCHEDULE, doublings};

pub(super) fn run(store: &Store<'_>, most_samples: usize) -> anyhow::Result<Findings> {
    let mut findings = Findings::new(store, "Importance sampling of the mean BRDF", &[SCHEDULE]);
    findings.text(
        "A Sobol sequence through the inverse distribution of the logarithmic mean of the \
         training materials, with the start and step sizes of Meta. In the paper it is more than \
         four times worse than Ours on average.",
    );
    let mean = MeanBrdf::new(&store.settings.data.load()?);
    let mut rows = Vec::new();
    let [_, baseline, best] = Approach::rivals(ModelKind::Neural, SCHEDULE);
    let mut curves = [Vec::new(), Vec::new(), Vec::new()];
    for n in doublings(most_samples) {
        let meta = Case::new(baseline, ModelKind::Neural, n);
        let ours = Case::new(best, ModelKind::Neural, n);
        let name = format!("neural-n{n}-importance");
        let importance = store.kept_evaluation(store.test, &name, 1, |judge| {
            let training = TrainingRun::of(&meta).context("Meta is trained")?;
            let learned = store.recipe(&training)?;
            let recipe = learned.file.recipe();
            let pattern = mean.samples(n, store.settings.seed as u32);
            judge(&Method::elsewhere("importance", &recipe, None, pattern)?)
        })?;
        let losses = [
            importance.scores.loss,
            store.evaluation(&meta)?.scores.loss,
            store.evaluation(&ours)?.scores.loss,
        ];
        for (curve, loss) in curves.iter_mut().zip(losses) {
            curve.push([n as f64, loss]);
        }
        let mut row = vec![Cell::Number(n as f64)];
        row.extend(losses.map(Cell::Number));
        row.push(Cell::Number(losses[0] / losses[2]));
        rows.push(row);
    }
    let names = ["Importance".to_owned(), baseline.title(), best.title()];
    let [of_importance, of_baseline, of_best] = curves;
    let importance = Series {
        name: names[0].clone(),
        hue: Hue::Green,
        mark: Mark::Rings,
        points: of_importance,
    };
    let series = vec![
        importance,
        series(baseline, of_baseline),
        series(best, of_best),
    ];
    findings.plot(
        "importance",
        by_samples(
            "Neural: importance of the mean BRDF".into(),
            METRICS[0].0,
            series,
        ),
    );
    let mut columns = vec![Column::number("n", 0, Best::None)];
    columns.extend(names.map(|name| Column::number(name, 4, Best::Least)));
    columns.push(Column::number(
        format!("Importance / {}", best.title()),
        2,
        Best::None,
    ));
    findings.table(
        "importance",
        Table {
            caption: "Neural, loss".into(),
            columns,
            rows,
            compare: Compare::Across,
        },
    );
    Ok(findings)
}
