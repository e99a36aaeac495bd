//! Text of a recipe's expected loss. It always names the materials on which the loss was measured.

use glimpse_core::recipe::{
    ExpectedLoss, Metadata, Origin, Recipe, RecipeError, Training, ValidationSplit,
};
use glimpse_trainer::bundled;

/// Describes the expected loss that a recipe states; None if it states none. The text starts with the number.
pub(super) fn expected_loss(recipe: &Recipe<'_>) -> Result<Option<String>, RecipeError> {
    let caution = caution(recipe)?;
    let metadata = recipe.metadata()?;
    let expectation = metadata.expectation;
    Ok(expectation.map(|expectation| describe(expectation, &metadata, caution.as_deref())))
}

/// A caution about a bundled recipe, or one that was trained on built-in materials only. None for other recipes, and
/// for recipes that do not state their training sources.
pub(super) fn caution(recipe: &Recipe<'_>) -> Result<Option<String>, RecipeError> {
    let losses = bundled::find_by_checksum(recipe.checksum()).and_then(|bundled| bundled.losses());
    if let Some(losses) = losses {
        return Ok(Some(format!(
            "the mean loss of this bundled recipe on 80 other materials, MERL's, is {:.4}",
            losses.merl
        )));
    }
    let training = recipe.metadata()?.training;
    let is_built_in = training.is_some_and(|training| is_built_in(&training));
    Ok(is_built_in.then(|| {
        "the recipe was trained on built-in materials only, and the loss on measured materials may be several times \
         larger"
            .to_owned()
    }))
}

/// Returns true if no material came from a file.
fn is_built_in(training: &Training<'_>) -> bool {
    let mut sources = training.sources;
    sources.len() > 0 && sources.all(|source| source.origin == Origin::BuiltIn)
}

fn describe(
    expectation: ExpectedLoss<'_>,
    metadata: &Metadata<'_>,
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
    let split = metadata.training.map(|training| training.split);
    let test_set = match (materials, split, metadata.provenance) {
        (0, ..) => return format!("{loss:.4}{error}, on unstated materials"),
        (_, Some(split), Some(provenance)) => describe_test_set(split, materials, provenance.data),
        _ => format!("measured on {materials} {on}"),
    };
    let caution = match (split, caution) {
        (Some(ValidationSplit::Training), _) => {
            "; the loss on unseen materials is unknown".to_owned()
        }
        (_, Some(caution)) => format!("; {caution}"),
        (_, None) => "; other kinds of materials may have a larger loss".to_owned(),
    };
    format!("{loss:.4}{error}, {test_set}{caution}")
}

/// Describes the materials of an expected loss and their role in training; `data` names the training materials.
fn describe_test_set(split: ValidationSplit, materials: u32, data: &str) -> String {
    let noun = if materials == 1 {
        "material"
    } else {
        "materials"
    };
    let trained = format!("{materials} training {noun} of {data}");
    match split {
        ValidationSplit::HeldOut => {
            format!("measured on {materials} {noun} of {data} held out of training")
        }
        ValidationSplit::Training => format!("measured on {trained}"),
        ValidationSplit::LeftOut => {
            format!("measured on {trained}, each with a basis of the others")
        }
        ValidationSplit::Folds => format!("cross-validated on {trained}"),
        other => format!("measured on {materials} {noun} of {data}, {}", other.name()),
    }
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
    fn split_selects_caution() {
        let expectation = ExpectedLoss {
            loss: 0.0125,
            standard_error: Some(0.0015),
            materials: 7,
            on: "materials of MERL that it was trained on",
        };
        let describe = |split| {
            let metadata = Metadata {
                training: Some(Training { split, ..TRAINING }),
                ..Metadata::default()
            };
            describe(expectation, &metadata, Some("CAUTION"))
        };
        for (split, has_caution) in [
            (ValidationSplit::HeldOut, true),
            (ValidationSplit::LeftOut, true),
            (ValidationSplit::Folds, true),
            (ValidationSplit::Training, false),
        ] {
            let text = describe(split);
            assert_eq!(text.contains("CAUTION"), has_caution, "{text}");
            assert!(text.contains("0.0125") && text.contains("0.0015"));
            assert!(text.contains(expectation.on), "{text}");
        }
    }

    #[test]
    fn caution_about_built_in_materials_and_bundled_recipes() {
        let is_built_in = |origins: &[Origin]| {
            // The label must not matter, only the origin.
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

        let bundled = bundled::find("neural-n8").expect("a bundled recipe");
        let recipe = bundled.recipe().expect("a valid recipe");
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
