//! Motion, homing and lost steps of the simulated arms.

use std::f32::consts::PI;

use crate::support::{HOMING_ORDER, go_home, go_to, homed, settle};
use glimpse_arms::axis::{AxisError, Motion};
use glimpse_arms::goniometer::{ArmError, LostSteps};
use glimpse_arms::simulated::{SimulatedScanner, settings};

/// Returns the positions of the simulated arms at these angles, in steps from their switches.
fn steps(angles: [f32; 4]) -> [i32; 4] {
    std::array::from_fn(|arm| {
        let settings = settings(arm);
        (settings.steps(angles[arm]) - settings.steps(settings.home)).abs()
    })
}

#[test]
fn homes_from_any_position() {
    for positions in [[0; 4], [-40, -1, 1, 2], [3000, 12_000, 77, 5000]] {
        let simulated = SimulatedScanner::new(positions);
        let mut arms = homed(&simulated);
        assert_eq!(simulated.positions(), [0; 4]);
        assert_eq!(
            arms.lost_steps().next(),
            None,
            "the previous position was unknown"
        );
        // The arms find the same position again from another one.
        go_to(&mut arms, [1.0, -1.0, 0.5, 3.0]);
        go_home(&mut arms);
        assert_eq!(simulated.positions(), [0; 4]);
        assert_eq!(arms.lost_steps().next(), None);
    }
}

#[test]
fn moves_to_target_angles() {
    let simulated = SimulatedScanner::new([100; 4]);
    let mut arms = homed(&simulated);
    for angles in [
        [0.3, -3.0, 1.5, 3.0],
        [0.3, -3.0, 0.0, -PI],
        [1.5, 0.0, 0.7, PI],
    ] {
        go_to(&mut arms, angles);
        assert_eq!(simulated.positions(), steps(angles));
    }
}

#[test]
fn rejects_move_while_moving() {
    let simulated = SimulatedScanner::new([1; 4]);
    let mut arms = homed(&simulated);
    arms.go_to([0.3; 4]).unwrap();
    assert_eq!(arms.poll(10), Ok(Motion::Moving));
    assert_eq!(arms.go_to([0.4; 4]).unwrap_err().error, AxisError::Moving);
}

/// A ramp up to 4000 steps/s at 20,000 steps/s^2 and down again.
#[test]
fn move_time_matches_trapezoid() {
    let simulated = SimulatedScanner::new([1; 4]);
    for (angle, trapezoid) in [(0.1, true), (3.0, false)] {
        let mut arms = homed(&simulated);
        arms.go_to([0.0, angle - PI, 1.5, -PI]).unwrap();
        let microseconds = settle(&mut arms, 1).unwrap();
        let steps = settings(1).steps(angle + 0.05) as f32;
        let seconds = if trapezoid {
            2.0 * (steps / 20_000.0).sqrt()
        } else {
            steps / 4000.0 + 4000.0 / 20_000.0
        };
        let ratio = microseconds as f32 * 1e-6 / seconds;
        assert!((0.95..1.1).contains(&ratio), "{angle}: {ratio}");
    }
}

/// A step pulse that is too short is a lost step.
#[test]
fn late_polls_slow_arms_but_lose_no_steps() {
    let simulated = SimulatedScanner::new([1; 4]);
    let [soon, late] = [1, 997].map(|round| {
        let mut arms = homed(&simulated);
        arms.go_to([0.5; 4]).unwrap();
        settle(&mut arms, round).unwrap()
    });
    assert!(late > 2 * soon, "{late} {soon}");
    assert_eq!(simulated.positions(), steps([0.5; 4]));
}

#[test]
fn rejects_angles_out_of_reach_without_moving() {
    let simulated = SimulatedScanner::new([1; 4]);
    let mut arms = homed(&simulated);
    for angles in [
        [0.1, 0.0, 1.6, 0.0],
        [-0.01, 0.0, 0.5, 0.0],
        [0.1, 0.0, 0.5, 3.2],
        [f32::NAN, 0.0, 0.5, 0.0],
    ] {
        let error = arms.go_to(angles).unwrap_err().error;
        assert!(matches!(error, AxisError::OutOfReach { .. }));
        assert_eq!(settle(&mut arms, 10), Ok(0));
        assert_eq!(simulated.positions(), [0; 4]);
    }
}

#[test]
fn rejects_move_before_homing() {
    let simulated = SimulatedScanner::new([1; 4]);
    let mut arms = simulated.goniometer();
    let error = arms.go_to([0.5; 4]).unwrap_err();
    assert_eq!(error.error, AxisError::NotHomed);
}

/// The home of the lamp is at its smallest angle, that of the sensor at its largest one.
#[test]
fn homing_reports_count_and_sign_of_lost_steps() {
    for (arm, sign_back) in [(0, -1), (2, 1)] {
        for (stalled, back) in [(5, false), (300, false), (7, true), (200, true)] {
            let simulated = SimulatedScanner::new([1; 4]);
            let mut arms = homed(&simulated);
            go_to(&mut arms, [0.1, 0.2, 0.1, 0.1]);
            if back {
                go_to(&mut arms, [0.6, 0.2, 0.6, 0.1]);
                simulated.stall(arm, stalled);
            } else {
                simulated.stall(arm, stalled);
                go_to(&mut arms, [0.6, 0.2, 0.6, 0.1]);
            }
            go_home(&mut arms);
            assert_eq!(simulated.positions(), [0; 4], "home is at the switch");
            let sign = if back { sign_back } else { 1 };
            let steps = sign * stalled as i32;
            let arm = arm as u8;
            let lost = LostSteps { arm, steps };
            assert_eq!(arms.lost_steps().collect::<Vec<_>>(), [lost]);
        }
    }
}

#[test]
fn one_lost_step_is_within_tolerance() {
    let simulated = SimulatedScanner::new([1; 4]);
    let mut arms = homed(&simulated);
    simulated.stall(0, 1);
    go_to(&mut arms, [0.4, 0.2, 0.6, 0.1]);
    go_home(&mut arms);
    assert_eq!(arms.lost_steps().next(), None);
}

#[test]
fn switch_opening_during_move_stops_arm() {
    let simulated = SimulatedScanner::new([1; 4]);
    let mut arms = homed(&simulated);
    simulated.stall(0, 1000);
    arms.go_to([1.0, 0.0, 1.0, 0.0]).unwrap();
    // The arm is at its switch, but far from it according to the step count.
    let error = settle(&mut arms, 10).unwrap_err();
    assert_eq!(error.arm, 0);
    assert!(matches!(error.error, AxisError::SwitchOpened { steps } if steps > 10));
    assert_eq!(arms.positions(), None);
}

#[test]
fn stuck_switch_is_an_error() {
    for (start, error) in [(1000, AxisError::HomeNotFound), (-10, AxisError::HomeStuck)] {
        let simulated = SimulatedScanner::new([start, 0, 0, 0]);
        simulated.stall(0, 1_000_000); // its motor is disconnected
        let mut arms = simulated.goniometer();
        arms.go_home(HOMING_ORDER).unwrap();
        assert_eq!(settle(&mut arms, 10), Err(ArmError { arm: 0, error }));
    }
}

/// After a reset the firmware has no state, and the arms are at their old positions.
#[test]
fn homing_checks_counts_from_before_reset() {
    for stalled in [0, 9] {
        let simulated = SimulatedScanner::new([1; 4]);
        let mut arms = homed(&simulated);
        simulated.stall(3, stalled);
        go_to(&mut arms, [0.4, 0.2, 0.6, 0.1]);
        let positions = arms.positions().unwrap();

        let mut arms = simulated.goniometer();
        arms.assume(positions);
        go_home(&mut arms);
        let lost = arms.lost_steps().map(|lost| lost.steps).next();
        assert_eq!(lost, (stalled > 0).then_some(stalled as i32));
    }
}
