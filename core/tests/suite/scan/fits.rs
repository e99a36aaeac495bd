//! A fit requires all readings, and its result does not depend on the budgets of its slices.

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::gonio::Reading;

use crate::scanning::{SAMPLES, empty_scans, fit, full_scan, record, synthetic_reading};

/// In version 0.1, calls without readings counted as steps of the fit. With 1 to 7 of 8 readings, the fit never ended.
#[test]
fn fit_needs_all_readings() {
    for mut scan in empty_scans() {
        let recipe = *scan.recipe();
        for first in 0..SAMPLES as u16 {
            for _ in 0..30 {
                let missing = SAMPLES as u16 - first;
                let error = Error::with(ErrorCode::Incomplete, [missing.into(), first.into()]);
                assert_eq!(scan.fit().err(), Some(error));
                assert!(scan.fit_under_way().is_none());
                assert!(scan.fitted().is_none());
            }
            scan.record(first, synthetic_reading(first)).unwrap();
        }
        let expected = full_scan(recipe, synthetic_reading);
        assert_eq!(fit(&mut scan, &[u32::MAX]), expected);
    }
}

/// A new reading discards a fit in progress and its result. A rejected reading changes nothing.
#[test]
fn reading_during_fit_discards_it() {
    let gray = |_| Reading::new([0.4; 3]);
    let other = |index| Reading::new([if index == 5 { 1.5 } else { 0.4 }; 3]);
    for mut scan in empty_scans() {
        let recipe = *scan.recipe();
        record(&mut scan, 0..8, gray);
        scan.fit().unwrap().advance(7);
        assert!(scan.record(5, Reading::new([f32::NAN; 3])).is_err());
        assert!(scan.record(8, other(5)).is_err());
        assert_eq!(scan.fit_under_way().unwrap().progress().done, 7);
        assert!(scan.record(5, other(5)).unwrap().replaced);
        assert!(scan.fit_under_way().is_none());
        assert!(scan.fitted().is_none());
        let expected = full_scan(recipe, other);
        assert_eq!(fit(&mut scan, &[11]), expected);

        assert!(scan.record(5, Reading::new([-2.0; 3])).is_err());
        assert!(scan.fitted().is_some());
        scan.record(5, gray(5)).unwrap();
        assert!(scan.fitted().is_none());
        let expected_gray = full_scan(recipe, gray);
        assert_ne!(expected_gray, expected);
        assert_eq!(fit(&mut scan, &[3]), expected_gray);
        // A second fit starts from the beginning.
        scan.fit().unwrap().advance(4);
        assert!(scan.fitted().is_none());
        assert_eq!(fit(&mut scan, &[5]), expected_gray);
    }
}
