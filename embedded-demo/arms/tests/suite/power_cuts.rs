//! The power goes in each write and each erase in turn, and leaves of it what it likes.

use std::ops::Range;

use crate::support::{Flash, LEAVES, SECTOR};
use glimpse_arms::store::StoreError;
use glimpse_arms::store::readings::Readings;
use glimpse_arms::store::recipes::{Recipes, ReplaceError};
use glimpse_core::link::BYTES_PER_FRAME;
use glimpse_core::scan::Reading;

const SAMPLES: u16 = 8;
const RECIPE: u32 = 0x1234_5678;
/// One sector each: they turn over often.
const AREAS: [Range<u32>; 2] = [0..SECTOR as u32, SECTOR as u32..2 * SECTOR as u32];

/// Does something to a flash with the power cut at each change in turn, and looks at what is found
/// afterwards: how often the power went. What is found is handed over as (before, after, found).
fn cut_everywhere<S: PartialEq, const WORD: usize>(
    flash: &mut Flash<WORD>,
    act: impl Fn(&mut Flash<WORD>) -> bool,
    look: impl Fn(&mut Flash<WORD>) -> S,
    judge: impl Fn(&S, &S, &S),
) -> u32 {
    let before = look(&mut flash.clone());
    let mut whole = flash.clone();
    whole.changes = 0;
    assert!(act(&mut whole));
    let after = look(&mut whole.clone());
    let mut cuts = 0;
    for leaves in LEAVES {
        for change in 1..=whole.changes {
            let mut broken = flash.clone();
            broken.cut = Some((change, leaves));
            assert!(!act(&mut broken), "it does not tell that the power went");
            broken.cut = None;
            judge(&before, &after, &look(&mut broken));
            // And it can be done after all.
            assert!(act(&mut broken));
            assert!(look(&mut broken) == after);
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
    Keep(u16, f32),
    Confirm,
    Discard,
    End,
}

impl Call {
    fn carry_out<const WORD: usize>(self, flash: &mut Flash<WORD>) -> Result<(), StoreError> {
        let mut readings = Readings::mount(flash, AREAS)?;
        match self {
            Self::Begin => readings.begin(flash, RECIPE, SAMPLES),
            Self::Keep(index, value) => readings.keep(flash, index, reading(index, value)),
            Self::Confirm => readings.confirm(flash),
            Self::Discard => readings.discard(flash),
            Self::End => readings.end(flash),
        }
    }
}

fn reading(index: u16, value: f32) -> Reading {
    Reading {
        brdf: [f32::from(index), value, 0.25],
        saturated: index % 3 == 1,
    }
}

/// All that is seen from outside.
fn look<const WORD: usize>(flash: &mut Flash<WORD>) -> (bool, Vec<Option<Reading>>) {
    let readings = Readings::mount(flash, AREAS).unwrap();
    let under_way = readings.is_under_way(RECIPE, SAMPLES);
    let read = (0..SAMPLES).map(|index| readings.get(flash, index).unwrap());
    (under_way, read.collect())
}

/// A scan that loses steps in its second half.
fn scan(value: f32) -> Vec<Call> {
    let keep = |range: Range<u16>, value| range.map(move |index| Call::Keep(index, value));
    let mut calls = vec![Call::Begin];
    calls.extend(keep(0..4, value));
    calls.push(Call::Confirm);
    calls.extend(keep(4..7, value));
    calls.push(Call::Discard);
    calls.extend(keep(4..8, value + 0.5));
    calls.extend([Call::Confirm, Call::End]);
    calls
}

#[test]
fn each_call_on_the_readings_has_happened_or_not() {
    let mut flash: Flash = Flash::new(2);
    let mut cuts = 0;
    for call in (0..6).flat_map(|turn| scan(turn as f32)) {
        cuts += cut_everywhere(
            &mut flash,
            |flash| match call.carry_out(flash) {
                Ok(()) => true,
                Err(StoreError::Flash) => false,
                Err(error) => panic!("{call:?}: {error}"),
            },
            look,
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
fn what_is_read_is_what_was_kept() {
    let mut flash: Flash = Flash::new(2);
    let half_way = scan(1.0).into_iter().take(9);
    for call in half_way {
        call.carry_out(&mut flash).unwrap();
    }
    let kept = |index| Some(reading(index, 1.0));
    let (under_way, found) = look(&mut flash);
    assert!(under_way);
    assert_eq!(found[..5], [0, 1, 2, 3, 4].map(kept));

    Call::Discard.carry_out(&mut flash).unwrap();
    let (_, found) = look(&mut flash);
    assert_eq!(found[..4], [0, 1, 2, 3].map(kept));
    assert_eq!(found[4..], [None; 4]);

    // Another scan knows nothing of them, nor does the time between two.
    Call::End.carry_out(&mut flash).unwrap();
    assert_eq!(look(&mut flash), (false, vec![None; 8]));
    let refused = Call::Keep(0, 1.0).carry_out(&mut flash);
    assert_eq!(refused, Err(StoreError::NoScan));
    Call::Begin.carry_out(&mut flash).unwrap();
    assert_eq!(look(&mut flash), (true, vec![None; 8]));
}

/// A chip comes with whatever somebody else put there.
#[test]
fn bytes_of_another_program_are_not_readings() {
    for filling in [0x00, 0x5A, 0xA5, 0xFF] {
        let mut flash: Flash = Flash::new(2);
        flash.bytes.fill(filling);
        assert_eq!(look(&mut flash), (false, vec![None; 8]));
        Call::Begin.carry_out(&mut flash).unwrap();
        Call::Keep(0, 1.0).carry_out(&mut flash).unwrap();
        assert_eq!(look(&mut flash).1[0], Some(reading(0, 1.0)));
    }
}

static PHONG: &[u8] = include_bytes!("../../../../trainer/recipes/phong-n8.recipe");
static COOK_TORRANCE: &[u8] = include_bytes!("../../../../trainer/recipes/cook-torrance-n8.recipe");
const SLOTS: [Range<u32>; 2] = [0..4 * SECTOR as u32, 4 * SECTOR as u32..8 * SECTOR as u32];

fn in_force<const WORD: usize>(flash: &mut Flash<WORD>) -> Option<Vec<u8>> {
    let mut buffer = [0; 2048];
    let recipes = Recipes::mount(flash, SLOTS, &mut buffer).unwrap();
    let found = recipes.load(flash, &mut buffer).unwrap();
    found.map(<[u8]>::to_vec)
}

/// As the link brings it.
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

/// Replaces recipes on a flash with words of `WORD` bytes, and cuts the power in each change.
fn replace_with_cuts<const WORD: usize>() {
    let mut flash = Flash::<WORD>::new(8);
    assert_eq!(in_force(&mut flash), None);
    for turn in 0..4 {
        let recipe = [PHONG, COOK_TORRANCE][turn % 2];
        let cuts = cut_everywhere(
            &mut flash,
            |flash| match replace(flash, recipe) {
                Ok(()) => true,
                Err(ReplaceError::Store(StoreError::Flash)) => false,
                Err(error) => panic!("{error}"),
            },
            in_force,
            |before, after, found| assert!(found == before || found == after),
        );
        assert!(cuts as usize > PHONG.len() / WORD, "{cuts}");
        assert_eq!(in_force(&mut flash).as_deref(), Some(recipe));
    }
}

#[test]
fn a_recipe_that_is_replaced_halfway_leaves_the_old_one() {
    replace_with_cuts::<4>();
}

/// A part of the link has 60 bytes, which are not whole words of every flash.
#[test]
fn recipes_and_readings_are_stored_with_words_of_1_to_32_bytes() {
    fn store<const WORD: usize>() {
        // A cut after each byte takes minutes with the smallest words.
        if WORD > 2 {
            replace_with_cuts::<WORD>();
        }
        let mut flash = Flash::<WORD>::new(8);
        for recipe in [PHONG, COOK_TORRANCE, PHONG] {
            replace(&mut flash, recipe).unwrap();
            assert_eq!(in_force(&mut flash).as_deref(), Some(recipe), "{WORD}");
        }
        let mut flash = Flash::<WORD>::new(2);
        let calls: Vec<_> = (0..6).flat_map(|turn| scan(turn as f32)).collect();
        for call in &calls[..calls.len() - 1] {
            call.carry_out(&mut flash).unwrap();
        }
        let (is_under_way, found) = look(&mut flash);
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
fn a_part_of_a_recipe_that_does_not_follow_the_last_one_is_refused() {
    let mut flash: Flash = Flash::new(8);
    let mut buffer = [0; 2048];
    let mut recipes = Recipes::mount(&mut flash, SLOTS, &mut buffer).unwrap();
    recipes.store(&mut flash, 0, &PHONG[..60]).unwrap();
    let refused = recipes.store(&mut flash, 120, &PHONG[120..180]);
    assert_eq!(refused, Err(StoreError::OutOfOrder));
}

#[test]
fn what_is_no_recipe_is_not_put_in_force() {
    let mut flash: Flash = Flash::new(8);
    replace(&mut flash, PHONG).unwrap();
    let mut altered = COOK_TORRANCE.to_vec();
    altered[40] ^= 1;
    for bad in [&COOK_TORRANCE[..100], &altered, &[]] {
        let refused = replace(&mut flash, bad);
        assert!(matches!(refused, Err(ReplaceError::Recipe(_))));
        assert_eq!(in_force(&mut flash).as_deref(), Some(PHONG));
    }
}

#[test]
fn a_recipe_has_to_fit_into_its_slot() {
    let mut flash: Flash = Flash::new(8);
    let long = [0; 4 * SECTOR];
    let refused = replace(&mut flash, &long);
    assert_eq!(refused, Err(ReplaceError::Store(StoreError::Full)));
}

/// A firmware with a smaller buffer was flashed since: what it cannot read is as none, and it offers no
/// more room than it has.
#[test]
fn a_recipe_that_the_buffer_has_no_room_for_is_none() {
    let mut flash: Flash = Flash::new(8);
    replace(&mut flash, PHONG).unwrap();
    replace(&mut flash, COOK_TORRANCE).unwrap();
    // Room for the first recipe, but not for the second, which is longer.
    let mut buffer = vec![0; PHONG.len() + 3];
    assert!(buffer.len() < COOK_TORRANCE.len());
    let recipes = Recipes::mount(&mut flash, SLOTS, &mut buffer).unwrap();
    assert_eq!(recipes.room() as usize, buffer.len() / 4 * 4, "whole words");
    let found = recipes.load(&mut flash, &mut buffer).unwrap();
    assert_eq!(found, Some(PHONG));
}
