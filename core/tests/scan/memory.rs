//! Memory is the caller's, is large where the scan is small, and comes back.

use glimpse_core::fit::{AnyModel, Fitter, Linear, linear_words};
use glimpse_core::model::{ModelKind, Neural, Phong};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Memory, Reading, Scan, ScanError};

use super::common::{linear, write_linear};
use super::scanning::{MODELS, SAMPLES, WORDS, every_fitter, fit, material, recipe_of, whole};

/// In version 0.1 it had 18.7 kB with room for 512 samples, all of which went over the stack.
#[test]
fn a_scan_is_small_by_value() {
    assert!(size_of::<Scan<'_, '_, Neural, 512>>() <= 400);
    assert!(size_of::<Scan<'_, '_, AnyModel<50_000>, 4_096>>() <= 400);
    assert_eq!(
        size_of::<Scan<'_, '_, Neural, 512>>(),
        size_of::<Scan<'_, '_, Phong, 1>>()
    );
}

/// In version 0.1 a workspace could not be had back, so that there was no second recipe at run time.
#[test]
fn memory_is_had_back_and_serves_a_recipe_of_another_model() {
    let mut memory = Memory::<AnyModel<WORDS>, SAMPLES>::new();
    let mut memory = &mut memory;
    let order = [
        ModelKind::Neural,
        ModelKind::Linear,
        ModelKind::Phong,
        ModelKind::CookTorrance,
        ModelKind::Neural,
    ];
    for model in order {
        let bytes = recipe_of(model);
        let recipe = Recipe::parse(&bytes).unwrap();
        let mut scan = Scan::new(recipe, memory).unwrap();
        assert_eq!(scan.recipe().model(), model);
        // Nothing is left of the scan before.
        assert_eq!(scan.pending().count(), SAMPLES);
        assert!(scan.fitted().is_none() && scan.fit_under_way().is_none());
        for index in 0..8 {
            scan.record(index, material(index)).unwrap();
        }
        assert_eq!(
            fit(&mut scan, &[17]),
            whole::<AnyModel<WORDS>>(recipe, material)
        );
        memory = scan.into_memory();
    }
}

/// A recipe with fewer samples and components finds nothing of the larger one before it.
#[test]
fn memory_that_was_used_for_more_serves_less() {
    let mut small = linear();
    small.pattern.truncate(9);
    small.components = 2;
    small.basis.truncate(6);
    small.precision.truncate(2);
    for list in [&mut small.mean, &mut small.median, &mut small.weight] {
        list.truncate(3);
    }
    let small = write_linear(&small).unwrap();
    let large = recipe_of(ModelKind::Linear);
    let (small, large) = (
        Recipe::parse(&small).unwrap(),
        Recipe::parse(&large).unwrap(),
    );
    let run = |memory: &mut Memory<AnyModel<WORDS>, SAMPLES>, recipe: Recipe<'_>| {
        let mut scan = Scan::new(recipe, memory).unwrap();
        for index in 0..recipe.samples() as u16 {
            scan.record(index, material(index)).unwrap();
        }
        fit(&mut scan, &[2])
    };
    let mut used = Memory::new();
    let expected = run(&mut Memory::new(), small);
    assert_eq!(expected.bits().len(), 3 * 2 + 2);
    run(&mut used, large);
    assert_eq!(run(&mut used, small), expected);
}

#[test]
fn a_recipe_for_another_firmware_is_refused() {
    fn refused<K: Fitter, const CAPACITY: usize>(model: ModelKind) -> Option<ScanError> {
        let bytes = recipe_of(model);
        let mut memory = Memory::<K, CAPACITY>::new();
        let scan = Scan::new(Recipe::parse(&bytes).unwrap(), &mut memory);
        scan.err()
    }
    let wrong = |firmware, recipe| Some(ScanError::Model { firmware, recipe });
    for model in MODELS {
        let of_neural = refused::<Neural, 8>(model);
        let expected = wrong(ModelKind::Neural, model).filter(|_| model != ModelKind::Neural);
        assert_eq!(of_neural, expected);
        let of_linear = refused::<Linear<WORDS>, 8>(model);
        let expected = wrong(ModelKind::Linear, model).filter(|_| model != ModelKind::Linear);
        assert_eq!(of_linear, expected);
        assert_eq!(refused::<AnyModel<WORDS>, 8>(model), None);
        let capacity = 7;
        let samples = 8;
        let small = Some(ScanError::Capacity { capacity, samples });
        assert_eq!(refused::<AnyModel<WORDS>, 7>(model), small);
        assert_eq!(refused::<Neural, 7>(model), small);
    }
    // Linear's words: three channels of m, n, the factors, and what a solve works in.
    let needed = 3 * 5 + 8 + 15 + (2 * 5 + 3 * 5);
    assert_eq!(linear_words(8, 5), needed);
    let small = Some(ScanError::Words {
        needed,
        found: WORDS - 1,
    });
    assert_eq!(
        refused::<Linear<{ WORDS - 1 }>, 8>(ModelKind::Linear),
        small
    );
    assert_eq!(
        refused::<AnyModel<{ WORDS - 1 }>, 8>(ModelKind::Linear),
        small
    );
    let (found, none) = (0, refused::<AnyModel<0>, 8>(ModelKind::Linear));
    assert_eq!(none, Some(ScanError::Words { needed, found }));
    assert_eq!(refused::<AnyModel<0>, 8>(ModelKind::Neural), None);
}

/// The firmware's scan that only borrowed its memory gives it back by itself.
#[test]
fn memory_outlives_its_scan() {
    fn check<K: Fitter>(recipe: Recipe<'_>) {
        let mut memory = Memory::<K, SAMPLES>::new();
        let expected = whole::<K>(recipe, material);
        for _ in 0..3 {
            let mut scan = Scan::new(recipe, &mut memory).unwrap();
            for index in 0..7 {
                scan.record(index, Reading::monochrome(5.0)).unwrap();
            }
            let mut scan = Scan::new(recipe, &mut memory).unwrap();
            assert_eq!(scan.pending().count(), 8);
            for index in 0..8 {
                scan.record(index, material(index)).unwrap();
            }
            assert_eq!(fit(&mut scan, &[100]), expected);
        }
    }
    every_fitter!(check);
}
