//! A CSV of readings, of a white, or of angles: it is refused, or all of its numbers are what they should.

use crate::{Folder, PLACES, refused};
use glimpse_core::geometry::Angles;
use glimpse_core::gonio::{Footprint, Quantity, Repeated};
use glimpse_trainer::measurement::{AngleTable, Counts, Meaning, Measured, TableError, White};

const NAME: &str = "felt.csv";
/// Radians.
const TOLERANCE: f64 = 0.02;

/// Checks one input.
pub fn check(bytes: &[u8]) {
    let folder = Folder::new();
    let path = folder.write(NAME, bytes);
    let pattern = &PLACES[..4];

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
        Err(error) => refused(&error, NAME),
    }

    let values = [Quantity::Brdf, Quantity::BrdfTimesCosThetaO].map(Meaning::Values);
    for meaning in values {
        check_measured(Measured::read(&path, pattern, TOLERANCE, &meaning), pattern);
    }
    for footprint in [None, Some(Footprint::LightLarger)] {
        let white = match White::read(&path, pattern, TOLERANCE, footprint) {
            Ok(white) => white,
            Err(error) => {
                refused(&error, NAME);
                continue;
            }
        };
        // The file as its own white.
        let counts = Meaning::Counts(Counts {
            dark: [0.0; 3],
            reflectance: [0.9; 3],
            saturation: Some(1e6),
            white,
        });
        check_measured(Measured::read(&path, pattern, TOLERANCE, &counts), pattern);
    }
}

fn check_measured(read: Result<Measured, TableError>, pattern: &[Angles<f32>]) {
    let measured = match read {
        Ok(measured) => measured,
        Err(error) => return refused(&error, NAME),
    };
    assert_eq!(measured.samples.len(), pattern.len());
    let counts = measured.samples.iter().map(Repeated::count);
    assert_eq!(
        counts.map(|count| count as usize).sum::<usize>(),
        measured.rows
    );
    assert!(measured.rows > 0);
    let means = measured.samples.iter().filter_map(Repeated::mean);
    for mean in means {
        assert!(mean.iter().all(|value| value.is_finite()), "{mean:?}");
    }
    if let Some(furthest) = measured.furthest {
        assert!(furthest.largest <= TOLERANCE);
    }
}
