//! Both stages trained once more after the end (paper, "Convergence").

use anyhow::Context;
use glimpse_core::model::ModelKind;
use glimpse_trainer::evaluation::Method;
use glimpse_trainer::report::{Best, Cell, Column, Compare, Table};
use glimpse_training::meta::options::Parts;
use glimpse_training::meta::plan::Schedule;

use super::case::{Approach, Case, TrainingRun};
use super::findings::Findings;
use super::store::Store;
use super::{MODELS, SAMPLES, paper, title};

/// The method that is trained by both stages.
const OURS: Approach = Approach::Ours(Schedule::Paper);

pub(super) fn run(store: &Store<'_>) -> anyhow::Result<Findings> {
    let mut findings = Findings::new(store, "Both stages once more", &[Schedule::Paper]);
    findings.text(
        "By the paper's schedule: start and step sizes on random samples, then the pattern; and \
         then start and step sizes on that pattern, and the pattern once more. (Linear learns no \
         start.)",
    );
    let mut rows = Vec::new();
    for model in MODELS {
        if model == ModelKind::Linear {
            continue;
        }
        let case = Case::new(OURS, model, SAMPLES);
        let mut losses = Vec::new();
        for (name, parts) in [("once", Parts::All), ("twice", Parts::AllTwice)] {
            let training = TrainingRun::of(&case).map(|training| TrainingRun { parts, ..training });
            let training = training.context("Ours is trained")?;
            let name = format!("{}-n{SAMPLES}-paper-{name}", model.name());
            let evaluation = store.kept_evaluation(store.test, &name, 1, |judge| {
                let learned = store.recipe(&training)?;
                judge(&Method::ours(&learned.file.recipe(), None)?)
            })?;
            losses.push(evaluation.scores.loss);
        }
        let [once, twice] = losses[..] else {
            continue;
        };
        rows.push(vec![
            Cell::Text(title(model).into()),
            Cell::Number(once),
            Cell::Number(twice),
            Cell::Number(100.0 * (1.0 - twice / once)),
            paper::again(model).map_or(Cell::Missing, Cell::Number),
        ]);
    }
    findings.table(
        "again",
        Table {
            caption: format!("Loss of {} at n = {SAMPLES}", OURS.title()),
            columns: vec![
                Column::text("Model"),
                Column::number("once", 4, Best::Least),
                Column::number("twice", 4, Best::Least),
                Column::number("gain, %", 2, Best::None),
                Column::number("paper: gain, %", 2, Best::None),
            ],
            rows,
            compare: Compare::Across,
        },
    );
    Ok(findings)
}
