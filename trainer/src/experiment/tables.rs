//! What tables of several experiments have in common.

use glimpse_core::model::ModelKind;
use glimpse_trainer::evaluation::Estimate;
use glimpse_trainer::metrics::Metrics;
use glimpse_trainer::report::{Best, Cell, Column};
use glimpse_training::meta::plan::Schedule;

use super::store::Evaluation;

/// All models, in the paper's order.
pub(super) const MODELS: [ModelKind; 4] = [
    ModelKind::Phong,
    ModelKind::CookTorrance,
    ModelKind::Linear,
    ModelKind::Neural,
];
/// The schedule of all experiments that do not name another one.
pub(super) const SCHEDULE: Schedule = Schedule::Joint;
/// The paper's n.
pub(super) const SAMPLES: usize = 8;

/// A model's name as the paper writes it.
pub(super) fn title(model: ModelKind) -> &'static str {
    match model {
        ModelKind::Phong => "Phong",
        ModelKind::CookTorrance => "Cook-Torrance",
        ModelKind::Linear => "Linear",
        ModelKind::Neural => "Neural",
        _ => model.name(),
    }
}

/// 1, 2, 4, ... up to the most.
pub(super) fn doublings(most: usize) -> impl Iterator<Item = usize> + Clone {
    std::iter::successors(Some(1), |n| Some(2 * n)).take_while(move |n| *n <= most)
}

/// The metrics' names, decimals, and how they are compared: the paper's four, and color difference.
pub(super) const METRICS: [(&str, usize, Best); 5] = [
    ("Loss", 4, Best::Least),
    ("DSSIM", 4, Best::Least),
    ("L2", 5, Best::Least),
    ("PSNR (dB)", 2, Best::Greatest),
    ("Delta E", 2, Best::Least),
];
/// The number of metrics that the paper has: the first of [`METRICS`].
pub(super) const PAPER_METRICS: usize = 4;
/// The paper's figures, in the order of [`METRICS`].
pub(super) type PaperMetrics = [f64; PAPER_METRICS];

/// The metrics in the order of [`METRICS`].
pub(super) fn metrics(scores: &Metrics) -> [f64; METRICS.len()] {
    let Metrics {
        loss,
        dssim,
        l2,
        psnr,
        delta_e,
    } = *scores;
    [loss, dssim, l2, psnr, delta_e]
}

/// Columns for our metrics, the standard error of our mean loss, and then for the paper's metrics.
pub(super) fn columns_beside_the_paper_s() -> Vec<Column> {
    let ours = METRICS.map(|(title, decimals, best)| Column::number(title, decimals, best));
    let error = Column::number("Loss: std. error", 4, Best::None);
    let paper = METRICS.into_iter().take(PAPER_METRICS);
    let paper = paper.map(|(title, decimals, _)| {
        Column::number(format!("paper: {title}"), decimals.min(3), Best::None)
    });
    ours.into_iter().chain([error]).chain(paper).collect()
}

/// Cells for those.
pub(super) fn cells_beside_the_paper_s(
    evaluation: &Evaluation,
    paper: Option<PaperMetrics>,
) -> Vec<Cell> {
    let losses: Vec<f64> = evaluation
        .materials
        .iter()
        .map(|each| each.scores.loss)
        .collect();
    let error = Estimate::of(&losses).standard_error;
    let paper = match paper {
        Some(paper) => paper.map(Cell::Number),
        None => [const { Cell::Missing }; PAPER_METRICS],
    };
    metrics(&evaluation.scores)
        .map(Cell::Number)
        .into_iter()
        .chain([error.map_or(Cell::Missing, Cell::Number)])
        .chain(paper)
        .collect()
}
