//! Readings that are missing or saturated: recipes that tolerate them, and fits without them.

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::gonio::Reading;
use glimpse_core::scan::Scan;

use crate::estimator::{outcome, readings};
use crate::recipes::{Contents, SAMPLES, tolerant};
use crate::reference::{Readings, color};
use crate::scanning::{Any, Outcome, fit, record};

/// The readings of a bit mask.
fn subset(present: u32) -> Readings {
    readings(SAMPLES, |sample| present >> sample & 1 == 1)
}

fn unsaturated(index: u16) -> Reading {
    Reading::new(color(index.into()))
}

fn saturated(index: u16) -> Reading {
    Reading {
        saturated: true,
        ..unsaturated(index)
    }
}

/// Calls `check` with an empty scan for each recipe with a net.
fn for_each_recipe(missing: u8, check: impl Fn(&Contents, &mut Scan<'_, Any>)) {
    for mut contents in tolerant() {
        contents.net.as_mut().unwrap().missing = missing;
        let recipe = contents.recipe();
        let mut memory = vec![0.0; recipe.memory_words()];
        check(&contents, &mut Scan::new(recipe, &mut memory).unwrap());
    }
}

const NOTHING: Error = Error::with(ErrorCode::Incomplete, [SAMPLES as u32, 0]);

#[test]
fn required_readings_are_required() {
    for_each_recipe(0, |contents, scan| {
        let required = Err(Error::new(ErrorCode::ReadingRequired));
        assert_eq!((scan.skip(0), scan.finish_early()), (required, required));
        for index in [0, 2, 1, 5, 4, 3] {
            let (first, _) = scan.next_pending().unwrap();
            let details = [scan.pending().count() as u32, first.into()];
            let expected = Error::with(ErrorCode::Incomplete, details);
            assert_eq!(scan.fit().err(), Some(expected));
            // Saturated readings count.
            let reading = if index > 0 {
                saturated(index)
            } else {
                unsaturated(0)
            };
            scan.record(index, reading).unwrap();
        }
        let actual = fit(scan, &[7]);
        let expected = outcome(contents, &subset(0b11_1111)).values();
        assert_eq!(actual.values(), expected);
        assert_eq!(actual.residual().saturated, 5);
    });
}

#[test]
fn omits_saturated_readings() {
    for_each_recipe(2, |contents, scan| {
        record(scan, [0, 2, 3, 5], unsaturated);
        record(scan, [1, 4], saturated);
        let actual = fit(scan, &[5]);
        assert_eq!(
            actual.values(),
            outcome(contents, &subset(0b10_1101)).values()
        );
        // The residual still counts them.
        assert_eq!(actual.residual().saturated, 2);
        // A second, unsaturated reading is used.
        scan.record(1, unsaturated(1)).unwrap();
        let expected = outcome(contents, &subset(0b10_1111));
        assert_eq!(fit(scan, &[5]).values(), expected.values());
    });
}

#[test]
fn uses_saturated_readings_without_others() {
    for_each_recipe(2, |contents, scan| {
        record(scan, [2, 3], saturated);
        let actual = fit(scan, &[5]);
        let expected = outcome(contents, &subset(0b1100));
        assert_eq!(actual.values(), expected.values());
        let residual = actual.residual();
        assert_eq!(
            (residual.mean, residual.saturated),
            (expected.residual().mean, 2)
        );
        // They are unused as soon as another reading is unsaturated.
        scan.record(0, unsaturated(0)).unwrap();
        let expected = outcome(contents, &subset(1)).values();
        assert_eq!(fit(scan, &[5]).values(), expected);
    });
}

/// Counts instead of BRDFs are rejected with few readings too. A restart discards them.
#[test]
fn restart_discards_readings() {
    for_each_recipe(2, |contents, scan| {
        for index in [0, 2, 3, 5] {
            assert!(scan.fit().is_ok() || index == 0);
            scan.record(index, Reading::new([1e4; 3])).unwrap();
        }
        assert_eq!(fit(scan, &[5]), Outcome::TooLarge);
        scan.restart();
        assert_eq!(scan.fit().err(), Some(NOTHING));
        scan.record(2, unsaturated(2)).unwrap();
        assert_eq!(scan.reading(0), None);
        assert_eq!(fit(scan, &[5]), outcome(contents, &subset(0b100)));
    });
}
