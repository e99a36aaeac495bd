//! Patterns trained and evaluated on subsets of the materials (paper, "Subsets").

use anyhow::Context;
use glimpse_core::fit::Estimator;
use glimpse_core::model::ModelKind;
use glimpse_materials::Material;
use glimpse_trainer::evaluation::{MaterialMetrics, Method};
use glimpse_trainer::report::{Cell, Column, Compare, Highlight, Table};
use glimpse_training::meta::plan::PretrainedInit;
use glimpse_training::meta::plan::TrainedParts;

use super::case::{Approach, Case, TrainingRun};
use super::findings::Findings;
use super::glossiness::by_glossiness;
use super::store::Store;
use super::{SAMPLES, SCHEDULE};

/// The subsets: all materials, the more diffuse half, the glossier half.
const SUBSETS: [&str; 3] = ["all", "diffuse", "glossy"];

pub(super) fn run(store: &Store<'_>) -> anyhow::Result<Findings> {
    let mut findings = Findings::new(
        store,
        "Patterns for diffuse and for glossy materials",
        &[SCHEDULE],
    );
    let training = store.settings.data.load()?;
    let training_names = split_by_glossiness(store, &training);
    let test_names = split_by_glossiness(store, store.test.materials);
    findings.text(
        "Neural: initial parameters and step sizes are trained on all materials, the pattern on a \
         subset. The diffuse half of the materials has the lower ratios of maximum to median (of BRDF \
         times cosine), the glossy half the higher ones.",
    );
    findings.text(format!(
        "Diffuse training materials: {}.",
        training_names[1].join(", ")
    ));
    findings.text(format!(
        "Diffuse test materials: {}.",
        test_names[1].join(", ")
    ));

    let case = Case::new(Approach::Meta(SCHEDULE), ModelKind::Neural, SAMPLES);
    let full_training =
        TrainingRun::for_case(&case).context("a case of Meta has no training run")?;
    let learned = store.recipe(&full_training)?;
    let recipe = learned.file.recipe();
    let Estimator::Sgd(sgd) = recipe.estimator() else {
        anyhow::bail!(
            "the recipe of the model neural is not fitted by descent: remove it to train it again"
        );
    };
    let pretrained = PretrainedInit {
        initial: sgd.initial.iter().collect(),
        step_sizes: sgd.step_sizes.iter().collect(),
    };
    let mut rows = Vec::new();
    for (subset, names) in SUBSETS.into_iter().zip(training_names) {
        let training = TrainingRun {
            parts: TrainedParts::PatternOnly,
            pretrained: Some(pretrained.clone()),
            subset: Some((subset, names)),
            ..full_training.clone()
        };
        let name = format!("neural-n{SAMPLES}-pattern-of-{subset}");
        let evaluation = store.cached_evaluation(store.test, &name, 1, |evaluate| {
            let learned = store.recipe(&training)?;
            evaluate(&Method::ours(&learned.file.recipe(), None)?)
        })?;
        let mut row = vec![Cell::Text(subset.into())];
        row.extend(
            test_names
                .iter()
                .map(|names| Cell::Number(mean_loss(&evaluation.materials, names))),
        );
        rows.push(row);
    }
    let mut columns = vec![Column::text("pattern trained on")];
    columns.extend(
        SUBSETS.map(|subset| Column::number(format!("judged on {subset}"), 4, Highlight::Lowest)),
    );
    findings.table(
        "subsets",
        Table {
            caption: format!(
                "Neural, n = {SAMPLES}: loss of {} by the training set of its pattern",
                Approach::Ours(SCHEDULE).title()
            ),
            columns,
            rows,
            compare: Compare::WithinColumn,
        },
    );
    Ok(findings)
}

/// Returns the names of all materials, of the more diffuse half, and of the glossier half.
fn split_by_glossiness(store: &Store<'_>, materials: &[Box<dyn Material>]) -> [Vec<String>; 3] {
    let order = by_glossiness(materials, store.settings.seed);
    let names: Vec<String> = order
        .into_iter()
        .map(|index| materials[index].name().to_owned())
        .collect();
    let (diffuse, glossy) = names.split_at(names.len() / 2);
    [names.clone(), diffuse.to_vec(), glossy.to_vec()]
}

/// Returns the mean loss over the materials with these names.
fn mean_loss(materials: &[MaterialMetrics], names: &[String]) -> f64 {
    let losses: Vec<f64> = materials
        .iter()
        .filter(|material| names.contains(&material.name))
        .map(|material| material.metrics.loss)
        .collect();
    losses.iter().sum::<f64>() / losses.len() as f64
}
