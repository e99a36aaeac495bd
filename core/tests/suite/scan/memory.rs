//! The caller provides the memory of a scan, and gets it back.

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::fit::Linear;
use glimpse_core::model::{ModelKind, Neural};
use glimpse_core::recipe::memory_words;
use glimpse_core::scan::Scan;

use crate::recipes::combinations;
use crate::scanning::*;

#[test]
fn scan_struct_is_small() {
    let size = size_of::<Scan<'_, Any>>();
    assert!(size <= 704, "a scan has {size} bytes");
}

/// `memory_words` equals the memory that a scan needs, by the formula of the document.
#[test]
fn memory_words_match_recipe() {
    let mut all = Vec::new();
    for (name, contents) in combinations() {
        let bytes = contents.write();
        let words = memory_words(&[&bytes]);
        // `recipe_reports_contents` compares the same formula with `Recipe::memory_words`.
        assert_eq!(words, contents.words(), "{name}");
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

#[test]
fn rejects_recipe_for_other_firmware() {
    for (_, contents) in combinations() {
        let recipe = contents.recipe();
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
