//! Warnings about test materials that a recipe was trained on: losses on them say nothing about unseen materials.

use glimpse_evaluation::evaluation::TrainingOverlap;
use glimpse_materials::{Identity, Material};

use super::first_of;

/// The name of each test material, and its overlap with the training materials; None if those are unknown.
pub(super) type Overlaps<'a> = Option<Vec<(&'a str, TrainingOverlap)>>;

/// Prints warnings on stderr about materials that are, or may be, training materials.
pub(super) fn warn(trained_on: &[Identity], materials: &[Box<dyn Material>]) {
    let materials = materials.iter();
    let overlaps = materials.map(|material| {
        let overlap = TrainingOverlap::of(&**material, trained_on)?;
        Some((material.name(), overlap))
    });
    for warning in warnings(&overlaps.collect()) {
        eprintln!("{warning}");
    }
}

/// Describes overlaps, one warning a line. Returns an empty list if all materials are unseen.
pub(super) fn warnings(overlaps: &Overlaps<'_>) -> Vec<String> {
    let Some(overlaps) = overlaps else {
        return vec![
            "the recipe does not name its training materials: these materials may be among them"
                .to_owned(),
        ];
    };
    let describe = |kind: TrainingOverlap, start: &str, end: &str| {
        let of_kind = overlaps.iter().filter(|(_, overlap)| *overlap == kind);
        let names: Vec<&str> = of_kind.map(|(name, _)| *name).collect();
        let count = names.len();
        (count > 0).then(|| {
            format!(
                "{count} of these {} materials: {start} ({}); {end}",
                overlaps.len(),
                first_of(names)
            )
        })
    };
    let same_brdf = describe(
        TrainingOverlap::SameBrdf,
        "in the training set",
        "losses on them say nothing about unseen materials",
    );
    let same_name = describe(
        TrainingOverlap::SameName,
        "the training set has another material of the same name",
        "it may be the same material in another format",
    );
    same_brdf.into_iter().chain(same_name).collect()
}
