//! Trainings with different seeds (paper, "Convergence": a spread of less than 5 %).

use anyhow::Context;
use glimpse_trainer::evaluation::Method;
use glimpse_trainer::report::{Cell, Column, Compare, Highlight, Table};

use super::case::{Approach, Case, TrainingRun};
use super::findings::Findings;
use super::store::Store;
use super::{MODELS, SAMPLES, SCHEDULE, title};

/// The method that is trained with each seed.
const OURS: Approach = Approach::Ours(SCHEDULE);
/// Number of independent trainings.
const TRAININGS: u64 = 5;

pub(super) fn run(store: &Store<'_>) -> anyhow::Result<Findings> {
    let mut findings = Findings::new(store, "Five trainings with different seeds", &[SCHEDULE]);
    findings.text("In the paper the standard deviation is less than 5 % of the loss.");
    let mut rows = Vec::new();
    for model in MODELS {
        let case = Case::new(OURS, model, SAMPLES);
        let mut losses = Vec::new();
        for repetition in 0..TRAININGS {
            let training =
                TrainingRun::for_case(&case).context("a case of Ours has no training run")?;
            let training = TrainingRun {
                repetition,
                ..training
            };
            let name = format!("{}-n{SAMPLES}-training{repetition}", model.name());
            let evaluation = store.cached_evaluation(store.test, &name, 1, |evaluate| {
                let learned = store.recipe(&training)?;
                let recipe = learned.file.recipe();
                evaluate(&Method::ours(&recipe, learned.basis.as_ref())?)
            })?;
            losses.push(evaluation.metrics.loss);
        }
        let count = losses.len() as f64;
        let mean = losses.iter().sum::<f64>() / count;
        let sum_of_squares: f64 = losses.iter().map(|loss| (loss - mean).powi(2)).sum();
        let deviation = (sum_of_squares / (count - 1.0)).sqrt();
        let mut row = vec![Cell::Text(title(model).into())];
        row.extend(losses.iter().map(|loss| Cell::Number(*loss)));
        row.extend([mean, deviation, 100.0 * deviation / mean].map(Cell::Number));
        rows.push(row);
    }
    let mut columns = vec![Column::text("Model")];
    let seed = |repetition: u64| store.settings.seed.wrapping_add(repetition);
    columns.extend((0..TRAININGS).map(|repetition| {
        Column::number(format!("seed {}", seed(repetition)), 4, Highlight::None)
    }));
    columns.extend([
        Column::number("mean", 4, Highlight::None),
        Column::number("standard deviation", 4, Highlight::None),
        Column::number("% of the mean", 1, Highlight::None),
    ]);
    findings.table(
        "seeds",
        Table {
            caption: format!("Loss of {} at n = {SAMPLES}", OURS.title()),
            columns,
            rows,
            compare: Compare::WithinColumn,
        },
    );
    Ok(findings)
}
