//! Recipes are read and copied bit for bit.

use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{Kind, PackedPartialLoss, Recipe, RecipeParts};

use super::contents::CompletedContents;
use super::partial::all_small;
use crate::recipes::{packed, parsed, write};

fn kinds(recipe: &Recipe<'_>) -> Vec<Kind> {
    recipe.sections().map(|(kind, _)| kind).collect()
}

#[test]
fn recipe_states_its_properties() {
    for missing in [
        MissingPolicy::AllRequired,
        MissingPolicy::Unscaled,
        MissingPolicy::Scaled,
    ] {
        for contents in CompletedContents::all_small(missing) {
            let recipe = contents.recipe();
            let is_linear = contents.model() == ModelKind::Linear;
            assert_eq!(recipe.model(), contents.model());
            // The recipe is neither a plain descent nor a ridge.
            assert!(recipe.descent().is_none() && recipe.ridge().is_none());
            let completed = recipe.completed().unwrap();
            assert_eq!(completed.components(), contents.fitted_components());
            assert_eq!(completed.missing(), missing);
            let tolerates = missing != MissingPolicy::AllRequired;
            assert_eq!(recipe.tolerates_missing(), tolerates);
            assert_eq!(recipe.basis_checksum(), is_linear.then_some(0xfeed_beef));
        }
    }
}

#[test]
fn checksum_0_means_no_basis() {
    let mut contents = CompletedContents::small(ModelKind::Linear, MissingPolicy::Scaled);
    contents.basis_checksum = 0;
    assert_eq!(contents.recipe().method().basis_checksum(), None);
}

#[test]
fn parsed_recipe_is_rewritten_identically() {
    for contents in all_small() {
        let bytes = contents.write();
        let recipe = parsed(bytes.clone());
        let angles = recipe
            .pattern()
            .flat_map(|a| [a.theta_h, a.theta_d, a.phi_d]);
        let pattern = packed(&angles.collect::<Vec<_>>());
        let completed = recipe.completed().unwrap();
        let partial = completed.partial().unwrap();
        let [prediction, loss, bound] =
            [completed.prediction(), partial.loss(), partial.bound()].map(|list| list.words());
        let rewritten = write(&RecipeParts {
            expected_loss: recipe.expected_loss(),
            prediction: Some(prediction.as_flattened()),
            uncertainty: completed.uncertainty(),
            partial: Some(PackedPartialLoss {
                loss: loss.as_flattened(),
                bound: bound.as_flattened(),
            }),
            ..RecipeParts::new(&pattern, recipe.method().into())
        });
        assert_eq!(rewritten, Ok(bytes.clone()));
        let copy = |without: &[Kind]| {
            let mut buffer = vec![0; bytes.len()];
            recipe
                .copy_without(without, &mut buffer)
                .map(<[u8]>::to_vec)
        };
        assert_eq!(copy(&[]), Ok(bytes.clone()));
        for kind in kinds(&recipe) {
            let Ok(bytes) = copy(&[kind]) else {
                assert!(kind.is_required());
                continue;
            };
            let mut others = kinds(&recipe);
            others.retain(|other| *other != kind);
            assert_eq!(kinds(&parsed(bytes)), others);
        }
    }
}
