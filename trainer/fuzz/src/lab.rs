//! Checks of the readers of lab files: a reader rejects its file, or returns valid numbers.

use glimpse_core::gonio::{Footprint, Quantity, Repeated};
use glimpse_fitting::measurement::{
    AngleArgs, AngleTable, CountCalibration, Measurements, ReadingQuantity, Rows, WhiteReference,
};

use crate::support::{ANGLES, Folder, accepted};

/// Largest accepted distance between the directions of a row and of a sample, in radians.
const TOLERANCE: f64 = 0.5_f64.to_radians();

/// Checks a CSV file as readings, as a white reference, and as angles.
pub(crate) fn check_readings(bytes: &[u8]) {
    let name = "input.csv";
    let folder = Folder::new();
    let path = folder.write(name, bytes);
    let pattern = &ANGLES[..4];
    let table = accepted(AngleTable::read(&path, &AngleArgs::default()), name);
    for row in table.iter().flat_map(|table| &table.rows) {
        if let Some(at) = row.angles {
            assert!((0.0..1.6).contains(&at.theta_h) && (0.0..1.6).contains(&at.theta_d));
            assert!((0.0..6.3).contains(&at.phi_d));
        }
    }
    // The file is its own white reference.
    let whites = [None, Some(Footprint::LightLarger)]
        .map(|footprint| WhiteReference::read(&path, &AngleArgs::default(), pattern, footprint));
    let counts = whites.into_iter().filter_map(|white| accepted(white, name));
    let counts = counts.map(|white| {
        ReadingQuantity::Counts(CountCalibration {
            dark: [0.0; 3],
            reflectance: [0.9; 3],
            saturation: Some(1e6),
            white,
        })
    });
    let values = [Quantity::Brdf, Quantity::BrdfTimesCosThetaO].map(ReadingQuantity::of);
    for quantity in values.into_iter().chain(counts) {
        let read = Rows::read(&path, &AngleArgs::default())
            .and_then(|rows| Measurements::new(&rows, pattern, &quantity));
        let Some(measurements) = accepted(read, name) else {
            continue;
        };
        assert_eq!(measurements.samples.len(), pattern.len());
        let counts = measurements.samples.iter().map(Repeated::count);
        let count = counts.map(|count| count as usize).sum::<usize>();
        assert!(count == measurements.rows && count > 0);
        let means = measurements.samples.iter().filter_map(Repeated::mean);
        assert!(means.flatten().all(f32::is_finite), "{measurements:?}");
        let distance = measurements.max_distance.map(|distance| distance.radians);
        assert!(distance.is_none_or(|distance| distance <= TOLERANCE));
    }
}
