//! Check of device reports in JSON: the reader rejects a report, or the report matches the recipe.
//!
//! The word `CHECKSUM` in an input is replaced by the recipe's checksum, which a fuzzer cannot guess.

use crate::{Folder, check_rejection};
use glimpse_core::recipe::Recipe;
use glimpse_trainer::measurement::DeviceReport;

const RECIPE: &[u8] = include_bytes!("../../../trainer/recipes/phong-n8.recipe");
const NAME: &str = "device.json";

/// Checks one input.
pub fn check(bytes: &[u8]) {
    let recipe = Recipe::parse(RECIPE).expect("a valid recipe");
    let checksum = format!("{:08x}", recipe.checksum());
    let text = String::from_utf8_lossy(bytes).replacen("CHECKSUM", &checksum, 1);
    let folder = Folder::new();
    let path = folder.write(NAME, text.as_bytes());
    let report = match DeviceReport::read(&path, &recipe) {
        Ok(report) => report,
        Err(error) => return check_rejection(&error, NAME),
    };
    assert_eq!(report.model, recipe.model().name());
    assert!(report.values.iter().all(|value| value.is_finite()));
    match report.fit(&path, &recipe) {
        Ok((measurements, fit)) => {
            assert_eq!(measurements.samples.len(), recipe.samples());
            assert_eq!(fit.statuses.len(), recipe.samples());
        }
        Err(error) => check_rejection(&error, NAME),
    }
}
