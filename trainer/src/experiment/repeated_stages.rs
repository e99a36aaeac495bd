//! A repetition of both training stages (paper, "Convergence").

use anyhow::Context;
use glimpse_core::model::ModelKind;
use glimpse_trainer::evaluation::Method;
use glimpse_trainer::report::{Cell, Column, Compare, Highlight, Table};
use glimpse_training::meta::plan::Schedule;
use glimpse_training::meta::plan::TrainedParts;

use super::case::{Approach, Case, TrainingRun};
use super::findings::Findings;
use super::store::Store;
use super::{MODELS, SAMPLES, paper, title};

/// The method that both stages train.
const OURS: Approach = Approach::Ours(Schedule::Paper);

pub(super) fn run(store: &Store<'_>) -> anyhow::Result<Findings> {
    let mut findings = Findings::new(store, "Both training stages repeated", &[Schedule::Paper]);
    findings.text(
        "The paper's schedule trains initial parameters and step sizes on random samples, then the \
         pattern. This experiment repeats both stages: it trains initial parameters and step sizes on \
         that pattern, then the pattern again. Linear has no learned initial parameters.",
    );
    let mut rows = Vec::new();
    for model in MODELS {
        if model == ModelKind::Linear {
            continue;
        }
        let case = Case::new(OURS, model, SAMPLES);
        let mut losses = Vec::new();
        for (name, parts) in [
            ("once", TrainedParts::All),
            ("twice", TrainedParts::AllTwice),
        ] {
            let training =
                TrainingRun::for_case(&case).context("a case of Ours has no training run")?;
            let training = TrainingRun { parts, ..training };
            let name = format!("{}-n{SAMPLES}-paper-{name}", model.name());
            let evaluation = store.cached_evaluation(store.test, &name, 1, |evaluate| {
                let learned = store.recipe(&training)?;
                evaluate(&Method::ours(&learned.file.recipe(), None)?)
            })?;
            losses.push(evaluation.metrics.loss);
        }
        let [once, twice] = losses[..] else {
            continue;
        };
        rows.push(vec![
            Cell::Text(title(model).into()),
            Cell::Number(once),
            Cell::Number(twice),
            Cell::Number(100.0 * (1.0 - twice / once)),
            paper::repeated_stages(model).map_or(Cell::Missing, Cell::Number),
        ]);
    }
    findings.table(
        "again",
        Table {
            caption: format!("Loss of {} at n = {SAMPLES}", OURS.title()),
            columns: vec![
                Column::text("Model"),
                Column::number("once", 4, Highlight::Lowest),
                Column::number("twice", 4, Highlight::Lowest),
                Column::number("gain, %", 2, Highlight::None),
                Column::number("paper: gain, %", 2, Highlight::None),
            ],
            rows,
            compare: Compare::WithinRow,
        },
    );
    Ok(findings)
}
