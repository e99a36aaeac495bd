//! A fit has all readings before it begins, and its result does not depend on how it is sliced.

use glimpse_core::fit::{Fitter, Progress};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{FinishError, FitError, Memory, Reading, Scan};
use proptest::prelude::*;

use super::scanning::{Outcome, SAMPLES, every_fitter, fit, material, whole};

/// Version 0.1 counted steps without readings, so that early calls used the fit up; and with 1 to 7
/// of 8 readings it never ended.
fn no_fit_begins_before_all_is_read<K: Fitter>(recipe: Recipe<'_>) {
    let mut memory = Memory::<K, SAMPLES>::new();
    let mut scan = Scan::new(recipe, &mut memory).unwrap();
    for read in 0..SAMPLES as u16 {
        for _ in 0..30 {
            let missing = SAMPLES as u16 - read;
            let error = FitError::Incomplete {
                missing,
                first: read,
            };
            assert_eq!(scan.fit().err(), Some(error));
            assert!(scan.fit_under_way().is_none());
            assert!(scan.fitted().is_none());
        }
        scan.record(read, material(read)).unwrap();
    }
    // All of it is left to do.
    let progress = scan.fit().unwrap().progress();
    assert_eq!(progress.done, 0);
    let total = recipe.descent().map_or(5 + 3, |_| 20 * 8);
    assert_eq!(progress.total, total);
    assert_eq!(fit(&mut scan, &[u32::MAX]), whole::<K>(recipe, material));
}

#[test]
fn a_fit_cannot_be_used_up_before_it_begins() {
    every_fitter!(no_fit_begins_before_all_is_read);
}

/// The missing ones are counted, and the first of them is named, wherever they are.
#[test]
fn an_incomplete_fit_names_the_first_missing_reading() {
    fn check<K: Fitter>(recipe: Recipe<'_>) {
        let mut memory = Memory::<K, SAMPLES>::new();
        let mut scan = Scan::new(recipe, &mut memory).unwrap();
        for index in [0, 1, 4, 7] {
            scan.record(index, material(index)).unwrap();
        }
        let (missing, first) = (4, 2);
        let error = scan.fit().err();
        assert_eq!(error, Some(FitError::Incomplete { missing, first }));
        let pending: Vec<u16> = scan.pending().map(|(index, _)| index).collect();
        assert_eq!(pending, [2, 3, 5, 6]);
    }
    every_fitter!(check);
}

/// In version 0.1 the residual of nothing was 0, perfect.
#[test]
fn there_is_no_residual_before_a_fit() {
    fn check<K: Fitter>(recipe: Recipe<'_>) {
        let mut memory = Memory::<K, SAMPLES>::new();
        let mut scan = Scan::new(recipe, &mut memory).unwrap();
        assert!(scan.fitted().is_none());
        for index in 0..8 {
            scan.record(index, material(index)).unwrap();
            assert!(scan.fitted().is_none());
        }
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
        assert!(fit.advance(u32::MAX).done == total);
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
    every_fitter!(check);
}

/// Neither a fit under way nor its result holds once a reading has changed; a reading that was
/// refused changes nothing.
#[test]
fn a_reading_in_the_middle_of_a_fit_gives_it_up() {
    fn check<K: Fitter>(recipe: Recipe<'_>) {
        let mut memory = Memory::<K, SAMPLES>::new();
        let mut scan = Scan::new(recipe, &mut memory).unwrap();
        let other = |index| Reading::new([if index == 5 { 1.5 } else { 0.4 }; 3]);
        for index in 0..8 {
            scan.record(index, Reading::new([0.4; 3])).unwrap();
        }
        scan.fit().unwrap().advance(7);
        assert!(scan.record(5, Reading::new([f32::NAN; 3])).is_err());
        assert!(scan.record(8, other(5)).is_err());
        assert_eq!(scan.fit_under_way().unwrap().progress().done, 7);
        assert!(scan.record(5, other(5)).unwrap().replaced);
        assert!(scan.fit_under_way().is_none());
        assert!(scan.fitted().is_none());
        let expected = whole::<K>(recipe, other);
        assert_eq!(fit(&mut scan, &[11]), expected);

        assert!(scan.fitted().is_some());
        assert!(scan.record(5, Reading::new([-2.0; 3])).is_err());
        assert!(scan.fitted().is_some());
        scan.record(5, Reading::new([0.4; 3])).unwrap();
        assert!(scan.fitted().is_none());
        let before = whole::<K>(recipe, |_| Reading::new([0.4; 3]));
        assert_ne!(before, expected);
        assert_eq!(fit(&mut scan, &[3]), before);
        // A second fit begins afresh.
        scan.fit().unwrap().advance(4);
        assert!(scan.fitted().is_none());
        assert_eq!(fit(&mut scan, &[5]), before);
    }
    every_fitter!(check);
}

#[test]
fn a_second_scan_in_the_same_memory_is_like_the_first() {
    fn check<K: Fitter>(recipe: Recipe<'_>) {
        let mut memory = Memory::<K, SAMPLES>::new();
        let mut scan = Scan::new(recipe, &mut memory).unwrap();
        let mut outcomes = Vec::new();
        for _ in 0..2 {
            while let Some((index, _)) = scan.next_pending() {
                scan.record(index, material(index)).unwrap();
            }
            outcomes.push(fit(&mut scan, &[5]));
            scan.restart();
        }
        assert_eq!(outcomes[0], outcomes[1]);
        assert!(matches!(&outcomes[0], Outcome::Fitted(_, residual) if residual.saturated == 1));
    }
    every_fitter!(check);
}

fn slices_do_not_change<K: Fitter>(recipe: Recipe<'_>, brdfs: &[[f32; 3]], budgets: &[u32]) {
    let reading = |index: u16| Reading::new(brdfs[usize::from(index)]);
    let mut memory = Memory::<K, SAMPLES>::new();
    let mut scan = Scan::new(recipe, &mut memory).unwrap();
    for index in 0..8 {
        scan.record(index, reading(index)).unwrap();
    }
    let sliced = fit(&mut scan, budgets);
    assert_eq!(sliced, whole::<K>(recipe, reading));
    // The same where each slice is found again.
    assert_eq!(scan.fit().unwrap().progress().done, 0);
    let mut budgets = budgets.iter().cycle();
    loop {
        let mut fit = scan.fit_under_way().unwrap();
        if fit.advance(*budgets.next().unwrap()).is_complete() {
            break;
        }
    }
    let fitted = scan.fit_under_way().unwrap().finish().unwrap();
    let values: Vec<u32> = fitted.values().map(f32::to_bits).collect();
    assert!(sliced.bits().starts_with(&values));
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
