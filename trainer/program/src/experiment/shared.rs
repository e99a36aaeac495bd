//! Rows, columns and names that several experiments share.

use crate::report::{Axis, Cell, Column, Compare, Scale, metric_columns};
use glimpse_core::model::ModelKind;
use glimpse_evaluation::evaluation::Report;
use glimpse_evaluation::metrics::METRICS;

use super::case::Case;
use super::engine::{Evaluated, Grid, Row};
use super::paper::PaperMetrics;

/// All models, in the paper's order.
pub(super) const MODELS: [ModelKind; 4] = [
    ModelKind::Phong,
    ModelKind::CookTorrance,
    ModelKind::Linear,
    ModelKind::Neural,
];
/// The paper's number of samples n.
pub(super) const SAMPLES: usize = 8;
/// Number of metrics in the paper, which come first in [`METRICS`].
pub(super) const PAPER_METRICS: usize = 4;

/// Returns a model's name as written in the paper.
pub(super) fn title(model: ModelKind) -> &'static str {
    match model {
        ModelKind::Phong => "Phong",
        ModelKind::CookTorrance => "Cook-Torrance",
        ModelKind::Linear => "Linear",
        ModelKind::Neural => "Neural",
        _ => model.name(),
    }
}

/// Iterates over 1, 2, 4, ... up to `max`.
pub(super) fn powers_of_two(max: usize) -> impl Iterator<Item = usize> + Clone {
    std::iter::successors(Some(1), |n| Some(2 * n)).take_while(move |n| *n <= max)
}

/// The axis of the number of samples n.
pub(super) fn samples_axis() -> Axis {
    Axis {
        title: "samples n".into(),
        scale: Scale::Log2,
    }
}

impl Grid {
    /// Creates a table on the test set, without plots, that compares the numbers of each column. Its rows show the
    /// loss of each case.
    pub(super) fn new(
        name: impl Into<String>,
        caption: impl Into<String>,
        columns: Vec<Column>,
        rows: Vec<Row>,
    ) -> Self {
        Self {
            name: name.into(),
            caption: caption.into(),
            set: 0,
            columns,
            compare: Compare::WithinColumn,
            rows,
            values: |evaluated| Ok(evaluated.row_of(evaluated.losses())),
            plots: Vec::new(),
        }
    }

    /// Creates a table of all metrics of single cases, with the standard error of the mean loss and the paper's
    /// metrics.
    pub(super) fn of_metrics(
        name: impl Into<String>,
        caption: impl Into<String>,
        labels: &[&str],
        rows: impl IntoIterator<Item = (Vec<Cell>, Case, Option<PaperMetrics>)>,
    ) -> Self {
        let mut columns: Vec<Column> = labels.iter().map(|label| Column::text(*label)).collect();
        columns.extend(metric_columns());
        columns.push(Column::plain("Loss: std. error", 4));
        let paper = METRICS.iter().take(PAPER_METRICS);
        columns.extend(paper.map(|metric| {
            Column::plain(format!("paper: {}", metric.title), metric.decimals.min(3))
        }));
        let rows = rows.into_iter().map(|(labels, case, published)| Row {
            labels,
            cases: vec![case],
            published: published_cells(published),
        });
        Self {
            values: all_metrics,
            ..Self::new(name, caption, columns, rows.collect())
        }
    }
}

/// Returns cells of the paper's metrics.
pub(super) fn published_cells(published: Option<PaperMetrics>) -> Vec<Cell> {
    let cell = |index: usize| published.map(|metrics| metrics[index]).into();
    (0..PAPER_METRICS).map(cell).collect()
}

/// Returns the metrics and the standard error of a single case.
fn all_metrics(evaluated: &Evaluated<'_, '_>) -> anyhow::Result<Vec<Vec<Cell>>> {
    let cells = |report: &Report| {
        let mut row = evaluated.row.labels.clone();
        row.extend(Cell::of_metrics(&report.metrics));
        row.push(report.loss_standard_error.into());
        row.extend(evaluated.row.published.clone());
        row
    };
    Ok(evaluated.reports.iter().map(cells).collect())
}
