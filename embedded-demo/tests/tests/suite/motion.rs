//! Motion, homing, lost steps, and faults of switches, motors and pins.

use std::f32::consts::{PI, TAU};

use glimpse_core::error::Error;
use glimpse_core::error::ErrorCode as Code;
use glimpse_desk::Wiring::*;
use glimpse_desk::axes::AXES;
use glimpse_desk::{Arms, Machine, Random, go_to, home, separation, settle};
use glimpse_scanner::axis::Settings;
use glimpse_scanner::goniometer::Progress::{Arrived, Homed};
use glimpse_scanner::goniometer::StepCheck::{Lost, Passed, Unknown};
use glimpse_scanner::route::{AxisAngles, Space};

/// The lamp is nearer to the horizon than the sensor.
const TARGET: AxisAngles = [1.0, 0.0, 0.5, 0.0];
const NOT_HOMED: Error = Error::new(Code::NotHomed);

/// Polls `rounds` times 100 us, or until an error.
fn poll_for(arms: &mut Arms, rounds: u32) -> Result<(), Error> {
    (0..rounds).try_for_each(|_| arms.poll(100).map(drop))
}

/// Polls for ten seconds, and asserts that no arm moves.
fn assert_rest(machine: &Machine, arms: &mut Arms) {
    let positions = machine.positions();
    (0..100_000).for_each(|_| _ = arms.poll(100));
    assert_eq!(machine.positions(), positions);
}

/// At unknown positions the sensor goes to the horizon first, so the arms do not come closer.
#[test]
fn arms_home_and_reach_targets() {
    for start in [[0; 4], [-40, -1, 1, 2], [1000, 5000, 1000, 5000]] {
        let machine = Machine::new(start);
        let mut arms = machine.arms(None);
        arms.home().unwrap();
        let closest = separation(machine.angles()).min(1.5);
        let watch = || assert!(separation(machine.angles()) >= closest);
        assert_eq!(settle(&mut arms, 10, watch), Ok(Homed(Unknown)));
        for (target, reached) in [
            ([0.3, -3.0, 1.5, 3.0], [0.3, -3.0, 1.5, 3.0]),
            ([1.5, 0.1 - TAU, 0.7, PI + TAU], [1.5, 0.1, 0.7, -PI]),
            ([0.3, 9.0 * TAU, 1.500_08, 5.0 * PI], [0.3, 0.0, 1.5, -PI]),
        ] {
            go_to(&mut arms, target);
            let angles = machine.angles();
            assert!((0..4).all(|axis| (angles[axis] - reached[axis]).abs() < 3e-4));
            assert_eq!(arms.angles(), Some(angles));
        }
        assert_eq!(home(&mut arms), Ok(Homed(Passed)));
        assert_eq!(machine.positions(), [0; 4]);
    }
}

/// A limit may lie between two steps: the template's axes, and random ones with a gap between the azimuths.
#[test]
fn arms_return_from_all_limits() {
    let mut random = Random(5);
    for case in 0..200 {
        let mut machine = Machine::new([90; 4]);
        let (mut theta, mut phi) = (1.5, PI);
        if case > 0 {
            theta = [70.0_f32, 75.0, 80.0, 82.0, 85.0][case % 5].to_radians();
            phi = 3.1399 - random.unit() * random.unit();
            let gear = [1.0, 2.0, 4.0][case % 3] * (1 + random.below(8)) as f32;
            let axis = |home, min_angle, max_angle| Settings {
                steps_per_radian: 200.0 * 8.0 * gear / TAU,
                home,
                min_angle,
                max_angle,
                ..AXES[0]
            };
            let azimuth = axis(-phi - 0.06, -phi, phi);
            let [lamp, sensor] = [-0.06, theta + 0.05].map(|home| axis(home, 0.0, theta));
            machine.settings = [lamp, azimuth, sensor, azimuth];
        }
        let mut arms = machine.homed();
        for target in [[theta, phi, 0.0, -phi], [0.0, -phi, theta, phi]] {
            arms.go_to(target).unwrap();
            assert_eq!(settle(&mut arms, 500, || ()), Ok(Arrived));
            arms.home().unwrap();
            assert_eq!(settle(&mut arms, 500, || ()), Ok(Homed(Passed)));
        }
    }
}

#[test]
fn refused_moves_move_nothing() {
    let machine = Machine::new([1; 4]);
    let mut arms = machine.arms(None);
    assert_eq!(arms.go_to(TARGET), Err(NOT_HOMED));
    assert_rest(&machine, &mut arms);
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
    let fields: [fn(&mut Settings) -> &mut f32; 8] = [
        |axis| &mut axis.steps_per_radian,
        |axis| &mut axis.speed,
        |axis| &mut axis.acceleration,
        |axis| &mut axis.homing_speed,
        |axis| &mut axis.home,
        |axis| &mut axis.min_angle,
        |axis| &mut axis.max_angle,
        |axis| axis.far.get_or_insert_default(),
    ];
    let mut invalid = vec![AXES[0]; 5];
    (invalid[0].tolerance, invalid[1].tolerance) = (-1, i32::MAX);
    (invalid[2].home, invalid[3].home) = (0.5, -0.5);
    invalid[4].steps_per_radian = 5.0;
    for value in [f32::NAN, f32::INFINITY, -f32::INFINITY, -1e9] {
        for field in fields {
            invalid.push(AXES[0]);
            invalid.last_mut().map(|axis| *field(axis) = value).unwrap();
        }
    }
    let [lamp, azimuth, sensor, _] = AXES;
    let (mut checked, mut fixed) = (lamp, azimuth);
    checked.far = Some(1.55);
    (fixed.home, fixed.min_angle, fixed.max_angle) = (-0.35, -0.3, 0.3);
    let machines = invalid
        .into_iter()
        .map(|axis| [lamp, axis, sensor, azimuth]);
    let machines = machines.map(|axes| (axes, 0.1, Code::AxisSettings, [1, 0]));
    for (axes, min_separation, code, details) in machines.chain([
        (AXES, f32::NAN, Code::Limits, [0; 2]),
        (AXES, -0.1, Code::Limits, [0; 2]),
        (AXES, 4.0, Code::Limits, [0; 2]),
        (AXES, 1.5, Code::HomeTooClose, [0; 2]),
        (
            [checked, fixed, sensor, fixed],
            0.1,
            Code::NoSafeRoute,
            [0; 2],
        ),
        (
            [sensor, azimuth, lamp, azimuth],
            0.1,
            Code::HomeTooClose,
            [0; 2],
        ),
    ]) {
        let error = Space::new(axes, min_separation).unwrap_err();
        assert_eq!((error.code, error.details), (code, details));
    }
}

/// A ramp up to 4000 steps/s at 20,000 steps/s² and down again. Late polls slow the arms, but lose no steps.
#[test]
fn move_time_matches_trapezoid() {
    let machine = Machine::new([1; 4]);
    for (angle, round, late) in [(0.1, 1, 1.0), (3.0, 1, 1.0), (0.5, 997, 4.5)] {
        let mut arms = machine.homed();
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

/// Steps lost away from the switch and toward it, at both kinds of homes, also with angles kept over a reset, and with a
/// homing that is stopped on its way and after the sensor's switch has opened.
#[test]
fn homing_measures_lost_steps() {
    let (near, far) = ([0.1, 0.2, 1.2, 3.0], [0.6, 0.2, 0.8, 3.0]);
    for (arm, from, to, stalled, expected) in [
        (0, near, far, 60, Lost(0, 60)),
        (0, far, near, 300, Lost(0, -300)),
        (2, near, far, 30, Lost(2, -30)),
        (2, far, near, 150, Lost(2, 150)),
        (0, near, far, 8, Passed), // within the tolerance
        (0, near, near, 0, Passed),
    ] {
        for interruption in ["", "reset", "stop"] {
            let machine = Machine::new([1; 4]);
            let mut arms = machine.homed();
            go_to(&mut arms, from);
            machine.arms[arm].stalled.set(stalled);
            go_to(&mut arms, to);
            if interruption == "reset" {
                arms = machine.arms(arms.angles());
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
            assert_eq!(home(&mut arms), Ok(Homed(expected)));
            assert_eq!(machine.positions(), [0; 4]);
        }
    }
    for damaged in [f32::NAN, f32::INFINITY, -0.2, 2.0] {
        let machine = Machine::new([500; 4]);
        assert_eq!(machine.arms(Some([damaged, 0.0, 0.5, 0.0])).angles(), None);
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
            let machine = Machine::new([5; 4]);
            let (faulty, travel) = (&machine.arms[arm], axis.travel());
            let is_proven = time != "unproven";
            let mut arms = if is_proven {
                machine.arms(None)
            } else {
                machine.unproven()
            };
            assert_eq!(arms.needs_confirmation(), is_proven);
            let is_first = !is_proven || time == "first";
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
                _ = poll_for(&mut arms, random.below(60_000));
                arms.stop();
                arms.home().unwrap();
            }
            let found = settle(&mut arms, 100, || ()).unwrap_err();
            assert_eq!(
                (found.details[0] as usize, found.code),
                (arm, code),
                "{fault:?} {time}"
            );
            let moved = faulty.position.get() - before;
            let bound = |percent: i32| travel * percent / 100 + 10;
            let bound = |percent| bound(percent).min(if is_proven { i32::MAX } else { 178 });
            assert!((-bound(toward)..=bound(away)).contains(&moved), "{moved}");

            assert_eq!((arms.angles(), arms.go_to(TARGET)), (None, Err(NOT_HOMED)));
            faulty.wiring.set(Intact);
            assert_rest(&machine, &mut arms);
            // The sensor may meet the lamp, which is outside of it at TARGET.
            assert!(arms.needs_confirmation() || code != Code::SwitchOpened);
            faulty.position.update(|at| at.clamp(0, travel)); // mechanical stops
            if [Code::SwitchNotFound, Code::SwitchStuck, Code::Direction].contains(&code) {
                arms = machine.arms(None); // a reset
            }
            assert_eq!(home(&mut arms), Ok(Homed(Unknown)));
        }
    }
}

#[test]
fn first_homing_proves_directions() {
    let mut machine = Machine::new([170, -20, 1, 0]);
    let mut arms = machine.unproven();
    assert!(!arms.directions_checked());
    assert_eq!(home(&mut arms), Ok(Homed(Unknown)));
    assert!(arms.directions_checked() && !arms.needs_confirmation());
    let checksum = arms.settings_checksum();
    machine.settings[3].reversed = true;
    assert_ne!(machine.arms(None).settings_checksum(), checksum);
}

/// A switch that opens at different positions widens the tolerance of lost steps, to a limit.
#[test]
fn homing_learns_scatter() {
    for (arm, scatter, stalled) in [(2, 0, 12), (2, 12, 0), (2, 12, 40), (1, 300, 0)] {
        let machine = Machine::new([700; 4]);
        machine.arms[arm].scatter.set(scatter);
        let mut arms = machine.arms(None);
        let found = home(&mut arms);
        if scatter == 300 {
            assert_eq!(found, Err(Error::with(Code::SwitchBounces, [1, 0])));
            continue;
        }
        for _ in 0..4 {
            go_to(&mut arms, TARGET);
            machine.arms[arm].stalled.set(stalled);
            go_to(&mut arms, [1.0, 0.0, 0.3, 0.0]);
            let found = home(&mut arms).unwrap();
            assert_eq!(matches!(found, Homed(Lost(2, _))), stalled > 0, "{found:?}");
        }
    }
}

/// Far switches of all axes: lamp and sensor stay apart, and a wrong scale of an axis is found.
#[test]
fn far_switches_check_scales() {
    let angles = [1.55, PI + 0.05, -0.05, PI + 0.05];
    for (scale, degrees, is_valid) in [
        (1.0, 0.0_f32, true),
        (1.0, 0.95, true),
        (1.0, -0.95, true),
        (1.0, 2.0, false),
        (1.0, -2.0, false),
        (0.5, 0.0, false),
        (2.0, 0.0, false),
    ] {
        for arm in 0..4 {
            let mut machine = Machine::new([700, 500, 1000, 6200]);
            for (number, axis) in machine.settings.iter_mut().enumerate() {
                axis.far = Some(angles[number]);
                let mut angle = (angles[number] - axis.home).abs();
                if number == arm {
                    angle = scale * angle + degrees.to_radians();
                }
                machine.arms[number].far.set(Some(axis.steps(angle)));
            }
            let arm_at = &machine.arms[arm];
            if is_valid {
                arm_at.position.set(arm_at.far.get().unwrap() + 3); // at its far switch
            }
            let mut arms = machine.arms(None);
            arms.home().unwrap();
            let mut closest = PI;
            let found = settle(&mut arms, 40, || {
                closest = closest.min(separation(machine.angles()))
            });
            if is_valid {
                assert!(
                    found == Ok(Homed(Unknown)) && closest > 0.09,
                    "{found:?} {closest}"
                );
                assert_eq!(machine.positions(), [0; 4]);
                go_to(&mut arms, TARGET);
                assert_eq!(home(&mut arms), Ok(Homed(Passed)));
            } else {
                let error = found.unwrap_err();
                assert_eq!((error.code, error.details[0]), (Code::Scale, arm as u32));
                assert_eq!(arms.needs_confirmation(), arm % 2 == 0);
            }
        }
    }
}
