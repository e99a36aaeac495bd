//! `trainer export --format basis`: writes and reads compact bases.

use std::path::Path;

use anyhow::{Context, bail};
use glimpse_core::model::linear;
use glimpse_fitting::linear::{COMPACT_COMPONENTS, COMPACT_NODES, to_compact_bytes};
use glimpse_materials::basis::Basis;

use super::read_recipe;

/// Compacts the whole basis next to a recipe of the model Linear.
pub(crate) fn compact_basis_of_recipe(
    recipe: &Path,
    components: Option<usize>,
) -> anyhow::Result<Vec<u8>> {
    let Some(basis) = read_recipe(recipe)?.basis else {
        bail!(
            "{} has no basis: --format basis takes a recipe of the model linear with its basis file \
             next to it",
            recipe.display()
        );
    };
    if basis.is_compact() {
        bail!(
            "{} is a compact basis already: copy it, or train the recipe again for a whole basis",
            Basis::path_for(recipe).display()
        );
    }
    compact_basis(&basis, components)
}

/// Compacts a whole basis to a given number of components, or else to [`COMPACT_COMPONENTS`] of them.
pub(crate) fn compact_basis(basis: &Basis, components: Option<usize>) -> anyhow::Result<Vec<u8>> {
    let all = basis.components();
    let components = match components {
        Some(count) if !(1..=all).contains(&count) => {
            bail!(
                "--components {count} is out of range: this recipe's basis has {all}; give 1 to {all}"
            )
        }
        Some(count) => count,
        None => COMPACT_COMPONENTS.min(all),
    };
    let bytes = to_compact_bytes(basis, components, COMPACT_NODES);
    linear::Basis::parse(&bytes).context("the new compact basis is invalid")?;
    eprintln!(
        "compact basis: {components} of {all} components, {} bytes, valid for recipes of any n with the \
         same whole basis",
        bytes.len()
    );
    Ok(bytes)
}

/// Reads and checks the file of a compact basis.
pub(crate) fn read_compact(path: &Path) -> anyhow::Result<Vec<u8>> {
    let bytes = Basis::read_compact(path)
        .with_context(|| format!("cannot read the compact basis {}", path.display()))?;
    linear::Basis::parse(&bytes).with_context(|| path.display().to_string())?;
    Ok(bytes)
}
