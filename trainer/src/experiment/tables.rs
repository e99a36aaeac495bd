//! What tables of several experiments have in common.

use glimpse_core::model::ModelKind;
use glimpse_trainer::evaluation::Estimate;
use glimpse_trainer::meta::plan::Schedule;
use glimpse_trainer::metrics::Scores;
use glimpse_trainer::report::{Best, Cell, Column};

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
    }
}

/// 1, 2, 4, ... up to the most.
pub(super) fn doublings(most: usize) -> impl Iterator<Item = usize> + Clone {
    std::iter::successors(Some(1), |n| Some(2 * n)).take_while(move |n| *n <= most)
}

/// The four metrics' names and how they are compared.
pub(super) const METRICS: [(&str, usize, Best); 4] = [
    ("Loss", 4, Best::Least),
    ("DSSIM", 4, Best::Least),
    ("L2", 5, Best::Least),
    ("PSNR (dB)", 2, Best::Greatest),
];

/// The four metrics, in that order.
pub(super) fn metrics(scores: &Scores) -> [f64; 4] {
    [scores.loss, scores.dssim, scores.l2, scores.psnr]
}

/// Columns for our four metrics, the standard error of our mean loss, and then for the paper's
/// metrics.
pub(super) fn columns_beside_the_paper_s() -> Vec<Column> {
    let ours = METRICS.map(|(title, decimals, best)| Column::number(title, decimals, best));
    let error = Column::number("Loss: std. error", 4, Best::None);
    let paper = METRICS.map(|(title, decimals, _)| {
        Column::number(format!("paper: {title}"), decimals.min(3), Best::None)
    });
    ours.into_iter().chain([error]).chain(paper).collect()
}

/// Cells for those.
pub(super) fn cells_beside_the_paper_s(
    evaluation: &Evaluation,
    paper: Option<&Scores>,
) -> Vec<Cell> {
    let losses: Vec<f64> = evaluation
        .materials
        .iter()
        .map(|each| each.scores.loss)
        .collect();
    let error = Estimate::of(&losses).standard_error;
    let paper = match paper {
        Some(paper) => metrics(paper).map(Cell::Number),
        None => [const { Cell::Missing }; 4],
    };
    metrics(&evaluation.scores)
        .map(Cell::Number)
        .into_iter()
        .chain([error.map_or(Cell::Missing, Cell::Number)])
        .chain(paper)
        .collect()
}
