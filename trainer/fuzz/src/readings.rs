//! Check of CSV files of readings, white references and angles: the readers reject a file, or return valid numbers.

use crate::{ANGLES, Folder, check_rejection};
use glimpse_core::geometry::Angles;
use glimpse_core::gonio::{Footprint, Quantity, Repeated};
use glimpse_trainer::measurement::{
    AngleTable, CountCalibration, Measurements, ReadingQuantity, TableError, WhiteReference,
};

const NAME: &str = "input.csv";
/// Largest accepted distance between the directions of a row and of a sample, in radians.
const TOLERANCE: f64 = 0.02;

/// Checks one input.
pub fn check(bytes: &[u8]) {
    let folder = Folder::new();
    let path = folder.write(NAME, bytes);
    let pattern = &ANGLES[..4];

    match AngleTable::read(&path) {
        Ok(table) => {
            for angles in table.rows.iter().filter_map(|row| row.angles) {
                let Angles {
                    theta_h,
                    theta_d,
                    phi_d,
                } = angles;
                assert!((0.0..1.6).contains(&theta_h) && (0.0..1.6).contains(&theta_d));
                assert!((0.0..6.3).contains(&phi_d));
            }
        }
        Err(error) => check_rejection(&error, NAME),
    }

    let quantities = [Quantity::Brdf, Quantity::BrdfTimesCosThetaO].map(ReadingQuantity::Values);
    for quantity in quantities {
        check_measurements(
            Measurements::read(&path, pattern, TOLERANCE, &quantity),
            pattern,
        );
    }
    for footprint in [None, Some(Footprint::LightLarger)] {
        let white = match WhiteReference::read(&path, pattern, TOLERANCE, footprint) {
            Ok(white) => white,
            Err(error) => {
                check_rejection(&error, NAME);
                continue;
            }
        };
        // The file is its own white reference.
        let counts = ReadingQuantity::Counts(CountCalibration {
            dark: [0.0; 3],
            reflectance: [0.9; 3],
            saturation: Some(1e6),
            white,
        });
        check_measurements(
            Measurements::read(&path, pattern, TOLERANCE, &counts),
            pattern,
        );
    }
}

fn check_measurements(result: Result<Measurements, TableError>, pattern: &[Angles<f32>]) {
    let measurements = match result {
        Ok(measurements) => measurements,
        Err(error) => return check_rejection(&error, NAME),
    };
    assert_eq!(measurements.samples.len(), pattern.len());
    let counts = measurements.samples.iter().map(Repeated::count);
    assert_eq!(
        counts.map(|count| count as usize).sum::<usize>(),
        measurements.rows
    );
    assert!(measurements.rows > 0);
    let means = measurements.samples.iter().filter_map(Repeated::mean);
    for mean in means {
        assert!(mean.iter().all(|value| value.is_finite()), "{mean:?}");
    }
    if let Some(distance) = measurements.max_distance {
        assert!(distance.radians <= TOLERANCE);
    }
}
