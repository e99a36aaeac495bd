//! A fit requires all readings, and its result does not depend on the budgets of its slices.

use std::cell::Cell;

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::fit::{Algorithm, Channels, FitMethod, Progress, ScanModel};
use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::linear::Basis;
use glimpse_core::model::{ModelKind, Phong, Samples};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Reading;
use proptest::prelude::*;

use crate::scanning::{
    Any, SAMPLES, empty_scans, fit, for_every_fitter, full_scan, new_scan, recipe_for, record,
    synthetic_reading,
};

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
        // Linear has 5 rows and 3 channels; a descent has 20 steps over 8 samples. Checks follow: one of the values, 8 of
        // the samples, and 16 of the albedo. None is done yet.
        let total = recipe.descent().map_or(5 + 3, |_| 20 * 8) + 25;
        let progress = scan.fit().unwrap().progress();
        assert_eq!(progress, Progress { done: 0, total });
        assert_eq!(
            fit(&mut scan, &[u32::MAX]),
            full_scan::<Any>(recipe, synthetic_reading)
        );
    }
}

/// In version 0.1, the residual before a fit was 0, as for a perfect fit.
#[test]
fn no_residual_before_fit() {
    for mut scan in empty_scans() {
        assert!(scan.fitted().is_none());
        record(&mut scan, 0..8, synthetic_reading);
        assert!(scan.fitted().is_none());
        let mut fit = scan.fit().unwrap();
        let progress = fit.advance(3);
        let total = progress.total;
        assert_eq!(progress, Progress { done: 3, total });
        let unfinished = Error::with(ErrorCode::Unfinished, [3, total]);
        assert_eq!(fit.finish().err(), Some(unfinished));
        assert!(scan.fitted().is_none());
        let mut fit = scan.fit_under_way().unwrap();
        assert_eq!(fit.progress(), progress);
        assert_eq!(fit.advance(0), progress);
        assert!(fit.advance(u32::MAX).is_complete());
        assert_eq!(fit.advance(u32::MAX).done, total);
        // The fit is complete, but not finished.
        assert!(scan.fitted().is_none());
        let residual = scan.fit_under_way().unwrap().finish().unwrap().residual();
        assert!(residual.mean > 0.0 && residual.worst >= residual.mean);
        assert_eq!(scan.fitted().unwrap().residual(), residual);
        assert_eq!(scan.fitted().unwrap().expected_loss(), Some(0.03));
        scan.restart();
        assert!(scan.fitted().is_none());
        assert_eq!(scan.pending().count(), SAMPLES);
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
        let expected = full_scan::<Any>(recipe, other);
        assert_eq!(fit(&mut scan, &[11]), expected);

        assert!(scan.record(5, Reading::new([-2.0; 3])).is_err());
        assert!(scan.fitted().is_some());
        scan.record(5, gray(5)).unwrap();
        assert!(scan.fitted().is_none());
        let expected_gray = full_scan::<Any>(recipe, gray);
        assert_ne!(expected_gray, expected);
        assert_eq!(fit(&mut scan, &[3]), expected_gray);
        // A second fit starts from the beginning.
        scan.fit().unwrap().advance(4);
        assert!(scan.fitted().is_none());
        assert_eq!(fit(&mut scan, &[5]), expected_gray);
    }
}

fn check_slices<K: ScanModel + 'static>(
    recipe: Recipe<'static>,
    brdfs: &[[f32; 3]],
    budgets: &[u32],
) {
    let reading = |index: u16| Reading::new(brdfs[usize::from(index)]);
    let mut scan = new_scan::<K>(recipe);
    record(&mut scan, 0..8, reading);
    assert_eq!(fit(&mut scan, budgets), full_scan::<K>(recipe, reading));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]
    #[test]
    fn slicing_keeps_result(
        brdfs in prop::collection::vec(prop::array::uniform3(0.0..5.0f32), 8),
        budgets in prop::collection::vec(1..40u32, 1..6),
    ) {
        for_every_fitter!(check_slices, &brdfs, &budgets);
    }
}

/// Phong, with a count of its evaluations.
struct CountedPhong;

thread_local! {
    static EVALUATIONS: Cell<u32> = const { Cell::new(0) };
}

impl ScanModel for CountedPhong {}

impl Algorithm for CountedPhong {
    fn words(method: &FitMethod<'_>, samples: usize) -> Result<usize, Error> {
        <Phong as Algorithm>::words(method, samples)
    }

    fn total(method: &FitMethod<'_>, samples: usize) -> u32 {
        <Phong as Algorithm>::total(method, samples)
    }

    fn start(words: &mut [f32], method: &FitMethod<'_>, channels: Channels) {
        <Phong as Algorithm>::start(words, method, channels);
    }

    fn advance(
        words: &mut [f32],
        method: &FitMethod<'_>,
        samples: Samples<'_>,
        channels: Channels,
        done: u32,
        budget: u32,
    ) -> u32 {
        <Phong as Algorithm>::advance(words, method, samples, channels, done, budget)
    }

    fn values<'w>(words: &'w [f32], method: &FitMethod<'_>) -> [&'w [f32]; 3] {
        <Phong as Algorithm>::values(words, method)
    }

    fn predicted_loss(words: &[f32], method: &FitMethod<'_>) -> Option<f32> {
        <Phong as Algorithm>::predicted_loss(words, method)
    }

    fn innovation(words: &[f32], method: &FitMethod<'_>) -> Option<f32> {
        <Phong as Algorithm>::innovation(words, method)
    }

    fn at_sample(
        words: &[f32],
        method: &FitMethod<'_>,
        index: usize,
        at: &HalfDifference<f32>,
    ) -> [f32; 3] {
        EVALUATIONS.set(EVALUATIONS.get() + 1);
        <Phong as Algorithm>::at_sample(words, method, index, at)
    }

    fn brdf(
        words: &[f32],
        method: &FitMethod<'_>,
        basis: Option<&Basis<'_>>,
        at: &HalfDifference<f32>,
    ) -> Option<[f32; 3]> {
        EVALUATIONS.set(EVALUATIONS.get() + 1);
        <Phong as Algorithm>::brdf(words, method, basis, at)
    }
}

/// `finish` did the checks at once: 24 evaluations of the BRDF, where a poll promises one per unit.
#[test]
fn checks_are_sliced() {
    let mut scan = new_scan::<CountedPhong>(recipe_for(ModelKind::Phong));
    record(&mut scan, 0..SAMPLES as u16, synthetic_reading);
    let mut fit = scan.fit().unwrap();
    let mut all = 0;
    loop {
        let is_complete = fit.advance(1).is_complete();
        let count = EVALUATIONS.take();
        assert!(count <= 1, "{count} evaluations in a unit");
        all += count;
        if is_complete {
            break;
        }
    }
    let error = fit.finish().err();
    assert!(error.is_none_or(|error| error.is_implausible()));
    assert_eq!((all, EVALUATIONS.get()), (8 + 16, 0));
}
