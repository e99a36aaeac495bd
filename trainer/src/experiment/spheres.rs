//! Rows of spheres (paper, figures "Teaser", "MethodsModels" and "IncreasingSamples").

use glimpse_core::model::ModelKind;
use glimpse_trainer::evaluation::SPHERE;
use glimpse_trainer::report::{Gallery, GalleryRow, Tile};

use super::case::{Approach, Case};
use super::findings::Findings;
use super::losses::by_samples;
use super::store::Store;
use super::{MODELS, SCHEDULE, doublings, title};

/// n of the paper's teaser.
const TEASER: usize = 64;
/// How many materials it shows.
const SHOWN: usize = 6;

pub(super) fn teaser(store: &Store<'_>) -> anyhow::Result<Findings> {
    let mut findings = Findings::new(store, "Some materials by each method", &[SCHEDULE]);
    let order = store.by_glossiness(store.test.materials);
    let last = order.len().saturating_sub(1);
    let shown = SHOWN.min(order.len());
    let mut rows = Vec::new();
    for place in 0..shown {
        let index = order[place * last / shown.saturating_sub(1).max(1)];
        let approaches = Approach::rivals(ModelKind::Neural, SCHEDULE);
        let cases = approaches.map(|approach| {
            let case = Case::new(approach, ModelKind::Neural, TEASER);
            (approach.title(), case)
        });
        rows.push(row(store, index, None, &cases)?);
    }
    findings.gallery(Gallery {
        caption: format!(
            "Neural, n = {TEASER}; from diffuse to glossy materials, none of which was trained on; {}",
            errors()
        ),
        rows,
    });
    Ok(findings)
}

pub(super) fn increasing(store: &Store<'_>, most_samples: usize) -> anyhow::Result<Findings> {
    let mut findings = Findings::new(
        store,
        "A glossy material, and more and more samples",
        &[SCHEDULE],
    );
    let order = store.by_glossiness(store.test.materials);
    let Some(&index) = order.last() else {
        return Ok(findings);
    };
    let ours = Approach::Ours(SCHEDULE);
    let mut rows = Vec::new();
    for model in MODELS {
        let cases: Vec<(String, Case)> = doublings(most_samples)
            .map(|n| (format!("n = {n}"), Case::new(ours, model, n)))
            .collect();
        rows.push(row(store, index, Some(title(model)), &cases)?);
    }
    findings.gallery(Gallery {
        caption: format!(
            "{} by {}; every picture is of a recipe of its own; {}",
            store.test.materials[index].name(),
            ours.title(),
            errors()
        ),
        rows,
    });
    findings.table("losses", by_samples(store, most_samples)?);
    Ok(findings)
}

/// A material by all models and methods.
pub(super) fn by_model(store: &Store<'_>, index: usize, samples: usize) -> anyhow::Result<Gallery> {
    let mut rows = Vec::new();
    for model in MODELS {
        let cases = Approach::rivals(model, SCHEDULE).map(|approach| {
            let case = Case::new(approach, model, samples);
            (approach.title(), case)
        });
        rows.push(row(store, index, Some(title(model)), &cases)?);
    }
    Ok(Gallery {
        caption: format!(
            "{}, n = {samples}; {}; click to enlarge",
            store.test.materials[index].name(),
            errors()
        ),
        rows,
    })
}

/// The part of a caption that states which pictures the errors below them belong to.
fn errors() -> String {
    format!(
        "DSSIM, PSNR and Delta E (CIEDE2000) are of these pictures of {SPHERE} x {SPHERE} pixels"
    )
}

/// A material as it is, and fitted in several ways, the best of which is marked.
fn row(
    store: &Store<'_>,
    index: usize,
    title: Option<&str>,
    cases: &[(String, Case)],
) -> anyhow::Result<GalleryRow> {
    let material = &*store.test.materials[index];
    let title = title.unwrap_or(material.name()).to_owned();
    let mut only_notes = false;
    for (_, case) in cases {
        only_notes |= store.only_notes(case)?;
    }
    if only_notes {
        let tiles = Vec::new();
        return Ok(GalleryRow { title, tiles });
    }
    let judge = store.test.judge();
    let mut tiles = vec![Tile {
        label: "Reference".into(),
        details: Vec::new(),
        best: false,
        picture: judge.reference(index).clone(),
    }];
    let mut least = (f64::INFINITY, 0);
    for (label, case) in cases {
        let seed = store.settings.seed.wrapping_add(index as u64);
        let (scores, picture) = store.with_method(case, |method| {
            Ok(judge.score(index, &method.fit(material, seed)?)?)
        })?;
        if scores.loss < least.0 {
            least = (scores.loss, tiles.len());
        }
        tiles.push(Tile {
            label: label.clone(),
            details: vec![
                format!("loss {:.4}", scores.loss),
                format!("DSSIM {:.4}", scores.dssim),
                format!("{:.1} dB", scores.psnr),
                format!("Delta E {:.2}", scores.delta_e),
            ],
            best: false,
            picture,
        });
    }
    if let Some(tile) = tiles.get_mut(least.1).filter(|_| least.1 > 0) {
        tile.best = true;
    }
    Ok(GalleryRow { title, tiles })
}
