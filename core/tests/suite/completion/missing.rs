//! Readings that are missing or saturated: recipes that tolerate them, and fits without them.

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::fit::coefficient_net::{MissingPolicy, dropout_gain};
use glimpse_core::scan::{Reading, Scan};

use super::contents::{CompletedContents, SAMPLES};
use super::reference::{Readings, all_readings, assert_close, color, some_readings};
use super::scans::{Any, full_scan_by_type};
use crate::scanning::{Outcome, fit, record};

/// The readings of a bit mask.
fn subset(present: u32) -> Readings {
    some_readings(SAMPLES, |sample| present >> sample & 1 == 1)
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

/// Calls `check` with an empty scan for each small recipe.
fn for_each_recipe(missing: MissingPolicy, check: impl Fn(&CompletedContents, &mut Scan<'_, Any>)) {
    for contents in CompletedContents::all_small(missing) {
        let recipe = contents.recipe();
        let mut memory = vec![0.0; recipe.memory_words()];
        check(&contents, &mut Scan::new(recipe, &mut memory).unwrap());
    }
}

#[test]
fn names_missing_required_reading() {
    for_each_recipe(MissingPolicy::AllRequired, |contents, scan| {
        for index in [0, 2, 1, 5, 4, 3] {
            let (first, _) = scan.next_pending().unwrap();
            let missing = scan.pending().count() as u16;
            let error = Error::with(ErrorCode::Incomplete, [missing.into(), first.into()]);
            assert_eq!(scan.fit().err(), Some(error));
            scan.record(index, unsaturated(index)).unwrap();
        }
        assert_eq!(
            fit(scan, &[7]),
            full_scan_by_type(contents, &all_readings(SAMPLES))
        );
    });
}

/// The policy has no effect if no reading is missing.
#[test]
fn policies_agree_with_all_readings() {
    let [without, alike, more] = [
        MissingPolicy::AllRequired,
        MissingPolicy::Unscaled,
        MissingPolicy::Scaled,
    ]
    .map(|missing| {
        let all = CompletedContents::all_small(missing).into_iter();
        let outcomes = all.map(|contents| full_scan_by_type(&contents, &all_readings(SAMPLES)));
        outcomes.collect::<Vec<_>>()
    });
    assert_eq!(alike, without);
    assert_eq!(more, without);
}

/// Each fit uses the recorded readings, in any order.
#[test]
fn each_reading_changes_fit() {
    for_each_recipe(MissingPolicy::Scaled, |contents, scan| {
        let error = Error::with(ErrorCode::Incomplete, [SAMPLES as u32, 0]);
        assert_eq!(scan.fit().err(), Some(error));
        let mut present = 0;
        let mut before = Outcome::Diverged;
        for index in [3, 5, 0, 1, 4, 2] {
            scan.record(index, unsaturated(index)).unwrap();
            present |= 1 << index;
            let actual = fit(scan, &[4]);
            assert_eq!(actual, full_scan_by_type(contents, &subset(present)));
            assert_ne!(actual, before);
            let pending = scan.pending().map(|(index, _)| index);
            assert!(pending.eq((0..6).filter(|k| present >> k & 1 == 0)));
            before = actual;
        }
    });
}

/// The gain is sqrt(n / k).
#[test]
fn dropout_gain_matches_formula() {
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
        // The gain is 1 with all readings, and with none.
        assert_eq!(
            [dropout_gain(samples, samples), dropout_gain(samples, 0)],
            [1.0; 2]
        );
    }
}

#[test]
fn omits_saturated_readings() {
    for_each_recipe(MissingPolicy::Scaled, |contents, scan| {
        record(scan, [0, 2, 3, 5], unsaturated);
        record(scan, [1, 4], saturated);
        let outcome = fit(scan, &[5]);
        let expected = full_scan_by_type(contents, &subset(0b10_1101));
        assert_eq!(outcome.values(), expected.values());
        // The residual still counts them.
        assert_eq!(outcome.residual().saturated, 2);
        // A second, unsaturated reading is used.
        scan.record(1, unsaturated(1)).unwrap();
        let expected = full_scan_by_type(contents, &subset(0b10_1111));
        assert_eq!(fit(scan, &[5]).values(), expected.values());
    });
}

#[test]
fn uses_saturated_readings_without_others() {
    for_each_recipe(MissingPolicy::Scaled, |contents, scan| {
        record(scan, [2, 3], saturated);
        let outcome = fit(scan, &[5]);
        let unsaturated_ones = full_scan_by_type(contents, &subset(0b1100));
        assert_eq!(outcome.values(), unsaturated_ones.values());
        let residual = outcome.residual();
        assert_eq!(residual.mean, unsaturated_ones.residual().mean);
        assert_eq!(residual.saturated, 2);
        // They are unused as soon as another reading is unsaturated.
        scan.record(0, unsaturated(0)).unwrap();
        let expected = full_scan_by_type(contents, &subset(1));
        assert_eq!(fit(scan, &[5]).values(), expected.values());
    });
}

#[test]
fn required_saturated_readings_count() {
    for_each_recipe(MissingPolicy::AllRequired, |contents, scan| {
        record(scan, [0], unsaturated);
        record(scan, 1..6, saturated);
        let outcome = fit(scan, &[5]);
        let expected = full_scan_by_type(contents, &all_readings(SAMPLES));
        assert_eq!(outcome.values(), expected.values());
        assert_eq!(outcome.residual().saturated, 5);
    });
}

#[test]
fn restart_discards_readings() {
    for_each_recipe(MissingPolicy::Scaled, |contents, scan| {
        // The fit rejects such large readings.
        record(scan, 0..6, |_| Reading::new([1e4; 3]));
        assert_eq!(fit(scan, &[5]), Outcome::TooLarge);
        scan.restart();
        let error = Error::with(ErrorCode::Incomplete, [SAMPLES as u32, 0]);
        assert_eq!(scan.fit().err(), Some(error));
        // The fit ignores the discarded readings.
        scan.record(2, unsaturated(2)).unwrap();
        assert_eq!(scan.reading(0), None);
        assert_eq!(fit(scan, &[5]), full_scan_by_type(contents, &subset(0b100)));
    });
}

/// Counts instead of BRDFs are rejected with few readings too.
#[test]
fn rejects_raw_counts_in_few_readings() {
    for_each_recipe(MissingPolicy::Scaled, |_, scan| {
        for index in [0, 2, 3, 5] {
            assert!(scan.fit().is_ok() || index == 0);
            scan.record(index, Reading::new([1e4; 3])).unwrap();
        }
        assert_eq!(fit(scan, &[5]), Outcome::TooLarge);
    });
}

/// The mean is over the recorded readings, not over the pattern.
#[test]
fn residual_averages_recorded_readings() {
    for_each_recipe(MissingPolicy::Scaled, |_, scan| {
        scan.record(4, unsaturated(4)).unwrap();
        let residual = fit(scan, &[5]).residual();
        assert_eq!((residual.mean, residual.worst_index), (residual.worst, 4));
        assert!(residual.mean > 0.0);
        scan.record(1, unsaturated(4)).unwrap();
        let residual = fit(scan, &[5]).residual();
        assert!(residual.mean > residual.worst / 2.0 && residual.mean < residual.worst);
        // Two equal readings count as repeated although samples between them are missing.
        assert_eq!(residual.repeated, 1);
    });
}

#[test]
fn fit_omits_skipped_samples() {
    for_each_recipe(MissingPolicy::Scaled, |contents, scan| {
        for index in [0, 2, 3, 5] {
            scan.record(index, unsaturated(index)).unwrap();
        }
        scan.skip(1).unwrap();
        assert_eq!(scan.next_pending().unwrap().0, 4);
        scan.skip(4).unwrap();
        assert!(scan.next_pending().is_none());
        assert_eq!(
            fit(scan, &[7]),
            full_scan_by_type(contents, &subset(0b101101))
        );
    });
}

#[test]
fn early_finish_uses_recorded_readings() {
    for_each_recipe(MissingPolicy::Scaled, |contents, scan| {
        scan.finish_early().unwrap();
        let nothing = Error::with(ErrorCode::Incomplete, [SAMPLES as u32, 0]);
        assert_eq!(scan.fit().err(), Some(nothing));
        // A reading of a skipped sample is used.
        scan.record(5, unsaturated(5)).unwrap();
        assert!(scan.next_pending().is_none());
        assert_eq!(
            fit(scan, &[7]),
            full_scan_by_type(contents, &subset(0b100000))
        );
        scan.restart();
        assert_eq!(scan.pending().count(), SAMPLES);
    });
}

#[test]
fn required_readings_cannot_be_skipped() {
    for_each_recipe(MissingPolicy::AllRequired, |_, scan| {
        assert_eq!(
            scan.skip(0),
            Err(Error::with(ErrorCode::ReadingRequired, [0; 2]))
        );
        assert_eq!(
            scan.finish_early(),
            Err(Error::with(ErrorCode::ReadingRequired, [0; 2]))
        );
        assert_eq!(scan.pending().count(), SAMPLES);
    });
    for_each_recipe(MissingPolicy::Unscaled, |_, scan| {
        let (index, samples) = (SAMPLES as u16, SAMPLES as u16);
        let error = Error::with(ErrorCode::ReadingIndex, [index.into(), samples.into()]);
        assert_eq!(scan.skip(index), Err(error));
    });
}
