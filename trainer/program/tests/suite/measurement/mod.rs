//! Readings from a lab: matching of rows to samples, quantities, and outliers.

mod outliers;
mod quantities;
mod rows;
mod tables;

use std::path::PathBuf;

use glimpse_core::geometry::Angles;
use glimpse_core::gonio::Quantity;
use glimpse_fitting::measurement::{AngleArgs, Measurements, ReadingQuantity, Rows, TableError};
use glimpse_training::recipe::RecipeFile;

/// Reads one of the bundled recipes.
pub(crate) fn recipe(name: &str) -> RecipeFile {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../recipes/");
    RecipeFile::read(&PathBuf::from(folder).join(name)).expect("a valid recipe")
}

/// Three samples, in radians.
pub(crate) fn pattern() -> Vec<Angles<f32>> {
    let sample = |theta_h: f32, theta_d: f32, phi_d: f32| Angles {
        theta_h: theta_h.to_radians(),
        theta_d: theta_d.to_radians(),
        phi_d: phi_d.to_radians(),
    };
    vec![
        sample(0.0, 30.0, 0.0),
        sample(20.0, 10.0, 90.0),
        sample(5.0, 60.0, 45.0),
    ]
}

/// Reads readings from a file with this text.
pub(crate) fn read_readings(
    text: &str,
    quantity: &ReadingQuantity,
) -> Result<Measurements, TableError> {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let path = scratch.path().join("a.csv");
    std::fs::write(&path, text).expect("the file is written");
    Measurements::new(
        &Rows::read(&path, &AngleArgs::default())?,
        &pattern(),
        quantity,
    )
}

/// Reads readings of the BRDF from a file with this text.
pub(crate) fn read_brdf(text: &str) -> Result<Measurements, TableError> {
    read_readings(text, &ReadingQuantity::of(Quantity::Brdf))
}

/// Returns the error message about an invalid file, without the path.
pub(crate) fn error_message(result: Result<Measurements, TableError>) -> String {
    match result {
        Err(TableError::Damaged { path, message } | TableError::OffPattern { path, message }) => {
            assert!(path.ends_with("a.csv"), "{}", path.display());
            message
        }
        Err(error) => panic!("{error}"),
        Ok(_) => panic!("the file is accepted"),
    }
}
