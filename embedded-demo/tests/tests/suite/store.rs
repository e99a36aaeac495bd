//! Readings survive a power cut in each write and each erase.

use glimpse_core::gonio::Reading;
use glimpse_desk::Random;
use glimpse_desk::{Effect, Flash, SECTOR_BYTES, effects};
use glimpse_scanner::goniometer::StepCheck;
use glimpse_scanner::store::{Layout, Store, StoreError};

/// Small areas, which change often.
const LAYOUT: Layout = Layout {
    start: 0,
    area_bytes: SECTOR_BYTES as u32,
};

/// The calls of a scan in which steps are lost in the second half; see [`run`].
const SCAN: &str = "nb0123+456-4567+";

type TestStore<'f> = Store<&'f mut Flash, 8>;

fn mount(flash: &mut Flash) -> TestStore<'_> {
    Store::mount(flash, LAYOUT).unwrap()
}

/// Calls a store: n counts a boot, b begins a scan, + and - record a homing without and with lost steps, and digits save
/// the reading of this index.
fn run(store: &mut TestStore<'_>, call: char, value: f32) -> Result<(), StoreError> {
    match call {
        'n' => store.count_boot().map(drop),
        'b' => store.begin_scan(77, 8),
        '+' => store.record_homing(StepCheck::Passed),
        '-' => store.record_homing(StepCheck::Lost(1, 40)),
        index => store.save(index as u16 - '0' as u16, Reading::new([value; 3])),
    }
}

/// Returns the scan, the confirmed readings and all readings as text, and the number of boots.
fn content(flash: &Flash) -> (String, u32) {
    let mut flash = flash.clone();
    flash.cut = None;
    let mut store = mount(&mut flash);
    let readings =
        |store: &TestStore<'_>| [0, 1, 2, 3, 4, 5, 6, 7].map(|index| store.reading(index));
    let confirmed = readings(&store);
    store.record_homing(StepCheck::Passed).unwrap();
    let scan = format!("{:?} {confirmed:?} {:?}", store.scan(), readings(&store));
    (scan, store.count_boot().unwrap() - 1)
}

/// A power cut in each change, at each byte. The content afterwards is that before or after the call, and the repeated
/// call succeeds. Each call writes once, or nothing if it has no effect, unless an area is full.
#[test]
fn power_cuts_lose_only_the_item_being_written() {
    let mut flash = Flash::new();
    let (mut cuts, mut since_erase) = ([0, 0], 5);
    let calls = "S+-SSnb01+34+SSS".replace('S', SCAN);
    for (number, call) in calls.chars().enumerate() {
        let run = |flash: &mut Flash| {
            flash.changes.clear();
            run(&mut Store::mount(flash, LAYOUT)?, call, number as f32)
        };
        let mut whole = flash.clone();
        run(&mut whole).unwrap();
        let ((before, boots_before), (after, boots_after)) = (content(&flash), content(&whole));
        let has_effect = (&before, boots_before) != (&after, boots_after);
        assert_eq!(whole.changes.is_empty(), !has_effect);
        since_erase += 1;
        if whole.changes.len() > 1 {
            // An area has 16 items: a header, and up to ten that were copied.
            assert!(whole.erased_sectors() == 1 && since_erase >= 5);
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
        assert_eq!(store.reading(0), None);
        store.record_homing(check).unwrap();
        store.record_homing(StepCheck::Passed).unwrap();
        assert_eq!(store.reading(0).is_some(), check == StepCheck::Passed);
    }
    store.record_homing(StepCheck::Unknown).unwrap();
    assert_eq!(store.reading(0), Some(Reading::new([1.0; 3])));
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
            _ => {}
        }
        let Ok(mut store) = TestStore::mount(&mut flash, layout) else {
            continue;
        };
        for call in "nb0123+-".repeat(4).chars() {
            let number = random.below(u32::MAX) >> random.below(32);
            let _ = run(&mut store, call, random.unit());
            let _ = store.begin_scan(number, number as u16);
            let _ = store.reading(number as u16);
        }
    }
}
