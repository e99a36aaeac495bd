//! Motion, routes, homing, lost steps, and faults of switches, motors and pins.

use std::array;
use std::f32::consts::{PI, TAU};

use glimpse_core::error::{Error, ErrorCode as Code};
use glimpse_desk::Wiring::*;
use glimpse_desk::axes::AXES;
use glimpse_desk::{Arms, Machine, directions};
use glimpse_scanner::axis::Settings;
use glimpse_scanner::goniometer::Motion::{self, Homed, Resting};
use glimpse_scanner::goniometer::StepCheck::{Lost, Passed, Unknown};
use glimpse_scanner::route::{AxisAngles, Space};

use crate::random::Random;

/// The lamp is nearer to the horizon than the sensor.
const TARGET: AxisAngles = [1.0, 0.0, 0.5, 0.0];
const NOT_HOMED: Error = Error::new(Code::NotHomed);

/// Polls every `round` us until the arms rest, and returns their last progress. Calls `watch` after each poll.
fn settle(arms: &mut Arms, round: u32, mut watch: impl FnMut()) -> Result<Motion, Error> {
    loop {
        let progress = arms.poll(round)?;
        watch();
        if progress != Motion::Moving {
            return Ok(progress);
        }
    }
}

fn home(arms: &mut Arms) -> Result<Motion, Error> {
    arms.home()?;
    settle(arms, 40, || ())
}

fn go_to(arms: &mut Arms, angles: AxisAngles) {
    arms.go_to(angles).unwrap();
    assert_eq!(settle(arms, 40, || ()), Ok(Resting));
}

/// Polls `rounds` times 100 us, or until an error.
fn poll_for(arms: &mut Arms, rounds: u64) -> Result<(), Error> {
    (0..rounds).try_for_each(|_| arms.poll(100).map(drop))
}

/// Polls for ten seconds, and asserts that no arm moves.
fn assert_rest(machine: &Machine, arms: &mut Arms) {
    let positions = machine.positions();
    poll_for(arms, 100_000).unwrap();
    assert_eq!(machine.positions(), positions);
}

/// There is a route between any two safe configurations. It is safe at any relative speeds of the axes.
#[test]
fn route_connects_safe_configurations() {
    const ROUNDING: f32 = 1e-5;
    let mut random = Random(1);
    for case in 0..7500 {
        let min_separation = [0.0, 0.05, 0.2, 0.5, 1.0][case % 5];
        let space = Space::new(AXES, min_separation).unwrap();
        let random_angles = |_| {
            AXES.map(|axis| {
                let part = random.uniform() as f32;
                let angle = axis.min_angle + part * (axis.max_angle - axis.min_angle);
                axis.angle(axis.steps(angle))
            })
        };
        let is_safe = |at: &_| directions(*at).separation() > min_separation + ROUNDING;
        let mut safe = (0..).map(random_angles).filter(is_safe);
        let [mut from, end] = [(); 2].map(|()| safe.next().unwrap());
        for to in space.route(from, end).unwrap() {
            for corner in 0..256 {
                let angles = array::from_fn(|axis| {
                    let parts = [(corner >> axis & 1) as f32, random.uniform() as f32];
                    from[axis] + parts[usize::from(corner >= 16)] * (to[axis] - from[axis])
                });
                assert!(directions(angles).separation() >= min_separation - ROUNDING);
            }
            from = to;
        }
        assert_eq!(from, end);
    }
}

/// The template's axes, and random ones with a gap between the azimuths. A limit may lie between two steps, and a target
/// may be full turns away. At unknown positions the sensor goes to the horizon first, so the arms do not come closer.
#[test]
fn arms_return_from_all_limits() {
    let mut random = Random(5);
    for case in 0..200 {
        let start = [[-40, -1, 1, 2], [1000, 5000, 1000, 5000], [90; 4]][case.min(2)];
        let mut machine = Machine::new(start);
        let mut scale = || [1.0, 1.0, 0.7 + 0.3 * random.uniform() as f32][case.min(2)];
        let angles = scale();
        for axis in &mut machine.settings {
            axis.steps_per_radian *= scale().powi(6);
            for angle in [&mut axis.home, &mut axis.min_angle, &mut axis.max_angle] {
                *angle *= angles;
            }
        }
        let [theta, phi] = [0, 1].map(|axis| machine.settings[axis].max_angle);
        let mut arms = machine.arms(true);
        arms.home().unwrap();
        let closest = machine.separation().min(theta);
        let watch = || assert!(machine.separation() >= closest);
        assert_eq!(settle(&mut arms, 40, watch), Ok(Homed(Unknown)));
        let limit = [theta + 8e-5, phi + 9.0 * TAU, 0.0, -phi];
        for target in [limit, [0.0, -phi, theta, phi - TAU]] {
            go_to(&mut arms, target);
            let angles = machine.angles();
            assert_eq!(arms.angles(), Some(angles));
            let error = |axis: usize| (angles[axis] - target[axis] + PI).rem_euclid(TAU) - PI;
            assert!((0..4).all(|axis| error(axis).abs() < 3e-3));
            assert_eq!(home(&mut arms), Ok(Homed(Passed)));
        }
    }
}

#[test]
fn refused_moves_move_nothing() {
    let machine = Machine::new([1; 4]);
    let mut arms = machine.arms(true);
    assert_eq!(arms.go_to(TARGET), Err(NOT_HOMED));
    home(&mut arms).unwrap();
    for (axis, count) in [(0, 5), (1, 3), (2, 5), (3, 3)] {
        // An azimuth reaches all finite angles.
        for angle in &[f32::NAN, f32::INFINITY, -f32::INFINITY, 1.51, -0.01][..count] {
            let mut target = TARGET;
            target[axis] = *angle;
            let error = Error::with(Code::AxisReach, [axis as u32, angle.to_bits()]);
            assert_eq!(arms.go_to(target), Err(error));
        }
    }
    assert_rest(&machine, &mut arms);
    arms.go_to(TARGET).unwrap();
    let moving = Err(Error::new(Code::Moving));
    assert_eq!([arms.go_to(TARGET), arms.home()], [moving; 2]);
    arms.stop();
    assert_eq!(arms.go_to(TARGET), Err(NOT_HOMED));
    assert_rest(&machine, &mut arms);
}

#[test]
fn invalid_settings_are_refused() {
    let code = |change: &dyn Fn(&mut [Settings; 4]), min_separation| {
        let mut axes = AXES;
        change(&mut axes);
        Space::new(axes, min_separation).unwrap_err().code
    };
    let changes: [fn(&mut Settings, f32); 13] = [
        |axis, value| axis.steps_per_radian = value,
        |axis, value| axis.speed = value,
        |axis, value| axis.acceleration = value,
        |axis, value| axis.homing_speed = value,
        |axis, value| axis.home = value,
        |axis, value| axis.min_angle = value,
        |axis, value| axis.max_angle = value,
        |axis, value| axis.far = Some(value),
        |axis, _| axis.tolerance = -1,
        |axis, _| axis.tolerance = i32::MAX,
        |axis, _| axis.home = 0.5,
        |axis, _| axis.home = -0.5,
        |axis, _| axis.steps_per_radian = 5.0,
    ];
    for value in [f32::NAN, f32::INFINITY, -f32::INFINITY, -1e9] {
        for change in changes {
            let found = code(&|axes| change(&mut axes[0], value), 0.1);
            assert_eq!(found, Code::AxisSettings);
        }
    }
    for min_separation in [f32::NAN, -0.1, 4.0] {
        assert_eq!(code(&|_| (), min_separation), Code::Limits);
    }
    assert_eq!(code(&|_| (), 1.5), Code::HomeTooClose);
    assert_eq!(code(&|axes| axes.swap(0, 2), 0.1), Code::HomeTooClose);
    // The lamp cannot pass the sensor on its way to its far switch.
    let fix = |axes: &mut [Settings; 4]| {
        axes[0].far = Some(1.55);
        for axis in [1, 3] {
            (axes[axis].home, axes[axis].min_angle, axes[axis].max_angle) = (-0.35, -0.3, 0.3);
        }
    };
    assert_eq!(code(&fix, 0.1), Code::NoSafeRoute);
}

/// A ramp up to 4000 steps/s at 20,000 steps/s² and down again. Late polls slow the arms, but lose no steps.
#[test]
fn move_time_matches_trapezoid() {
    let machine = Machine::new([1; 4]);
    for (angle, round, late) in [(0.1, 1, 1.0), (3.0, 1, 1.0), (0.5, 997, 4.5)] {
        let mut arms = machine.arms(true);
        home(&mut arms).unwrap();
        go_to(&mut arms, [0.0, -PI, 1.5, -PI]);
        arms.go_to([0.0, angle - PI, 1.5, -PI]).unwrap();
        let mut polls = 0;
        settle(&mut arms, round, || polls += round).unwrap();
        let distance = AXES[1].steps(angle) as f32;
        let peak = (distance * 20_000.0).sqrt().min(4000.0);
        let seconds = (distance / peak + peak / 20_000.0) * late;
        assert!((0.95..1.15).contains(&(polls as f32 * 1e-6 / seconds)));
        assert_eq!(arms.angles(), Some(machine.angles()));
    }
}

/// Steps lost away from the switch and toward it, at both kinds of homes; also with a homing that is stopped on its way and
/// after the sensor's switch has opened, and with angles kept over a reset. A switch that opens at different positions
/// widens the tolerance.
#[test]
fn homing_measures_lost_steps() {
    let (near, far) = ([0.1, 0.2, 1.2, 3.0], [0.6, 0.2, 0.8, 3.0]);
    for (arm, from, to, scatter, stalled, expected) in [
        (0, near, far, 0, 60, 60),
        (0, far, near, 0, 300, -300),
        (2, near, far, 0, 30, -30),
        (2, far, near, 0, 150, 150),
        (0, near, far, 0, 8, 0), // within the tolerance
        (0, near, near, 0, 0, 0),
        (2, near, far, 12, 0, 0),
        (2, near, far, 12, 40, -40),
    ] {
        for interruption in ["", "reset", "stop"] {
            let mut machine = Machine::new([1; 4]);
            machine.arms[arm].scatter = scatter;
            let mut arms = machine.arms(true);
            home(&mut arms).unwrap();
            go_to(&mut arms, from);
            machine.arms[arm].stalled.set(stalled);
            go_to(&mut arms, to);
            if interruption == "reset" {
                let angles = arms.angles().unwrap();
                arms = machine.arms(true);
                arms.assume(angles);
                assert_eq!(arms.go_to(from), Err(NOT_HOMED));
            } else if interruption == "stop" {
                for sensor in [300, 0] {
                    arms.home().unwrap();
                    while machine.positions()[2] > sensor {
                        arms.poll(100).unwrap();
                    }
                    poll_for(&mut arms, 100).unwrap();
                    arms.stop();
                }
            }
            let found = match home(&mut arms) {
                Ok(Homed(Passed)) => 0,
                Ok(Homed(Lost(axis, steps))) if usize::from(axis) == arm => steps,
                found => panic!("{found:?}"),
            };
            assert!((found - expected).abs() <= scatter, "{found} {expected}");
            let positions = machine.positions();
            assert!(positions.iter().all(|at| (0..=scatter).contains(at)));
        }
    }
    let machine = Machine::new([1; 4]);
    for damaged in [f32::NAN, f32::INFINITY, -0.2, 2.0] {
        let mut arms = machine.arms(true);
        arms.assume([damaged, 0.0, 0.5, 0.0]);
        assert_eq!(arms.angles(), None);
    }
}

/// Each fault stops all arms within a bound, also over several presses of a button. Nothing moves without one.
#[test]
fn faults_stop_arms_until_homed() {
    let mut random = Random(7);
    // The fault, the time at which it occurs, the error, and the bounds toward the switch and away from it in percent of
    // the travel, or if the direction is unproven, 5 degrees.
    for (fault, time, code, toward, away) in [
        (Reversed, "unproven", Code::Direction, 0, 6),
        (Shorted, "unproven", Code::Direction, 6, 0),
        (Broken, "unproven", Code::SwitchStuck, 0, 5),
        (Reversed, "first", Code::SwitchNotFound, 0, 101),
        (Broken, "first", Code::SwitchStuck, 0, 5),
        (Shorted, "first", Code::SwitchNotFound, 101, 0),
        (Jammed, "first", Code::SwitchNotFound, 0, 0),
        (Bouncing, "first", Code::SwitchBounces, 0, 0),
        (Broken, "homing", Code::SwitchOpened, 0, 0),
        (Shorted, "homing", Code::SwitchNotFound, 110, 0),
        (Jammed, "homing", Code::SwitchNotFound, 0, 0),
        (Unreadable, "homing", Code::Pin, 0, 0),
        (Broken, "moving", Code::SwitchOpened, 1, 1),
        (Bouncing, "moving", Code::SwitchBounces, 15, 15),
        (Unreadable, "moving", Code::Pin, 0, 0),
    ] {
        for (arm, axis) in AXES.iter().enumerate() {
            let is_proven = time != "unproven";
            let is_first = !is_proven || time == "first";
            let machine = Machine::new([5; 4]);
            let (faulty, travel) = (&machine.arms[arm], axis.travel());
            let mut arms = machine.arms(is_proven);
            assert_eq!(arms.needs_confirmation(), is_proven);
            if is_first {
                faulty.position.set(1000);
            } else {
                home(&mut arms).unwrap();
                go_to(&mut arms, TARGET);
            }
            if time == "moving" {
                arms.go_to([0.5, 1.0, 0.9, 1.0]).unwrap();
                poll_for(&mut arms, 500).unwrap();
            } else {
                arms.home().unwrap();
            }
            let before = faulty.position.get();
            faulty.wiring.set(fault);
            for _ in 0..if is_first { 6 } else { 0 } {
                _ = poll_for(&mut arms, random.bits() % 60_000);
                arms.stop();
                arms.home().unwrap();
            }
            let found = settle(&mut arms, 100, || ()).unwrap_err();
            let found = (found.code, found.details[0] as usize);
            assert_eq!(found, (code, arm), "{fault:?} {time}");
            let most = if is_proven { i32::MAX } else { 178 };
            let [toward, away] = [toward, away].map(|part| (travel * part / 100 + 10).min(most));
            let moved = faulty.position.get() - before;
            assert!((-toward..=away).contains(&moved), "{moved}");

            assert_eq!((arms.angles(), arms.go_to(TARGET)), (None, Err(NOT_HOMED)));
            faulty.wiring.set(Intact);
            assert_rest(&machine, &mut arms);
            // The sensor may meet the lamp, which is outside of it at TARGET.
            assert!(arms.needs_confirmation() || code != Code::SwitchOpened);
            faulty.position.update(|at| at.clamp(0, travel)); // mechanical stops
            if [Code::SwitchNotFound, Code::SwitchStuck, Code::Direction].contains(&code) {
                arms = machine.arms(true); // a reset
            }
            assert_eq!(home(&mut arms), Ok(Homed(Unknown)));
        }
    }
}

/// Far switches of all axes: lamp and sensor stay apart, and a wrong scale of an axis is found.
#[test]
fn far_switches_check_scales() {
    for degrees in [0.95_f32, -0.95, 2.0, -2.0] {
        for (number, axis) in AXES.iter().enumerate() {
            let mut machine = Machine::new([700, 500, 1000, 6200]);
            machine.add_far_switches();
            let far = machine.arms[number].far.unwrap() + axis.steps(degrees.to_radians());
            machine.arms[number].far = Some(far);
            let mut arms = machine.arms(true);
            if degrees.abs() > 1.0 {
                let error = home(&mut arms).unwrap_err();
                assert_eq!((error.code, error.details[0]), (Code::Scale, number as u32));
                assert_eq!(arms.needs_confirmation(), number % 2 == 0);
                continue;
            }
            machine.arms[number].position.set(far + 3); // at its far switch
            arms.home().unwrap();
            let watch = || assert!(machine.separation() > 0.09);
            assert_eq!(settle(&mut arms, 40, watch), Ok(Homed(Unknown)));
            assert_eq!(machine.positions(), [0; 4]);
            go_to(&mut arms, TARGET);
            assert_eq!(home(&mut arms), Ok(Homed(Passed)));
        }
    }
}
