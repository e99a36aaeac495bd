//! Tests of routes against independent computations.

use glimpse_core::geometry::Arms;
use glimpse_core::gonio::{self, Limits};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::search::{Effort, Points};
use super::*;

fn random_stops(count: usize, random: &mut ChaCha8Rng) -> Vec<Arms<f64>> {
    let ranges = [0.0..90.0, -180.0..180.0, 0.0..90.0, -180.0..180.0];
    let mut draw = || ranges.clone().map(|range| random.random_range(range));
    (0..count).map(|_| Arms::from_array(draw())).collect()
}

/// The speed of the light's azimuth in [`machines`], in degrees per second.
const AZIMUTH_SPEED: f64 = 19.0;

/// Returns machines with and without full turns, and one without the light's azimuth axis. Each axis has a different
/// speed.
fn machines() -> [TimedMachine; 3] {
    [(true, AZIMUTH_SPEED), (false, AZIMUTH_SPEED), (true, 0.0)].map(|(full_turns, phi_i)| {
        TimedMachine {
            speeds: Arms::from_array([7.0, phi_i, 11.0, 25.0]),
            full_turns,
            ..TimedMachine::default()
        }
    })
}

/// Returns the shortest time over all orders, by a search that only abandons paths that already take longer.
fn exhaustive_shortest(points: &Points, count: usize) -> f64 {
    fn visit(points: &Points, path: &mut Vec<usize>, count: usize, shortest: &mut f64) {
        let seconds = points.path_seconds(path);
        if seconds >= *shortest {
            return;
        }
        if path.len() == count {
            *shortest = seconds;
        }
        for stop in 0..count {
            if !path.contains(&stop) {
                path.push(stop);
                visit(points, path, count, shortest);
                path.pop();
            }
        }
    }
    let mut shortest = f64::INFINITY;
    visit(points, &mut Vec::new(), count, &mut shortest);
    shortest
}

#[test]
fn routes_of_few_stops_match_exhaustive_search() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for machine in machines() {
        for count in [1, 2, 5, 7, 9] {
            let stops = random_stops(count, &mut random);
            let route = Route::new(&machine, &stops, Order::Travel, 0);
            let shortest = exhaustive_shortest(&Points::new(&machine, &stops), count);
            assert!(
                (route.travel - shortest).abs() < 1e-9,
                "{count} {machine:?}: {} and {shortest}",
                route.travel
            );
            let mut indices: Vec<usize> = route.visits.iter().map(|visit| visit.index).collect();
            indices.sort_unstable();
            assert!(indices.into_iter().eq(0..count));
            let quick = Route::quick(&machine, &stops, Order::Travel);
            assert!(
                quick.travel <= 1.01 * shortest,
                "{} and {shortest}",
                quick.travel
            );
        }
    }
}

/// Compares travel times and azimuths with those of the device's implementation.
#[test]
fn agrees_with_device_implementation() {
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let radians = |arms: &Arms<f64>| arms.map(|degrees| degrees.to_radians() as f32);
    for machine in machines().into_iter().filter(|machine| machine.full_turns) {
        let device = gonio::Machine {
            speeds: radians(&machine.speeds),
            isotropic: true,
            fixed: radians(&TimedMachine::START),
            ..gonio::Machine::new(Limits::NONE)
        };
        let stops = random_stops(40, &mut random);
        let route = Route::new(&machine, &stops, Order::Progressive, 0);
        let (mut position, mut previous_seconds) = (TimedMachine::START, 0.0);
        for (visit, stop) in route.visits.iter().zip(&stops) {
            let to = radians(stop).directions();
            let nearest = device
                .nearest(std::iter::once((0, to)), &radians(&position))
                .expect("the sample is within reach");
            let seconds = visit.seconds - previous_seconds - machine.settle;
            assert!(
                (f64::from(nearest.seconds) - seconds).abs() < 1e-3,
                "{nearest:?} {visit:?}"
            );
            for (device, planned) in [
                (nearest.arms.phi_i, visit.arms.phi_i),
                (nearest.arms.phi_o, visit.arms.phi_o),
            ] {
                assert!((f64::from(device).to_degrees() - planned).abs() < 1e-2);
            }
            (position, previous_seconds) = (visit.arms, visit.seconds);
        }
    }
}

/// Checks that axis positions give the sample's directions, up to a common rotation.
#[test]
fn axis_positions_match_sample_directions() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    for machine in machines() {
        let stops = random_stops(12, &mut random);
        for visit in Route::new(&machine, &stops, Order::Travel, 0).visits {
            let expected = stops[visit.index];
            assert_eq!(
                (visit.arms.theta_i, visit.arms.theta_o),
                (expected.theta_i, expected.theta_o)
            );
            let difference = |arms: &Arms<f64>| arms.phi_o - arms.phi_i;
            let turn = difference(&visit.arms) - difference(&expected);
            assert!((turn - 360.0 * (turn / 360.0).round()).abs() < 1e-9);
            if machine.speeds.phi_i == 0.0 {
                assert_eq!(visit.arms.phi_i, TimedMachine::START.phi_i);
            }
            if !machine.full_turns {
                assert!(difference(&visit.arms).abs() < 180.0 + 1e-9);
            }
        }
    }
}

/// In one plane the sensor swings through the normal, and a move takes as long as the slower one of two axes.
#[test]
fn arms_in_one_plane_swing_through_the_normal() {
    let machine = TimedMachine {
        speeds: Arms::from_array([20.0, 0.0, 10.0, 0.0]),
        settle: 0.0,
        limits: Limits {
            in_plane: true,
            ..Limits::NONE
        },
        ..TimedMachine::default()
    };
    assert_eq!(machine.validate(), Ok(()));
    // The mirror side, the light's side, and the mirror side after a turn.
    let stops = [
        [10.0, 20.0, 30.0, 200.0],
        [50.0, -170.0, 20.0, -170.0],
        [10.0, 90.0, 5.0, -90.0],
    ];
    let route = Route::new(
        &machine,
        &stops.map(Arms::from_array),
        Order::Progressive,
        0,
    );
    let expected = [(30.0, 3.0), (-20.0, 8.0), (5.0, 10.5)];
    for ((visit, [theta_i, ..]), (theta_o, seconds)) in route.visits.iter().zip(stops).zip(expected)
    {
        let arms = Arms::from_array([theta_i, 0.0, theta_o, 180.0]);
        assert_eq!((visit.arms, visit.seconds), (arms, seconds));
    }
}

/// Compares the search for 64 stops, whose fastest order is unknown, with longer searches from other seeds.
#[test]
fn search_of_64_stops_is_within_5_percent_of_longer_searches() {
    let stops = random_stops(64, &mut ChaCha8Rng::seed_from_u64(6));
    let machine = TimedMachine::default();
    let route = Route::new(&machine, &stops, Order::Travel, 0);
    let points = Points::new(&machine, &stops);
    let long = Effort {
        for_triple: 300_000_000,
        max: 300_000_000,
    };
    let longer = [1, 2]
        .map(|seed| points.path_seconds(&points.fastest_path(&long, seed)))
        .into_iter()
        .fold(f64::INFINITY, f64::min);
    assert!(
        route.travel <= 1.05 * longer,
        "{} and {longer}",
        route.travel
    );
    assert_eq!(route, Route::new(&machine, &stops, Order::Travel, 0));
}
