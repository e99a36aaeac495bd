//! The firmware as it runs on a board, scan after scan.

use std::cell::Cell;

use crate::bench::{
    BAD, Board, COOK_TORRANCE, DARK, GRAY, Host, PHONG, POSITIONS, SECOND, WHITE, answer,
    checksum_of, counting, is_finished, serve, world,
};
use crate::support::{BUFFER_BYTES, Flash, mount_recipes};
use glimpse_arms::scanner::{Command, End, News, ScannerError};
use glimpse_arms::{MEMORY_WORDS, Model};
use glimpse_core::fit::Fitter;
use glimpse_core::link::{BYTES_PER_FRAME, Failure, Request};
use glimpse_core::model::Phong;
use glimpse_core::recipe::memory_words;
use glimpse_core::scan::ReadingError;

/// The cable is pulled in the middle of a recipe, before anybody has pressed the button.
#[test]
fn a_host_that_falls_silent_moves_no_motor() {
    let world = world();
    let mut parts = 0;
    let mut board = Board::new(10 * SECOND, |_| false);
    board.host = Some(Host::new(|request| {
        parts += u32::from(matches!(request, Request::RecipePart { .. }));
        let offered = (COOK_TORRANCE, checksum_of(COOK_TORRANCE));
        (parts <= 2).then(|| answer(request, Some(offered)))
    }));
    board.serve(&world, &mut Flash::new(6));
    assert_eq!(world.positions(), POSITIONS, "{:?}", board.news);
    assert_eq!(
        board.ends().len(),
        1,
        "it reports that the host fell silent"
    );
}

/// The same in a scan that somebody has begun: it goes on alone.
#[test]
fn a_scan_under_way_goes_on_without_a_host_that_falls_silent() {
    let mut board = Board::new(600 * SECOND, is_finished);
    board.host = Some(Host::new(|request| match request {
        Request::Progress(_) => None,
        request => Some(answer(request, None)),
    }));
    board.commands.push_back((SECOND, Command::NewScan));
    board.serve(&world(), &mut Flash::new(6));
    assert_eq!(board.ends().last(), Some(&End::Finished));
    assert_eq!(board.reads(), 8, "nothing is read twice");
}

/// One byte of noise, long before the press, is not a host.
#[test]
fn noise_on_the_line_leaves_the_button_alone() {
    let mut board = Board::new(600 * SECOND, is_finished);
    board.noise.push_back((SECOND, 0x55));
    board.commands.push_back((10 * SECOND, Command::NewScan));
    board.serve(&world(), &mut Flash::new(6));
    assert_eq!(board.ends(), [End::Alone, End::Finished]);
}

/// Serves a button that is pressed for each of some scans, with a sensor that counts `lit(n)` for the nth
/// reading. Returns the number of readings too.
fn scan_counting(scans: u64, lit: impl Fn(u32) -> u16) -> (Board<'static>, u32) {
    let mut ends = 0;
    let mut board = Board::new(600 * SECOND, move |news| {
        ends += u64::from(matches!(news, News::End(End::Failed(_) | End::Finished)));
        ends == scans
    });
    board.commands = (0..scans)
        .map(|scan| (300 * scan * SECOND, Command::NewScan))
        .collect();
    let (world, is_lit) = (world(), Cell::new(false));
    let mut taken = 0;
    let mut count = || {
        taken += 1;
        Some(lit(taken))
    };
    let station = counting(&world, &is_lit, &mut count);
    let mut memory = [0.0; MEMORY_WORDS];
    serve::<_, _, Model>(station, &mut Flash::new(6), &mut memory, &mut board);
    (board, taken)
}

/// A reading that is less than nothing is taken again, and the scan goes on. Attempts count for one
/// sample, though the driver receives good readings only once the arms are home.
#[test]
fn an_impossible_reading_is_taken_again() {
    for bad in [&[3][..], &[2, 3, 5]] {
        let (board, taken) =
            scan_counting(1, |taken| if bad.contains(&taken) { BAD } else { GRAY });
        assert_eq!(board.ends(), [End::Alone, End::Finished]);
        assert_eq!((board.reads(), taken as usize), (8, 8 + bad.len()));
    }
}

/// After three attempts at the same sample the scan is given up, by the name of the fault.
#[test]
fn an_impossible_reading_ends_the_scan_after_three_attempts() {
    let (board, taken) = scan_counting(1, |taken| if taken < 3 { GRAY } else { BAD });
    let Some(End::Failed(ScannerError::Scan(Failure::Reading { error, .. }))) = board.ends().pop()
    else {
        panic!("{:?}", board.news);
    };
    assert_eq!(error, ReadingError::Negative(0));
    assert_eq!(taken, 2 + 3);
}

/// Raw counts in place of a BRDF: the fit refuses them, and nobody fits them again.
#[test]
fn readings_that_cannot_be_fitted_are_forgotten() {
    let large = DARK + 110 * WHITE;
    let (board, _) = scan_counting(2, |taken| if taken <= 8 { large } else { GRAY });
    let [
        End::Alone,
        End::Failed(ScannerError::Scan(Failure::Fit(_))),
        End::Alone,
        End::Finished,
    ] = board.ends()[..]
    else {
        panic!("{:?}", board.news);
    };
    assert_eq!(board.reads(), 16);
}

/// Boots a firmware with a host that offers a recipe, for twenty seconds. Returns the host.
fn offer<K: Fitter>(
    recipe: &[u8],
    checksum: u32,
    memory: &mut [f32],
    flash: &mut Flash,
) -> Vec<Request> {
    let mut board = Board::new(20 * SECOND, |_| false);
    board.host = Some(Host::new(|request| {
        Some(answer(request, Some((recipe, checksum))))
    }));
    serve::<_, _, K>(world().station(), flash, memory, &mut board);
    let host = board.host.unwrap();
    let greetings = host.count(|request| matches!(request, Request::Hello { .. }));
    assert!(greetings > 3, "it greets again from time to time");
    host.requests
}

fn in_force(flash: &mut Flash) -> Option<Vec<u8>> {
    let recipes = mount_recipes(flash);
    let mut buffer = [0; BUFFER_BYTES];
    let found = recipes.load(flash, &mut buffer).unwrap();
    found.map(<[u8]>::to_vec)
}

/// A whole recipe, but of a model that the firmware lacks: it is fetched once, and the old one stays.
#[test]
fn a_recipe_that_cannot_be_used_is_fetched_once_and_not_put_in_force() {
    let mut flash = Flash::new(6);
    // Only for Phong, with eight samples at most.
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
    assert_eq!(in_force(&mut flash), None);
}

/// The bytes are damaged, or those of another recipe than was offered.
#[test]
fn a_damaged_recipe_is_fetched_once() {
    for at in [40, 8] {
        let mut damaged = PHONG.to_vec();
        damaged[at] ^= 1;
        let mut flash = Flash::new(6);
        let mut memory = [0.0; MEMORY_WORDS];
        let requests = offer::<Model>(&damaged, 0x1234_5678, &mut memory, &mut flash);
        let first = Request::RecipePart { offset: 0 };
        let fetched = requests.iter().filter(|request| **request == first);
        assert_eq!(fetched.count(), 1);
        assert_eq!(in_force(&mut flash), None);
    }
}
