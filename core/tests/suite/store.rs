//! Readings, positions and the calibration survive a power cut in each write and each erase.

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::gonio::Reading;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Recipe;
use glimpse_core::store::{Layout, Store};

use crate::documents::recovery::common::flash::{Flash, SECTOR_BYTES, effects};
use crate::scanning::{new_scan, recipe_for};

/// Small areas, which change often: a header, fourteen items that count and one more.
const LAYOUT: Layout = Layout {
    start: 0,
    area_bytes: SECTOR_BYTES as u32,
};

/// The calls of a scan in which steps are lost in the second half; see [`run`].
const SCAN: &str = "na0b123+45c6w-4567+";

/// A recipe of eight samples.
fn recipe() -> Recipe<'static> {
    recipe_for(ModelKind::Phong)
}

fn mount(flash: &mut Flash) -> Result<Store<&mut Flash>, Error> {
    Store::mount(flash, LAYOUT, &recipe())
}

/// Calls a store: n counts a boot, a and b save angles, c clears, w saves a calibration and p a proof, + and - confirm and
/// discard, and digits save the reading of this index, 3 a skip.
fn run(store: &mut Store<&mut Flash>, call: char, value: f32) -> Result<(), Error> {
    match call {
        'n' => store.count_boot().map(drop),
        'a' => store.save_angles(Some([value; 4])),
        'b' => store.save_angles(None),
        'c' => store.clear(),
        'p' => store.save_proven(7),
        'w' => store.save_white([value; 3], [value + 1.0; 3]),
        '+' => store.confirm(true),
        '-' => store.confirm(false),
        '3' => store.save(3, None, false),
        index => store.save(
            index as u16 - '0' as u16,
            Some(Reading::new([value; 3])),
            false,
        ),
    }
}

/// Returns all that a store restores, also with all samples confirmed, as text; then the number of boots.
fn content(flash: &Flash) -> (String, u32) {
    let mut flash = flash.clone();
    flash.cut = None;
    let mut store = mount(&mut flash).unwrap();
    let mut text = format!(
        "{:?} {:?} {}",
        store.angles(),
        store.white(),
        store.is_proven(7)
    );
    for _ in 0..2 {
        let mut scan = new_scan(recipe());
        let count = store.restore(&mut scan).unwrap();
        let readings = [0, 1, 2, 3, 4, 5, 6, 7].map(|index| scan.reading(index));
        text += &format!(" {count} {readings:?}");
        store.confirm(true).unwrap();
    }
    (text, store.count_boot().unwrap() - 1)
}

/// A power cut in each change, at each byte. The content afterwards is that before or after the call, and the repeated
/// call succeeds. Each call writes once (a calibration twice), unless an area is full.
#[test]
fn power_cuts_lose_only_the_item_being_written() {
    let mut flash = Flash::new(2);
    let mut cuts = [0, 0];
    let calls = "S+-SpSncb01+34+SSS".replace('S', SCAN);
    for (number, call) in calls.chars().enumerate() {
        let run = |flash: &mut Flash| {
            flash.changes.clear();
            run(&mut mount(flash)?, call, number as f32)
        };
        let mut whole = flash.clone();
        run(&mut whole).unwrap();
        let ((before, boots_before), (after, boots_after)) = (content(&flash), content(&whole));
        for (change, length) in whole.changes.iter().enumerate() {
            for effect in effects(*length) {
                let mut broken = flash.clone();
                broken.cut = Some((change, effect));
                assert_eq!(run(&mut broken), Err(Error::new(ErrorCode::Storage)));
                let (found, boots) = content(&broken);
                let is_half = call == 'w' && found.contains(" None ");
                assert!(
                    found == before || found == after || is_half,
                    "{call} {effect:?}"
                );
                assert!((boots_before..=boots_after).contains(&boots));
                broken.cut = None;
                run(&mut broken).unwrap();
                assert_eq!(content(&broken).0, after, "{call} {effect:?}");
                cuts[usize::from(*length == SECTOR_BYTES)] += 1;
            }
        }
        flash = whole;
    }
    assert!(cuts[0] > 10_000 && cuts[1] > 10_000, "{cuts:?}");
}

/// Samples count only after a homing without lost steps, and those of another recipe never.
#[test]
fn samples_count_once_confirmed() {
    let flash = &mut Flash::new(2);
    let mut store = mount(flash).unwrap();
    let index = Error::with(ErrorCode::ReadingIndex, [8, 8]);
    assert_eq!(run(&mut store, '8', 1.0), Err(index));
    let invalid = run(&mut store, '0', f32::NAN).unwrap_err();
    assert_eq!(invalid.code, ErrorCode::ReadingNonFinite);
    for are_valid in [false, true] {
        run(&mut store, '0', 1.0).unwrap();
        let mut scan = new_scan(recipe());
        assert_eq!(store.restore(&mut scan), Ok(0));
        store.confirm(are_valid).unwrap();
        store.confirm(true).unwrap();
        assert_eq!(store.restore(&mut scan), Ok(u16::from(are_valid)));
    }
    let other = recipe_for(ModelKind::Neural);
    Store::mount(&mut *flash, LAYOUT, &other).unwrap();
    let mut scan = new_scan(recipe());
    assert_eq!(mount(flash).unwrap().restore(&mut scan), Ok(0));
}
