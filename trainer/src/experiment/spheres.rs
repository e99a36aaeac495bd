//! Rows of rendered spheres (paper, figures "Teaser", "MethodsModels" and "IncreasingSamples").

use glimpse_core::model::ModelKind;
use glimpse_trainer::evaluation::SPHERE_SIZE;
use glimpse_trainer::report::{Gallery, GalleryRow, Tile};

use super::case::{Approach, Case};
use super::findings::Findings;
use super::glossiness::by_glossiness;
use super::losses::losses_over_samples;
use super::store::Store;
use super::{MODELS, SCHEDULE, powers_of_two, title};

/// Number of samples of the paper's teaser.
const TEASER_SAMPLES: usize = 64;
/// Number of materials of the teaser.
const TEASER_MATERIALS: usize = 6;

pub(super) fn teaser(store: &Store<'_>) -> anyhow::Result<Findings> {
    let mut findings = Findings::new(store, "Materials fitted with each method", &[SCHEDULE]);
    let order = by_glossiness(store.test.materials, store.settings.seed);
    let last = order.len().saturating_sub(1);
    let count = TEASER_MATERIALS.min(order.len());
    let mut rows = Vec::new();
    for position in 0..count {
        let index = order[position * last / count.saturating_sub(1).max(1)];
        let approaches = Approach::compared(ModelKind::Neural, SCHEDULE);
        let cases = approaches.map(|approach| {
            let case = Case::new(approach, ModelKind::Neural, TEASER_SAMPLES);
            (approach.title(), case)
        });
        rows.push(sphere_row(store, index, None, &cases)?);
    }
    findings.gallery(Gallery {
        caption: format!(
            "Neural, n = {TEASER_SAMPLES}; test materials from diffuse to glossy; {}",
            metrics_note()
        ),
        rows,
    });
    Ok(findings)
}

pub(super) fn increasing(store: &Store<'_>, max_samples: usize) -> anyhow::Result<Findings> {
    let mut findings = Findings::new(
        store,
        "A glossy material with an increasing number of samples",
        &[SCHEDULE],
    );
    let order = by_glossiness(store.test.materials, store.settings.seed);
    let Some(&index) = order.last() else {
        return Ok(findings);
    };
    let ours = Approach::Ours(SCHEDULE);
    let mut rows = Vec::new();
    for model in MODELS {
        let cases: Vec<(String, Case)> = powers_of_two(max_samples)
            .map(|n| (format!("n = {n}"), Case::new(ours, model, n)))
            .collect();
        rows.push(sphere_row(store, index, Some(title(model)), &cases)?);
    }
    findings.gallery(Gallery {
        caption: format!(
            "{} fitted with {}; each picture uses a different recipe; {}",
            store.test.materials[index].name(),
            ours.title(),
            metrics_note()
        ),
        rows,
    });
    findings.table("losses", losses_over_samples(store, max_samples)?);
    Ok(findings)
}

/// Returns a gallery of a material, with one row per model and one picture per method.
pub(super) fn gallery_by_model(
    store: &Store<'_>,
    index: usize,
    samples: usize,
) -> anyhow::Result<Gallery> {
    let mut rows = Vec::new();
    for model in MODELS {
        let cases = Approach::compared(model, SCHEDULE).map(|approach| {
            let case = Case::new(approach, model, samples);
            (approach.title(), case)
        });
        rows.push(sphere_row(store, index, Some(title(model)), &cases)?);
    }
    Ok(Gallery {
        caption: format!(
            "{}, n = {samples}; {}; click to enlarge",
            store.test.materials[index].name(),
            metrics_note()
        ),
        rows,
    })
}

/// Returns a note for captions about the metrics below the pictures.
fn metrics_note() -> String {
    format!(
        "DSSIM, PSNR and Delta E (CIEDE2000) are computed on these pictures of {SPHERE_SIZE} x {SPHERE_SIZE} pixels"
    )
}

/// Returns a row of pictures: the material as the reference, and its fits. The fit with the lowest loss is marked.
fn sphere_row(
    store: &Store<'_>,
    index: usize,
    title: Option<&str>,
    cases: &[(String, Case)],
) -> anyhow::Result<GalleryRow> {
    let material = &*store.test.materials[index];
    let title = title.unwrap_or(material.name()).to_owned();
    // A run that does not evaluate methods has no pictures.
    let mut is_record_only = false;
    for (_, case) in cases {
        is_record_only |= store.record_only(case)?;
    }
    if is_record_only {
        let tiles = Vec::new();
        return Ok(GalleryRow { title, tiles });
    }
    let evaluator = store.test.evaluator();
    let mut tiles = vec![Tile {
        label: "Reference".into(),
        details: Vec::new(),
        best: false,
        picture: evaluator.reference(index).clone(),
    }];
    let (mut best_loss, mut best_tile) = (f64::INFINITY, None);
    for (label, case) in cases {
        let seed = store.settings.seed.wrapping_add(index as u64);
        let (metrics, picture) = store.with_method(case, |method| {
            Ok(evaluator.compare(index, &method.fit(material, seed)?)?)
        })?;
        if metrics.loss < best_loss {
            (best_loss, best_tile) = (metrics.loss, Some(tiles.len()));
        }
        tiles.push(Tile {
            label: label.clone(),
            details: vec![
                format!("loss {:.4}", metrics.loss),
                format!("DSSIM {:.4}", metrics.dssim),
                format!("{:.1} dB", metrics.psnr),
                format!("Delta E {:.2}", metrics.delta_e),
            ],
            best: false,
            picture,
        });
    }
    if let Some(tile) = best_tile.and_then(|index| tiles.get_mut(index)) {
        tile.best = true;
    }
    Ok(GalleryRow { title, tiles })
}
