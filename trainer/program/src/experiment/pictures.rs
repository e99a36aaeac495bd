//! Rows of rendered spheres, and drawings of patterns (paper, figures "Teaser", "MethodsModels", "IncreasingSamples"
//! and "Pattern").

use crate::report::Column;
use glimpse_core::model::ModelKind;
use glimpse_evaluation::evaluation::SPHERE_SIZE;

use super::case::{Approach, Case};
use super::curves::over_samples;
use super::engine::{Grid, Part, Plan, Row, SphereRow, Spheres};
use super::glossiness::by_glossiness;
use super::shared::{MODELS, SAMPLES, powers_of_two, title};
use super::store::Store;

/// Spheres of some materials with each method, for Neural at n = 64.
pub(super) fn teaser(store: &Store<'_>) -> Plan {
    /// Number of samples of the paper's teaser, and of its materials.
    const SAMPLES: usize = 64;
    const MATERIALS: usize = 6;
    let order = by_glossiness(store.sets[0].materials, store.settings.seed);
    let last = order.len().saturating_sub(1);
    let count = MATERIALS.min(order.len());
    let rows = (0..count).map(|position| SphereRow {
        title: None,
        material: order[position * last / count.saturating_sub(1).max(1)],
        cases: compared(ModelKind::Neural, SAMPLES),
    });
    Plan {
        title: "Materials fitted with each method",
        parts: vec![Part::Spheres(Spheres {
            caption: format!(
                "Neural, n = {SAMPLES}; test materials from diffuse to glossy; {}",
                metrics_note()
            ),
            rows: rows.collect(),
        })],
    }
}

/// Spheres of a glossy material for increasing n, and the loss over n.
pub(super) fn increasing(store: &Store<'_>, max_samples: usize) -> Plan {
    let order = by_glossiness(store.sets[0].materials, store.settings.seed);
    let each = [Approach::Paper, Approach::Glimpse]
        .into_iter()
        .flat_map(|approach| MODELS.map(|model| (approach, model)));
    let spheres = order.last().map(|&material| Spheres {
        caption: format!(
            "{}; each picture uses a different recipe; {}",
            store.sets[0].materials[material].name(),
            metrics_note()
        ),
        rows: each
            .clone()
            .map(|(approach, model)| SphereRow {
                title: Some(format!("{}, {}", title(model), approach.name())),
                material,
                cases: over_samples(approach, model, max_samples)
                    .map(|case| (format!("n = {}", case.samples), case))
                    .collect(),
            })
            .collect(),
    });
    let rows = each.map(|(approach, model)| Row {
        labels: vec![approach.name().into(), title(model).into()],
        cases: over_samples(approach, model, max_samples).collect(),
        ..Row::default()
    });
    let mut columns = vec![Column::text("Method"), Column::text("Model")];
    columns.extend(powers_of_two(max_samples).map(|n| Column::plain(format!("n = {n}"), 4)));
    let caption = "Loss over the number of samples";
    let losses = Grid::new("losses", caption, columns, rows.collect());
    Plan {
        title: "A glossy material with an increasing number of samples",
        parts: spheres
            .map(Part::Spheres)
            .into_iter()
            .chain([Part::Grid(losses)])
            .collect(),
    }
}

/// Drawings of the learned patterns.
pub(super) fn patterns() -> Plan {
    let learned = [Approach::Paper, Approach::Glimpse];
    let cases = learned
        .into_iter()
        .flat_map(|approach| MODELS.map(|model| Case::new(approach, model, SAMPLES)));
    let njr15 = Case::new(Approach::Njr15, ModelKind::Linear, SAMPLES);
    Plan {
        title: "Learned sample patterns of each model",
        parts: cases.chain([njr15]).map(Part::Pattern).collect(),
    }
}

/// Returns spheres of the most diffuse and of the glossiest material, with a row for each model and a picture for each
/// method.
pub(super) fn spheres_by_model(store: &Store<'_>) -> impl Iterator<Item = Spheres> {
    let materials = store.sets[0].materials;
    let order = by_glossiness(materials, store.settings.seed);
    let ends = [order.first().copied(), order.last().copied()];
    ends.into_iter().flatten().map(|material| Spheres {
        caption: format!(
            "{}, n = {SAMPLES}; {}; click to enlarge",
            materials[material].name(),
            metrics_note()
        ),
        rows: MODELS
            .map(|model| SphereRow {
                title: Some(title(model).into()),
                material,
                cases: compared(model, SAMPLES),
            })
            .into(),
    })
}

/// Returns the compared methods with their names.
fn compared(model: ModelKind, samples: usize) -> Vec<(String, Case)> {
    let labeled = |approach: Approach| {
        let case = Case::new(approach, model, samples);
        (approach.name().to_owned(), case)
    };
    Approach::compared(model).map(labeled).into()
}

/// Returns a note for captions about the metrics below the pictures.
fn metrics_note() -> String {
    format!(
        "DSSIM, PSNR and Delta E (CIEDE2000) are computed on these pictures of {SPHERE_SIZE} x {SPHERE_SIZE} pixels"
    )
}
