//! Columns and cells that tables of several experiments share.

use glimpse_core::model::ModelKind;
pub(super) use glimpse_materials::MODELS;
use glimpse_trainer::evaluation::Estimate;
use glimpse_trainer::metrics::Metrics;
use glimpse_trainer::report::{Cell, Column, Highlight};
use glimpse_training::meta::plan::Schedule;

use super::store::Evaluation;

/// The default schedule of experiments.
pub(super) const SCHEDULE: Schedule = Schedule::Joint;
/// The paper's number of samples n.
pub(super) const SAMPLES: usize = 8;

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

/// Names, decimals and highlights of the metrics: the paper's four, and color difference.
pub(super) const METRICS: [(&str, usize, Highlight); 5] = [
    ("Loss", 4, Highlight::Lowest),
    ("DSSIM", 4, Highlight::Lowest),
    ("L2", 5, Highlight::Lowest),
    ("PSNR (dB)", 2, Highlight::Highest),
    ("Delta E", 2, Highlight::Lowest),
];
/// Number of metrics in the paper, which come first in [`METRICS`].
pub(super) const PAPER_METRICS: usize = 4;
/// The published values, in the order of [`METRICS`].
pub(super) type PaperMetrics = [f64; PAPER_METRICS];

/// Returns the metrics in the order of [`METRICS`].
pub(super) fn metric_values(metrics: &Metrics) -> [f64; METRICS.len()] {
    let Metrics {
        loss,
        dssim,
        l2,
        psnr,
        delta_e,
    } = *metrics;
    [loss, dssim, l2, psnr, delta_e]
}

/// Returns columns for our metrics, the standard error of our mean loss, and the paper's metrics.
pub(super) fn metric_columns() -> Vec<Column> {
    let ours =
        METRICS.map(|(title, decimals, highlight)| Column::number(title, decimals, highlight));
    let standard_error = Column::number("Loss: std. error", 4, Highlight::None);
    let paper = METRICS.into_iter().take(PAPER_METRICS);
    let paper = paper.map(|(title, decimals, _)| {
        Column::number(format!("paper: {title}"), decimals.min(3), Highlight::None)
    });
    ours.into_iter()
        .chain([standard_error])
        .chain(paper)
        .collect()
}

/// Returns the cells for [`metric_columns`].
pub(super) fn metric_cells(evaluation: &Evaluation, paper: Option<PaperMetrics>) -> Vec<Cell> {
    let losses: Vec<f64> = evaluation
        .materials
        .iter()
        .map(|material| material.metrics.loss)
        .collect();
    let standard_error = Estimate::from_values(&losses).standard_error;
    let paper = match paper {
        Some(paper) => paper.map(Cell::Number),
        None => [const { Cell::Missing }; PAPER_METRICS],
    };
    metric_values(&evaluation.metrics)
        .map(Cell::Number)
        .into_iter()
        .chain([standard_error.map_or(Cell::Missing, Cell::Number)])
        .chain(paper)
        .collect()
}
