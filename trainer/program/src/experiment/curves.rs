//! Quality over the number of samples, and over the seconds of a scan.

use crate::report::{Axis, Cell, Column, Compare, Marker, Scale, SeriesColor};
use glimpse_core::gonio::Limits;
use glimpse_core::model::ModelKind;
use glimpse_evaluation::metrics::METRICS;
use glimpse_training::route::{Machine, Order, Route, stops};

use super::case::{Approach, Case, MOTION_SPEED, Variation};
use super::engine::{Evaluated, Grid, Line, Part, Plan, PlotOfColumns, Row};
use super::paper;
use super::shared::{
    MODELS, PAPER_METRICS, SAMPLES, powers_of_two, published_cells, samples_axis, title,
};
use super::store::Store;

/// Returns the cases of a method for each n.
pub(super) fn over_samples(
    approach: Approach,
    model: ModelKind,
    max_samples: usize,
) -> impl Iterator<Item = Case> {
    powers_of_two(max_samples).map(move |n| Case::new(approach, model, n))
}

/// Loss and DSSIM over n, with the optimum as a dot (paper, figure "QualityVsSamples").
pub(super) fn curves(store: &Store<'_>, max_samples: usize) -> Plan {
    let mut parts = vec![Part::Text(format!(
        "Each point of Meta, the paper's and Glimpse is a separate training. The dot at the right end is the \
         optimum of the model with unlimited samples and steps ({} steps of 512 samples, Neural {}; Linear \
         is solved in closed form).",
        store.optimum_steps(ModelKind::Phong),
        store.optimum_steps(ModelKind::Neural),
    ))];
    for model in MODELS {
        let approaches = Approach::compared(model)
            .into_iter()
            .chain([Approach::Optimum]);
        let rows = approaches.clone().map(|approach| Row {
            labels: vec![approach.name().into()],
            cases: match approach {
                Approach::Optimum => vec![Case::new(approach, model, 0)],
                _ => over_samples(approach, model, max_samples).collect(),
            },
            ..Row::default()
        });
        let plots = [0, 1].map(|metric| {
            let name = METRICS[metric].title;
            let lines = approaches.clone().enumerate();
            PlotOfColumns {
                name: format!("{}-{}", model.name(), name.to_lowercase()),
                title: format!("{}: {name} over the number of samples", title(model)),
                x: samples_axis(),
                x_column: 1,
                metric: name,
                lines: lines
                    .map(|(row, approach)| Line::new(approach, Some(row), 2 + metric))
                    .collect(),
            }
        });
        let mut columns = vec![Column::text("Method"), Column::plain("n", 0)];
        columns.extend(METRICS.map(|metric| Column::plain(metric.title, metric.decimals)));
        parts.push(Part::Grid(Grid {
            values: |evaluated| {
                let cases = evaluated.row.cases.iter().zip(&evaluated.reports);
                let rows = cases.map(|(case, report)| {
                    // The number of samples of Optimum is unlimited.
                    let n = Some(case.samples as f64).filter(|n| *n > 0.0);
                    let labels = evaluated.row.labels.iter().cloned().chain([Cell::from(n)]);
                    labels
                        .chain(report.metrics.values().map(Cell::Number))
                        .collect()
                });
                Ok(rows.collect())
            },
            plots: plots.into(),
            ..Grid::new(model.name(), title(model), columns, rows.collect())
        }));
    }
    Plan {
        title: "Quality over the number of samples",
        parts,
    }
}

/// The number of samples that other methods need to match the quality of the paper's at n = 8 (paper, table
/// "SameQuality").
pub(super) fn same_quality(max_samples: usize) -> Plan {
    let intro = format!(
        "The number of samples that a method needs to match the quality of the paper's at n = 8, divided by \
         8. Values between the evaluated n are interpolated linearly over ln n. An entry is empty if {max_samples} samples \
         are not enough."
    );
    let rows = MODELS.into_iter().flat_map(|model| {
        let approaches = [
            Approach::Random,
            Approach::baseline(model),
            Approach::Glimpse,
        ];
        approaches.map(|approach| Row {
            labels: vec![title(model).into(), approach.name().into()],
            cases: [Case::new(Approach::Paper, model, SAMPLES)]
                .into_iter()
                .chain(over_samples(approach, model, max_samples))
                .collect(),
            published: published_cells(paper::same_quality(model, approach)),
        })
    });
    let mut columns = vec![Column::text("Model"), Column::text("Method")];
    let ratios = |prefix: &'static str| {
        METRICS.iter().map(move |metric| {
            let (name, _unit) = metric.title.split_once(" (").unwrap_or((metric.title, ""));
            Column::plain(format!("{prefix}{name}, x"), 1)
        })
    };
    columns.extend(ratios(""));
    columns.extend(ratios("paper: ").take(PAPER_METRICS));
    let caption = format!(
        "Samples needed to match the quality of the paper's at n = {SAMPLES}, divided by {SAMPLES}"
    );
    let grid = Grid {
        values: |evaluated| {
            let values = evaluated.reports.iter().map(|each| each.metrics.values());
            let values: Vec<[f64; METRICS.len()]> = values.collect();
            let cells = METRICS.iter().enumerate().map(|(index, metric)| {
                let points = evaluated.row.cases.iter().zip(&values).skip(1);
                let points = points.map(|(case, values)| (case.samples as f64, values[index]));
                let n = samples_to_reach(points, values[0][index], !metric.higher_is_better);
                Cell::from(n.map(|n| n / SAMPLES as f64))
            });
            let row = evaluated.row.labels.iter().cloned().chain(cells);
            Ok(vec![row.chain(evaluated.row.published.clone()).collect()])
        },
        ..Grid::new("times", caption, columns, rows.collect())
    };
    Plan {
        title: "Samples needed for the same quality",
        parts: vec![Part::Text(intro), Part::Grid(grid)],
    }
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

/// Importance sampling of the mean BRDF (paper, "Mean-BRDF importance sampling").
pub(super) fn importance(max_samples: usize) -> Plan {
    let intro = "A Sobol sequence is mapped through the inverse cumulative distribution of the logarithmic \
                 mean of the training materials. Initial parameters and step sizes are those of Meta. In \
                 the paper, the loss is more than four times that of its own method on average.";
    let rows = powers_of_two(max_samples).map(|n| {
        let meta = Case::new(Approach::Meta, ModelKind::Neural, n);
        let paper = Case::new(Approach::Paper, ModelKind::Neural, n);
        Row {
            labels: vec![n.into()],
            cases: vec![meta.with(Variation::Importance), meta, paper],
            ..Row::default()
        }
    });
    let columns = vec![
        Column::plain("n", 0),
        Column::loss("Importance"),
        Column::loss(Approach::Meta.name()),
        Column::loss(Approach::Paper.name()),
        Column::plain(format!("Importance / {}", Approach::Paper.name()), 2),
    ];
    let importance = Line {
        name: "Importance".into(),
        style: (SeriesColor::Green, Marker::Ring),
        row: None,
        column: 1,
    };
    let plot = PlotOfColumns {
        name: "importance".into(),
        title: "Neural: importance sampling of the mean BRDF".into(),
        x: samples_axis(),
        x_column: 0,
        metric: METRICS[0].title,
        lines: vec![
            importance,
            Line::new(Approach::Meta, None, 2),
            Line::new(Approach::Paper, None, 3),
        ],
    };
    let grid = Grid {
        compare: Compare::WithinRow,
        values: |evaluated| {
            let losses = evaluated.losses();
            let ratio = losses[0] / losses[2];
            Ok(evaluated.row_of(losses.into_iter().chain([ratio])))
        },
        plots: vec![plot],
        ..Grid::new("importance", "Neural, loss", columns, rows.collect())
    };
    Plan {
        title: "Importance sampling of the mean BRDF",
        parts: vec![Part::Text(intro.into()), Part::Grid(grid)],
    }
}

/// Budgets for motion in training, in seconds at [`MOTION_SPEED`].
const BUDGETS: [u32; 3] = [5, 10, 20];

/// Quality over the seconds of a scan, for patterns trained with and without a budget for the time of motion.
pub(super) fn frontier(store: &Store<'_>, max_samples: usize) -> Plan {
    const MODEL: ModelKind = ModelKind::Linear;
    /// Indices in [`METRICS`]: Loss and Delta E.
    const SHOWN: [usize; 2] = [0, 4];
    let intro = format!(
        "Linear, n = 1, 2, 4, ... {max_samples}; each point is a separate training. Patterns that were trained for \
         samples are scanned in the fastest order. Those that were trained for seconds keep to a budget of motion. \
         \"Chosen by the readings\" has no pattern: each direction is the one that reduces the expected loss most per \
         second. All axes turn at {MOTION_SPEED} degrees per second, and a reading takes 0.5 s. A scan starts with the light and the \
         sensor along the normal, and ends with the last reading."
    );
    let (paper, glimpse) = (Approach::Paper, Approach::Glimpse);
    let mut kinds = vec![
        (
            format!("{}, for samples", paper.name()),
            paper,
            Variation::None,
        ),
        (
            format!("{}, for samples", glimpse.name()),
            glimpse,
            Variation::None,
        ),
    ];
    kinds.extend(BUDGETS.map(|seconds| {
        let name = format!("{}, {seconds} s of motion", glimpse.name());
        (name, glimpse, Variation::Within(seconds))
    }));
    let chosen = format!("{}, chosen by the readings", glimpse.name());
    kinds.push((chosen, Approach::Any, Variation::Chosen(0)));
    let styles = [
        (SeriesColor::Black, Marker::Cross),
        (SeriesColor::Blue, Marker::Ring),
        (SeriesColor::Vermillion, Marker::Triangle),
        (SeriesColor::Orange, Marker::Disc),
        (SeriesColor::Green, Marker::Disc),
        (SeriesColor::Purple, Marker::Ring),
    ];
    let mut columns = vec![Column::text("Trained"), Column::plain("n", 0)];
    columns.push(Column::plain("seconds", 1));
    columns.extend(SHOWN.map(|index| Column::plain(METRICS[index].title, METRICS[index].decimals)));
    let mut parts = vec![Part::Text(intro)];
    for set in 0..store.sets.len() {
        let suffix = match set {
            0 => String::new(),
            set => format!("-{set}"),
        };
        let rows = |min_samples| {
            let rows = kinds.iter().map(|(name, approach, variation)| Row {
                labels: vec![name[..].into()],
                cases: over_samples(*approach, MODEL, max_samples)
                    .filter(|case| case.samples >= min_samples)
                    .map(|case| match variation {
                        Variation::Chosen(_) => Case {
                            samples: 0,
                            variation: Variation::Chosen(case.samples),
                            ..case
                        },
                        _ => case.with(*variation),
                    })
                    .collect(),
                ..Row::default()
            });
            rows.collect::<Vec<_>>()
        };
        let plots = SHOWN.iter().enumerate().map(|(column, metric)| {
            let name = METRICS[*metric].title;
            let short = name.to_lowercase().replace(' ', "-");
            let lines = kinds.iter().zip(styles).enumerate();
            PlotOfColumns {
                name: format!("{short}{suffix}"),
                title: format!("{name} over the seconds of a scan"),
                x: Axis {
                    title: "seconds of a scan".into(),
                    scale: Scale::Log10,
                },
                x_column: 2,
                metric: name,
                lines: lines
                    .map(|(row, ((name, ..), style))| Line {
                        name: name.clone(),
                        style,
                        row: Some(row),
                        column: 3 + column,
                    })
                    .collect(),
            }
        });
        let grid = |name: &str, min_samples| Grid {
            set,
            values: rows_with_seconds,
            ..Grid::new(
                format!("{name}{suffix}"),
                "Linear",
                columns.clone(),
                rows(min_samples),
            )
        };
        // A short table of the two largest n, and the points of the plots.
        parts.push(Part::Grid(grid("seconds", max_samples.div_ceil(3))));
        parts.push(Part::Grid(Grid {
            plots: plots.collect(),
            ..grid("points", 1)
        }));
    }
    Plan {
        title: "Quality over the seconds of a scan",
        parts,
    }
}

/// Returns n, the seconds of a scan, the loss and the color difference of each case.
fn rows_with_seconds(evaluated: &Evaluated<'_, '_>) -> anyhow::Result<Vec<Vec<Cell>>> {
    let mut rows = Vec::new();
    for (case, report) in evaluated.row.cases.iter().zip(&evaluated.reports) {
        let mut row = evaluated.row.labels.clone();
        row.push(report.samples.into());
        if let Some(seconds) = report.seconds {
            row.push(seconds.into());
        } else if let Some(training) = case.training() {
            let (file, _) = evaluated.store.recipe(&training)?;
            let stops = stops(&file.recipe(), &Limits::NONE)
                .map_err(|_| anyhow::anyhow!("a sample is below the horizon"))?;
            let seed = evaluated.store.settings.seed;
            let route = Route::new(&Machine::default(), &stops, Order::Travel, seed);
            row.push(route.total().into());
        }
        row.extend([report.metrics.loss, report.metrics.delta_e].map(Cell::Number));
        rows.push(row);
    }
    Ok(rows)
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
