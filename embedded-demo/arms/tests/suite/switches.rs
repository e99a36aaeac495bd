//! Broken, shorted and bouncing home switches.

use glimpse_arms::axis::{AxisError, Motion};
use glimpse_arms::goniometer::ArmError;
use glimpse_arms::simulated::{Wiring, World, settings};

use crate::support::{ORDER, go_home, go_to, homed, settle};

/// Degrees of a number of steps.
fn degrees(arm: usize, steps: i32) -> f32 {
    settings(arm).angle(steps).to_degrees()
}

/// It reads as an open switch, so the arm only moves away from its end, and not far.
#[test]
fn a_broken_wire_is_found_before_the_arm_moves_5_percent_of_its_travel() {
    for arm in 0..4 {
        let start = 1000;
        let world = World::new([start; 4]);
        world.wire(arm, Wiring::Broken);
        let mut arms = world.goniometer();
        arms.go_home(ORDER).unwrap();
        let error = AxisError::HomeStuck;
        let arm_error = ArmError {
            arm: arm as u8,
            error,
        };
        assert_eq!(settle(&mut arms, 10), Err(arm_error));
        let moved = world.positions()[arm] - start;
        let allowed = settings(arm).travel() as i32 / 20 + 1;
        assert!(
            (0..=allowed).contains(&moved),
            "arm {arm} moved {moved} steps"
        );
        assert_eq!(arms.positions(), None);
    }
}

#[test]
fn a_wire_that_breaks_during_a_move_stops_all_arms_with_an_error() {
    for arm in 0..4 {
        let world = World::new([1; 4]);
        let mut arms = homed(&world);
        arms.go_to([1.0, 0.0, 0.5, 0.0]).unwrap();
        for _ in 0..20_000 {
            assert_eq!(arms.poll(10), Ok(Motion::Moving));
        }
        world.wire(arm, Wiring::Broken);
        let broke_at = world.positions();
        let error = settle(&mut arms, 10).unwrap_err();
        assert_eq!(usize::from(error.arm), arm);
        assert!(matches!(error.error, AxisError::SwitchOpened { steps } if steps > 100));
        for (arm, (at, broke_at)) in world.positions().into_iter().zip(broke_at).enumerate() {
            assert!(degrees(arm, at - broke_at).abs() < 1.0, "arm {arm} went on");
        }
        let stopped_at = world.positions();
        settle(&mut arms, 10).unwrap();
        assert_eq!(world.positions(), stopped_at);
    }
}

/// Before each move the switch is read, so a wire that broke while the arms stood is found first.
#[test]
fn a_wire_that_breaks_while_the_arms_stand_is_found_before_they_move() {
    let world = World::new([1; 4]);
    let mut arms = homed(&world);
    go_to(&mut arms, [1.0, 0.0, 0.5, 0.0]);
    let stood_at = world.positions();
    world.wire(3, Wiring::Broken);
    arms.go_to([0.5, 1.0, 0.5, 1.0]).unwrap();
    let error = settle(&mut arms, 10).unwrap_err();
    assert_eq!(error.arm, 3);
    assert!(matches!(error.error, AxisError::SwitchOpened { .. }));
    for (arm, (at, stood_at)) in world.positions().into_iter().zip(stood_at).enumerate() {
        assert!(degrees(arm, at - stood_at).abs() < 0.1, "arm {arm} moved");
    }
}

/// An arm whose position is known looks for its switch only as far as it may have lost steps.
#[test]
fn a_switch_that_does_not_open_stops_an_arm_with_a_known_position_near_its_end() {
    for arm in 0..4 {
        let world = World::new([1; 4]);
        let mut arms = homed(&world);
        go_to(&mut arms, [1.0, 0.0, 0.5, 0.0]);
        world.wire(arm, Wiring::Shorted);
        arms.go_home(ORDER).unwrap();
        let error = AxisError::HomeNotFound;
        let arm_error = ArmError {
            arm: arm as u8,
            error,
        };
        assert_eq!(settle(&mut arms, 10), Err(arm_error));
        let past = -world.positions()[arm];
        let allowed = settings(arm).travel() as i32 / 10 + 1;
        assert!(
            (0..=allowed).contains(&past),
            "arm {arm} went {past} steps past its end"
        );
    }
}

/// The switch has shown that it works when the arm left it.
#[test]
fn a_switch_that_fails_right_after_it_closed_stops_the_arm_within_5_percent_of_its_travel() {
    let world = World::new([-40, 1, 1, 1]);
    let mut arms = world.goniometer();
    arms.go_home(ORDER).unwrap();
    while world.positions()[0] <= 0 {
        assert_eq!(arms.poll(10), Ok(Motion::Moving));
    }
    world.wire(0, Wiring::Shorted);
    let error = AxisError::HomeNotFound;
    assert_eq!(settle(&mut arms, 10), Err(ArmError { arm: 0, error }));
    let past = -world.positions()[0];
    assert!(past <= settings(0).travel() as i32 / 20, "{past} steps");
}

/// Nobody knows where the arm is, but its travel is known. A mechanical stop has to hold it.
#[test]
fn a_switch_that_does_not_open_stops_an_arm_with_an_unknown_position_after_its_travel() {
    for arm in 0..4 {
        let start = settings(arm).travel() as i32;
        let world = World::new(std::array::from_fn(
            |other| if other == arm { start } else { 1 },
        ));
        world.wire(arm, Wiring::Shorted);
        let mut arms = world.goniometer();
        arms.go_home(ORDER).unwrap();
        let error = AxisError::HomeNotFound;
        let arm_error = ArmError {
            arm: arm as u8,
            error,
        };
        assert_eq!(settle(&mut arms, 10), Err(arm_error));
        let past = -world.positions()[arm];
        assert!(
            past <= start / 100 + 3,
            "arm {arm} went {past} steps past its end"
        );
    }
}

/// Contacts bounce at each change, and vibrations open them for a moment during a move.
#[test]
fn a_bouncing_contact_changes_no_position_and_stops_no_move() {
    for bounces in [1, 7, 100, 400] {
        let world = World::new([50, 60, 70, 80]);
        let mut arms = world.goniometer();
        arms.go_home(ORDER).unwrap();
        for arm in 0..4 {
            world.bounce(arm, bounces);
        }
        settle(&mut arms, 10).unwrap();
        assert_eq!(world.positions(), [0; 4]);
        arms.go_to([1.0, 0.0, 0.5, 0.0]).unwrap();
        for round in 0..200_000 {
            if round % 1000 == 0 {
                world.bounce(round / 1000 % 4, bounces);
            }
            arms.poll(10).unwrap();
        }
        go_home(&mut arms);
        assert_eq!(arms.lost_steps().next(), None);
        assert_eq!(world.positions(), [0; 4]);
    }
}

#[test]
fn a_contact_that_never_settles_is_an_error() {
    let world = World::new([1; 4]);
    let mut arms = homed(&world);
    arms.go_to([1.0, 0.0, 0.5, 0.0]).unwrap();
    world.bounce(1, u32::MAX);
    let error = AxisError::SwitchBounces;
    assert_eq!(settle(&mut arms, 10), Err(ArmError { arm: 1, error }));
}
