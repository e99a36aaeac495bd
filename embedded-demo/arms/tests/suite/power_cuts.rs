//! A power cut in each write and each erase, with different effects on the interrupted operation.

use std::ops::Range;

use crate::support::{CUT_EFFECTS, Flash, SECTOR_BYTES};
use glimpse_arms::store::StoreError;
use glimpse_arms::store::readings::Readings;
use glimpse_arms::store::recipes::{Recipes, ReplaceError};
use glimpse_core::link::BYTES_PER_FRAME;
use glimpse_core::scan::Reading;

const SAMPLES: u16 = 8;
const RECIPE: u32 = 0x1234_5678;
/// One sector each, so the journal is compacted often.
const AREAS: [Range<u32>; 2] = [
    0..SECTOR_BYTES as u32,
    SECTOR_BYTES as u32..2 * SECTOR_BYTES as u32,
];

/// Calls `act` with a power cut at each change of the flash in turn, and reads the state afterwards. `check` receives
/// the states (before, after, found). Returns the number of cuts.
fn cut_everywhere<S: PartialEq, const WORD: usize>(
    flash: &mut Flash<WORD>,
    act: impl Fn(&mut Flash<WORD>) -> bool,
    inspect: impl Fn(&mut Flash<WORD>) -> S,
    check: impl Fn(&S, &S, &S),
) -> u32 {
    let before = inspect(&mut flash.clone());
    let mut whole = flash.clone();
    whole.changes = 0;
    assert!(act(&mut whole));
    let after = inspect(&mut whole.clone());
    let mut cuts = 0;
    for effect in CUT_EFFECTS {
        for change in 1..=whole.changes {
            let mut broken = flash.clone();
            broken.cut = Some((change, effect));
            assert!(!act(&mut broken), "the power cut is not reported");
            broken.cut = None;
            check(&before, &after, &inspect(&mut broken));
            // The call succeeds afterwards.
            assert!(act(&mut broken));
            assert!(inspect(&mut broken) == after);
            cuts += 1;
        }
    }
    *flash = whole;
    cuts
}

/// A call of [`Readings`].
#[derive(Clone, Copy, Debug)]
enum Call {
    Begin,
    Save(u16, f32),
    Confirm,
    Discard,
    End,
}

impl Call {
    fn run<const WORD: usize>(self, flash: &mut Flash<WORD>) -> Result<(), StoreError> {
        let mut readings = Readings::mount(flash, AREAS)?;
        match self {
            Self::Begin => readings.begin_scan(flash, RECIPE, SAMPLES),
            Self::Save(index, value) => readings.save(flash, index, reading(index, value)),
            Self::Confirm => readings.confirm(flash),
            Self::Discard => readings.discard_unconfirmed(flash),
            Self::End => readings.end_scan(flash),
        }
    }
}

fn reading(index: u16, value: f32) -> Reading {
    Reading {
        brdf: [f32::from(index), value, 0.25],
        saturated: index % 3 == 1,
    }
}

/// Reads the complete state: if the scan is under way, and its readings.
fn inspect<const WORD: usize>(flash: &mut Flash<WORD>) -> (bool, Vec<Option<Reading>>) {
    let readings = Readings::mount(flash, AREAS).unwrap();
    let under_way = readings.is_under_way(RECIPE, SAMPLES);
    let read = (0..SAMPLES).map(|index| readings.get(flash, index).unwrap());
    (under_way, read.collect())
}

/// Returns the calls of a scan in which a motor loses steps in the second half: the unconfirmed readings are discarded
/// and taken again.
fn scan(value: f32) -> Vec<Call> {
    let save = |range: Range<u16>, value| range.map(move |index| Call::Save(index, value));
    let mut calls = vec![Call::Begin];
    calls.extend(save(0..4, value));
    calls.push(Call::Confirm);
    calls.extend(save(4..7, value));
    calls.push(Call::Discard);
    calls.extend(save(4..8, value + 0.5));
    calls.extend([Call::Confirm, Call::End]);
    calls
}

#[test]
fn readings_calls_are_atomic() {
    let mut flash: Flash = Flash::new(2);
    let mut cuts = 0;
    for call in (0..6).flat_map(|turn| scan(turn as f32)) {
        cuts += cut_everywhere(
            &mut flash,
            |flash| match call.run(flash) {
                Ok(()) => true,
                Err(StoreError::Flash) => false,
                Err(error) => panic!("{call:?}: {error}"),
            },
            inspect,
            |before, after, found| {
                assert!(
                    found == before || found == after,
                    "{call:?}: {before:?}, {after:?}, but {found:?}"
                );
            },
        );
    }
    println!("{cuts} cuts");
    assert!(cuts > 1000, "{cuts}");
}

#[test]
fn saved_readings_are_read_back() {
    let mut flash: Flash = Flash::new(2);
    let half_way = scan(1.0).into_iter().take(9);
    for call in half_way {
        call.run(&mut flash).unwrap();
    }
    let saved = |index| Some(reading(index, 1.0));
    let (under_way, found) = inspect(&mut flash);
    assert!(under_way);
    assert_eq!(found[..5], [0, 1, 2, 3, 4].map(saved));

    Call::Discard.run(&mut flash).unwrap();
    let (_, found) = inspect(&mut flash);
    assert_eq!(found[..4], [0, 1, 2, 3].map(saved));
    assert_eq!(found[4..], [None; 4]);

    // The readings are gone after the end of the scan, and in another scan.
    Call::End.run(&mut flash).unwrap();
    assert_eq!(inspect(&mut flash), (false, vec![None; 8]));
    let result = Call::Save(0, 1.0).run(&mut flash);
    assert_eq!(result, Err(StoreError::NoScan));
    Call::Begin.run(&mut flash).unwrap();
    assert_eq!(inspect(&mut flash), (true, vec![None; 8]));
}

/// The flash of a new chip may have any content.
#[test]
fn unknown_flash_content_is_ignored() {
    for filling in [0x00, 0x5A, 0xA5, 0xFF] {
        let mut flash: Flash = Flash::new(2);
        flash.bytes.fill(filling);
        assert_eq!(inspect(&mut flash), (false, vec![None; 8]));
        Call::Begin.run(&mut flash).unwrap();
        Call::Save(0, 1.0).run(&mut flash).unwrap();
        assert_eq!(inspect(&mut flash).1[0], Some(reading(0, 1.0)));
    }
}

static PHONG: &[u8] = include_bytes!("../../../../trainer/recipes/phong-n8.recipe");
static COOK_TORRANCE: &[u8] = include_bytes!("../../../../trainer/recipes/cook-torrance-n8.recipe");
const SLOTS: [Range<u32>; 2] = [
    0..4 * SECTOR_BYTES as u32,
    4 * SECTOR_BYTES as u32..8 * SECTOR_BYTES as u32,
];

fn active_recipe<const WORD: usize>(flash: &mut Flash<WORD>) -> Option<Vec<u8>> {
    let mut buffer = [0; 2048];
    let recipes = Recipes::mount(flash, SLOTS, &mut buffer).unwrap();
    let found = recipes.load(flash, &mut buffer).unwrap();
    found.map(<[u8]>::to_vec)
}

/// Stores a recipe part by part, as it arrives over the link, and installs it.
fn replace<const WORD: usize>(flash: &mut Flash<WORD>, recipe: &[u8]) -> Result<(), ReplaceError> {
    let mut buffer = [0; 2048];
    let mut recipes = Recipes::mount(flash, SLOTS, &mut buffer).map_err(ReplaceError::Store)?;
    for (part, bytes) in (0..).zip(recipe.chunks(BYTES_PER_FRAME)) {
        let offset = part * BYTES_PER_FRAME as u32;
        let stored = recipes.store(flash, offset, bytes);
        stored.map_err(ReplaceError::Store)?;
    }
    let installed = recipes.install(flash, recipe.len() as u32, &mut buffer, |_| Ok(()))?;
    assert_eq!(installed, recipe);
    Ok(())
}

/// Replaces recipes on a flash with words of `WORD` bytes, with a power cut at each change.
fn replace_with_cuts<const WORD: usize>() {
    let mut flash = Flash::<WORD>::new(8);
    assert_eq!(active_recipe(&mut flash), None);
    for turn in 0..4 {
        let recipe = [PHONG, COOK_TORRANCE][turn % 2];
        let cuts = cut_everywhere(
            &mut flash,
            |flash| match replace(flash, recipe) {
                Ok(()) => true,
                Err(ReplaceError::Store(StoreError::Flash)) => false,
                Err(error) => panic!("{error}"),
            },
            active_recipe,
            |before, after, found| assert!(found == before || found == after),
        );
        assert!(cuts as usize > PHONG.len() / WORD, "{cuts}");
        assert_eq!(active_recipe(&mut flash).as_deref(), Some(recipe));
    }
}

#[test]
fn recipe_replacement_is_atomic() {
    replace_with_cuts::<4>();
}

/// A part on the link has 60 bytes. That is not a multiple of every flash's word size.
#[test]
fn supports_flash_words_of_1_to_32_bytes() {
    fn store<const WORD: usize>() {
        // Cuts at each byte take minutes with the smallest words.
        if WORD > 2 {
            replace_with_cuts::<WORD>();
        }
        let mut flash = Flash::<WORD>::new(8);
        for recipe in [PHONG, COOK_TORRANCE, PHONG] {
            replace(&mut flash, recipe).unwrap();
            assert_eq!(active_recipe(&mut flash).as_deref(), Some(recipe), "{WORD}");
        }
        let mut flash = Flash::<WORD>::new(2);
        let calls: Vec<_> = (0..6).flat_map(|turn| scan(turn as f32)).collect();
        for call in &calls[..calls.len() - 1] {
            call.run(&mut flash).unwrap();
        }
        let (is_under_way, found) = inspect(&mut flash);
        assert!(is_under_way, "{WORD}");
        assert_eq!(found[0], Some(reading(0, 5.0)), "{WORD}");
    }
    store::<1>();
    store::<2>();
    store::<4>();
    store::<8>();
    store::<16>();
    store::<32>();
}

#[test]
fn rejects_nonconsecutive_recipe_part() {
    let mut flash: Flash = Flash::new(8);
    let mut buffer = [0; 2048];
    let mut recipes = Recipes::mount(&mut flash, SLOTS, &mut buffer).unwrap();
    recipes.store(&mut flash, 0, &PHONG[..60]).unwrap();
    let result = recipes.store(&mut flash, 120, &PHONG[120..180]);
    assert_eq!(result, Err(StoreError::OutOfOrder));
}

#[test]
fn invalid_recipe_is_not_activated() {
    let mut flash: Flash = Flash::new(8);
    replace(&mut flash, PHONG).unwrap();
    let mut altered = COOK_TORRANCE.to_vec();
    altered[40] ^= 1;
    for bad in [&COOK_TORRANCE[..100], &altered, &[]] {
        let result = replace(&mut flash, bad);
        assert!(matches!(result, Err(ReplaceError::Recipe(_))));
        assert_eq!(active_recipe(&mut flash).as_deref(), Some(PHONG));
    }
}

#[test]
fn rejects_recipe_larger_than_slot() {
    let mut flash: Flash = Flash::new(8);
    let long = [0; 4 * SECTOR_BYTES];
    let result = replace(&mut flash, &long);
    assert_eq!(result, Err(ReplaceError::Store(StoreError::Full)));
}

/// A firmware with a smaller buffer ignores a recipe that it cannot read, and reports the smaller capacity.
#[test]
fn ignores_recipe_larger_than_buffer() {
    let mut flash: Flash = Flash::new(8);
    replace(&mut flash, PHONG).unwrap();
    replace(&mut flash, COOK_TORRANCE).unwrap();
    // The first recipe fits, but the second one is longer.
    let mut buffer = vec![0; PHONG.len() + 3];
    assert!(buffer.len() < COOK_TORRANCE.len());
    let recipes = Recipes::mount(&mut flash, SLOTS, &mut buffer).unwrap();
    assert_eq!(
        recipes.capacity() as usize,
        buffer.len() / 4 * 4,
        "whole words"
    );
    let found = recipes.load(&mut flash, &mut buffer).unwrap();
    assert_eq!(found, Some(PHONG));
}
