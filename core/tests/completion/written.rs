//! What is written is read, and copied, to the bit.

use glimpse_core::fit::Target;
use glimpse_core::fit::completion::Missing;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{Ingredients, Kind, Recipe};

use super::made::{MODELS, Made};

fn numbers(sections: &Recipe<'_>) -> Vec<u16> {
    sections.sections().map(|(kind, _)| kind.number()).collect()
}

#[test]
fn what_is_written_is_read() {
    let by_model = [
        Missing::NoFit,
        Missing::CountAlike,
        Missing::CountForMore,
        Missing::NoFit,
    ];
    for (kind, missing) in MODELS.into_iter().zip(by_model) {
        let made = Made::small(kind, missing);
        let bytes = made.write().unwrap();
        let recipe = Recipe::parse(&bytes).unwrap();
        assert_eq!(recipe.model(), kind);
        assert_eq!(recipe.learner().model(), kind);
        // It is neither a descent nor a ridge by itself.
        assert!(recipe.descent().is_none() && recipe.ridge().is_none());
        let completed = recipe.completed().unwrap();
        assert_eq!(completed.model(), kind);
        assert_eq!(completed.missing(), missing);
        assert_eq!(completed.takes_missing(), missing != Missing::NoFit);
        assert_eq!(completed.scale(), made.scale);
        assert!(completed.centre().iter().eq(made.centre));
        let weights = completed.completion().readings.iter();
        assert!(weights.map(|w| w.cast_signed()).eq(made.readings));
        match (completed.target(), &made.then) {
            (Target::Linear(components), None) => {
                assert_eq!(numbers(&recipe), [0, 3, 130]);
                let rows = components.rows().iter();
                assert!(rows.map(|w| w.cast_signed()).eq(made.rows));
                assert!(components.scales().iter().eq(made.row_scales));
                assert_eq!(components.basis_checksum(), Some(0xfeed_beef));
                assert_eq!(recipe.learner().basis_checksum(), Some(0xfeed_beef));
            }
            (Target::Descent(descent, start), Some((descends, starts))) => {
                assert_eq!(numbers(&recipe), [0, 1, 3, 4, 130]);
                assert_eq!(descent.inner_steps(), 3);
                assert!(descent.initial().iter().eq(descends.initial.clone()));
                assert!(descent.step_sizes().iter().eq(descends.step_sizes.clone()));
                assert_eq!(start.units(), starts.bias.len());
                let weights = start.hidden.iter().map(|w| w.cast_signed());
                assert!(weights.eq(starts.hidden.clone()));
                assert_eq!(recipe.learner().basis_checksum(), None);
            }
            _ => panic!("another target was read than was written"),
        }
    }
}

#[test]
fn a_basis_is_named_or_not() {
    let mut made = Made::small(ModelKind::Linear, Missing::CountForMore);
    made.basis_checksum = 0;
    let bytes = made.write().unwrap();
    let recipe = Recipe::parse(&bytes).unwrap();
    assert_eq!(recipe.learner().basis_checksum(), None);
}

#[test]
fn what_is_read_is_written_again() {
    for kind in MODELS {
        let bytes = Made::small(kind, Missing::CountForMore).write().unwrap();
        let recipe = Recipe::parse(&bytes).unwrap();
        let pattern = recipe.pattern();
        let pattern: Vec<u8> = pattern
            .flat_map(|angles| [angles.theta_h, angles.theta_d, angles.phi_d])
            .flat_map(f32::to_le_bytes)
            .collect();
        let ingredients = Ingredients {
            expectation: recipe.statements().unwrap().expectation,
            ..Ingredients::new(&pattern, recipe.learner().into())
        };
        let mut buffer = vec![0; bytes.len()];
        assert_eq!(Recipe::write(&ingredients, &mut buffer), Ok(&bytes[..]));
        let mut buffer = vec![0; bytes.len()];
        assert_eq!(recipe.copy_without(&[], &mut buffer), Ok(&bytes[..]));

        let mut buffer = vec![0; bytes.len()];
        let bare = recipe
            .copy_without(&[Kind::EXPECTATION], &mut buffer)
            .unwrap();
        let bare = Recipe::parse(bare).unwrap();
        assert_eq!(bare.expected_loss(), None);
        let required: Vec<u16> = numbers(&recipe).into_iter().filter(|k| *k < 128).collect();
        assert_eq!(numbers(&bare), required);
        for kind in [Kind::COMPLETION, Kind::START] {
            let mut buffer = vec![0; bytes.len()];
            assert!(recipe.copy_without(&[kind], &mut buffer).is_err());
        }
    }
}
