//! Both stages trained once more after the end (paper, "Convergence").

use glimpse_core::model::ModelKind;
use glimpse_trainer::evaluation::Method;
use glimpse_trainer::linear::Prior;
use glimpse_trainer::meta::options::Parts;
use glimpse_trainer::meta::plan::Schedule;
use glimpse_trainer::report::{Best, Cell, Column, Compare, Table};

use super::case::TrainingRun;
use super::findings::Findings;
use super::store::Store;
use super::{MODELS, SAMPLES, paper, title};

pub(super) fn run(store: &Store<'_>) -> anyhow::Result<Findings> {
    let mut findings = Findings::new("Both stages once more");
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
        let mut losses = Vec::new();
        for (name, parts) in [("once", Parts::All), ("twice", Parts::AllTwice)] {
            let training = TrainingRun {
                model,
                samples: SAMPLES,
                schedule: Schedule::Paper,
                parts,
                prior: Prior::PAPER,
                repetition: 0,
                only: None,
            };
            let name = format!("{}-n{SAMPLES}-paper-{name}", model.name());
            let evaluation = store.kept_evaluation(store.test, &name, 1, |judge| {
                let learned = store.recipe(&training)?;
                judge(&Method::ours(&learned.file.recipe()?, None)?)
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
            caption: format!("Loss of Ours at n = {SAMPLES}"),
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
