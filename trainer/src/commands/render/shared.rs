//! Shared code of the render commands: types of output files, and methods from recipes.

use std::path::Path;

use anyhow::bail;
use glimpse_trainer::evaluation::Method;

use super::super::read_recipe;

/// Returns the extension of an output path, in lower case, which must be one of `types`.
pub(super) fn file_type(path: &Path, types: &[&'static str]) -> anyhow::Result<&'static str> {
    let extension = path.extension().and_then(|extension| extension.to_str());
    let extension = extension.unwrap_or_default().to_ascii_lowercase();
    match types.iter().find(|known| **known == extension) {
        Some(file_type) => Ok(file_type),
        None => bail!(
            "--out {}: unsupported file type, give a name with the extension .{}",
            path.display(),
            types.join(" or .")
        ),
    }
}

/// Reads a recipe, if there is one, and runs a closure with its method.
pub(super) fn with_method<T>(
    recipe: Option<&Path>,
    run: impl FnOnce(Option<&Method<'_>>) -> anyhow::Result<T>,
) -> anyhow::Result<T> {
    let Some(path) = recipe else {
        return run(None);
    };
    let (file, basis) = read_recipe(path)?;
    let recipe = file.recipe();
    run(Some(&Method::ours(&recipe, basis.as_ref())?))
}
