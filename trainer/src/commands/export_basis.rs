//! `trainer export --format basis`, and what reads such a file again.

use std::path::Path;

use anyhow::{Context, bail};
use glimpse_core::model::linear;
use glimpse_materials::basis::Basis;
use glimpse_training::linear::{COMPACT_COMPONENTS, COMPACT_NODES, compact};

use super::read_recipe;

/// The compact basis of a recipe of the model Linear, made of the whole basis beside it.
pub(crate) fn compact_basis(recipe: &Path, components: Option<usize>) -> anyhow::Result<Vec<u8>> {
    let (_, basis) = read_recipe(recipe)?;
    let Some(basis) = basis else {
        bail!(
            "{} has no basis: --format basis is for recipes of the model linear that were trained \
             here",
            recipe.display()
        );
    };
    if basis.is_compact() {
        bail!(
            "{} is a compact basis already: copy it, or train the recipe again for the whole one",
            Basis::beside(recipe).display()
        );
    }
    compacted(&basis, components)
}

/// A whole basis made compact, by so many components or by the usual number.
pub(crate) fn compacted(basis: &Basis, components: Option<usize>) -> anyhow::Result<Vec<u8>> {
    let all = basis.components();
    let components = match components {
        Some(count) if !(1..=all).contains(&count) => {
            bail!("--components must be 1 to {all}, the components of this recipe's basis")
        }
        Some(count) => count,
        None => COMPACT_COMPONENTS.min(all),
    };
    let bytes = compact(basis, components, COMPACT_NODES);
    linear::Basis::parse(&bytes).context("the compact basis that was made")?;
    eprintln!(
        "{components} of {all} components, {} bytes; it serves every recipe that was trained with \
         the same basis, of whatever n",
        bytes.len()
    );
    Ok(bytes)
}

/// The bytes of a compact basis's file, checked.
pub(crate) fn read_compact(path: &Path) -> anyhow::Result<Vec<u8>> {
    let bytes = Basis::read_compact(path)
        .with_context(|| format!("cannot read the compact basis {}", path.display()))?;
    linear::Basis::parse(&bytes).with_context(|| path.display().to_string())?;
    Ok(bytes)
}
