//! Learned samples replaced by random ones (paper, table "robustness").

use anyhow::Context;
use glimpse_core::geometry::Angles;
use glimpse_materials::sampling::uniform_valid;
use glimpse_trainer::evaluation::Method;
use glimpse_trainer::report::{Best, Cell, Column, Compare, Table};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::case::{Approach, Case, TrainingRun};
use super::findings::Findings;
use super::store::Store;
use super::{MODELS, SAMPLES, SCHEDULE, paper, title};

/// How many samples are replaced.
const REPLACED: [usize; 2] = [2, 4];
/// The method whose samples are replaced.
const OURS: Approach = Approach::Ours(SCHEDULE);
/// Independent runs.
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
        let ours = store.evaluation(&case)?.scores.loss;
        for (count, paper) in REPLACED.into_iter().zip(paper::robustness(model)) {
            let mut sum = 0.0;
            for run in 0..RUNS {
                let seed = store.settings.seed.wrapping_add(run << 32);
                let name = format!("{}-n{SAMPLES}-replaced{count}-run{run}", model.name());
                let evaluation = store.kept_evaluation(store.test, &name, 1, |judge| {
                    let training = TrainingRun::of(&case).context("Ours is trained")?;
                    let learned = store.recipe(&training)?;
                    let recipe = learned.file.recipe();
                    let pattern: Vec<Angles<f32>> = recipe.pattern().collect();
                    let pattern = replaced(&pattern, count, seed);
                    let basis = learned.basis.as_ref();
                    judge(&Method::elsewhere("replaced", &recipe, basis, pattern)?)
                })?;
                sum += evaluation.scores.loss;
            }
            let loss = sum / RUNS as f64;
            rows.push(vec![
                Cell::Text(title(model).into()),
                Cell::Number(count as f64),
                Cell::Number(ours),
                Cell::Number(loss),
                Cell::Number(100.0 * (loss / ours - 1.0)),
                Cell::Number(paper),
            ]);
        }
    }
    findings.table(
        "robustness",
        Table {
            caption: format!(
                "Loss of {} where r of {SAMPLES} learned samples are random instead, mean of {RUNS} runs",
                OURS.title()
            ),
            columns: vec![
                Column::text("Model"),
                Column::number("r", 0, Best::None),
                Column::number("Loss, r = 0", 4, Best::None),
                Column::number("Loss", 4, Best::None),
                Column::number("increase, %", 1, Best::None),
                Column::number("paper: increase, %", 1, Best::None),
            ],
            rows,
            compare: Compare::Down,
        },
    );
    Ok(findings)
}

/// The pattern with so many of its samples, chosen at random, uniform random ones.
fn replaced(pattern: &[Angles<f32>], count: usize, seed: u64) -> Vec<Angles<f32>> {
    let mut places: Vec<usize> = (0..pattern.len()).collect();
    places.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    let mut pattern = pattern.to_vec();
    for (place, angles) in places.into_iter().zip(uniform_valid(count, seed)) {
        pattern[place] = angles;
    }
    pattern
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_samples_change_as_were_asked_for() {
        let pattern = uniform_valid(8, 1);
        for count in [0, 2, 8] {
            let changed = replaced(&pattern, count, 7);
            let differ = pattern.iter().zip(&changed).filter(|(a, b)| a != b);
            assert_eq!(differ.count(), count);
        }
        assert_ne!(replaced(&pattern, 2, 7), replaced(&pattern, 2, 8));
    }
}
