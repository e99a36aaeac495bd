//! Readings and recipes survive a power cut in each write and each erase.

use glimpse_core::fit::AnyModel;
use glimpse_core::gonio::Reading;
use glimpse_core::link::BYTES_PER_FRAME;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Scan;
use glimpse_motion::goniometer::StepCheck;
use glimpse_motion::simulation::Random;
use glimpse_motion::simulation::{Effect, Flash, SECTOR_BYTES, effects};
use glimpse_motion::store::{Layout, Store, StoreError};

const SLOT_BYTES: usize = 6 * SECTOR_BYTES;
/// Small areas, which change often.
const LAYOUT: Layout = Layout {
    start: 0,
    area_bytes: SECTOR_BYTES as u32,
    slot_bytes: SLOT_BYTES as u32,
};
static PHONG: &[u8] = include_bytes!("../../../../trainer/recipes/paper/phong-n8.recipe");
static COOK_TORRANCE: &[u8] =
    include_bytes!("../../../../trainer/recipes/paper/cook-torrance-n8.recipe");

/// The calls of a scan in which steps are lost in the second half; see [`run`].
const SCAN: &str = "nb0123+456-4567+e";

type TestStore<'f> = Store<&'f mut Flash, 8>;

fn mount(flash: &mut Flash) -> TestStore<'_> {
    Store::mount(flash, LAYOUT).unwrap()
}

/// Calls a store: n counts a boot, b begins a scan, + and - record a homing without and with lost steps, e ends the scan,
/// p and c replace the recipe, and digits save the reading of this index.
fn run(store: &mut TestStore<'_>, call: char, value: f32) -> Result<(), StoreError> {
    match call {
        'n' => store.count_boot().map(drop),
        'b' => store.begin_scan(77, 8),
        '+' => store.record_homing(StepCheck::Passed),
        '-' => store.record_homing(StepCheck::Lost(1, 40)),
        'e' => store.end_scan(),
        'p' => replace(store, PHONG),
        'c' => replace(store, COOK_TORRANCE),
        index => store.save(index as u16 - '0' as u16, Reading::new([value; 3])),
    }
}

/// Stores a recipe part by part, as it arrives over the link, and installs it.
fn replace(store: &mut TestStore<'_>, recipe: &[u8]) -> Result<(), StoreError> {
    let parts = recipe.chunks(BYTES_PER_FRAME);
    for (offset, part) in (0..).step_by(BYTES_PER_FRAME).zip(parts) {
        store.write_recipe(offset, part)?;
    }
    store.install(&mut [0; SLOT_BYTES], |_| Ok(())).map(drop)
}

/// Returns scan, readings and recipe as text, and the number of boots.
fn content(flash: &Flash) -> (String, u32) {
    let mut flash = flash.clone();
    flash.cut = None;
    let mut store = mount(&mut flash);
    let readings = (0..8).map(|index| (store.is_saved(index), store.reading(index)));
    let scan = format!("{:?} {:?}", store.scan(), readings.collect::<Vec<_>>());
    let recipe = format!("{:?}", store.recipe(&mut [0; SLOT_BYTES]));
    (scan + &recipe, store.count_boot().unwrap() - 1)
}

/// A power cut in each change, at each byte. The content afterwards is that before or after the call, and the repeated
/// call succeeds. Each call writes once, or nothing if it has no effect, unless an area is full.
#[test]
fn power_cuts_lose_only_the_item_being_written() {
    let mut flash = Flash::new();
    let (mut cuts, mut since_erase) = ([0, 0], 5);
    let calls = "pSe+-SSnb01c+34+SSSc".replace('S', SCAN);
    for (number, call) in calls.chars().enumerate() {
        let run = |flash: &mut Flash| {
            flash.changes.clear();
            run(&mut Store::mount(flash, LAYOUT)?, call, number as f32)
        };
        let mut whole = flash.clone();
        run(&mut whole).unwrap();
        let ((before, boots_before), (after, boots_after)) = (content(&flash), content(&whole));
        let has_effect = (&before, boots_before) != (&after, boots_after) || call == 'c';
        assert_eq!(whole.changes.is_empty(), !has_effect);
        since_erase += 1;
        if !"pc".contains(call) && whole.changes.len() > 1 {
            // An area has 16 items: a header, and up to eleven that were copied.
            assert!(whole.erased_sectors() == 1 && since_erase >= 4);
            since_erase = 0;
        }
        for (change, length) in whole.changes.iter().enumerate() {
            for effect in effects(*length) {
                let mut broken = flash.clone();
                broken.cut = Some((change, effect));
                assert_eq!(run(&mut broken), Err(StoreError::Flash));
                let (found, boots) = content(&broken);
                assert!(found == before || found == after, "{call} {effect:?}");
                assert!((boots_before..=boots_after).contains(&boots));
                broken.cut = None;
                run(&mut broken).unwrap();
                assert_eq!(content(&broken).0, after, "{call} {effect:?}");
                cuts[usize::from(*length == SECTOR_BYTES)] += 1;
            }
        }
        flash = whole;
    }
    assert!(cuts[0] > 10_000 && cuts[1] > 10_000);
}

/// Readings count only after a homing without lost steps.
#[test]
fn readings_count_once_confirmed() {
    let flash = &mut Flash::new();
    let mut store = mount(flash);
    assert_eq!(run(&mut store, '0', 1.0), Err(StoreError::NoSample));
    assert_eq!(store.begin_scan(1, 9), Err(StoreError::TooLarge));
    store.begin_scan(1, 2).unwrap();
    assert_eq!(run(&mut store, '2', 1.0), Err(StoreError::NoSample));
    let invalid = run(&mut store, '0', f32::NAN);
    assert!(matches!(invalid, Err(StoreError::Invalid(_))));
    for check in [StepCheck::Unknown, StepCheck::Lost(0, 3), StepCheck::Passed] {
        run(&mut store, '0', 1.0).unwrap();
        assert_eq!((store.is_saved(0), store.reading(0)), (true, None));
        store.record_homing(check).unwrap();
        assert_eq!(store.is_saved(0), check == StepCheck::Passed);
    }
    store.record_homing(StepCheck::Unknown).unwrap();
    assert_eq!(store.reading(0), Some(Reading::new([1.0; 3])));
}

#[test]
fn recipe_transfer_can_be_retried() {
    let mut flash = Flash::new();
    run(&mut mount(&mut flash), 'p', 0.0).unwrap();
    let present = content(&flash);
    let (start, rest) = COOK_TORRANCE.split_at(60);
    let install = |store: &mut TestStore<'_>, buffer: &mut [u8]| {
        let accepts = |recipe: &Recipe<'_>| Scan::<AnyModel>::accept(recipe, 1).map(drop);
        store.install(buffer, accepts).unwrap_err()
    };
    let mut store = mount(&mut flash);
    assert_eq!(install(&mut store, &mut []), StoreError::OutOfOrder);
    let invalid = replace(&mut store, start);
    assert!(matches!(invalid, Err(StoreError::Invalid(_))));
    let too_long = replace(&mut store, &[0; SLOT_BYTES + 1]);
    assert_eq!(too_long, Err(StoreError::TooLarge));
    store.write_recipe(0, start).unwrap();
    for offset in [1, 61, 120, u32::MAX] {
        assert!(store.write_recipe(offset, rest).is_err());
    }
    // The transfer goes on after a part that was out of order.
    store.write_recipe(60, rest).unwrap();
    let declined = install(&mut store, &mut [0; SLOT_BYTES]);
    assert!(matches!(declined, StoreError::Invalid(_)));
    store.write_recipe(0, COOK_TORRANCE).unwrap();
    assert_eq!(install(&mut store, &mut [0; 64]), StoreError::TooLarge);
    assert_eq!(content(&flash), present);

    // A failed write ends the transfer. A new one erases the slot once.
    flash.changes.clear();
    flash.cut = Some((8, Effect::Low(3)));
    let mut store = mount(&mut flash);
    store.write_recipe(0, start).unwrap();
    assert_eq!(store.write_recipe(60, rest), Err(StoreError::Flash));
    assert_eq!(store.write_recipe(60, rest), Err(StoreError::OutOfOrder));
    (flash.changes, flash.cut) = (Vec::new(), None);
    run(&mut mount(&mut flash), 'c', 0.0).unwrap();
    assert!(flash.erased_sectors() == 6 && content(&flash) != present);
}

/// Random content, layouts and calls cause errors, but no panics.
#[test]
fn no_call_panics() {
    let mut random = Random(9);
    for case in 1..1000 {
        let mut flash = Flash::new();
        flash.bytes.fill_with(|| random.below(case) as u8);
        flash.cut = Some((random.below(99) as usize, Effect::Bits(case.into())));
        let mut layout = LAYOUT;
        match case % 8 {
            0 => layout.start = random.below(5000),
            1 => layout.area_bytes = random.below(6) * 512,
            2 => layout.slot_bytes = random.below(99) << 26,
            _ => {}
        }
        let Ok(mut store) = TestStore::mount(&mut flash, layout) else {
            continue;
        };
        for call in "nb0123+-e".repeat(4).chars() {
            let number = random.below(u32::MAX) >> random.below(32);
            let part = &PHONG[..number as usize % PHONG.len()];
            let _ = run(&mut store, call, random.unit());
            let _ = store.write_recipe(number, part);
            let _ = replace(&mut store, part);
            let _ = store.begin_scan(number, number as u16);
            let _ = (store.reading(number as u16), store.recipe(&mut []));
        }
    }
}
