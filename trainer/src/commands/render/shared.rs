//! What drawings have in common: where they go, and the scans that they show.

use std::path::Path;

use anyhow::{Context, bail};
use glimpse_materials::files::try_write;
use glimpse_trainer::evaluation::Method;

use super::super::read_recipe;

/// The one of some file types that a path ends in.
pub(super) fn file_type(path: &Path, types: &[&'static str]) -> anyhow::Result<&'static str> {
    let extension = path.extension().and_then(|extension| extension.to_str());
    let extension = extension.unwrap_or_default().to_ascii_lowercase();
    match types.iter().find(|known| **known == extension) {
        Some(known) => Ok(known),
        None => bail!(
            "--out {}: its name must end in .{}",
            path.display(),
            types.join(" or .")
        ),
    }
}

/// Opens a recipe, if there is one, and goes on with its method.
pub(super) fn with_method<T>(
    recipe: Option<&Path>,
    go_on: impl FnOnce(Option<&Method<'_>>) -> anyhow::Result<T>,
) -> anyhow::Result<T> {
    let Some(path) = recipe else {
        return go_on(None);
    };
    let (file, basis) = read_recipe(path)?;
    let recipe = file.recipe();
    go_on(Some(&Method::ours(&recipe, basis.as_ref())?))
}

/// Makes sure that a file can be written, before anything is drawn.
pub(super) fn check_out(path: &Path) -> anyhow::Result<()> {
    try_write(path, 1 << 16).with_context(|| format!("cannot write {}", path.display()))
}
