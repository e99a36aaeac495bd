//! Patterns trained and judged on parts of the materials (paper, "Subsets").

use anyhow::Context;
use glimpse_core::model::ModelKind;
use glimpse_materials::Material;
use glimpse_trainer::evaluation::{MaterialMetrics, Method};
use glimpse_trainer::report::{Best, Cell, Column, Compare, Table};
use glimpse_training::meta::options::Parts;
use glimpse_training::meta::plan::PretrainedInit;

use super::case::{Approach, Case, TrainingRun};
use super::findings::Findings;
use super::store::Store;
use super::{SAMPLES, SCHEDULE};

/// The parts: all materials, the more diffuse half, the glossier half.
const PARTS: [&str; 3] = ["all", "diffuse", "glossy"];

pub(super) fn run(store: &Store<'_>) -> anyhow::Result<Findings> {
    let mut findings = Findings::new(
        store,
        "Patterns for diffuse and for glossy materials",
        &[SCHEDULE],
    );
    let training = store.settings.data.load()?;
    let names = parts(store, &training);
    let judged = parts(store, store.test.materials);
    findings.text(
        "Neural: start and step sizes are trained on all materials, the pattern on a part of them. \
         Diffuse are those whose greatest value (BRDF times cosine) is the least multiple of their \
         median; glossy are the other half.",
    );
    findings.text(format!(
        "Diffuse of those trained on: {}.",
        names[1].join(", ")
    ));
    findings.text(format!(
        "Diffuse of those judged: {}.",
        judged[1].join(", ")
    ));

    let case = Case::new(Approach::Meta(SCHEDULE), ModelKind::Neural, SAMPLES);
    let whole = TrainingRun::of(&case).context("Meta is trained")?;
    let meta = store.recipe(&whole)?;
    let recipe = meta.file.recipe();
    let Some(descent) = recipe.descent() else {
        anyhow::bail!("a recipe of the model neural is fitted by descent");
    };
    let known = PretrainedInit {
        initial: descent.initial().iter().collect(),
        step_sizes: descent.step_sizes().iter().collect(),
    };
    let mut rows = Vec::new();
    for (part, names) in PARTS.into_iter().zip(names) {
        let training = TrainingRun {
            parts: Parts::PatternOnly(known.clone()),
            only: Some((part, names)),
            ..whole.clone()
        };
        let name = format!("neural-n{SAMPLES}-pattern-of-{part}");
        let evaluation = store.kept_evaluation(store.test, &name, 1, |judge| {
            let learned = store.recipe(&training)?;
            judge(&Method::ours(&learned.file.recipe(), None)?)
        })?;
        let mut row = vec![Cell::Text(part.into())];
        row.extend(
            judged
                .iter()
                .map(|names| Cell::Number(mean(&evaluation.materials, names))),
        );
        rows.push(row);
    }
    let mut columns = vec![Column::text("pattern trained on")];
    columns.extend(PARTS.map(|part| Column::number(format!("judged on {part}"), 4, Best::Least)));
    findings.table(
        "subsets",
        Table {
            caption: format!(
                "Neural, n = {SAMPLES}: loss of {} by the training set of its pattern",
                Approach::Ours(SCHEDULE).title()
            ),
            columns,
            rows,
            compare: Compare::Down,
        },
    );
    Ok(findings)
}

/// Names of all materials, of the more diffuse half, and of the glossier half.
fn parts(store: &Store<'_>, materials: &[Box<dyn Material>]) -> [Vec<String>; 3] {
    let order = store.by_glossiness(materials);
    let names: Vec<String> = order
        .into_iter()
        .map(|index| materials[index].name().to_owned())
        .collect();
    let (diffuse, glossy) = names.split_at(names.len() / 2);
    [names.clone(), diffuse.to_vec(), glossy.to_vec()]
}

fn mean(materials: &[MaterialMetrics], names: &[String]) -> f64 {
    let losses: Vec<f64> = materials
        .iter()
        .filter(|each| names.contains(&each.name))
        .map(|each| each.scores.loss)
        .collect();
    losses.iter().sum::<f64>() / losses.len() as f64
}
