//! Warnings about test materials that a recipe was trained on: losses on them say nothing about unseen materials.

use glimpse_core::recipe::Recipe;
use glimpse_evaluation::evaluation::{TrainingMaterials, TrainingOverlap};
use glimpse_fitting::recipe::MetadataError;
use glimpse_materials::Material;

/// For each test material, the kind of overlap with the training materials, if there is one.
pub(super) type Overlaps = Vec<Option<TrainingOverlap>>;

/// Compares test materials with training materials: for each test material, the kind of overlap, if there is one.
/// Returns None if the training materials are unknown.
pub(super) fn training_overlaps(
    trained_on: Option<&TrainingMaterials>,
    materials: &[Box<dyn Material>],
) -> Option<Overlaps> {
    let trained_on = trained_on?;
    let overlaps = materials
        .iter()
        .map(|material| trained_on.overlap(&**material));
    Some(overlaps.collect())
}

/// Prints a warning on stderr if a recipe was, or may have been, trained on some of these materials.
///
/// # Errors
/// If the recipe's metadata is malformed.
pub(super) fn warn_of_overlap(
    recipe: &Recipe<'_>,
    materials: &[Box<dyn Material>],
) -> Result<(), MetadataError> {
    let overlaps = training_overlaps(TrainingMaterials::from_recipe(recipe)?.as_ref(), materials);
    let names = materials.iter().map(|material| material.name());
    for warning in warnings(overlaps.as_deref(), &names.collect::<Vec<_>>()) {
        eprintln!("{warning}");
    }
    Ok(())
}

/// Maximum number of names in a warning.
const MAX_NAMES: usize = 3;

/// Describes the result of [`training_overlaps`], one warning a line. Returns an empty list if all materials are
/// new.
pub(super) fn warnings(
    overlaps: Option<&[Option<TrainingOverlap>]>,
    names: &[&str],
) -> Vec<String> {
    let Some(overlaps) = overlaps else {
        return vec![
            "the recipe does not name its training materials: these materials may be among them"
                .to_owned(),
        ];
    };
    let of = |kind: TrainingOverlap| -> Vec<&str> {
        let pairs = names.iter().zip(overlaps);
        pairs
            .filter(|(_, overlap)| **overlap == Some(kind))
            .map(|(name, _)| *name)
            .collect()
    };
    let mut warnings = Vec::new();
    let same = of(TrainingOverlap::SameBrdf);
    if !same.is_empty() {
        warnings.push(format!(
            "{} of these {} materials: in the training set ({}); losses on them say nothing about unseen \
             materials",
            same.len(),
            names.len(),
            abbreviated(&same)
        ));
    }
    let namesakes = of(TrainingOverlap::SameName);
    if !namesakes.is_empty() {
        warnings.push(format!(
            "{} of these {} materials: the training set has another material of the same name ({}); it may \
             be the same material in another format",
            namesakes.len(),
            names.len(),
            abbreviated(&namesakes)
        ));
    }
    warnings
}

fn abbreviated(names: &[&str]) -> String {
    let more = if names.len() > MAX_NAMES { ", ..." } else { "" };
    format!("{}{more}", names[..names.len().min(MAX_NAMES)].join(", "))
}
