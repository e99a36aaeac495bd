//! Says which materials a recipe was trained on: what it does on those is no news.

use glimpse_core::recipe::{Recipe, RecipeError};
use glimpse_materials::Material;
use glimpse_trainer::evaluation::{Known, TrainedOn};

/// Which of some materials are known, and how; None if that cannot be told.
pub(super) fn known(
    trained_on: Option<&TrainedOn>,
    materials: &[Box<dyn Material>],
) -> Option<Vec<Option<Known>>> {
    let trained_on = trained_on?;
    let each = materials
        .iter()
        .map(|material| trained_on.knows(&**material));
    Some(each.collect())
}

/// Tells what must be known of a recipe's losses on some materials; nothing if all are new to it.
///
/// # Errors
/// If what the recipe states about itself makes no sense.
pub(super) fn tell(
    recipe: &Recipe<'_>,
    materials: &[Box<dyn Material>],
) -> Result<(), RecipeError> {
    let known = known(TrainedOn::of_recipe(recipe)?.as_ref(), materials);
    let names = materials.iter().map(|material| material.name());
    for line in lines(known.as_deref(), &names.collect::<Vec<_>>()) {
        eprintln!("{line}");
    }
    Ok(())
}

/// How many names are shown.
const SHOWN: usize = 3;

/// In words, a line for each thing that is to be said.
pub(super) fn lines(known: Option<&[Option<Known>]>, names: &[&str]) -> Vec<String> {
    let Some(known) = known else {
        return vec![
            "the recipe does not name the materials that it was trained on: whether these are \
             among them is not known"
                .to_owned(),
        ];
    };
    let of = |kind: Known| -> Vec<&str> {
        let pairs = names.iter().zip(known);
        pairs
            .filter(|(_, known)| **known == Some(kind))
            .map(|(name, _)| *name)
            .collect()
    };
    let mut lines = Vec::new();
    let same = of(Known::Same);
    if !same.is_empty() {
        lines.push(format!(
            "trained on {} of these {} materials ({}): what is found on them says nothing of \
             unseen ones",
            same.len(),
            names.len(),
            shown(&same)
        ));
    }
    let namesakes = of(Known::Namesake);
    if !namesakes.is_empty() {
        lines.push(format!(
            "trained on other materials of the same name as {} of these {} ({}): they may be \
             known in another form",
            namesakes.len(),
            names.len(),
            shown(&namesakes)
        ));
    }
    lines
}

fn shown(names: &[&str]) -> String {
    let more = if names.len() > SHOWN { ", ..." } else { "" };
    format!("{}{more}", names[..names.len().min(SHOWN)].join(", "))
}
