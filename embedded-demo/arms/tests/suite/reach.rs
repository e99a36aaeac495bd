//! Samples out of reach: found before anything moves.

use crate::bench::{
    Board, Host, MASKED, PHONG, POSITIONS, SECOND, answer, scan_once, serve, world,
};
use crate::support::Flash;
use glimpse_arms::scanner::{Command, End, News, ScannerError};
use glimpse_arms::{MEMORY_WORDS, Model};
use glimpse_core::error_code::ErrorCode;
use glimpse_core::geometry::{ArmAngles, Spherical};
use glimpse_core::gonio::{Limits, Move};
use glimpse_core::link::{Failure, Request};
use glimpse_core::recipe::Recipe;

/// Lamp and sensor have to be this far apart: two samples of [`PHONG`] are closer, the first of them the third.
const LIMITS: Limits = Limits {
    min_separation: 0.2,
    ..Limits::NONE
};
const FAILURE: Failure = Failure::OutOfReach { index: 2, count: 2 };

/// The recipe needs every reading.
#[test]
fn reach_is_checked_before_anything_moves() {
    let world = world();
    let mut board = Board::new(600 * SECOND, |_| false);
    let end = scan_once(world.station_within(LIMITS), PHONG, &mut board);
    assert_eq!(end, End::Failed(ScannerError::Scan(FAILURE)));
    assert_eq!(board.news, []);
    assert_eq!(world.positions(), POSITIONS);
}

/// The same after a press of the button, with and without a host. A host receives the number of samples.
#[test]
fn a_host_receives_the_samples_out_of_reach_and_nothing_moves() {
    for has_host in [false, true] {
        let world = world();
        let mut board = Board::new(60 * SECOND, |news| {
            matches!(news, News::End(End::Failed(_)))
        });
        board.host = has_host.then(|| Host::new(|request| Some(answer(request, None))));
        board.commands.push_back((0, Command::NewScan));
        let station = world.station_within(LIMITS);
        let mut memory = [0.0; MEMORY_WORDS];
        serve::<_, _, Model>(station, &mut Flash::new(6), &mut memory, &mut board);
        let error = ScannerError::Scan(FAILURE);
        assert_eq!(board.ends().last(), Some(&End::Failed(error)));
        assert_eq!(world.positions(), POSITIONS);
        let reports = board.host.map(|host| {
            let is_report = |request: &&Request| {
                matches!(request, Request::Failed(report)
                    if report.error() == Some(ErrorCode::OutOfReach) && report.details == [2, 2])
            };
            host.requests.iter().filter(is_report).count()
        });
        assert_eq!(reports, has_host.then_some(1));
    }
}

/// A recipe that tolerates missing readings: the scan leaves these samples out.
#[test]
fn samples_out_of_reach_are_skipped_if_the_recipe_tolerates_that() {
    let limits = Limits {
        min_separation: 0.3,
        ..Limits::NONE
    };
    let recipe = Recipe::parse(MASKED).unwrap();
    let within = |limits: &Limits| {
        let reached = recipe
            .directions()
            .filter(|(_, directions)| limits.check(directions).is_ok());
        reached.map(|(index, _)| index).collect::<Vec<u16>>()
    };
    let world = world();
    let station = world.station_within(limits);
    let expected = within(&station.limits());
    assert!((8..16).contains(&expected.len()), "{expected:?}");
    let mut board = Board::new(1200 * SECOND, |_| false);
    let end = scan_once(station, MASKED, &mut board);
    assert_eq!(end, End::Finished);
    let read = |news: &News| match news {
        News::Read { index, .. } => Some(*index),
        _ => None,
    };
    let mut read: Vec<u16> = board.news.iter().filter_map(read).collect();
    read.sort_unstable();
    assert_eq!(read, expected);
}

/// The sensor's axis ends 0.03 rad above the horizon, which the limits of the machine do not state.
#[test]
fn the_ends_of_the_polar_axes_are_limits() {
    let station_limits = world().station_within(Limits::NONE).limits();
    let largest = [0, 2].map(|arm| glimpse_arms::simulated::settings(arm).largest);
    let [max_theta_i, max_theta_o] = largest;
    let expected = Limits {
        max_theta_i,
        max_theta_o,
        ..Limits::NONE
    };
    assert_eq!(station_limits, expected);
}

/// Rounding may place a sample of a limit a little beyond the end of the axis: it is read at the end.
#[test]
fn a_sample_on_the_end_of_an_axis_is_read() {
    let world = world();
    let mut station = world.station();
    station.go_home().unwrap();
    while station.poll(40).unwrap().is_none() {}
    let at = |theta| Spherical { theta, phi: 0.0 };
    let end = station.limits().max_theta_o;
    for (beyond, is_read) in [(0.5 * Limits::TOLERANCE, true), (0.01, false)] {
        let arms = ArmAngles {
            incoming: at(0.2),
            outgoing: at(end + beyond),
        };
        let (index, seconds) = (0, 1.0);
        let to = Move {
            index,
            arms,
            seconds,
        };
        let directions = arms.directions();
        assert_eq!(station.limits().check(&directions).is_ok(), is_read);
        assert_eq!(station.read(to, directions).is_ok(), is_read);
    }
}
