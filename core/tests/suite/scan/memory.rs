//! Memory is the caller's, is large where the scan is small, and comes back.

use glimpse_core::fit::{AnyModel, Fitter, Linear, linear_words};
use glimpse_core::model::{ModelKind, Neural, Phong};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Memory, Reading, Scan, ScanError};

use crate::recipes::{linear, parsed};
use crate::scanning::{Any, MODELS, SAMPLES, WORDS, fit, material, recipe_of, record, whole};

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

/// In version 0.1 there was no second recipe at run time: a workspace could not be had back.
#[test]
fn memory_serves_one_recipe_after_the_other() {
    let mut memory = Memory::<Any, SAMPLES>::new();
    let mut memory = &mut memory;
    for model in MODELS.into_iter().chain(MODELS) {
        let recipe = recipe_of(model);
        let mut scan = Scan::new(recipe, memory).unwrap();
        assert_eq!(scan.recipe().model(), model);
        // Nothing is left of the scan before.
        assert_eq!(scan.pending().count(), SAMPLES);
        assert!(scan.fitted().is_none() && scan.fit_under_way().is_none());
        record(&mut scan, 0..8, material);
        assert_eq!(fit(&mut scan, &[17]), whole::<Any>(recipe, material));
        memory = scan.into_memory();
        // A scan that only borrows the memory leaves nothing either.
        let mut unfinished = Scan::new(recipe, &mut *memory).unwrap();
        record(&mut unfinished, 0..7, |_| Reading::monochrome(5.0));
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
    let small = parsed(small.write().unwrap());
    let run = |memory: &mut Memory<Any, SAMPLES>, recipe: Recipe<'_>| {
        let mut scan = Scan::new(recipe, memory).unwrap();
        record(&mut scan, 0..recipe.samples() as u16, material);
        fit(&mut scan, &[2])
    };
    let mut used = Memory::new();
    let expected = run(&mut Memory::new(), small);
    assert_eq!(expected.values().len(), 3 * 2);
    run(&mut used, recipe_of(ModelKind::Linear));
    assert_eq!(run(&mut used, small), expected);
}

#[test]
fn a_recipe_for_another_firmware_is_refused() {
    fn refused<K: Fitter, const CAPACITY: usize>(model: ModelKind) -> Option<ScanError> {
        let mut memory = Memory::<K, CAPACITY>::new();
        Scan::new(recipe_of(model), &mut memory).err()
    }
    let wrong =
        |firmware, recipe| (firmware != recipe).then_some(ScanError::Model { firmware, recipe });
    for model in MODELS {
        let (neural, linear) = (ModelKind::Neural, ModelKind::Linear);
        assert_eq!(refused::<Neural, 8>(model), wrong(neural, model));
        assert_eq!(refused::<Linear<WORDS>, 8>(model), wrong(linear, model));
        assert_eq!(refused::<Any, 8>(model), None);
        let (capacity, samples) = (7, 8);
        let small = Some(ScanError::Capacity { capacity, samples });
        assert_eq!(refused::<Any, 7>(model), small);
        assert_eq!(refused::<Neural, 7>(model), small);
    }
    // Linear's words: three channels of m, n, the factors, and the scratch of a solve.
    let needed = 3 * 5 + 8 + 15 + (2 * 5 + 3 * 5);
    assert_eq!(linear_words(8, 5), needed);
    let small = |found| Some(ScanError::Words { needed, found });
    const TOO_FEW: usize = WORDS - 1;
    assert_eq!(
        refused::<Linear<TOO_FEW>, 8>(ModelKind::Linear),
        small(TOO_FEW)
    );
    assert_eq!(
        refused::<AnyModel<TOO_FEW>, 8>(ModelKind::Linear),
        small(TOO_FEW)
    );
    assert_eq!(refused::<AnyModel<0>, 8>(ModelKind::Linear), small(0));
    assert_eq!(refused::<AnyModel<0>, 8>(ModelKind::Neural), None);
}
