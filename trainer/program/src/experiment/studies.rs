//! The paper's studies of its method: robustness, seeds, repeated stages, convergence and subsets.

use crate::report::{Cell, Column, Compare};
use glimpse_core::model::ModelKind;

use super::case::{Approach, Case, REFINEMENT_STEPS, Subset, Variation};
use super::engine::{Grid, Part, Plan, Row};
use super::glossiness::split_by_glossiness;
use super::paper;
use super::shared::{MODELS, SAMPLES, title};
use super::store::Store;

/// Learned samples replaced by random ones (paper, table "robustness").
pub(super) fn robustness() -> Plan {
    /// Numbers of replaced samples.
    const REPLACED: [usize; 2] = [2, 4];
    /// Number of independent runs.
    const RUNS: u64 = 5;
    let rows = MODELS.into_iter().flat_map(|model| {
        let whole = Case::new(Approach::Paper, model, SAMPLES);
        let counts = REPLACED.into_iter().zip(paper::robustness(model));
        counts.map(move |(count, published)| {
            let runs = (0..RUNS).map(|run| whole.with(Variation::Replaced(count, run)));
            Row {
                labels: vec![title(model).into(), count.into()],
                cases: [whole].into_iter().chain(runs).collect(),
                published: vec![published.into()],
            }
        })
    });
    let caption = format!(
        "Loss of the paper's method with r of {SAMPLES} learned samples replaced by random ones, mean of {RUNS} runs"
    );
    let columns = vec![
        Column::text("Model"),
        Column::plain("r", 0),
        Column::plain("Loss, r = 0", 4),
        Column::plain("Loss", 4),
        Column::plain("increase, %", 1),
        Column::plain("paper: increase, %", 1),
    ];
    let grid = Grid {
        values: |evaluated| {
            let losses = evaluated.losses();
            let (whole, runs) = (losses[0], &losses[1..]);
            let loss = runs.iter().sum::<f64>() / runs.len() as f64;
            Ok(evaluated.row_of([whole, loss, 100.0 * (loss / whole - 1.0)]))
        },
        ..Grid::new("robustness", caption, columns, rows.collect())
    };
    Plan {
        title: "Some learned samples replaced by random ones",
        parts: vec![Part::Grid(grid)],
    }
}

/// Trainings with different seeds (paper, "Convergence": a spread of less than 5 %).
pub(super) fn seeds(store: &Store<'_>) -> Plan {
    /// Number of independent trainings.
    const TRAININGS: u64 = 5;
    let rows = MODELS.map(|model| Row {
        labels: vec![title(model).into()],
        cases: (0..TRAININGS)
            .map(|repetition| {
                let variation = match repetition {
                    0 => Variation::None,
                    number => Variation::Seed(number),
                };
                Case::new(Approach::Paper, model, SAMPLES).with(variation)
            })
            .collect(),
        ..Row::default()
    });
    let mut columns = vec![Column::text("Model")];
    let seed = |repetition: u64| store.settings.seed.wrapping_add(repetition);
    columns.extend((0..TRAININGS).map(|each| Column::plain(format!("seed {}", seed(each)), 4)));
    columns.extend([
        Column::plain("mean", 4),
        Column::plain("standard deviation", 4),
        Column::plain("% of the mean", 1),
    ]);
    let caption = format!("Loss of the paper's method at n = {SAMPLES}");
    let grid = Grid {
        values: |evaluated| {
            let mut row = evaluated.losses();
            let count = row.len() as f64;
            let mean = row.iter().sum::<f64>() / count;
            let sum_of_squares: f64 = row.iter().map(|loss| (loss - mean).powi(2)).sum();
            let deviation = (sum_of_squares / (count - 1.0)).sqrt();
            row.extend([mean, deviation, 100.0 * deviation / mean]);
            Ok(evaluated.row_of(row))
        },
        ..Grid::new("seeds", caption, columns, rows.into())
    };
    let intro = "In the paper the standard deviation is less than 5 % of the loss.";
    Plan {
        title: "Five trainings with different seeds",
        parts: vec![Part::Text(intro.into()), Part::Grid(grid)],
    }
}

/// A repetition of both training stages (paper, "Convergence").
pub(super) fn repeated_stages() -> Plan {
    let intro = "The paper's schedule trains initial parameters and step sizes on random samples, then the \
                 pattern. This experiment repeats both stages: it trains initial parameters and step sizes \
                 on that pattern, then the pattern again. Linear has no learned initial parameters.";
    let models = MODELS
        .into_iter()
        .filter(|model| *model != ModelKind::Linear);
    let rows = models.map(|model| {
        let once = Case::new(Approach::Paper, model, SAMPLES);
        Row {
            labels: vec![title(model).into()],
            cases: vec![once, once.with(Variation::Twice)],
            published: vec![Cell::from(paper::repeated_stages(model))],
        }
    });
    let columns = vec![
        Column::text("Model"),
        Column::loss("once"),
        Column::loss("twice"),
        Column::plain("gain, %", 2),
        Column::plain("paper: gain, %", 2),
    ];
    let caption = format!("Loss of the paper's method at n = {SAMPLES}");
    let grid = Grid {
        compare: Compare::WithinRow,
        values: |evaluated| {
            let losses = evaluated.losses();
            let gain = 100.0 * (1.0 - losses[1] / losses[0]);
            Ok(evaluated.row_of(losses.into_iter().chain([gain])))
        },
        ..Grid::new("again", caption, columns, rows.collect())
    };
    Plan {
        title: "Both training stages repeated",
        parts: vec![Part::Text(intro.into()), Part::Grid(grid)],
    }
}

/// 20 steps of each method, then many more on random samples (paper, "Convergence").
pub(super) fn convergence() -> Plan {
    /// Number of samples of the first 20 steps with learned methods, and with Random.
    const SAMPLES: [usize; 2] = [32, 512];
    let rows = [Approach::Random, Approach::Meta, Approach::Paper].map(|approach| {
        let samples = SAMPLES[usize::from(approach == Approach::Random)];
        let case = Case::new(approach, ModelKind::Neural, samples);
        Row {
            labels: vec![approach.name().into(), samples.into()],
            cases: vec![case, case.with(Variation::Refined)],
            published: vec![Cell::from(paper::convergence(approach))],
        }
    });
    let caption = format!(
        "Neural: loss after 20 steps, and after {REFINEMENT_STEPS} more on 512 fresh random samples each"
    );
    let columns = vec![
        Column::text("Method"),
        Column::plain("n of the 20 steps", 0),
        Column::loss("after 20 steps"),
        Column::loss("after all"),
        Column::plain("paper: after all", 4),
    ];
    Plan {
        title: "Convergence from learned initial parameters",
        parts: vec![Part::Grid(Grid::new(
            "convergence",
            caption,
            columns,
            rows.into(),
        ))],
    }
}

/// Patterns trained and evaluated on subsets of the materials (paper, "Subsets").
pub(super) fn subsets(store: &Store<'_>) -> anyhow::Result<Plan> {
    let intro = "Neural: initial parameters and step sizes are trained on all materials, the pattern on a \
                 subset. The diffuse half of the materials has the lower ratios of maximum to median (of \
                 BRDF times cosine), the glossy half the higher ones.";
    let mut parts = vec![Part::Text(intro.into())];
    let training = store.settings.data.load()?;
    for (set, materials) in [
        ("training", &training[..]),
        ("test", store.sets[0].materials),
    ] {
        let names = split_by_glossiness(materials, store.settings.seed, Subset::Diffuse);
        parts.push(Part::Text(format!(
            "Diffuse {set} materials: {}.",
            names.join(", ")
        )));
    }
    let paper = Case::new(Approach::Paper, ModelKind::Neural, SAMPLES);
    let rows = Subset::EACH.map(|subset| Row {
        labels: vec![subset.name().into()],
        cases: vec![paper.with(Variation::PatternOf(subset))],
        ..Row::default()
    });
    let mut columns = vec![Column::text("pattern trained on")];
    columns.extend(Subset::EACH.map(|subset| Column::loss(format!("judged on {}", subset.name()))));
    let caption = format!(
        "Neural, n = {SAMPLES}: loss of the paper's method by the training set of its pattern"
    );
    parts.push(Part::Grid(Grid {
        values: |evaluated| {
            let losses = Subset::EACH.map(|subset| {
                let (materials, seed) = (evaluated.set.materials, evaluated.store.settings.seed);
                let names = split_by_glossiness(materials, seed, subset);
                let materials = evaluated.reports.iter().flat_map(|each| &each.materials);
                let materials = materials.filter(|material| names.contains(&material.name));
                let sum: f64 = materials.map(|material| material.metrics.loss).sum();
                sum / names.len() as f64
            });
            Ok(evaluated.row_of(losses))
        },
        ..Grid::new("subsets", caption, columns, rows.into())
    }));
    Ok(Plan {
        title: "Patterns for diffuse and for glossy materials",
        parts,
    })
}
