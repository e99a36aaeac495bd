//! The caller provides the memory of a scan, and gets it back.

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::fit::Linear;
use glimpse_core::gonio::Reading;
use glimpse_core::model::{ModelKind, Neural};
use glimpse_core::recipe::{Recipe, memory_words};
use glimpse_core::scan::Scan;

use crate::recipes::combinations;
use crate::scanning::*;

#[test]
fn scan_struct_is_small() {
    let size = size_of::<Scan<'_, Any>>();
    assert!(size <= 704, "a scan has {size} bytes");
}

/// A recipe of each model, and of each combination of stages.
fn all_recipes() -> Vec<Recipe<'static>> {
    let combinations = combinations()
        .into_iter()
        .map(|(_, contents)| contents.recipe());
    MODELS
        .map(recipe_for)
        .into_iter()
        .chain(combinations)
        .collect()
}

/// `memory_words` equals the memory that a scan needs, by the formula of the document.
#[test]
fn memory_words_match_recipe() {
    let mut all = Vec::new();
    for (name, contents) in combinations() {
        let bytes = contents.write();
        let words = memory_words(&[&bytes]);
        let recipe = contents.recipe();
        assert_eq!(
            (words, words),
            (recipe.memory_words(), contents.words()),
            "{name}"
        );
        all.push((words, bytes));
    }
    let max_words = all.iter().map(|(words, _)| *words).max().unwrap();
    let bytes: Vec<&[u8]> = all.iter().map(|(_, bytes)| &bytes[..]).collect();
    assert_eq!(memory_words(&bytes), max_words);
    assert_eq!(memory_words(&[]), 0);
    let bytes = encoded_recipe(ModelKind::Linear);
    for cut in 0..bytes.len() {
        let words = memory_words(&[&bytes[..cut]]);
        assert!(words == usize::MAX || words == memory_words(&[&bytes]));
    }
    let other_version = [&b"GLMP\x03\0"[..], &bytes[6..]].concat();
    for bytes in [&b"not a recipe, but long enough"[..], &other_version] {
        assert_eq!(memory_words(&[bytes]), usize::MAX);
    }
}

/// In version 0.1, a workspace could not be reused for a second recipe at run time.
#[test]
fn memory_is_reusable() {
    let recipes = all_recipes();
    let words = recipes.iter().map(Recipe::memory_words).max().unwrap();
    let mut memory = &mut vec![0.0; words][..];
    for recipe in recipes.iter().chain(&recipes).copied() {
        let samples = recipe.samples() as u16;
        let mut scan = Scan::<Any>::new(recipe, memory).unwrap();
        // Nothing is left of the previous scan.
        assert_eq!(scan.pending().count(), recipe.samples());
        assert!(scan.fitted().is_none() && scan.fit_under_way().is_none());
        record(&mut scan, 0..samples, synthetic_reading);
        let outcome = fit(&mut scan, &[17]);
        assert_eq!(outcome.values().len(), recipe.values());
        assert_eq!(outcome, full_scan::<Any>(recipe, synthetic_reading));
        memory = scan.into_memory();
        assert_eq!(memory.len(), words);
        // A scan that only borrows the memory leaves nothing behind either.
        let mut unfinished = Scan::<Any>::new(recipe, &mut *memory).unwrap();
        record(&mut unfinished, 1..samples, |_| Reading::monochrome(5.0));
    }
}

#[test]
fn rejects_recipe_for_other_firmware() {
    for recipe in all_recipes() {
        let needed = recipe.memory_words();
        let wrong = |firmware| match firmware == recipe.model() {
            true => Ok(needed),
            false => {
                let details = [firmware as u32, recipe.model() as u32];
                Err(Error::with(ErrorCode::Model, details))
            }
        };
        let accepted = Scan::<Neural>::accept(&recipe, needed);
        assert_eq!(accepted, wrong(ModelKind::Neural));
        let accepted = Scan::<Linear>::accept(&recipe, needed);
        assert_eq!(accepted, wrong(ModelKind::Linear));
        assert_eq!(Scan::<Any>::accept(&recipe, needed), Ok(needed));
        let found = needed - 1;
        let details = [needed, found].map(|words| words as u32);
        let small = Err(Error::with(ErrorCode::Memory, details));
        assert_eq!(Scan::<Any>::accept(&recipe, found), small);
    }
}
