//! The next move, compared with a search over turns.

use std::f32::consts::{PI, TAU};

use glimpse_core::geometry::{Arms, HalfDifference};
use glimpse_core::gonio::{Limits, Machine, Move};
use proptest::prelude::*;

use super::{arms, at, close};

fn machine(isotropic: bool) -> Machine {
    Machine {
        speeds: Arms::from_array([0.5, 0.2, 1.0, 0.6]),
        isotropic,
        ..Machine::new(Limits::NONE)
    }
}

/// The shorter of the two turns to an angle, in radians.
fn shorter_turn(angle: f32) -> f32 {
    let angle = angle.rem_euclid(TAU);
    angle.min(TAU - angle)
}

/// The duration of the slowest axis, as `Machine` documents it.
fn seconds(speeds: &Arms, to: &Arms, from: &Arms, turn: f32) -> f32 {
    let theta_i = (to.theta_i - from.theta_i).abs() / speeds.theta_i;
    let theta_o = (to.theta_o - from.theta_o).abs() / speeds.theta_o;
    let phi_i = shorter_turn(to.phi_i + turn - from.phi_i) / speeds.phi_i;
    let phi_o = shorter_turn(to.phi_o + turn - from.phi_o) / speeds.phi_o;
    theta_i.max(theta_o).max(phi_i).max(phi_o)
}

prop_compose! {
    fn any_arms()(theta_i in 1.0..85f32, phi_i in -180.0..180f32, theta_o in 1.0..85f32, phi_o in -180.0..180f32)
        -> [f32; 4] {
        [theta_i, phi_i, theta_o, phi_o]
    }
}

fn moved(machine: &Machine, to: [f32; 4], from: [f32; 4]) -> Move {
    machine
        .nearest([(7, at(to))].into_iter(), &arms(from))
        .expect("in reach")
}

proptest! {

    /// Azimuths take the shorter turn, also after full turns. If the sample may turn, both turn together.
    #[test]
    fn chooses_fastest_turn(
        to in any_arms(), from in any_arms(), isotropic in any::<bool>(), turns in -10..10i16,
    ) {
        let machine = machine(isotropic);
        let [theta_i, phi_i, theta_o, phi_o] = from;
        let from = [theta_i, phi_i + 360.0 * f32::from(turns), theta_o, phi_o];
        let actual = moved(&machine, to, from);
        let common_turns = 0..if isotropic { 3600 } else { 1 };
        let best = common_turns
            .map(|turn| seconds(&machine.speeds, &arms(to), &arms(from), (turn as f32 / 10.0).to_radians()))
            .fold(f32::INFINITY, f32::min);
        for (to, from) in [(actual.arms.phi_i, arms(from).phi_i), (actual.arms.phi_o, arms(from).phi_o)] {
            prop_assert!((to - from).abs() < PI + 1e-4, "{actual:?}");
        }
        prop_assert!(actual.seconds <= best + 1e-3, "{} {best}", actual.seconds);
        // The search has steps of a tenth of a degree.
        prop_assert!(actual.seconds >= best - 0.1f32.to_radians() / 0.2, "{} {best}", actual.seconds);
        prop_assert!((actual.seconds - seconds(&machine.speeds, &actual.arms, &arms(from), 0.0)).abs() < 1e-3);
        // The half and difference vectors stay the same.
        let [here, there] = [actual.arms.directions(), at(to)]
            .map(|pair| HalfDifference::from_directions(&pair).expect("a half vector"));
        prop_assume!(here.hx > 0.01 && here.dz > 0.01);
        for (a, b) in [(here.hx, there.hx), (here.dx, there.dx), (here.dy, there.dy), (here.dz, there.dz)] {
            prop_assert!((a - b).abs() < 2e-3, "{here:?} {there:?}");
        }
    }

    #[test]
    fn chooses_nearest_sample(
        to in prop::collection::vec(any_arms(), 1..12), from in any_arms(), isotropic in any::<bool>(),
    ) {
        let machine = machine(isotropic);
        let pending = (3..).zip(to.iter().map(|to| at(*to)));
        let actual = machine.nearest(pending, &arms(from)).expect("in reach");
        let costs: Vec<_> = to.iter().map(|to| moved(&machine, *to, from).seconds).collect();
        let best = costs.iter().copied().fold(f32::INFINITY, f32::min);
        let first = costs.iter().position(|cost| *cost == best).expect("one of the costs");
        prop_assert_eq!(usize::from(actual.index), 3 + first);
        prop_assert_eq!(actual.seconds, best);
    }
}

#[test]
fn ignores_samples_out_of_reach() {
    let mut machine = machine(true);
    machine.limits.max_theta_i = 1.0;
    let from = arms([60.0, 0.0, 10.0, 0.0]);
    let places = [at([60.0, 0.0, 10.0, 0.0]), at([20.0, 0.0, 80.0, 0.0])];
    let actual = machine
        .nearest((0..).zip(places), &from)
        .expect("a sample in reach");
    assert_eq!(actual.index, 1, "the nearer one is past the lamp's limit");
    assert_eq!(machine.nearest((0..).zip([places[0]]), &from), None);
    assert_eq!(machine.nearest([].into_iter(), &from), None);
}

/// A usual machine has three axes: the lamp has no azimuth, and the sample turns instead.
#[test]
fn missing_axis_stays_fixed() {
    let mut machine = machine(true);
    machine.speeds.phi_i = 0.0;
    machine.fixed.phi_i = 15f32.to_radians();
    let from = [30.0, 15.0, 40.0, 100.0];
    let actual = moved(&machine, [20.0, -120.0, 40.0, -20.0], from);
    assert_eq!(actual.arms.phi_i, 15f32.to_radians());
    assert!((actual.arms.phi_o - 115f32.to_radians()).abs() < 1e-5);
    // Without a turn of the sample, the position is out of reach, unless the azimuth is correct already or has no
    // effect.
    machine.isotropic = false;
    let nearest = |to, from| machine.nearest([(0, at(to))].into_iter(), &arms(from));
    assert_eq!(nearest([20.0, -120.0, 40.0, -20.0], from), None);
    assert!(nearest([20.0, 15.0, 40.0, -20.0], from).is_some());
    assert!(nearest([0.0, 77.0, 40.0, -20.0], from).is_some());
}

/// Two arms in one plane swing through the normal instead of turning about it.
#[test]
fn in_plane_arms_swing_through_normal() {
    let mut machine = machine(true);
    machine.limits.in_plane = true;
    (machine.speeds.phi_i, machine.speeds.phi_o) = (0.0, 0.0);
    let from = [30.0, 0.0, 30.0, 0.0];
    let mirror = at([40.0, 70.0, 50.0, 250.0]);
    let nearest = |machine: &Machine| machine.nearest([(0, mirror)].into_iter(), &arms(from));
    assert_eq!(nearest(&machine), None);
    machine.through_normal = true;
    let actual = nearest(&machine).expect("in reach");
    let [theta_i, phi_i, theta_o, phi_o] = actual.arms.to_array();
    assert_eq!((phi_i, phi_o), (0.0, 0.0));
    assert!(close(theta_i.abs(), 40f32.to_radians()) && close(theta_o.abs(), 50f32.to_radians()));
    assert!(theta_i * theta_o < 0.0);
    // The sensor moves 80 degrees at 1 rad/s, the lamp 10 degrees at half this speed.
    assert!((actual.seconds - 80f32.to_radians()).abs() < 1e-4);
}

#[test]
fn invalid_arms_reach_nothing() {
    let mut from = arms([10.0, 0.0, 10.0, PI]);
    from.theta_i = f32::NAN;
    let pending = || [(0, at([10.0, 0.0, 20.0, 0.0]))].into_iter();
    assert_eq!(machine(true).nearest(pending(), &from), None);
    from = arms([10.0, 0.0, 10.0, f32::INFINITY]);
    assert_eq!(machine(false).nearest(pending(), &from), None);
}
