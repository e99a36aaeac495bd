//! Samples that cannot be read, with recipes that tolerate missing readings and with others.

use std::cell::Cell;

use crate::bench::{BAD, Board, GRAY, MASKED, PHONG, SECOND, counting, scan_once, world};
use glimpse_arms::scanner::{End, News, ScannerError};
use glimpse_arms::sensor::SensorError;
use glimpse_arms::station::StationError;
use glimpse_core::link::Failure;

/// Scans once by a recipe; `lit(n)` is the count of the nth reading. Returns the number of readings too.
fn scan(recipe: &[u8], lit: impl Fn(u32) -> Option<u16>) -> (Vec<News>, End, u32) {
    scan_watched(recipe, lit, |_, _| {})
}

/// As [`scan`]; `watch` receives the world and all news.
fn scan_watched(
    recipe: &[u8],
    lit: impl Fn(u32) -> Option<u16>,
    watch: impl Fn(&glimpse_arms::simulated::World, &News),
) -> (Vec<News>, End, u32) {
    let (world, is_lit) = (world(), Cell::new(false));
    let mut taken = 0;
    let mut count = || {
        taken += 1;
        lit(taken)
    };
    let station = counting(&world, &is_lit, &mut count);
    let mut board = Board::new(1200 * SECOND, |news| {
        watch(&world, news);
        false
    });
    let end = scan_once(station, recipe, &mut board);
    let news = board.news;
    (news, end, taken)
}

fn skipped(news: &[News]) -> Vec<u16> {
    let skipped = |news: &News| match news {
        News::Skipped { index } => Some(*index),
        _ => None,
    };
    news.iter().filter_map(skipped).collect()
}

/// The indices of readings that were taken, in order.
fn read(news: &[News]) -> Vec<u16> {
    let read = |news: &News| match news {
        News::Read { index, .. } => Some(*index),
        _ => None,
    };
    let mut indices: Vec<u16> = news.iter().filter_map(read).collect();
    indices.sort_unstable();
    indices
}

/// The converter fails, or its counts are no reading, three times at the third sample. The arms go home first, which
/// shows that no lost step is the reason.
#[test]
fn a_sample_that_cannot_be_read_is_skipped() {
    for fault in [None, Some(BAD)] {
        let (news, end, taken) = scan(MASKED, |taken| match taken {
            3..=5 => fault,
            _ => Some(GRAY),
        });
        assert_eq!(end, End::Finished, "{news:?}");
        let [skipped] = skipped(&news)[..] else {
            panic!("{news:?}");
        };
        let others: Vec<u16> = (0..16).filter(|index| *index != skipped).collect();
        assert_eq!(read(&news), others);
        assert_eq!(taken, 15 + 3);
        let before = news
            .iter()
            .position(|news| *news == News::Skipped { index: skipped });
        let home = news[before.unwrap() - 1];
        assert_eq!(home, News::Home { confirmed: 2 });
    }
}

#[test]
fn a_sample_that_is_read_in_the_third_attempt_is_not_skipped() {
    let (news, end, taken) = scan(MASKED, |taken| match taken {
        3 => None,
        4 => Some(BAD),
        _ => Some(GRAY),
    });
    assert_eq!(end, End::Finished, "{news:?}");
    assert_eq!(skipped(&news), []);
    assert_eq!((read(&news).len(), taken), (16, 16 + 2));
}

/// An arm that has lost steps may be why: the sample is read again, with all readings since the arms were home.
#[test]
fn a_sample_is_not_skipped_if_steps_were_lost() {
    let (news, end, _) = scan_watched(
        MASKED,
        |taken| (!(3..=5).contains(&taken)).then_some(GRAY),
        |world, news| {
            if matches!(news, News::Unread { .. }) {
                world.stall(3, 40);
            }
        },
    );
    assert_eq!(end, End::Finished, "{news:?}");
    let lost = news
        .iter()
        .filter(|news| matches!(news, News::LostSteps(_)));
    assert_eq!(lost.count(), 1);
    assert_eq!(skipped(&news), []);
    assert_eq!(read(&news).len(), 2 + 16);
}

/// A recipe that needs every reading.
#[test]
fn without_tolerance_a_sample_that_cannot_be_read_ends_the_scan() {
    let (news, end, taken) = scan(PHONG, |taken| (taken < 3).then_some(GRAY));
    let error = StationError::Sensor(SensorError::Converter);
    assert_eq!(end, End::Failed(ScannerError::Station(error)), "{news:?}");
    assert_eq!(taken, 2 + 3);

    let (_, end, taken) = scan(PHONG, |taken| Some(if taken < 3 { GRAY } else { BAD }));
    let End::Failed(ScannerError::Scan(Failure::Reading { .. })) = end else {
        panic!("{end:?}");
    };
    assert_eq!(taken, 2 + 3);
}

/// The scan ends by the sensor's error, not by the readings that are missing.
#[test]
fn a_sensor_that_reads_nothing_ends_the_scan_by_its_error() {
    let (news, end, taken) = scan(MASKED, |_| None);
    let error = StationError::Sensor(SensorError::Converter);
    assert_eq!(end, End::Failed(ScannerError::Station(error)));
    assert_eq!((skipped(&news).len(), taken), (16, 3 * 16));
}
