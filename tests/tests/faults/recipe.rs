//! The recipe in flash is damaged or replaced.

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::link::FailureReport;
use glimpse_core::model::ModelKind;
use glimpse_core::numeric::Floats;
use glimpse_core::recipe::{Contents, Pattern, Recipe, SECTIONS_START};
use glimpse_tests::RECIPE;
use glimpse_tests::device::assert_matches_host;
use glimpse_tests::elf::{Firmware, pad_recipe};
use glimpse_tests::emulator::Emulator;
use glimpse_tests::host::{noiseless_scanner, unseen_material};
use glimpse_trainer::scanner::ScannerError;
use glimpse_training::recipe::RecipeFile;

/// Returns the device's report for an altered recipe.
fn failure(alter: impl FnOnce(&mut [u8])) -> FailureReport {
    let firmware = Firmware::load();
    let image = firmware.with_altered_recipe(alter);
    let mut emulator = Emulator::boot(&firmware, image.path());
    let material = unseen_material(0);
    let error = noiseless_scanner(&material)
        .serve(&mut emulator.serial)
        .unwrap_err();
    let ScannerError::Device(report) = error else {
        panic!("{error}");
    };
    emulator.wait_for_error(report.error().unwrap().code);
    report
}

/// Checks the device's report for an altered recipe.
#[track_caller]
fn check(alter: impl FnOnce(&mut [u8]), expected: Error) {
    assert_eq!(failure(alter), expected.into());
}

const MAGIC: Error = Error::new(ErrorCode::RecipeMagic);
const CHECKSUM: Error = Error::new(ErrorCode::RecipeChecksum);

#[test]
fn reports_flipped_bit() {
    check(|recipe| recipe[2] ^= 0x40, MAGIC);
    let version = u32::from(RECIPE[4] ^ 0x40);
    let error = Error::with(ErrorCode::RecipeVersion, [version, 0]);
    check(|recipe| recipe[4] ^= 0x40, error);
    check(|recipe| recipe[13] ^= 1, CHECKSUM);
    for index in [SECTIONS_START, RECIPE.len() / 3, RECIPE.len() - 1] {
        check(|recipe| recipe[index] ^= 0x10, CHECKSUM);
    }
}

#[test]
fn reports_truncated_recipe() {
    // Fewer bytes than the header states, as after interrupted flashing. Here the stated length grows.
    let found = RECIPE.len() as u32;
    let error = Error::with(ErrorCode::RecipeLength, [found + 0x100, found]);
    check(|recipe| recipe[7] += 1, error);
    // The rest of the recipe is erased flash.
    check(|recipe| recipe[100..].fill(0xFF), CHECKSUM);
    check(|recipe| recipe.fill(0xFF), MAGIC);
}

/// Returns the firmware's recipe for another number of samples, whose pattern repeats, padded to its length.
fn neural(samples: usize) -> Vec<u8> {
    let original = Recipe::parse(RECIPE).unwrap();
    let pattern = original.pattern().cycle().take(samples);
    let directions: Vec<u8> = pattern
        .flat_map(|angles| [angles.theta_h, angles.theta_d, angles.phi_d])
        .flat_map(f32::to_le_bytes)
        .collect();
    let file = RecipeFile::write(&Contents {
        sgd: Contents::read(RECIPE).unwrap().sgd,
        pattern: Some(Pattern {
            directions: Floats::new(&directions),
            is_path: false,
            expected_loss: None,
        }),
        ..Contents::default()
    });
    pad_recipe(file.unwrap().bytes(), RECIPE.len())
}

#[test]
fn reports_recipe_of_other_model() {
    let others: [&[u8]; 3] = [
        include_bytes!("../../../trainer/recipes/paper/phong-n8.recipe"),
        include_bytes!("../../../trainer/recipes/paper/cook-torrance-n8.recipe"),
        include_bytes!("../../../trainer/recipes/paper/linear-n8.recipe"),
    ];
    for bytes in others {
        let model = Recipe::parse(bytes).unwrap().model();
        let details = [ModelKind::Neural as u32, model as u32];
        let padded = pad_recipe(bytes, RECIPE.len());
        check(
            |recipe| recipe.copy_from_slice(&padded),
            Error::with(ErrorCode::Model, details),
        );
    }
}

#[test]
fn reports_recipe_with_too_many_samples() {
    let bytes = neural(9);
    let needed = Recipe::parse(&bytes).unwrap().memory_words();
    let found = Recipe::parse(&neural(8)).unwrap().memory_words();
    let details = [needed, found].map(|words| words as u32);
    let failure = failure(|recipe| recipe.copy_from_slice(&bytes));
    assert_eq!(failure, Error::with(ErrorCode::Memory, details).into());
}

#[test]
fn scans_with_fewer_samples() {
    let bytes = neural(3);
    let firmware = Firmware::load();
    let image = firmware.with_recipe(&bytes);
    let mut emulator = Emulator::boot(&firmware, image.path());
    let material = unseen_material(0);
    let report = noiseless_scanner(&material)
        .serve(&mut emulator.serial)
        .unwrap();
    assert_matches_host(&report, &bytes);
}
