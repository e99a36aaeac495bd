//! Readings that are missing or saturated: which recipes can do without them, and what is left.

use glimpse_core::fit::coefficient_net::{MissingPolicy, dropout_gain};
use glimpse_core::scan::{FitError, Reading, Scan, SkipError};

use super::made::{Made, SAMPLES};
use super::reference::{Readings, all, assert_close, color, some};
use super::scans::{Any, whole_by_type};
use crate::scanning::{MODELS, Outcome, fit, record};

/// Those of a mask.
fn subset(present: u32) -> Readings {
    some(SAMPLES, |sample| present >> sample & 1 == 1)
}

fn clear(index: u16) -> Reading {
    Reading::new(color(index.into()))
}

fn saturated(index: u16) -> Reading {
    Reading {
        saturated: true,
        ..clear(index)
    }
}

/// Calls `check` with an empty scan by a recipe of each model.
fn each(missing: MissingPolicy, check: impl Fn(&Made, &mut Scan<'_, Any>)) {
    for kind in MODELS {
        let made = Made::small(kind, missing);
        let recipe = made.recipe();
        let mut memory = vec![0.0; recipe.memory_words()];
        check(&made, &mut Scan::new(recipe, &mut memory).unwrap());
    }
}

#[test]
fn a_recipe_that_needs_all_readings_says_which_is_missing() {
    each(MissingPolicy::AllRequired, |made, scan| {
        for index in [0, 2, 1, 5, 4, 3] {
            let (first, _) = scan.next_pending().unwrap();
            let missing = scan.pending().count() as u16;
            let error = FitError::Incomplete { missing, first };
            assert_eq!(scan.fit().err(), Some(error));
            scan.record(index, clear(index)).unwrap();
        }
        assert_eq!(fit(scan, &[7]), whole_by_type(made, &all(SAMPLES)));
    });
}

/// Training without some of them makes no difference where all are there.
#[test]
fn with_all_readings_all_fit_alike() {
    for kind in MODELS {
        let [without, alike, more] = [
            MissingPolicy::AllRequired,
            MissingPolicy::Unscaled,
            MissingPolicy::Scaled,
        ]
        .map(|missing| whole_by_type(&Made::small(kind, missing), &all(SAMPLES)));
        assert_eq!(alike, without);
        assert_eq!(more, without);
    }
}

/// After each reading the fit goes by those that are there; the order does not count.
#[test]
fn one_reading_is_enough_and_each_further_one_counts() {
    each(MissingPolicy::Scaled, |made, scan| {
        let (missing, first) = (SAMPLES as u16, 0);
        let error = FitError::Incomplete { missing, first };
        assert_eq!(scan.fit().err(), Some(error));
        let mut present = 0;
        let mut before = Outcome::Diverged;
        for index in [3, 5, 0, 1, 4, 2] {
            scan.record(index, clear(index)).unwrap();
            present |= 1 << index;
            let found = fit(scan, &[4]);
            assert_eq!(found, whole_by_type(made, &subset(present)));
            assert_ne!(found, before);
            let pending = scan.pending().map(|(index, _)| index);
            assert!(pending.eq((0..6).filter(|k| present >> k & 1 == 0)));
            before = found;
        }
    });
}

/// sqrt(n / k).
#[test]
fn the_gain_is_the_root_of_the_share_that_is_missing() {
    for samples in 1..=64_usize {
        for present in 1..=samples {
            let expected = (samples as f64 / present as f64).sqrt();
            assert_close(
                "gain",
                [dropout_gain(samples, present)].into_iter(),
                &[expected],
            );
            let there = (0..samples).map(|sample| sample < present);
            let alike = [MissingPolicy::AllRequired, MissingPolicy::Unscaled];
            assert_eq!(alike.map(|each| each.dropout_gain(there.clone())), [1.0; 2]);
            let more = MissingPolicy::Scaled.dropout_gain(there);
            assert_eq!(more, dropout_gain(samples, present));
        }
        // No more than what there is, and nothing to multiply.
        assert_eq!(
            [dropout_gain(samples, samples), dropout_gain(samples, 0)],
            [1.0; 2]
        );
    }
}

#[test]
fn a_saturated_reading_is_left_out_where_others_are_there() {
    each(MissingPolicy::Scaled, |made, scan| {
        record(scan, [0, 2, 3, 5], clear);
        record(scan, [1, 4], saturated);
        let outcome = fit(scan, &[5]);
        let expected = whole_by_type(made, &subset(0b10_1101));
        assert_eq!(outcome.values(), expected.values());
        // The residual counts them nevertheless.
        assert_eq!(outcome.residual().saturated, 2);
        // A second reading, with less light, counts.
        scan.record(1, clear(1)).unwrap();
        let expected = whole_by_type(made, &subset(0b10_1111));
        assert_eq!(fit(scan, &[5]).values(), expected.values());
    });
}

#[test]
fn if_all_are_saturated_they_count() {
    each(MissingPolicy::Scaled, |made, scan| {
        record(scan, [2, 3], saturated);
        let outcome = fit(scan, &[5]);
        let clear_ones = whole_by_type(made, &subset(0b1100));
        assert_eq!(outcome.values(), clear_ones.values());
        let residual = outcome.residual();
        assert_eq!(residual.mean, clear_ones.residual().mean);
        assert_eq!(residual.saturated, 2);
        // Not any more once there is one that is not.
        scan.record(0, clear(0)).unwrap();
        let expected = whole_by_type(made, &subset(1));
        assert_eq!(fit(scan, &[5]).values(), expected.values());
    });
}

#[test]
fn a_recipe_that_needs_all_readings_counts_saturated_ones() {
    each(MissingPolicy::AllRequired, |made, scan| {
        record(scan, [0], clear);
        record(scan, 1..6, saturated);
        let outcome = fit(scan, &[5]);
        let expected = whole_by_type(made, &all(SAMPLES));
        assert_eq!(outcome.values(), expected.values());
        assert_eq!(outcome.residual().saturated, 5);
    });
}

#[test]
fn a_restart_forgets() {
    each(MissingPolicy::Scaled, |made, scan| {
        // Readings so large that a fit of them is refused.
        record(scan, 0..6, |_| Reading::new([1e4; 3]));
        assert_eq!(fit(scan, &[5]), Outcome::TooLarge);
        scan.restart();
        let (missing, first) = (SAMPLES as u16, 0);
        let error = FitError::Incomplete { missing, first };
        assert_eq!(scan.fit().err(), Some(error));
        // The readings of before are neither fitted nor looked at.
        scan.record(2, clear(2)).unwrap();
        assert_eq!(scan.reading(0), None);
        assert_eq!(fit(scan, &[5]), whole_by_type(made, &subset(0b100)));
    });
}

/// Counts instead of BRDFs are refused among few readings as among all of them.
#[test]
fn counts_are_refused_among_few_readings() {
    each(MissingPolicy::Scaled, |_, scan| {
        for index in [0, 2, 3, 5] {
            assert!(scan.fit().is_ok() || index == 0);
            scan.record(index, Reading::new([1e4; 3])).unwrap();
        }
        assert_eq!(fit(scan, &[5]), Outcome::TooLarge);
    });
}

/// The mean is over the readings that are there, not over the pattern.
#[test]
fn the_residual_counts_the_readings_that_are_there() {
    each(MissingPolicy::Scaled, |_, scan| {
        scan.record(4, clear(4)).unwrap();
        let residual = fit(scan, &[5]).residual();
        assert_eq!((residual.mean, residual.worst_index), (residual.worst, 4));
        assert!(residual.mean > 0.0);
        scan.record(1, clear(4)).unwrap();
        let residual = fit(scan, &[5]).residual();
        assert!(residual.mean > residual.worst / 2.0 && residual.mean < residual.worst);
        // Alike, with others between them in the pattern that are not there.
        assert_eq!(residual.repeated, 1);
    });
}

#[test]
fn skipped_samples_are_left_out_of_the_fit() {
    each(MissingPolicy::Scaled, |made, scan| {
        for index in [0, 2, 3, 5] {
            scan.record(index, clear(index)).unwrap();
        }
        scan.skip(1).unwrap();
        assert_eq!(scan.next_pending().unwrap().0, 4);
        scan.skip(4).unwrap();
        assert!(scan.next_pending().is_none());
        assert_eq!(fit(scan, &[7]), whole_by_type(made, &subset(0b101101)));
    });
}

#[test]
fn a_scan_that_finishes_early_uses_what_was_read() {
    each(MissingPolicy::Scaled, |made, scan| {
        scan.finish_early().unwrap();
        let nothing = FitError::Incomplete {
            missing: SAMPLES as u16,
            first: 0,
        };
        assert_eq!(scan.fit().err(), Some(nothing));
        // A reading of a skipped sample counts again.
        scan.record(5, clear(5)).unwrap();
        assert!(scan.next_pending().is_none());
        assert_eq!(fit(scan, &[7]), whole_by_type(made, &subset(0b100000)));
        scan.restart();
        assert_eq!(scan.pending().count(), SAMPLES);
    });
}

#[test]
fn a_recipe_that_needs_all_readings_refuses_to_skip() {
    each(MissingPolicy::AllRequired, |_, scan| {
        assert_eq!(scan.skip(0), Err(SkipError::Required));
        assert_eq!(scan.finish_early(), Err(SkipError::Required));
        assert_eq!(scan.pending().count(), SAMPLES);
    });
    each(MissingPolicy::Unscaled, |_, scan| {
        let (index, samples) = (SAMPLES as u16, SAMPLES as u16);
        let error = SkipError::Index { index, samples };
        assert_eq!(scan.skip(index), Err(error));
    });
}
