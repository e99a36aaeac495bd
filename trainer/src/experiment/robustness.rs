//! Learned samples replaced by random ones (paper, table "robustness").

use anyhow::Context;
use glimpse_core::geometry::Angles;
use glimpse_materials::sampling::uniform_valid;
use glimpse_trainer::evaluation::Method;
use glimpse_trainer::report::{Cell, Column, Compare, Highlight, Table};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::case::{Approach, Case, TrainingRun};
use super::findings::Findings;
use super::store::Store;
use super::{MODELS, SAMPLES, SCHEDULE, paper, title};

/// Numbers of replaced samples.
const REPLACED: [usize; 2] = [2, 4];
/// The method whose samples are replaced.
const OURS: Approach = Approach::Ours(SCHEDULE);
/// Number of independent runs.
const RUNS: u64 = 5;

pub(super) fn run(store: &Store<'_>) -> anyhow::Result<Findings> {
    let mut findings = Findings::new(
        store,
        "Some learned samples replaced by random ones",
        &[SCHEDULE],
    );
    let mut rows = Vec::new();
    for model in MODELS {
        let case = Case::new(OURS, model, SAMPLES);
        let ours = store.evaluation(&case)?.metrics.loss;
        for (count, published) in REPLACED.into_iter().zip(paper::robustness(model)) {
            let mut sum = 0.0;
            for run in 0..RUNS {
                let seed = store.settings.seed.wrapping_add(run << 32);
                let name = format!("{}-n{SAMPLES}-replaced{count}-run{run}", model.name());
                let evaluation = store.cached_evaluation(store.test, &name, 1, |evaluate| {
                    let training = TrainingRun::for_case(&case)
                        .context("a case of Ours has no training run")?;
                    let learned = store.recipe(&training)?;
                    let recipe = learned.file.recipe();
                    let pattern: Vec<Angles<f32>> = recipe.pattern().collect();
                    let pattern = replace_samples(&pattern, count, seed);
                    let basis = learned.basis.as_ref();
                    evaluate(&Method::at_directions("replaced", &recipe, basis, pattern)?)
                })?;
                sum += evaluation.metrics.loss;
            }
            let loss = sum / RUNS as f64;
            rows.push(vec![
                Cell::Text(title(model).into()),
                Cell::Number(count as f64),
                Cell::Number(ours),
                Cell::Number(loss),
                Cell::Number(100.0 * (loss / ours - 1.0)),
                Cell::Number(published),
            ]);
        }
    }
    findings.table(
        "robustness",
        Table {
            caption: format!(
                "Loss of {} with r of {SAMPLES} learned samples replaced by random ones, mean of {RUNS} runs",
                OURS.title()
            ),
            columns: vec![
                Column::text("Model"),
                Column::number("r", 0, Highlight::None),
                Column::number("Loss, r = 0", 4, Highlight::None),
                Column::number("Loss", 4, Highlight::None),
                Column::number("increase, %", 1, Highlight::None),
                Column::number("paper: increase, %", 1, Highlight::None),
            ],
            rows,
            compare: Compare::WithinColumn,
        },
    );
    Ok(findings)
}

/// Replaces `count` samples of a pattern, chosen at random, by uniform random ones.
fn replace_samples(pattern: &[Angles<f32>], count: usize, seed: u64) -> Vec<Angles<f32>> {
    let mut indices: Vec<usize> = (0..pattern.len()).collect();
    indices.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    let mut pattern = pattern.to_vec();
    for (index, angles) in indices.into_iter().zip(uniform_valid(count, seed)) {
        pattern[index] = angles;
    }
    pattern
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replaces_requested_number_of_samples() {
        let pattern = uniform_valid(8, 1);
        for count in [0, 2, 8] {
            let changed = replace_samples(&pattern, count, 7);
            let differ = pattern.iter().zip(&changed).filter(|(a, b)| a != b);
            assert_eq!(differ.count(), count);
        }
        assert_ne!(
            replace_samples(&pattern, 2, 7),
            replace_samples(&pattern, 2, 8)
        );
    }
}
