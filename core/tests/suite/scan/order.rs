//! Readings may come in any order and repeatedly. The model may be unknown until run time.

use glimpse_core::fit::ScanModel;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Reading;
use proptest::prelude::*;

use crate::scanning::{
    MODELS, Outcome, SAMPLES, empty_scans, fit, for_every_fitter, full_scan, new_scan,
    synthetic_reading,
};

fn check_order<K: ScanModel + 'static>(recipe: Recipe<'static>, order: &[u16], repeated: &[u16]) {
    let mut scan = new_scan::<K>(recipe);
    // Some samples have a wrong reading first.
    for index in repeated {
        let reading = Reading {
            brdf: [0.9, 0.8, 0.7],
            saturated: true,
        };
        scan.record(*index, reading).unwrap();
        assert_eq!(scan.reading(*index), Some(reading));
    }
    for index in order {
        let recorded = scan.record(*index, synthetic_reading(*index)).unwrap();
        assert_eq!(recorded.replaced, repeated.contains(index));
        assert!(!recorded.clamped);
        assert_eq!(scan.reading(*index), Some(synthetic_reading(*index)));
    }
    assert_eq!(scan.next_pending(), None);
    assert_eq!(
        fit(&mut scan, &[9]),
        full_scan::<K>(recipe, synthetic_reading)
    );
}

fn push_outcome<K: ScanModel>(
    recipe: Recipe<'static>,
    reading: impl Fn(u16) -> Reading,
    outcomes: &mut Vec<Outcome>,
) {
    outcomes.push(full_scan::<K>(recipe, reading));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn reading_order_keeps_result(
        order in Just((0..8).collect::<Vec<u16>>()).prop_shuffle(),
        repeated in prop::collection::vec(0..8u16, 0..5),
    ) {
        for_every_fitter!(check_order, &order, &repeated);
    }

    /// The order and the directions are those of the recipe.
    #[test]
    fn unread_samples_are_pending(
        order in Just((0..8).collect::<Vec<u16>>()).prop_shuffle(),
    ) {
        for mut scan in empty_scans() {
            let samples: Vec<_> = scan.pending().collect();
            prop_assert_eq!(samples.len(), SAMPLES);
            for (read, index) in order.iter().enumerate() {
                prop_assert_eq!(scan.reading(*index), None);
                scan.record(*index, synthetic_reading(*index)).unwrap();
                let unread = samples.iter().filter(|place| !order[..=read].contains(&place.0));
                prop_assert!(scan.pending().eq(unread.copied()));
                prop_assert_eq!(scan.next_pending(), scan.pending().next());
            }
        }
    }

    /// Firmware for any recipe gives the same result as firmware for one model.
    #[test]
    fn any_model_matches_each_model(brdfs in prop::collection::vec([0.0..4.0f32, 0.0..4.0, 0.0..4.0], 8)) {
        let reading = |index: u16| Reading::new(brdfs[usize::from(index)]);
        let mut outcomes = Vec::new();
        for_every_fitter!(push_outcome, reading, &mut outcomes);
        let (by_type, by_recipe) = outcomes.split_at(MODELS.len());
        prop_assert_eq!(by_type, by_recipe);
        for (model, outcome) in MODELS.iter().zip(by_recipe) {
            prop_assert_eq!(outcome.values().len(), model.parameters().unwrap_or(15));
        }
    }
}
