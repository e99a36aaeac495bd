//! What a device has sent, as JSON: it is refused, or of the recipe.
//!
//! The checksum of the recipe, which nobody guesses, is put in the place of its name.

use crate::{Folder, refused};
use glimpse_core::recipe::Recipe;
use glimpse_trainer::measurement::DeviceReport;

const RECIPE: &[u8] = include_bytes!("../../../trainer/recipes/phong-n8.recipe");
const NAME: &str = "device.json";

/// Checks one input.
pub fn check(bytes: &[u8]) {
    let recipe = Recipe::parse(RECIPE).expect("it is a recipe");
    let checksum = format!("{:08x}", recipe.checksum());
    let text = String::from_utf8_lossy(bytes).replacen("CHECKSUM", &checksum, 1);
    let folder = Folder::new();
    let path = folder.write(NAME, text.as_bytes());
    let report = match DeviceReport::read(&path, &recipe) {
        Ok(report) => report,
        Err(error) => return refused(&error, NAME),
    };
    assert_eq!(report.model, recipe.model().name());
    assert!(report.values.iter().all(|value| value.is_finite()));
    match report.fit(&path, &recipe) {
        Ok((measured, fit)) => {
            assert_eq!(measured.samples.len(), recipe.samples());
            assert_eq!(fit.fates.len(), recipe.samples());
        }
        Err(error) => refused(&error, NAME),
    }
}
