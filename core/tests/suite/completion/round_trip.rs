//! Recipes are read and copied bit for bit.

use glimpse_core::fit::Target;
use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{Kind, Recipe, RecipeParts};

use super::contents::CompletedContents;
use crate::recipes::{packed, parsed, write};
use crate::scanning::MODELS;

fn numbers(recipe: &Recipe<'_>) -> Vec<u16> {
    recipe.sections().map(|(kind, _)| kind.number()).collect()
}

#[test]
fn recipe_round_trip() {
    let missings = [
        MissingPolicy::AllRequired,
        MissingPolicy::Unscaled,
        MissingPolicy::Scaled,
    ];
    for (kind, missing) in MODELS.into_iter().zip(missings.into_iter().cycle()) {
        let contents = CompletedContents::small(kind, missing);
        let recipe = contents.recipe();
        assert_eq!(recipe.model(), kind);
        assert_eq!(recipe.method().model(), kind);
        // The recipe is neither a plain descent nor a ridge.
        assert!(recipe.descent().is_none() && recipe.ridge().is_none());
        let completed = recipe.completed().unwrap();
        assert_eq!(completed.model(), kind);
        assert_eq!(completed.missing(), missing);
        assert_eq!(
            completed.tolerates_missing(),
            missing != MissingPolicy::AllRequired
        );
        assert_eq!(completed.scale(), contents.scale);
        assert!(completed.center().iter().eq(contents.center));
        let weights = completed.coefficient_net().readings.iter();
        assert!(weights.map(|w| w.cast_signed()).eq(contents.readings));
        match (completed.target(), &contents.descent) {
            (Target::Linear(components), None) => {
                assert_eq!(numbers(&recipe), [0, 3, 130]);
                let rows = components.rows().iter();
                assert!(rows.map(|w| w.cast_signed()).eq(contents.rows));
                assert!(components.scales().iter().eq(contents.row_scales));
                assert_eq!(components.basis_checksum(), Some(0xfeed_beef));
                assert_eq!(recipe.method().basis_checksum(), Some(0xfeed_beef));
            }
            (Target::Descent(descent, start), Some((descent_part, init_net_part))) => {
                assert_eq!(numbers(&recipe), [0, 1, 3, 4, 130]);
                assert_eq!(descent.inner_steps(), 3);
                assert!(descent.initial().iter().eq(descent_part.initial.clone()));
                assert!(
                    descent
                        .step_sizes()
                        .iter()
                        .eq(descent_part.step_sizes.clone())
                );
                assert_eq!(start.units(), init_net_part.bias.len());
                let weights = start.hidden.iter().map(|w| w.cast_signed());
                assert!(weights.eq(init_net_part.hidden.clone()));
                assert_eq!(recipe.method().basis_checksum(), None);
            }
            _ => panic!("the target read differs from the target written"),
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
    for kind in MODELS {
        let bytes = CompletedContents::small(kind, MissingPolicy::Scaled)
            .write()
            .unwrap();
        let recipe = parsed(bytes.clone());
        let angles = recipe
            .pattern()
            .flat_map(|a| [a.theta_h, a.theta_d, a.phi_d]);
        let pattern = packed(&angles.collect::<Vec<_>>());
        let rewritten = write(&RecipeParts {
            expectation: recipe.metadata().unwrap().expectation,
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
        let bare = parsed(copy(&[Kind::EXPECTATION]).unwrap());
        assert_eq!(bare.expected_loss(), None);
        let required: Vec<u16> = numbers(&recipe).into_iter().filter(|k| *k < 128).collect();
        assert_eq!(numbers(&bare), required);
        for kind in [Kind::COMPLETION, Kind::START] {
            assert!(copy(&[kind]).is_err());
        }
    }
}
