//! Samples out of reach are detected before the arms move.

use crate::board::{
    Host, MASKED, PHONG, POSITIONS, SECOND, TestBoard, answer, scan_once, serve, simulated,
};
use crate::support::Flash;
use glimpse_arms::scanner::{Command, Event, Outcome, ScannerError};
use glimpse_arms::{MEMORY_WORDS, Model};
use glimpse_core::error_code::ErrorCode;
use glimpse_core::geometry::{ArmAngles, Spherical};
use glimpse_core::gonio::{Limits, Move};
use glimpse_core::link::{Failure, Request};
use glimpse_core::recipe::Recipe;

/// Minimum separation at which two samples of [`PHONG`] are too close. The first of them is the third sample.
const LIMITS: Limits = Limits {
    min_separation: 0.2,
    ..Limits::NONE
};
const FAILURE: Failure = Failure::OutOfReach { index: 2, count: 2 };

/// For a recipe that needs every reading.
#[test]
fn reach_is_checked_before_first_move() {
    let simulated = simulated();
    let mut board = TestBoard::new(600 * SECOND, |_| false);
    let outcome = scan_once(simulated.station_with_limits(LIMITS), PHONG, &mut board);
    assert_eq!(outcome, Outcome::Failed(ScannerError::Scan(FAILURE)));
    assert_eq!(board.events, []);
    assert_eq!(simulated.positions(), POSITIONS);
}

/// The same after a command, with and without a host. A host receives the number of samples.
#[test]
fn host_receives_samples_out_of_reach() {
    for has_host in [false, true] {
        let simulated = simulated();
        let mut board = TestBoard::new(60 * SECOND, |event| {
            matches!(event, Event::Ended(Outcome::Failed(_)))
        });
        board.host = has_host.then(|| Host::new(|request| Some(answer(request, None))));
        board.commands.push_back((0, Command::NewScan));
        let station = simulated.station_with_limits(LIMITS);
        let mut memory = [0.0; MEMORY_WORDS];
        serve::<_, _, Model>(station, &mut Flash::new(6), &mut memory, &mut board);
        let error = ScannerError::Scan(FAILURE);
        assert_eq!(board.outcomes().last(), Some(&Outcome::Failed(error)));
        assert_eq!(simulated.positions(), POSITIONS);
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

/// For a recipe that tolerates missing readings.
#[test]
fn tolerant_recipe_skips_samples_out_of_reach() {
    let recipe = Recipe::parse(MASKED).unwrap();
    // Whatever the recipe, the arms reach half of its samples or more, and not all.
    let mut angles: Vec<f32> = recipe
        .directions()
        .map(|(_, directions)| directions.incoming[2].acos())
        .collect();
    angles.sort_by(f32::total_cmp);
    let limits = Limits {
        max_theta_i: angles[angles.len() / 2],
        ..Limits::NONE
    };
    let within = |limits: &Limits| {
        let reached = recipe
            .directions()
            .filter(|(_, directions)| limits.check(directions).is_ok());
        reached.map(|(index, _)| index).collect::<Vec<u16>>()
    };
    let simulated = simulated();
    let station = simulated.station_with_limits(limits);
    let expected = within(&station.limits());
    assert!((8..16).contains(&expected.len()), "{expected:?}");
    let mut board = TestBoard::new(1200 * SECOND, |_| false);
    let outcome = scan_once(station, MASKED, &mut board);
    assert_eq!(outcome, Outcome::Finished);
    let read = |event: &Event| match event {
        Event::Read { index, .. } => Some(*index),
        _ => None,
    };
    let mut read: Vec<u16> = board.events.iter().filter_map(read).collect();
    read.sort_unstable();
    assert_eq!(read, expected);
}

/// The sensor's axis ends 0.03 rad above the horizon; the limits of the machine do not include that.
#[test]
fn limits_include_ends_of_polar_axes() {
    let station_limits = simulated().station_with_limits(Limits::NONE).limits();
    let largest = [0, 2].map(|arm| glimpse_arms::simulated::settings(arm).max_angle);
    let [max_theta_i, max_theta_o] = largest;
    let expected = Limits {
        max_theta_i,
        max_theta_o,
        ..Limits::NONE
    };
    assert_eq!(station_limits, expected);
}

/// Rounding may place a sample slightly beyond the end of the axis. It is read at the end.
#[test]
fn sample_at_end_of_axis_is_read() {
    let simulated = simulated();
    let mut station = simulated.station();
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
