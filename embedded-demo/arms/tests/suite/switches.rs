//! Broken, shorted and bouncing home switches. The switches are normally closed: they open at the arm's end.

use glimpse_arms::axis::{AxisError, Motion};
use glimpse_arms::goniometer::ArmError;
use glimpse_arms::simulated::{SimulatedScanner, Wiring, settings};

use crate::support::{HOMING_ORDER, go_home, go_to, homed, settle};

/// Converts steps to degrees.
fn degrees(arm: usize, steps: i32) -> f32 {
    settings(arm).angle(steps).to_degrees()
}

/// A broken wire looks like an arm at its end, so the arm only moves away from it, and not far.
#[test]
fn broken_wire_stops_homing_within_5_percent_of_travel() {
    for arm in 0..4 {
        let start = 1000;
        let simulated = SimulatedScanner::new([start; 4]);
        simulated.set_wiring(arm, Wiring::Broken);
        let mut arms = simulated.goniometer();
        arms.go_home(HOMING_ORDER).unwrap();
        let error = AxisError::HomeStuck;
        let arm_error = ArmError {
            arm: arm as u8,
            error,
        };
        assert_eq!(settle(&mut arms, 10), Err(arm_error));
        let moved = simulated.positions()[arm] - start;
        let allowed = settings(arm).travel() as i32 / 20 + 1;
        assert!(
            (0..=allowed).contains(&moved),
            "arm {arm} moved {moved} steps"
        );
        assert_eq!(arms.positions(), None);
    }
}

#[test]
fn wire_breaking_during_move_stops_all_arms() {
    for arm in 0..4 {
        let simulated = SimulatedScanner::new([1; 4]);
        let mut arms = homed(&simulated);
        arms.go_to([1.0, 0.0, 0.5, 0.0]).unwrap();
        for _ in 0..20_000 {
            assert_eq!(arms.poll(10), Ok(Motion::Moving));
        }
        simulated.set_wiring(arm, Wiring::Broken);
        let broke_at = simulated.positions();
        let error = settle(&mut arms, 10).unwrap_err();
        assert_eq!(usize::from(error.arm), arm);
        assert!(matches!(error.error, AxisError::SwitchOpened { steps } if steps > 100));
        for (arm, (at, broke_at)) in simulated.positions().into_iter().zip(broke_at).enumerate() {
            assert!(degrees(arm, at - broke_at).abs() < 1.0, "arm {arm} went on");
        }
        let stopped_at = simulated.positions();
        settle(&mut arms, 10).unwrap();
        assert_eq!(simulated.positions(), stopped_at);
    }
}

/// The switch is read before each move, so a wire that broke at standstill is detected first.
#[test]
fn wire_broken_at_standstill_is_detected_before_move() {
    let simulated = SimulatedScanner::new([1; 4]);
    let mut arms = homed(&simulated);
    go_to(&mut arms, [1.0, 0.0, 0.5, 0.0]);
    let stood_at = simulated.positions();
    simulated.set_wiring(3, Wiring::Broken);
    arms.go_to([0.5, 1.0, 0.5, 1.0]).unwrap();
    let error = settle(&mut arms, 10).unwrap_err();
    assert_eq!(error.arm, 3);
    assert!(matches!(error.error, AxisError::SwitchOpened { .. }));
    for (arm, (at, stood_at)) in simulated.positions().into_iter().zip(stood_at).enumerate() {
        assert!(degrees(arm, at - stood_at).abs() < 0.1, "arm {arm} moved");
    }
}

/// An arm with a known position moves toward its switch at most by its known distance plus the steps that it may have
/// lost.
#[test]
fn closed_switch_stops_arm_with_known_position_near_end() {
    for arm in 0..4 {
        let simulated = SimulatedScanner::new([1; 4]);
        let mut arms = homed(&simulated);
        go_to(&mut arms, [1.0, 0.0, 0.5, 0.0]);
        simulated.set_wiring(arm, Wiring::Shorted);
        arms.go_home(HOMING_ORDER).unwrap();
        let error = AxisError::HomeNotFound;
        let arm_error = ArmError {
            arm: arm as u8,
            error,
        };
        assert_eq!(settle(&mut arms, 10), Err(arm_error));
        let past = -simulated.positions()[arm];
        let allowed = settings(arm).travel() as i32 / 10 + 1;
        assert!(
            (0..=allowed).contains(&past),
            "arm {arm} went {past} steps past its end"
        );
    }
}

/// The switch worked when the arm left it.
#[test]
fn switch_failing_after_release_stops_arm_within_5_percent_of_travel() {
    let simulated = SimulatedScanner::new([-40, 1, 1, 1]);
    let mut arms = simulated.goniometer();
    arms.go_home(HOMING_ORDER).unwrap();
    while simulated.positions()[0] <= 0 {
        assert_eq!(arms.poll(10), Ok(Motion::Moving));
    }
    simulated.set_wiring(0, Wiring::Shorted);
    let error = AxisError::HomeNotFound;
    assert_eq!(settle(&mut arms, 10), Err(ArmError { arm: 0, error }));
    let past = -simulated.positions()[0];
    assert!(past <= settings(0).travel() as i32 / 20, "{past} steps");
}

/// With an unknown position the motion is bounded by the travel. A mechanical stop must hold the arm.
#[test]
fn closed_switch_stops_arm_with_unknown_position_after_travel() {
    for arm in 0..4 {
        let start = settings(arm).travel() as i32;
        let simulated =
            SimulatedScanner::new(std::array::from_fn(
                |other| if other == arm { start } else { 1 },
            ));
        simulated.set_wiring(arm, Wiring::Shorted);
        let mut arms = simulated.goniometer();
        arms.go_home(HOMING_ORDER).unwrap();
        let error = AxisError::HomeNotFound;
        let arm_error = ArmError {
            arm: arm as u8,
            error,
        };
        assert_eq!(settle(&mut arms, 10), Err(arm_error));
        let past = -simulated.positions()[arm];
        assert!(
            past <= start / 100 + 3,
            "arm {arm} went {past} steps past its end"
        );
    }
}

/// Contacts bounce at each change, and vibrations open them briefly during a move.
#[test]
fn bouncing_contact_is_tolerated() {
    for bounces in [1, 7, 100, 400] {
        let simulated = SimulatedScanner::new([50, 60, 70, 80]);
        let mut arms = simulated.goniometer();
        arms.go_home(HOMING_ORDER).unwrap();
        for arm in 0..4 {
            simulated.bounce(arm, bounces);
        }
        settle(&mut arms, 10).unwrap();
        assert_eq!(simulated.positions(), [0; 4]);
        arms.go_to([1.0, 0.0, 0.5, 0.0]).unwrap();
        for round in 0..200_000 {
            if round % 1000 == 0 {
                simulated.bounce(round / 1000 % 4, bounces);
            }
            arms.poll(10).unwrap();
        }
        go_home(&mut arms);
        assert_eq!(arms.lost_steps().next(), None);
        assert_eq!(simulated.positions(), [0; 4]);
    }
}

#[test]
fn unsettled_contact_is_an_error() {
    let simulated = SimulatedScanner::new([1; 4]);
    let mut arms = homed(&simulated);
    arms.go_to([1.0, 0.0, 0.5, 0.0]).unwrap();
    simulated.bounce(1, u32::MAX);
    let error = AxisError::SwitchBounces;
    assert_eq!(settle(&mut arms, 10), Err(ArmError { arm: 1, error }));
}
