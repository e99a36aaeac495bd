//! Quality over the number of samples (paper, figure "QualityVsSamples" and table "SameQuality").

use glimpse_core::model::ModelKind;
use glimpse_trainer::report::{Cell, Column, Compare, Highlight, Plot, Series, Table};

use super::case::{Approach, Case};
use super::findings::Findings;
use super::plots::{plot_over_samples, series};
use super::store::{Evaluation, Store};
use super::{
    METRICS, MODELS, PAPER_METRICS, SAMPLES, SCHEDULE, metric_values, paper, powers_of_two, title,
};

/// Indices in [`METRICS`] of the plotted metrics: Loss and DSSIM.
const PLOTTED_METRICS: [usize; 2] = [0, 1];

/// Evaluations of a method, one for each n.
type Curve = Vec<(usize, Evaluation)>;

fn curve(
    store: &Store<'_>,
    approach: Approach,
    model: ModelKind,
    max_samples: usize,
) -> anyhow::Result<Curve> {
    powers_of_two(max_samples)
        .map(|n| Ok((n, store.evaluation(&Case::new(approach, model, n))?)))
        .collect()
}

pub(super) fn run(store: &Store<'_>, max_samples: usize) -> anyhow::Result<Findings> {
    let mut findings = Findings::new(store, "Quality over the number of samples", &[SCHEDULE]);
    findings.text(format!(
        "Each point of Meta and Ours is a separate training. The dot at the right end is the optimum of \
         the model with unlimited samples and steps ({} steps of 512 samples, Neural {}; Linear is \
         solved in closed form).",
        store.optimum_steps(ModelKind::Phong),
        store.optimum_steps(ModelKind::Neural),
    ));
    for model in MODELS {
        let mut curves = Vec::new();
        for approach in Approach::compared(model, SCHEDULE) {
            curves.push((approach, curve(store, approach, model, max_samples)?));
        }
        let optimum = store.evaluation(&Case::new(Approach::Optimum, model, 0))?;
        for metric in PLOTTED_METRICS {
            findings.plot(
                format!("{}-{}", model.name(), METRICS[metric].0.to_lowercase()),
                plot(model, metric, &curves, &optimum, max_samples),
            );
        }
        findings.table(model.name(), table(model, &curves, &optimum));
    }
    Ok(findings)
}

fn plot(
    model: ModelKind,
    metric: usize,
    curves: &[(Approach, Curve)],
    optimum: &Evaluation,
    max_samples: usize,
) -> Plot {
    let mut all_series: Vec<Series> = curves
        .iter()
        .map(|(approach, curve)| {
            let point = |(n, evaluation): &(usize, Evaluation)| {
                [*n as f64, metric_values(&evaluation.metrics)[metric]]
            };
            series(*approach, curve.iter().map(point).collect())
        })
        .collect();
    let end = powers_of_two(max_samples).last().unwrap_or(1);
    let dot = [end as f64, metric_values(&optimum.metrics)[metric]];
    all_series.push(series(Approach::Optimum, vec![dot]));
    let metric = METRICS[metric].0;
    let title = format!("{}: {metric} over the number of samples", title(model));
    plot_over_samples(title, metric, all_series)
}

fn table(model: ModelKind, curves: &[(Approach, Curve)], optimum: &Evaluation) -> Table {
    let mut columns = vec![Column::text("Method"), Column::text("n")];
    columns.extend(
        METRICS.map(|(title, decimals, _)| Column::number(title, decimals, Highlight::None)),
    );
    let row = |approach: Approach, n: String, evaluation: &Evaluation| {
        let mut row = vec![Cell::Text(approach.title()), Cell::Text(n)];
        row.extend(metric_values(&evaluation.metrics).map(Cell::Number));
        row
    };
    let mut rows = Vec::new();
    for (approach, curve) in curves {
        rows.extend(
            curve
                .iter()
                .map(|(n, evaluation)| row(*approach, n.to_string(), evaluation)),
        );
    }
    rows.push(row(Approach::Optimum, "unlimited".into(), optimum));
    Table {
        caption: title(model).into(),
        columns,
        rows,
        compare: Compare::WithinColumn,
    }
}

pub(super) fn same_quality(store: &Store<'_>, max_samples: usize) -> anyhow::Result<Findings> {
    let mut findings = Findings::new(store, "Samples needed for the same quality", &[SCHEDULE]);
    findings.text(format!(
        "The number of samples that a method needs to match the quality of Ours at n = 8, divided by 8. Values \
         between the evaluated n are interpolated linearly over ln n. An entry is empty if \
         {max_samples} samples are not enough."
    ));
    let mut rows = Vec::new();
    for model in MODELS {
        let ours = store.evaluation(&Case::new(Approach::Ours(SCHEDULE), model, SAMPLES))?;
        let targets = metric_values(&ours.metrics);
        for approach in [Approach::Random, Approach::baseline(model, SCHEDULE)] {
            let curve = curve(store, approach, model, max_samples)?;
            let mut row = vec![
                Cell::Text(title(model).into()),
                Cell::Text(approach.title()),
            ];
            for (metric, target) in targets.iter().enumerate() {
                let points = curve
                    .iter()
                    .map(|(n, evaluation)| (*n as f64, metric_values(&evaluation.metrics)[metric]));
                let lower_is_better = METRICS[metric].2 == Highlight::Lowest;
                row.push(match samples_to_reach(points, *target, lower_is_better) {
                    Some(n) => Cell::Number(n / SAMPLES as f64),
                    None => Cell::Missing,
                });
            }
            row.extend(match paper::same_quality(model, approach) {
                Some(ratios) => ratios.map(Cell::Number),
                None => [const { Cell::Missing }; PAPER_METRICS],
            });
            rows.push(row);
        }
    }
    let mut columns = vec![Column::text("Model"), Column::text("Method")];
    let ratio_columns = |prefix: &str| {
        METRICS.map(|(title, ..)| {
            let (name, _unit) = title.split_once(" (").unwrap_or((title, ""));
            Column::number(format!("{prefix}{name}, x"), 1, Highlight::None)
        })
    };
    columns.extend(ratio_columns(""));
    columns.extend(ratio_columns("paper: ").into_iter().take(PAPER_METRICS));
    findings.table(
        "times",
        Table {
            caption: format!(
                "Samples needed to match the quality of {} at n = {SAMPLES}, divided by {SAMPLES}",
                Approach::Ours(SCHEDULE).title()
            ),
            columns,
            rows,
            compare: Compare::WithinColumn,
        },
    );
    Ok(findings)
}

/// Returns the smallest n at which a curve reaches the target, interpolated linearly over ln n. Returns None if no
/// point reaches it.
fn samples_to_reach(
    points: impl Iterator<Item = (f64, f64)>,
    target: f64,
    lower_is_better: bool,
) -> Option<f64> {
    let sign = if lower_is_better { 1.0 } else { -1.0 };
    let mut before: Option<(f64, f64)> = None;
    for (n, value) in points {
        let excess = sign * (value - target);
        if excess <= 0.0 {
            return Some(match before {
                Some((n_before, excess_before)) => {
                    let fraction = excess_before / (excess_before - excess);
                    (n_before.ln() + fraction * (n.ln() - n_before.ln())).exp()
                }
                None => n,
            });
        }
        before = Some((n, excess));
    }
    None
}

#[cfg(test)]
mod tests {
    use super::samples_to_reach;

    #[test]
    fn interpolates_between_points() {
        let falling = [(1.0, 0.4), (4.0, 0.2), (16.0, 0.1)];
        let near = |a: Option<f64>, b: f64| (a.unwrap_or(f64::NAN) - b).abs() < 1e-9;
        assert!(near(samples_to_reach(falling.into_iter(), 0.3, true), 2.0));
        assert!(near(samples_to_reach(falling.into_iter(), 0.4, true), 1.0));
        assert_eq!(samples_to_reach(falling.into_iter(), 0.05, true), None);
        let rising = falling.map(|(n, value)| (n, -value));
        assert!(near(
            samples_to_reach(rising.into_iter(), -0.15, false),
            8.0
        ));
    }
}
