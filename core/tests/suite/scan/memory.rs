//! The caller provides the memory of a scan, and gets it back.

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::fit::{AnyModel, Linear};
use glimpse_core::model::{ModelKind, Neural};
use glimpse_core::recipe::{Recipe, max_samples, memory_words};
use glimpse_core::scan::{Reading, Scan};

use crate::completion::contents::{self as completion, CORRECTED, CompletedContents};
use crate::recipes::{linear, parsed};
use crate::scanning::{
    MODELS, encoded_recipe, fit, full_scan, recipe_for, record, synthetic_reading,
};

#[test]
fn scan_struct_is_small() {
    let size = size_of::<Scan<'_, AnyModel>>();
    assert!(size <= 640, "a scan has {size} bytes");
}

/// A recipe of each model, without and with a completion.
fn all_recipes() -> Vec<Recipe<'static>> {
    let completed = CompletedContents::all_small(MissingPolicy::AllRequired);
    let completed = completed.iter().map(CompletedContents::recipe);
    MODELS
        .map(recipe_for)
        .into_iter()
        .chain(completed)
        .collect()
}

/// `memory_words` equals the memory that a scan needs, with each model as type and with the model at run time.
#[test]
fn memory_words_match_recipe() {
    let mut all = Vec::new();
    let completed = CompletedContents::all_small(MissingPolicy::AllRequired);
    let completed = completed.iter().map(CompletedContents::write);
    for bytes in MODELS.into_iter().map(encoded_recipe).chain(completed) {
        let recipe = parsed(bytes.clone());
        let words = memory_words(&[&bytes]);
        assert_eq!(words, recipe.memory_words());
        assert_eq!(max_samples(&[&bytes]), recipe.samples());
        all.push((words, bytes));
    }
    let max_words = all.iter().map(|(words, _)| *words).max().unwrap();
    let bytes: Vec<&[u8]> = all.iter().map(|(_, bytes)| &bytes[..]).collect();
    assert_eq!(memory_words(&bytes), max_words);
    assert_eq!(memory_words(&[]), 0);
    // Linear's solve: ten words per sample, three channels of m, n, the factors, and scratch memory.
    let bytes = encoded_recipe(ModelKind::Linear);
    assert_eq!(
        memory_words(&[&bytes]),
        10 * 8 + 3 * 5 + 8 + 15 + (2 * 5 + 3 * 5)
    );
    // In version 0.2, `linear_words(16, 24)` returned 320 words for completed recipes that need 352.
    for cut in 0..bytes.len() {
        let words = memory_words(&[&bytes[..cut]]);
        assert!(words == usize::MAX || words <= memory_words(&[&bytes]));
    }
    assert_eq!(
        memory_words(&[b"not a recipe, but long enough"]),
        usize::MAX
    );
}

/// The innovation of a correction has its own word in a descent whose gradient takes more words than the completion.
#[test]
fn descent_keeps_innovation_in_one_word() {
    for model in [ModelKind::Phong, ModelKind::CookTorrance, ModelKind::Neural] {
        let plain = CompletedContents::small(model, MissingPolicy::Scaled);
        let corrected = plain.clone().corrected(CORRECTED);
        let parameters = model.parameters().unwrap();
        let slots = 10 * completion::SAMPLES;
        let [_, m, h, g] = completion::SMALL;
        let net = 4 * (m + h) + g;
        let correction = CORRECTED * (CORRECTED + 1) / 2 + 3 * CORRECTED + 1;
        let expected = [parameters.max(net), (parameters + 1).max(net + correction)];
        let words = [plain, corrected].map(|contents| contents.recipe().memory_words());
        let with_rest = |words| slots + parameters + words + 1;
        assert_eq!(words, expected.map(with_rest));
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
        let mut scan = Scan::<AnyModel>::new(recipe, memory).unwrap();
        // Nothing is left of the previous scan.
        assert_eq!(scan.pending().count(), recipe.samples());
        assert!(scan.fitted().is_none() && scan.fit_under_way().is_none());
        record(&mut scan, 0..samples, synthetic_reading);
        let outcome = fit(&mut scan, &[17]);
        assert_eq!(outcome.values().len(), recipe.values());
        assert_eq!(outcome, full_scan::<AnyModel>(recipe, synthetic_reading));
        memory = scan.into_memory();
        assert_eq!(memory.len(), words);
        // A scan that only borrows the memory leaves nothing behind either.
        let mut unfinished = Scan::<AnyModel>::new(recipe, &mut *memory).unwrap();
        record(&mut unfinished, 1..samples, |_| Reading::monochrome(5.0));
    }
}

/// A recipe with fewer samples and components is not affected by a larger recipe before it.
#[test]
fn smaller_recipe_reuses_memory() {
    let mut small = linear();
    small.pattern.truncate(9);
    small.components = 2;
    small.basis.truncate(6);
    small.precision.truncate(2);
    for list in [&mut small.mean, &mut small.median, &mut small.weight] {
        list.truncate(3);
    }
    let small = parsed(small.write().unwrap());
    let run = |memory: &mut [f32], recipe: Recipe<'_>| {
        let mut scan = Scan::<AnyModel>::new(recipe, memory).unwrap();
        record(&mut scan, 0..recipe.samples() as u16, synthetic_reading);
        fit(&mut scan, &[2])
    };
    let mut used = [0.0; 400];
    let expected = run(&mut [0.0; 400], small);
    assert_eq!(expected.values().len(), 3 * 2);
    run(&mut used, recipe_for(ModelKind::Linear));
    assert_eq!(run(&mut used, small), expected);
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
        assert_eq!(Scan::<AnyModel>::accept(&recipe, needed), Ok(needed));
        let found = needed - 1;
        let small = Err(Error::with(
            ErrorCode::Memory,
            [needed, found].map(|words| words as u32),
        ));
        assert_eq!(Scan::<AnyModel>::accept(&recipe, found), small);
    }
}
