//! The section of the training.

use glimpse_core::recipe::{Kind, Recipe, RecipeError, RecipeParts, Training, TrainingSources};

use super::{SOURCES, TRAINING, full_parts, full_sections};
use crate::recipes::{recipe_with, section_mut, write};

/// Reads a recipe whose section `training` was changed, and checks that it is written identically.
fn training_with(change: impl FnOnce(&mut Vec<u8>)) -> Result<(), RecipeError> {
    let mut sections = full_sections();
    change(section_mut(&mut sections, Kind::TRAINING));
    let bytes = recipe_with(&sections);
    let training = Recipe::parse(&bytes)?.metadata()?.training;
    let rewritten = write(&RecipeParts {
        training,
        ..full_parts()
    })?;
    assert_eq!(rewritten, bytes);
    Ok(())
}

#[test]
fn training_variant_round_trip() {
    // The first four bytes are the numbers of schedule, effort, parts and split.
    for (field, variants) in [(0, 3), (1, 4), (2, 4), (3, 4)] {
        for number in 0..=u8::MAX {
            let actual = training_with(|bytes| bytes[field] = number);
            let expected_error = RecipeError::Section(Kind::TRAINING);
            let expected = if number < variants {
                Ok(())
            } else {
                Err(expected_error)
            };
            assert_eq!(actual, expected, "field {field}, number {number}");
        }
    }
    let none = Training {
        sources: TrainingSources::new(&[]),
        ..TRAINING
    };
    assert_ne!(none, TRAINING);
    let training = Some(none);
    let bytes = write(&RecipeParts {
        training,
        ..full_parts()
    })
    .unwrap();
    let metadata = Recipe::parse(&bytes).unwrap().metadata().unwrap();
    assert_eq!(metadata.training, training);
}

#[test]
fn rejects_incomplete_list_of_sources() {
    // Four enums, and a digest of ten bytes.
    const COUNT: usize = 4 + 10;
    let expected_error = Err(RecipeError::Section(Kind::TRAINING));
    // Smaller and larger counts than the number of sources, 3. After a smaller count, bytes remain.
    for count in [2, 4, 5, 127] {
        let actual = training_with(|bytes| {
            assert_eq!(bytes[COUNT], 3);
            bytes[COUNT] = count;
        });
        assert_eq!(actual, expected_error, "{count}");
    }
    // A count of four billion, but only a few bytes.
    let actual = training_with(|bytes| {
        bytes.splice(COUNT..=COUNT, [0xFF, 0xFF, 0xFF, 0xFF, 0x0F]);
    });
    assert_eq!(actual, expected_error);
    // An unknown origin. The origin follows the length and the text of the label.
    let actual = training_with(|bytes| {
        let origin = COUNT + 2 + SOURCES[0].label.len();
        assert_eq!(bytes[origin], 0);
        bytes[origin] = 2;
    });
    assert_eq!(actual, expected_error);
}
