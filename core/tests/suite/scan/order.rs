//! Readings come in any order and may come again; the model may be known at run time only.

use glimpse_core::fit::Fitter;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Reading;
use proptest::prelude::*;

use crate::scanning::{
    MODELS, Outcome, SAMPLES, empty_scans, fit, for_every_fitter, full_scan, new_scan,
    synthetic_reading,
};

fn check_order<K: Fitter + 'static>(recipe: Recipe<'static>, order: &[u16], again: &[u16]) {
    let mut scan = new_scan::<K>(recipe);
    // Some are read wrongly at first.
    for index in again {
        let reading = Reading {
            brdf: [0.9, 0.8, 0.7],
            saturated: true,
        };
        scan.record(*index, reading).unwrap();
        assert_eq!(scan.reading(*index), Some(reading));
    }
    for index in order {
        let recorded = scan.record(*index, synthetic_reading(*index)).unwrap();
        assert_eq!(recorded.replaced, again.contains(index));
        assert!(!recorded.clamped);
        assert_eq!(scan.reading(*index), Some(synthetic_reading(*index)));
    }
    assert_eq!(scan.next_pending(), None);
    assert_eq!(
        fit(&mut scan, &[9]),
        full_scan::<K>(recipe, synthetic_reading)
    );
}

fn push_outcome<K: Fitter>(
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
        again in prop::collection::vec(0..8u16, 0..5),
    ) {
        for_every_fitter!(check_order, &order, &again);
    }

    /// In the recipe's order, at the recipe's directions.
    #[test]
    fn unread_samples_are_pending(
        order in Just((0..8).collect::<Vec<u16>>()).prop_shuffle(),
    ) {
        for mut scan in empty_scans() {
            let places: Vec<_> = scan.pending().collect();
            prop_assert_eq!(places.len(), SAMPLES);
            for (read, index) in order.iter().enumerate() {
                prop_assert_eq!(scan.reading(*index), None);
                scan.record(*index, synthetic_reading(*index)).unwrap();
                let left = places.iter().filter(|place| !order[..=read].contains(&place.0));
                prop_assert!(scan.pending().eq(left.copied()));
                prop_assert_eq!(scan.next_pending(), scan.pending().next());
            }
        }
    }

    /// Firmware that takes any recipe ends where that for one model does.
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
