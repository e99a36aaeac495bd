//! The main loop of the firmware over several scans.

use std::cell::Cell;

use crate::board::{
    COOK_TORRANCE, DARK, GRAY, Host, NEGATIVE, PHONG, POSITIONS, SECOND, TestBoard, WHITE, answer,
    checksum_of, is_finished, scripted_station, serve, simulated,
};
use crate::support::{BUFFER_BYTES, Flash, mount_recipes};
use glimpse_arms::scanner::{Command, Event, Outcome, ScannerError};
use glimpse_arms::{MEMORY_WORDS, Model};
use glimpse_core::fit::Fitter;
use glimpse_core::link::{BYTES_PER_FRAME, Failure, Request};
use glimpse_core::model::Phong;
use glimpse_core::recipe::memory_words;
use glimpse_core::scan::ReadingError;

/// The host is disconnected during a recipe transfer, before any command.
#[test]
fn lost_host_moves_no_arm() {
    let simulated = simulated();
    let mut parts = 0;
    let mut board = TestBoard::new(10 * SECOND, |_| false);
    board.host = Some(Host::new(|request| {
        parts += u32::from(matches!(request, Request::RecipePart { .. }));
        let offered = (COOK_TORRANCE, checksum_of(COOK_TORRANCE));
        (parts <= 2).then(|| answer(request, Some(offered)))
    }));
    board.serve(&simulated, &mut Flash::new(6));
    assert_eq!(simulated.positions(), POSITIONS, "{:?}", board.events);
    assert_eq!(board.outcomes().len(), 1, "it reports the lost host");
}

/// The host is disconnected during a started scan.
#[test]
fn started_scan_continues_without_lost_host() {
    let mut board = TestBoard::new(600 * SECOND, is_finished);
    board.host = Some(Host::new(|request| match request {
        Request::Progress(_) => None,
        request => Some(answer(request, None)),
    }));
    board.commands.push_back((SECOND, Command::NewScan));
    board.serve(&simulated(), &mut Flash::new(6));
    assert_eq!(board.outcomes().last(), Some(&Outcome::Finished));
    assert_eq!(board.reads(), 8, "nothing is read twice");
}

/// A byte of noise before the command does not count as a host.
#[test]
fn noise_on_line_does_not_block_button() {
    let mut board = TestBoard::new(600 * SECOND, is_finished);
    board.noise.push_back((SECOND, 0x55));
    board.commands.push_back((10 * SECOND, Command::NewScan));
    board.serve(&simulated(), &mut Flash::new(6));
    assert_eq!(board.outcomes(), [Outcome::NoHost, Outcome::Finished]);
}

/// Runs a number of scans with a command each. The sensor counts `lit(n)` at its nth reading. Also returns the number
/// of readings.
fn scan_with_counts(scans: u64, lit: impl Fn(u32) -> u16) -> (TestBoard<'static>, u32) {
    let mut ends = 0;
    let mut board = TestBoard::new(600 * SECOND, move |event| {
        ends += u64::from(matches!(
            event,
            Event::Ended(Outcome::Failed(_) | Outcome::Finished)
        ));
        ends == scans
    });
    board.commands = (0..scans)
        .map(|scan| (300 * scan * SECOND, Command::NewScan))
        .collect();
    let (simulated, is_lit) = (simulated(), Cell::new(false));
    let mut reads = 0;
    let mut count = || {
        reads += 1;
        Some(lit(reads))
    };
    let station = scripted_station(&simulated, &is_lit, &mut count);
    let mut memory = [0.0; MEMORY_WORDS];
    serve::<_, _, Model>(station, &mut Flash::new(6), &mut memory, &mut board);
    (board, reads)
}

/// An invalid reading is repeated. Attempts count per sample, although the driver receives good readings only once the
/// arms are home.
#[test]
fn invalid_reading_is_repeated() {
    for bad in [&[3][..], &[2, 3, 5]] {
        let (board, reads) =
            scan_with_counts(
                1,
                |reads| if bad.contains(&reads) { NEGATIVE } else { GRAY },
            );
        assert_eq!(board.outcomes(), [Outcome::NoHost, Outcome::Finished]);
        assert_eq!((board.reads(), reads as usize), (8, 8 + bad.len()));
    }
}

/// After three attempts at the same sample the scan fails with the error of the reading.
#[test]
fn three_invalid_readings_end_scan() {
    let (board, reads) = scan_with_counts(1, |reads| if reads < 3 { GRAY } else { NEGATIVE });
    let Some(Outcome::Failed(ScannerError::Scan(Failure::Reading { error, .. }))) =
        board.outcomes().pop()
    else {
        panic!("{:?}", board.events);
    };
    assert_eq!(error, ReadingError::Negative(0));
    assert_eq!(reads, 2 + 3);
}

/// Counts instead of BRDF values: the fit rejects them, and they are not fitted again.
#[test]
fn readings_of_failed_fit_are_deleted() {
    let large = DARK + 110 * WHITE;
    let (board, _) = scan_with_counts(2, |reads| if reads <= 8 { large } else { GRAY });
    let [
        Outcome::NoHost,
        Outcome::Failed(ScannerError::Scan(Failure::Fit(_))),
        Outcome::NoHost,
        Outcome::Finished,
    ] = board.outcomes()[..]
    else {
        panic!("{:?}", board.events);
    };
    assert_eq!(board.reads(), 16);
}

/// Runs a firmware for twenty seconds with a host that offers a recipe. Returns the requests to the host.
fn offer<K: Fitter>(
    recipe: &[u8],
    checksum: u32,
    memory: &mut [f32],
    flash: &mut Flash,
) -> Vec<Request> {
    let mut board = TestBoard::new(20 * SECOND, |_| false);
    board.host = Some(Host::new(|request| {
        Some(answer(request, Some((recipe, checksum))))
    }));
    serve::<_, _, K>(simulated().station(), flash, memory, &mut board);
    let host = board.host.unwrap();
    let greetings = host.count(|request| matches!(request, Request::Hello { .. }));
    assert!(greetings > 3, "it repeats its greeting");
    host.requests
}

fn active_recipe(flash: &mut Flash) -> Option<Vec<u8>> {
    let recipes = mount_recipes(flash);
    let mut buffer = [0; BUFFER_BYTES];
    let found = recipes.load(flash, &mut buffer).unwrap();
    found.map(<[u8]>::to_vec)
}

/// A valid recipe for a model that the firmware lacks is fetched once, and the old one stays active.
#[test]
fn unusable_recipe_is_fetched_once_and_not_activated() {
    let mut flash = Flash::new(6);
    // Enough for Phong with eight samples only.
    let mut memory = [0.0; memory_words(&[PHONG])];
    let checksum = checksum_of(COOK_TORRANCE);
    let requests = offer::<Phong>(COOK_TORRANCE, checksum, &mut memory, &mut flash);
    let is_part = |request: &&Request| matches!(request, Request::RecipePart { .. });
    let fetched: Vec<_> = requests
        .into_iter()
        .filter(|request| is_part(&request))
        .collect();
    let parts = (0..COOK_TORRANCE.len() as u32).step_by(BYTES_PER_FRAME);
    let once: Vec<_> = parts.map(|offset| Request::RecipePart { offset }).collect();
    assert_eq!(fetched, once);
    assert_eq!(active_recipe(&mut flash), None);
}

/// The bytes are damaged, or belong to a different recipe from the offered one.
#[test]
fn damaged_recipe_is_fetched_once() {
    for at in [40, 8] {
        let mut damaged = PHONG.to_vec();
        damaged[at] ^= 1;
        let mut flash = Flash::new(6);
        let mut memory = [0.0; MEMORY_WORDS];
        let requests = offer::<Model>(&damaged, 0x1234_5678, &mut memory, &mut flash);
        let first = Request::RecipePart { offset: 0 };
        let fetched = requests.iter().filter(|request| **request == first);
        assert_eq!(fetched.count(), 1);
        assert_eq!(active_recipe(&mut flash), None);
    }
}
