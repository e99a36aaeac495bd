//! Readings from a lab: matching of rows to samples, quantities, and outliers.

mod alternatives;
mod any_directions;
mod columns;
mod instruments;
mod outliers;
mod quantities;
mod rows;
mod tables;

use std::path::PathBuf;

use glimpse_core::geometry::Angles;
use glimpse_core::model::ModelKind;
use glimpse_fitting::linear::{Posterior, PosteriorReading};
use glimpse_fitting::measurement::{
    Multiple, NamedRecipe, Outliers, ReadingQuantity, ReadingRows, Readings, SampleReading,
    TableArgs, TableError,
};
use glimpse_fitting::recipe::RecipeFile;

/// Reads one of the bundled recipes.
pub(crate) fn recipe(name: &str) -> RecipeFile {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../recipes/");
    RecipeFile::read(&PathBuf::from(folder).join(name)).expect("a valid recipe")
}

/// Three samples, in radians.
pub(crate) fn pattern() -> Vec<Angles<f32>> {
    let samples = [[0.0, 30.0, 0.0], [20.0, 10.0, 90.0], [5.0, 60.0, 45.0]];
    samples
        .map(|degrees| Angles::from_array(degrees).map(f32::to_radians))
        .to_vec()
}

/// Finds the outliers among readings of a pattern.
fn find_outliers(
    pattern: impl Iterator<Item = Angles<f32>>,
    readings: &[Option<[f32; 3]>],
) -> (Outliers, Vec<SampleReading>) {
    let samples = pattern.zip(readings).map(|(angles, reading)| {
        let mut sample = SampleReading::new(angles);
        if let Some(brdf) = reading {
            sample.brdf.add(*brdf, false).expect("a finite reading");
        }
        sample
    });
    let mut samples: Vec<SampleReading> = samples.collect();
    let known = samples.iter().enumerate();
    let known = known.filter(|(_, sample)| sample.brdf.count > 0);
    let known = known.map(|(index, sample)| {
        let brdf = sample.brdf.mean().expect("a reading");
        (index, PosteriorReading::new(sample.angles, brdf))
    });
    let (known, present): (Vec<usize>, Vec<PosteriorReading>) = known.unzip();
    let prior = NamedRecipe::any(ModelKind::Linear).prior;
    let posterior = Posterior::new(&prior, &present).expect("finite");
    (Outliers::find(posterior, &known, &mut samples), samples)
}

/// Reads a file with this text.
pub(crate) fn rows(text: &str, args: &TableArgs) -> Result<ReadingRows, TableError> {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let path = scratch.path().join("a.csv");
    std::fs::write(&path, text).expect("the file is written");
    ReadingRows::read(&path, args)
}

/// Reads readings at [`pattern`] from a file with this text.
pub(crate) fn read_readings(text: &str, quantity: ReadingQuantity) -> Result<Readings, TableError> {
    let any = NamedRecipe::any(ModelKind::Linear);
    let recipe = any.at(&pattern()).expect("valid directions");
    let rows = rows(text, &TableArgs::default())?;
    let readings = Readings::new(&recipe, rows, quantity)?;
    match readings.off_pattern {
        Some(message) => Err(TableError::Damaged {
            path: readings.rows.path,
            message,
        }),
        None => Ok(readings),
    }
}

/// Reads readings of the BRDF from a file with this text.
pub(crate) fn read_brdf(text: &str) -> Result<Readings, TableError> {
    read_readings(text, ReadingQuantity::of(Multiple::Brdf))
}

/// Returns the error message about an invalid file, without the path.
pub(crate) fn error_message<T>(result: Result<T, TableError>) -> String {
    match result {
        Err(TableError::Damaged { path, message }) => {
            assert!(path.ends_with("a.csv"), "{}", path.display());
            message
        }
        Err(error) => panic!("{error}"),
        Ok(_) => panic!("the file is accepted"),
    }
}
