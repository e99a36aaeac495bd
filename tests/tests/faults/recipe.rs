//! The recipe in flash is damaged, or another one.

use glimpse_core::link::{Failure, FailureReport};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{
    PackedDescent, PackedMethod, PackedRidge, Recipe, RecipeError, RecipeParts,
};
use glimpse_core::scan::ScanError;
use glimpse_tests::RECIPE;
use glimpse_tests::device::assert_agrees;
use glimpse_tests::elf::{Firmware, padded};
use glimpse_tests::emulator::Emulator;
use glimpse_tests::host::{scanner, unseen};
use glimpse_trainer::scanner::ScannerError;

/// The device's report of a recipe with some bytes altered.
fn failure(alter: impl FnOnce(&mut [u8])) -> FailureReport {
    let firmware = Firmware::load();
    let image = firmware.with_altered_recipe(alter);
    let mut emulator = Emulator::boot(&firmware, image.path());
    let material = unseen(0);
    let error = scanner(&material).serve(&mut emulator.serial).unwrap_err();
    let ScannerError::Device(report) = error else {
        panic!("{error}");
    };
    // The log names it too.
    let name = match report.code {
        32..48 => "Recipe(",
        _ => "Scan(",
    };
    assert_ne!(emulator.wait_for(name), "");
    report
}

/// Checks the device's report of a recipe with some bytes altered.
#[track_caller]
fn check(alter: impl FnOnce(&mut [u8]), expected: RecipeError) {
    assert_eq!(failure(alter), Failure::Recipe(expected).into());
}

#[test]
fn a_flipped_bit_in_the_recipe_is_refused_by_name() {
    check(|recipe| recipe[2] ^= 0x40, RecipeError::Magic);
    let version = u16::from(RECIPE[4] ^ 0x40);
    check(|recipe| recipe[4] ^= 0x40, RecipeError::Version(version));
    check(|recipe| recipe[13] ^= 1, RecipeError::Checksum);
    for index in [14, RECIPE.len() / 3, RECIPE.len() - 1] {
        check(|recipe| recipe[index] ^= 0x10, RecipeError::Checksum);
    }
}

#[test]
fn a_recipe_cut_short_is_refused_by_name() {
    // Fewer bytes than the header promises, as after a flash that was cut off: the promise grows.
    let found = RECIPE.len() as u32;
    let expected = found + 0x100;
    let error = RecipeError::Length { expected, found };
    check(|recipe| recipe[7] += 1, error);
    // The rest of it as erased flash.
    check(|recipe| recipe[100..].fill(0xFF), RecipeError::Checksum);
    check(|recipe| recipe.fill(0xFF), RecipeError::Magic);
}

/// A whole recipe with this pattern and learner, padded to the length of the firmware's.
fn recipe_of(pattern: &[u8], learner: PackedMethod<'_>) -> Vec<u8> {
    let mut buffer = vec![0; 2 * RECIPE.len()];
    let bytes = Recipe::write(&RecipeParts::new(pattern, learner), &mut buffer).unwrap();
    padded(bytes, RECIPE.len())
}

/// The pattern of the firmware's recipe for as many samples, over and over.
fn pattern(samples: usize) -> Vec<u8> {
    let original = Recipe::parse(RECIPE).unwrap();
    let all = original.pattern().cycle().take(samples);
    all.flat_map(|angles| [angles.theta_h, angles.theta_d, angles.phi_d])
        .flat_map(f32::to_le_bytes)
        .collect()
}

/// The firmware's recipe for another number of samples.
fn neural(samples: usize) -> Vec<u8> {
    let learner = Recipe::parse(RECIPE).unwrap().method();
    recipe_of(&pattern(samples), learner.into())
}

#[test]
fn a_recipe_of_another_model_is_refused_by_name() {
    let flashed = |bytes: &[u8]| failure(|recipe| recipe.copy_from_slice(bytes));
    let refused = |recipe| {
        let firmware = ModelKind::Neural;
        FailureReport::from(Failure::Scan(ScanError::Model { firmware, recipe }))
    };
    for model in [ModelKind::Phong, ModelKind::CookTorrance] {
        let parameters = [0; 4].repeat(model.parameters().unwrap());
        let learner = PackedMethod::Descent(PackedDescent {
            model,
            inner_steps: 20,
            initial: &parameters,
            step_sizes: &parameters,
        });
        assert_eq!(flashed(&recipe_of(&pattern(8), learner)), refused(model));
    }
    let ones = 1.0_f32.to_le_bytes().repeat(8);
    let learner = PackedMethod::Ridge(PackedRidge {
        components: 1,
        basis: &ones,
        mean: &ones,
        median: &ones,
        weight: &ones,
        precision: &ones[..4],
        basis_checksum: 0,
    });
    let linear = recipe_of(&pattern(8), learner);
    assert_eq!(flashed(&linear), refused(ModelKind::Linear));
}

#[test]
fn a_recipe_of_more_samples_than_there_is_room_for_is_refused_by_name() {
    let bytes = neural(9);
    let needed = Recipe::parse(&bytes).unwrap().memory_words();
    let found = Recipe::parse(&neural(8)).unwrap().memory_words();
    let error = ScanError::Memory { needed, found };
    let failure = failure(|recipe| recipe.copy_from_slice(&bytes));
    assert_eq!(failure, Failure::Scan(error).into());
}

#[test]
fn a_recipe_of_fewer_samples_is_scanned_by() {
    let bytes = neural(3);
    let firmware = Firmware::load();
    let image = firmware.with_recipe(&bytes);
    let mut emulator = Emulator::boot(&firmware, image.path());
    let material = unseen(0);
    let report = scanner(&material).serve(&mut emulator.serial).unwrap();
    assert_agrees(&report, &bytes);
}
