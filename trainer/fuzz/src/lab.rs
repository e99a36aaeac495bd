//! Checks of the readers of lab files: a reader rejects its file, or returns valid numbers.

use std::sync::LazyLock;

use glimpse_core::gonio::Footprint;
use glimpse_core::model::ModelKind;
use glimpse_fitting::measurement::{
    AngleArgs, AngleTable, CountCalibration, Multiple, NamedRecipe, ReadingQuantity, ReadingRows,
    Readings, TableArgs,
};
use glimpse_program::picture;

use crate::support::{ANGLES, Folder, accepted};

/// Largest accepted distance between the directions of a row and of a sample, in degrees.
const TOLERANCE: f64 = 0.5;

/// A recipe for any directions, and one with a pattern.
static RECIPES: LazyLock<[NamedRecipe; 2]> = LazyLock::new(|| {
    let any = NamedRecipe::any(ModelKind::Linear);
    let with_pattern = any.at(&ANGLES[..4]).expect("valid directions");
    [any, with_pattern]
});

/// Checks a picture.
pub(crate) fn check_picture(bytes: &[u8]) {
    // Only the error of a file has its name.
    if let Some(picture) = accepted(picture::decode(bytes), "") {
        assert_eq!(picture.pixels.len(), picture.width * picture.height);
        let mut values = picture.pixels.as_flattened().iter();
        assert!(values.all(|value| value.is_finite()));
    }
}

/// Checks a CSV file as readings, as a white reference, and as angles.
pub(crate) fn check_readings(bytes: &[u8]) {
    let name = "input.csv";
    let folder = Folder::new();
    let path = folder.write(name, bytes);
    let table = accepted(AngleTable::read(&path, &AngleArgs::default()), name);
    for row in table.iter().flat_map(|table| &table.rows) {
        if let Some(at) = row.angles {
            assert!((0.0..1.6).contains(&at.theta_h) && (0.0..1.6).contains(&at.theta_d));
            assert!((0.0..6.3).contains(&at.phi_d));
        }
    }
    let Some(rows) = accepted(ReadingRows::read(&path, &TableArgs::default()), name) else {
        return;
    };
    // The file is its own white reference.
    let whites = [None, Some(Footprint::LightLarger)];
    let counts = whites.map(|footprint| {
        ReadingQuantity::Counts(CountCalibration {
            dark: None,
            reflectance: Some([0.9; 3]),
            saturation: Some(1e6),
            white: rows.clone(),
            footprint,
        })
    });
    let values = [Multiple::Brdf, Multiple::BrdfCosO].map(ReadingQuantity::of);
    for quantity in values.into_iter().chain(counts) {
        for recipe in &*RECIPES {
            let readings = Readings::new(recipe, rows.clone(), quantity.clone());
            if let Some(readings) = accepted(readings, name) {
                check_samples(&readings);
            }
        }
    }
}

fn check_samples(readings: &Readings) {
    let samples = &readings.samples;
    assert_eq!(samples.len(), readings.recipe.file.recipe().samples());
    let counts = samples.iter().map(|sample| sample.brdf.count as usize);
    let count = counts.sum::<usize>();
    assert!(count == readings.rows.readings.len() && count > 0);
    let means = samples.iter().filter_map(|sample| sample.brdf.mean());
    assert!(means.flatten().all(f32::is_finite), "{readings:?}");
    let bands = samples.iter().flat_map(|sample| &sample.bands);
    assert!(bands.copied().all(f32::is_finite), "{readings:?}");
    let distance = readings.max_distance.map(|distance| distance.degrees);
    assert!(distance.is_none_or(|distance| distance <= TOLERANCE));
}
