//! Quality by number of samples (paper, figure "QualityVsSamples" and table "SameQuality").

use glimpse_core::model::ModelKind;
use glimpse_trainer::report::{Best, Cell, Column, Compare, Plot, Series, Table};

use super::case::{Approach, Case};
use super::findings::Findings;
use super::plots::{by_samples, series};
use super::store::{Evaluation, Store};
use super::{METRICS, MODELS, PAPER_METRICS, SAMPLES, SCHEDULE, doublings, metrics, paper, title};

/// A method's judgments, one for each n.
type Curve = Vec<(usize, Evaluation)>;

fn curve(
    store: &Store<'_>,
    approach: Approach,
    model: ModelKind,
    most_samples: usize,
) -> anyhow::Result<Curve> {
    doublings(most_samples)
        .map(|n| Ok((n, store.evaluation(&Case::new(approach, model, n))?)))
        .collect()
}

pub(super) fn run(store: &Store<'_>, most_samples: usize) -> anyhow::Result<Findings> {
    let mut findings = Findings::new(store, "Quality by number of samples", &[SCHEDULE]);
    findings.text(format!(
        "Each point of Meta and Ours is a training of its own. The dot is what the model can do \
         with samples and steps without limit ({} steps of 512 samples, Neural {}; Linear is \
         solved for), drawn at the right end.",
        store.optimum_steps(ModelKind::Phong),
        store.optimum_steps(ModelKind::Neural),
    ));
    for model in MODELS {
        let mut curves = Vec::new();
        for approach in Approach::rivals(model, SCHEDULE) {
            curves.push((approach, curve(store, approach, model, most_samples)?));
        }
        let optimum = store.evaluation(&Case::new(Approach::Optimum, model, 0))?;
        for metric in [0, 1] {
            findings.plot(
                format!("{}-{}", model.name(), METRICS[metric].0.to_lowercase()),
                plot(model, metric, &curves, &optimum, most_samples),
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
    most_samples: usize,
) -> Plot {
    let mut all: Vec<Series> = curves
        .iter()
        .map(|(approach, curve)| {
            let point = |(n, evaluation): &(usize, Evaluation)| {
                [*n as f64, metrics(&evaluation.scores)[metric]]
            };
            series(*approach, curve.iter().map(point).collect())
        })
        .collect();
    let end = doublings(most_samples).last().unwrap_or(1);
    let dot = [end as f64, metrics(&optimum.scores)[metric]];
    all.push(series(Approach::Optimum, vec![dot]));
    let metric = METRICS[metric].0;
    let title = format!("{}: {metric} by number of samples", title(model));
    by_samples(title, metric, all)
}

fn table(model: ModelKind, curves: &[(Approach, Curve)], optimum: &Evaluation) -> Table {
    let mut columns = vec![Column::text("Method"), Column::text("n")];
    columns.extend(METRICS.map(|(title, decimals, _)| Column::number(title, decimals, Best::None)));
    let row = |approach: Approach, n: String, evaluation: &Evaluation| {
        let mut row = vec![Cell::Text(approach.title()), Cell::Text(n)];
        row.extend(metrics(&evaluation.scores).map(Cell::Number));
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
    rows.push(row(Approach::Optimum, "without limit".into(), optimum));
    Table {
        caption: title(model).into(),
        columns,
        rows,
        compare: Compare::Down,
    }
}

pub(super) fn same_quality(store: &Store<'_>, most_samples: usize) -> anyhow::Result<Findings> {
    let mut findings = Findings::new(
        store,
        "Same quality: how many more samples others need",
        &[SCHEDULE],
    );
    findings.text(format!(
        "Times the 8 samples of Ours that a method needs to be as good, between the n that were \
         tried by straight lines over ln n. What is not reached with {most_samples} samples is \
         left empty."
    ));
    let mut rows = Vec::new();
    for model in MODELS {
        let ours = store.evaluation(&Case::new(Approach::Ours(SCHEDULE), model, SAMPLES))?;
        let goals = metrics(&ours.scores);
        for approach in [Approach::Random, Approach::baseline(model, SCHEDULE)] {
            let curve = curve(store, approach, model, most_samples)?;
            let mut row = vec![
                Cell::Text(title(model).into()),
                Cell::Text(approach.title()),
            ];
            for (metric, goal) in goals.iter().enumerate() {
                let points = curve
                    .iter()
                    .map(|(n, evaluation)| (*n as f64, metrics(&evaluation.scores)[metric]));
                let least = METRICS[metric].2 == Best::Least;
                row.push(match reached(points, *goal, least) {
                    Some(n) => Cell::Number(n / SAMPLES as f64),
                    None => Cell::Missing,
                });
            }
            row.extend(match paper::same_quality(model, approach) {
                Some(times) => times.map(Cell::Number),
                None => [const { Cell::Missing }; PAPER_METRICS],
            });
            rows.push(row);
        }
    }
    let mut columns = vec![Column::text("Model"), Column::text("Method")];
    let times = |prefix: &str| {
        METRICS.map(|(title, ..)| {
            let (name, _unit) = title.split_once(" (").unwrap_or((title, ""));
            Column::number(format!("{prefix}{name}, x"), 1, Best::None)
        })
    };
    columns.extend(times(""));
    columns.extend(times("paper: ").into_iter().take(PAPER_METRICS));
    findings.table(
        "times",
        Table {
            caption: format!(
                "Samples needed for the quality of {} at n = {SAMPLES}, in times 8",
                Approach::Ours(SCHEDULE).title()
            ),
            columns,
            rows,
            compare: Compare::Down,
        },
    );
    Ok(findings)
}

/// The least n at which a curve is as good as the goal, between its points by straight lines over
/// ln n.
fn reached(points: impl Iterator<Item = (f64, f64)>, goal: f64, least: bool) -> Option<f64> {
    let sign = if least { 1.0 } else { -1.0 };
    let mut before: Option<(f64, f64)> = None;
    for (n, value) in points {
        let excess = sign * (value - goal);
        if excess <= 0.0 {
            return Some(match before {
                Some((earlier, excess_before)) => {
                    let share = excess_before / (excess_before - excess);
                    (earlier.ln() + share * (n.ln() - earlier.ln())).exp()
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
    use super::reached;

    #[test]
    fn a_goal_is_reached_between_two_points_or_not_at_all() {
        let falling = [(1.0, 0.4), (4.0, 0.2), (16.0, 0.1)];
        let near = |a: Option<f64>, b: f64| (a.unwrap_or(f64::NAN) - b).abs() < 1e-9;
        assert!(near(reached(falling.into_iter(), 0.3, true), 2.0));
        assert!(near(reached(falling.into_iter(), 0.4, true), 1.0));
        assert_eq!(reached(falling.into_iter(), 0.05, true), None);
        let rising = falling.map(|(n, value)| (n, -value));
        assert!(near(reached(rising.into_iter(), -0.15, false), 8.0));
    }
}
