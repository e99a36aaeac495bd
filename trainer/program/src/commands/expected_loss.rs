//! Text of expected losses. That of a recipe names the materials on which it was measured, that of readings has other losses
//! to compare it with.

use std::fmt::Display;

use glimpse_core::recipe::Recipe;
use glimpse_fitting::bundled;
use glimpse_fitting::measurement::LossScale;
use glimpse_fitting::recipe::expected_loss::{ValidatedLoss, ValidationSplit};
use glimpse_fitting::recipe::{Metadata, MetadataError};
use glimpse_materials::{Origin, SourceShare};

/// Describes the expected loss that a recipe states; None if it states none. The text starts with the number.
pub(super) fn expected_loss(recipe: &Recipe<'_>) -> Result<Option<String>, MetadataError> {
    let metadata = Metadata::of(recipe)?;
    let Some(loss) = recipe.expected_loss() else {
        return Ok(None);
    };
    let materials = metadata.validation_materials();
    let Some((expected, materials)) = metadata.expected_loss.zip(materials) else {
        return Ok(Some(format!("{loss:.4}, on unstated materials")));
    };
    let ValidatedLoss { estimate, split } = expected;
    let error = standard_error(estimate.standard_error);
    let caution = match (split, caution(recipe)?) {
        (ValidationSplit::Training, _) => "the loss on unseen materials is unknown".to_owned(),
        (_, Some(caution)) => caution,
        (_, None) => "other kinds of materials may have a larger loss".to_owned(),
    };
    let count = estimate.materials;
    Ok(Some(format!(
        "{loss:.4}{error}, measured on {count} {materials}; {caution}"
    )))
}

/// Describes a loss that was predicted from readings.
pub(super) fn with_scale(loss: f32, bound: Option<f32>, scale: &LossScale) -> String {
    let bound = bound.map_or(String::new(), |bound| {
        format!("at most {bound:.4} for 90 % of materials; ")
    });
    format!(
        "{loss:.4} ({bound}black would be {:.3}, a good fit {}, just visible {})",
        scale.black, scale.good, scale.just_visible
    )
}

/// Describes a standard error, to follow its mean.
pub(super) fn standard_error(error: Option<impl Display>) -> String {
    error.map_or(String::new(), |error| {
        format!(" (standard error {error:.4})")
    })
}

/// A caution about a bundled recipe, or one that was trained on built-in materials only. None for other recipes, and
/// for recipes that do not state their training sources.
pub(super) fn caution(recipe: &Recipe<'_>) -> Result<Option<String>, MetadataError> {
    let losses = bundled::find_by_checksum(recipe.checksum()).and_then(|bundled| bundled.losses());
    if let Some(losses) = losses {
        let rgl = losses.rgl.map_or_else(String::new, |loss| {
            format!(" and {loss:.4} (17 of RGL, cross-validated)")
        });
        return Ok(Some(format!(
            "the mean loss of this bundled recipe on measured materials is {:.4} (80 of MERL){rgl}",
            losses.merl
        )));
    }
    let training = Metadata::of(recipe)?.training;
    let is_built_in = training.is_some_and(|training| is_built_in(&training.options.sources()));
    Ok(is_built_in.then(|| {
        "the recipe was trained on built-in materials only, and the loss on measured materials may be several times \
         larger"
            .to_owned()
    }))
}

/// Returns true if no material came from a file.
fn is_built_in(sources: &[SourceShare]) -> bool {
    let is_built_in = |source: &SourceShare| source.origin == Origin::BuiltIn;
    !sources.is_empty() && sources.iter().all(is_built_in)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn caution_about_built_in_materials_and_bundled_recipes() {
        let source = |origin| SourceShare {
            // The label must not matter, only the origin.
            origin,
            ..SourceShare::single(&glimpse_materials::Source("procedural:400".to_owned()), 1)
        };
        let [built_in, files] = [Origin::BuiltIn, Origin::Files].map(source);
        assert!(is_built_in(&[built_in.clone(), built_in.clone()]));
        assert!(!is_built_in(&[built_in, files]) && !is_built_in(&[]));

        let bundled = bundled::find("neural-n8").expect("a bundled recipe");
        let recipe = bundled.recipe();
        let losses = bundled.losses().expect("recorded losses");
        let caution = caution(&recipe)
            .expect("valid metadata")
            .expect("a caution");
        assert!(
            caution.contains(&format!("{:.4}", losses.merl)),
            "{caution}"
        );
    }
}
