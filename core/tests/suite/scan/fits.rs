//! A fit has all readings before it begins, and its result does not depend on how it is sliced.

use glimpse_core::fit::{Fitter, Progress};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{FinishError, FitError, Reading};
use proptest::prelude::*;

use crate::scanning::{
    Any, SAMPLES, each_scan, every_fitter, fit, material, record, scan_by, whole,
};

/// Version 0.1 counted steps without readings, so that early calls used the fit up; and with 1 to 7
/// of 8 readings it never ended.
#[test]
fn a_fit_cannot_be_used_up_before_it_begins() {
    for mut scan in each_scan() {
        let recipe = *scan.recipe();
        for first in 0..SAMPLES as u16 {
            for _ in 0..30 {
                let missing = SAMPLES as u16 - first;
                let error = FitError::Incomplete { missing, first };
                assert_eq!(scan.fit().err(), Some(error));
                assert!(scan.fit_under_way().is_none());
                assert!(scan.fitted().is_none());
            }
            scan.record(first, material(first)).unwrap();
        }
        // All of it is left to do.
        let total = recipe.descent().map_or(5 + 3, |_| 20 * 8);
        let progress = scan.fit().unwrap().progress();
        assert_eq!(progress, Progress { done: 0, total });
        assert_eq!(fit(&mut scan, &[u32::MAX]), whole::<Any>(recipe, material));
    }
}

/// The missing ones are counted, and the first of them is named, wherever they are.
#[test]
fn an_incomplete_fit_names_the_first_missing_reading() {
    for mut scan in each_scan() {
        record(&mut scan, [0, 1, 4, 7], material);
        let (missing, first) = (4, 2);
        let error = scan.fit().err();
        assert_eq!(error, Some(FitError::Incomplete { missing, first }));
    }
}

/// In version 0.1 the residual of nothing was 0, perfect.
#[test]
fn there_is_no_residual_before_a_fit() {
    for mut scan in each_scan() {
        assert!(scan.fitted().is_none());
        record(&mut scan, 0..8, material);
        assert!(scan.fitted().is_none());
        let mut fit = scan.fit().unwrap();
        let progress = fit.advance(3);
        let total = progress.total;
        assert_eq!(progress, Progress { done: 3, total });
        assert_eq!(fit.finish().err(), Some(FinishError::Unfinished(progress)));
        assert!(scan.fitted().is_none());
        let mut fit = scan.fit_under_way().unwrap();
        assert_eq!(fit.progress(), progress);
        assert_eq!(fit.advance(0), progress);
        assert!(fit.advance(u32::MAX).is_complete());
        assert_eq!(fit.advance(u32::MAX).done, total);
        // Complete, but nobody has looked at it.
        assert!(scan.fitted().is_none());
        let fitted = scan.fit_under_way().unwrap().finish().unwrap().residual();
        assert!(fitted.mean > 0.0 && fitted.worst >= fitted.mean);
        assert_eq!(scan.fitted().unwrap().residual(), fitted);
        assert_eq!(scan.fitted().unwrap().expected_loss(), Some(0.03));
        scan.restart();
        assert!(scan.fitted().is_none());
        assert_eq!(scan.pending().count(), SAMPLES);
    }
}

/// Neither a fit under way nor its result holds once a reading has changed; a reading that was
/// refused changes nothing.
#[test]
fn a_reading_in_the_middle_of_a_fit_gives_it_up() {
    let gray = |_| Reading::new([0.4; 3]);
    let other = |index| Reading::new([if index == 5 { 1.5 } else { 0.4 }; 3]);
    for mut scan in each_scan() {
        let recipe = *scan.recipe();
        record(&mut scan, 0..8, gray);
        scan.fit().unwrap().advance(7);
        assert!(scan.record(5, Reading::new([f32::NAN; 3])).is_err());
        assert!(scan.record(8, other(5)).is_err());
        assert_eq!(scan.fit_under_way().unwrap().progress().done, 7);
        assert!(scan.record(5, other(5)).unwrap().replaced);
        assert!(scan.fit_under_way().is_none());
        assert!(scan.fitted().is_none());
        let expected = whole::<Any>(recipe, other);
        assert_eq!(fit(&mut scan, &[11]), expected);

        assert!(scan.record(5, Reading::new([-2.0; 3])).is_err());
        assert!(scan.fitted().is_some());
        scan.record(5, gray(5)).unwrap();
        assert!(scan.fitted().is_none());
        let before = whole::<Any>(recipe, gray);
        assert_ne!(before, expected);
        assert_eq!(fit(&mut scan, &[3]), before);
        // A second fit begins afresh.
        scan.fit().unwrap().advance(4);
        assert!(scan.fitted().is_none());
        assert_eq!(fit(&mut scan, &[5]), before);
    }
}

fn slices_do_not_change<K: Fitter + 'static>(
    recipe: Recipe<'static>,
    brdfs: &[[f32; 3]],
    budgets: &[u32],
) {
    let reading = |index: u16| Reading::new(brdfs[usize::from(index)]);
    let mut scan = scan_by::<K>(recipe);
    record(&mut scan, 0..8, reading);
    let sliced = fit(&mut scan, budgets);
    assert_eq!(sliced, whole::<K>(recipe, reading));
    // The same where each slice is found again.
    assert_eq!(scan.fit().unwrap().progress().done, 0);
    let mut budgets = budgets.iter().cycle();
    let mut is_complete = false;
    while !is_complete {
        let mut fit = scan.fit_under_way().unwrap();
        is_complete = fit.advance(*budgets.next().unwrap()).is_complete();
    }
    let _ = scan.fit_under_way().unwrap().finish(); // which need not be plausible
    let fitted = scan.fitted().unwrap();
    assert!(fitted.values().eq(sliced.values()));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]
    #[test]
    fn slices_do_not_change_the_result(
        brdfs in prop::collection::vec(prop::array::uniform3(0.0..5.0f32), 8),
        budgets in prop::collection::vec(1..40u32, 1..6),
    ) {
        every_fitter!(slices_do_not_change, &brdfs, &budgets);
    }
}
