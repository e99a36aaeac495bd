//! Recipes are read and copied as they were written, to the bit.

use glimpse_core::fit::Target;
use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{Kind, Recipe, RecipeParts};

use super::made::Made;
use crate::recipes::{packed, parsed, write};
use crate::scanning::MODELS;

fn numbers(recipe: &Recipe<'_>) -> Vec<u16> {
    recipe.sections().map(|(kind, _)| kind.number()).collect()
}

#[test]
fn a_recipe_is_read_as_it_was_written() {
    let missings = [
        MissingPolicy::AllRequired,
        MissingPolicy::Unscaled,
        MissingPolicy::Scaled,
    ];
    for (kind, missing) in MODELS.into_iter().zip(missings.into_iter().cycle()) {
        let made = Made::small(kind, missing);
        let recipe = made.recipe();
        assert_eq!(recipe.model(), kind);
        assert_eq!(recipe.method().model(), kind);
        // It is neither a descent nor a ridge by itself.
        assert!(recipe.descent().is_none() && recipe.ridge().is_none());
        let completed = recipe.completed().unwrap();
        assert_eq!(completed.model(), kind);
        assert_eq!(completed.missing(), missing);
        assert_eq!(
            completed.tolerates_missing(),
            missing != MissingPolicy::AllRequired
        );
        assert_eq!(completed.scale(), made.scale);
        assert!(completed.center().iter().eq(made.center));
        let weights = completed.coefficient_net().readings.iter();
        assert!(weights.map(|w| w.cast_signed()).eq(made.readings));
        match (completed.target(), &made.then) {
            (Target::Linear(components), None) => {
                assert_eq!(numbers(&recipe), [0, 3, 130]);
                let rows = components.rows().iter();
                assert!(rows.map(|w| w.cast_signed()).eq(made.rows));
                assert!(components.scales().iter().eq(made.row_scales));
                assert_eq!(components.basis_checksum(), Some(0xfeed_beef));
                assert_eq!(recipe.method().basis_checksum(), Some(0xfeed_beef));
            }
            (Target::Descent(descent, start), Some((descends, starts))) => {
                assert_eq!(numbers(&recipe), [0, 1, 3, 4, 130]);
                assert_eq!(descent.inner_steps(), 3);
                assert!(descent.initial().iter().eq(descends.initial.clone()));
                assert!(descent.step_sizes().iter().eq(descends.step_sizes.clone()));
                assert_eq!(start.units(), starts.bias.len());
                let weights = start.hidden.iter().map(|w| w.cast_signed());
                assert!(weights.eq(starts.hidden.clone()));
                assert_eq!(recipe.method().basis_checksum(), None);
            }
            _ => panic!("another target was read than was written"),
        }
    }
}

#[test]
fn a_checksum_of_0_names_no_basis() {
    let mut made = Made::small(ModelKind::Linear, MissingPolicy::Scaled);
    made.basis_checksum = 0;
    assert_eq!(made.recipe().method().basis_checksum(), None);
}

#[test]
fn a_recipe_that_was_read_is_written_and_copied_alike() {
    for kind in MODELS {
        let bytes = Made::small(kind, MissingPolicy::Scaled).write().unwrap();
        let recipe = parsed(bytes.clone());
        let angles = recipe
            .pattern()
            .flat_map(|a| [a.theta_h, a.theta_d, a.phi_d]);
        let pattern = packed(&angles.collect::<Vec<_>>());
        let again = write(&RecipeParts {
            expectation: recipe.metadata().unwrap().expectation,
            ..RecipeParts::new(&pattern, recipe.method().into())
        });
        assert_eq!(again, Ok(bytes.clone()));
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
