//! The loss to expect by a recipe, always with the materials that it was found on.

use glimpse_core::recipe::{
    ExpectedLoss, Metadata, Origin, Recipe, RecipeError, Training, ValidationSplit,
};
use glimpse_trainer::bundled;
use glimpse_training::recipe::split_in_words;

/// The loss to expect by a recipe, in words that begin with the number; None if it states none.
pub(super) fn expected_loss(recipe: &Recipe<'_>) -> Result<Option<String>, RecipeError> {
    let caution = caution(recipe)?;
    let statements = recipe.metadata()?;
    let expectation = statements.expectation;
    Ok(expectation.map(|expectation| in_words(expectation, &statements, caution.as_deref())))
}

/// A caution about a recipe that was trained on built-in materials alone; None for others, and where
/// the recipe does not state its sources.
pub(super) fn caution(recipe: &Recipe<'_>) -> Result<Option<String>, RecipeError> {
    let training = recipe.metadata()?.training;
    if !training.is_some_and(|training| is_built_in(&training)) {
        return Ok(None);
    }
    let losses = bundled::find_by_checksum(recipe.checksum()).and_then(|bundled| bundled.losses());
    let measured = match losses {
        Some(losses) => format!(
            "has loss {:.4} on 80 materials of MERL and {:.4} on 17 of RGL, on average",
            losses.merl, losses.rgl
        ),
        None => "may have several times this loss on measured ones".to_owned(),
    };
    Ok(Some(format!(
        "but it was trained on built-in materials alone, and {measured}"
    )))
}

/// Returns true if no material came from a file.
fn is_built_in(training: &Training<'_>) -> bool {
    let mut sources = training.sources;
    sources.len() > 0 && sources.all(|source| source.origin == Origin::BuiltIn)
}

fn in_words(
    expectation: ExpectedLoss<'_>,
    statements: &Metadata<'_>,
    caution: Option<&str>,
) -> String {
    let ExpectedLoss {
        loss,
        standard_error,
        materials,
        on,
    } = expectation;
    let error = match standard_error {
        Some(error) => format!(" (standard error {error:.4})"),
        None => String::new(),
    };
    let split = statements.training.map(|training| training.split);
    let found_on = match (materials, split, statements.provenance) {
        (0, ..) => return format!("{loss:.4}{error}, on materials that are not stated"),
        (1, Some(split), Some(provenance)) => format!(
            "1 material of {} {}",
            provenance.data,
            split_in_words(split)
        ),
        _ => format!("{materials} {on}"),
    };
    let caution = match (split, caution) {
        (Some(ValidationSplit::Training), _) => {
            ": nothing is known about unseen materials".to_owned()
        }
        (_, Some(caution)) => format!(", {caution}"),
        (_, None) => "; materials of another kind may have a larger loss".to_owned(),
    };
    format!("{loss:.4}{error}, found on {found_on}{caution}")
}

#[cfg(test)]
mod tests {
    use glimpse_core::recipe::{Effort, Parts, Schedule, TrainingSource, TrainingSources};

    use super::*;

    const TRAINING: Training<'_> = Training {
        schedule: Schedule::Prior,
        effort: Effort::Quick,
        parts: Parts::All,
        split: ValidationSplit::HeldOut,
        digest: 0,
        sources: TrainingSources::new(&[]),
    };

    #[test]
    fn the_split_decides_which_caution_is_given_whatever_the_text_is() {
        let expectation = ExpectedLoss {
            loss: 0.0125,
            standard_error: Some(0.0015),
            materials: 7,
            on: "materials of MERL that it was trained on",
        };
        let in_words = |split| {
            let statements = Metadata {
                training: Some(Training { split, ..TRAINING }),
                ..Metadata::default()
            };
            in_words(expectation, &statements, Some("CAUTION"))
        };
        for (split, is_cautioned) in [
            (ValidationSplit::HeldOut, true),
            (ValidationSplit::LeftOut, true),
            (ValidationSplit::Folds, true),
            (ValidationSplit::Training, false),
        ] {
            let words = in_words(split);
            assert_eq!(words.contains("CAUTION"), is_cautioned, "{words}");
            assert!(words.contains("0.0125") && words.contains("0.0015"));
            assert!(words.contains(expectation.on), "{words}");
        }
    }

    #[test]
    fn a_recipe_of_built_in_materials_alone_is_cautioned_about() {
        let is_built_in = |origins: &[Origin]| {
            // Labels are for people: they decide nothing.
            let sources: Vec<TrainingSource<'_>> = origins
                .iter()
                .map(|origin| TrainingSource {
                    label: "procedural:400",
                    origin: *origin,
                    materials: 1,
                    share: 0.5,
                })
                .collect();
            is_built_in(&Training {
                sources: TrainingSources::new(&sources),
                ..TRAINING
            })
        };
        assert!(is_built_in(&[Origin::BuiltIn]));
        assert!(is_built_in(&[Origin::BuiltIn, Origin::BuiltIn]));
        assert!(!is_built_in(&[Origin::Files]));
        assert!(!is_built_in(&[Origin::BuiltIn, Origin::Files]));
        assert!(!is_built_in(&[]));

        let bundled = bundled::find("neural-n8").expect("it is bundled");
        let recipe = bundled.recipe().expect("it is whole");
        let losses = bundled.losses().expect("they were measured");
        let words = caution(&recipe)
            .expect("it makes sense")
            .expect("a caution");
        assert!(words.contains(&format!("{:.4}", losses.merl)), "{words}");
    }
}
