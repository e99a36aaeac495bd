//! Recipes are read and copied bit for bit.

use glimpse_core::fit::Target;
use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{Floats, Kind, PackedPartialLoss, Recipe, RecipeParts};

use super::contents::{CompletedContents, VIRTUAL_READINGS};
use super::partial::all_small;
use crate::recipes::{packed, parsed, write};

fn numbers(recipe: &Recipe<'_>) -> Vec<u16> {
    recipe.sections().map(|(kind, _)| kind.number()).collect()
}

/// The kinds of a recipe's sections, required and then the expectation.
fn expected_numbers(contents: &CompletedContents) -> Vec<u16> {
    let sections = [
        (0, true),
        (1, contents.descent.is_some()),
        (3, true),
        (4, contents.init_net.is_some()),
        (5, contents.gauss_newton.is_some()),
        (6, contents.correction.is_some()),
        (130, true),
    ];
    let present = sections.into_iter().filter(|(_, is_present)| *is_present);
    present.map(|(number, _)| number).collect()
}

#[track_caller]
fn assert_weights(actual: &[u8], expected: &[i8]) {
    let weights = actual.iter().map(|weight| weight.cast_signed());
    assert!(weights.eq(expected.iter().copied()));
}

#[track_caller]
fn assert_list(actual: Floats<'_>, expected: &[f32]) {
    assert!(actual.iter().eq(expected.iter().copied()));
}

#[test]
fn recipe_round_trip() {
    for missing in [
        MissingPolicy::AllRequired,
        MissingPolicy::Unscaled,
        MissingPolicy::Scaled,
    ] {
        for contents in CompletedContents::all_small(missing) {
            check_round_trip(&contents, missing);
        }
    }
}

fn check_round_trip(contents: &CompletedContents, missing: MissingPolicy) {
    let recipe = contents.recipe();
    assert_eq!(recipe.model(), contents.model());
    assert_eq!(recipe.method().model(), contents.model());
    assert_eq!(numbers(&recipe), expected_numbers(contents));
    // The recipe is neither a plain descent nor a ridge.
    assert!(recipe.descent().is_none() && recipe.ridge().is_none());
    let completed = recipe.completed().unwrap();
    assert_eq!(completed.model(), contents.model());
    assert_eq!(completed.components(), contents.fitted_components());
    assert_eq!(completed.missing(), missing);
    assert_eq!(
        completed.tolerates_missing(),
        missing != MissingPolicy::AllRequired
    );
    assert_eq!(completed.scale(), contents.scale);
    assert_list(completed.center(), &contents.center);
    assert_weights(completed.coefficient_net().readings, &contents.readings);
    if let Some(correction_part) = &contents.correction {
        let correction = completed.correction().unwrap();
        assert_eq!(correction.components(), correction_part.precision.len());
        assert_weights(correction.at_samples().rows(), &correction_part.rows);
        assert_list(
            correction.at_samples().scales(),
            &correction_part.row_scales,
        );
        assert_list(correction.precision(), &correction_part.precision);
    } else {
        assert!(completed.correction().is_none());
    }
    let start = match completed.target() {
        Target::Linear(components) => {
            if contents.correction.is_none() {
                let at_samples = completed.at_samples().unwrap();
                assert_weights(at_samples.rows(), &contents.rows);
                assert_list(at_samples.scales(), &contents.row_scales);
            }
            assert_eq!(components.basis_checksum(), Some(0xfeed_beef));
            assert_eq!(recipe.method().basis_checksum(), Some(0xfeed_beef));
            let values = 3 * contents.fitted_components();
            assert_eq!(recipe.values(), values);
            return;
        }
        Target::Descent(descent, start) => {
            let descent_part = contents.descent.as_ref().unwrap();
            assert_eq!(descent.inner_steps(), descent_part.inner_steps);
            assert_list(descent.initial(), &descent_part.initial);
            assert_list(descent.step_sizes(), &descent_part.step_sizes);
            start
        }
        Target::GaussNewton(steps, start) => {
            let steps_part = contents.gauss_newton.as_ref().unwrap();
            assert_eq!(steps.steps(), steps_part.steps);
            assert_list(steps.initial(), &steps_part.initial);
            assert_list(steps.precision(), &steps_part.precision);
            assert_eq!(steps.reading_weight(), steps_part.reading_weight);
            assert_eq!(steps.error_scale(), steps_part.error_scale);
            let virtual_readings = steps.virtual_readings();
            assert_eq!(virtual_readings.len(), VIRTUAL_READINGS);
            assert!(!virtual_readings.is_empty());
            assert_eq!(
                virtual_readings.directions().as_flattened(),
                packed(&steps_part.directions)
            );
            assert_list(virtual_readings.center(), &steps_part.center);
            assert_weights(virtual_readings.components().rows(), &steps_part.rows);
            assert_list(
                virtual_readings.components().scales(),
                &steps_part.row_scales,
            );
            start
        }
    };
    let init_net_part = contents.init_net.as_ref().unwrap();
    assert_eq!(start.units(), init_net_part.bias.len());
    assert_weights(start.hidden, &init_net_part.hidden);
    assert_eq!(recipe.values(), contents.initial().len());
    assert_eq!(recipe.method().basis_checksum(), None);
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
            expectation: recipe.metadata().unwrap().expectation,
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
        let bare = parsed(copy(&[Kind::EXPECTATION]).unwrap());
        assert_eq!(bare.expected_loss(), None);
        let others: Vec<u16> = numbers(&recipe).into_iter().filter(|k| *k != 130).collect();
        assert_eq!(numbers(&bare), others);
        for kind in [
            Kind::COMPLETION,
            Kind::START,
            Kind::GAUSS_NEWTON,
            Kind::CORRECTION,
        ] {
            assert!(copy(&[kind]).is_err());
        }
    }
}
