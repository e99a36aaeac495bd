//! Motion, homing, lost steps, and faults of switches, motors and pins.

use std::array;
use std::f32::consts::{PI, TAU};

use glimpse_core::error::{Error, ErrorCode};
use glimpse_desk::{Arms, Machine, Wiring::*, go_to, home, separation, settings, settle};
use glimpse_scanner::axis::Settings;
use glimpse_scanner::goniometer::Progress::{self, Homed};
use glimpse_scanner::goniometer::StepCheck::{Lost, Passed, Unknown};
use glimpse_scanner::route::{AxisAngles, Space};

const SEPARATION: f32 = 0.08;
const TARGET: AxisAngles = [1.0, 0.0, 0.5, 0.0];

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
        let mut arms = machine.arms(SEPARATION, None);
        arms.home().unwrap();
        let closest = separation(machine.angles()).min(1.5);
        let watch = || assert!(separation(machine.angles()) >= closest);
        assert_eq!(settle(&mut arms, 10, watch), Ok(Homed(Unknown)));
        for (target, reached) in [
            ([0.3, -3.0, 1.5, 3.0], [0.3, -3.0, 1.5, 3.0]),
            ([1.5, 0.1 - TAU, 0.7, PI + TAU], [1.5, 0.1, 0.7, PI]),
            ([0.3, -PI, 1.540_88, -PI], [0.3, -PI, 1.540_8, -PI]),
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

#[test]
fn refused_moves_move_nothing() {
    let machine = Machine::new([1; 4]);
    let mut arms = machine.arms(SEPARATION, None);
    assert_eq!(arms.go_to(TARGET), Err(Error::new(ErrorCode::NotHomed)));
    assert_rest(&machine, &mut arms);
    home(&mut arms).unwrap();
    for axis in 0..4 {
        for angle in [f32::NAN, f32::INFINITY, -f32::INFINITY, 9.5, -9.5] {
            let mut target = TARGET;
            target[axis] = angle;
            let details = [axis as u32, angle.to_bits()];
            let error = Error::with(ErrorCode::AxisReach, details);
            assert_eq!(arms.go_to(target), Err(error));
        }
    }
    assert_rest(&machine, &mut arms);
    arms.go_to(TARGET).unwrap();
    assert_eq!(
        [arms.go_to(TARGET), arms.home()],
        [Err(Error::new(ErrorCode::Moving)); 2]
    );
    arms.stop();
    assert_eq!(arms.go_to(TARGET), Err(Error::new(ErrorCode::NotHomed)));
    assert_rest(&machine, &mut arms);
}

#[test]
fn invalid_settings_are_refused() {
    let fields: [fn(&mut Settings) -> &mut f32; 7] = [
        |settings| &mut settings.steps_per_radian,
        |settings| &mut settings.speed,
        |settings| &mut settings.acceleration,
        |settings| &mut settings.homing_speed,
        |settings| &mut settings.home,
        |settings| &mut settings.min_angle,
        |settings| &mut settings.max_angle,
    ];
    let mut invalid = vec![settings(0); 5];
    (invalid[0].tolerance, invalid[1].tolerance) = (-1, i32::MAX);
    (invalid[2].home, invalid[3].home) = (0.5, -0.5);
    invalid[4].steps_per_radian = 5.0;
    for value in [f32::NAN, f32::INFINITY, -f32::INFINITY, -1e9] {
        let changed = fields.map(|field| {
            let mut changed = settings(0);
            *field(&mut changed) = value;
            changed
        });
        invalid.extend(changed);
    }
    let axes = array::from_fn(settings);
    let code = |axes, min_separation| {
        Space::new(axes, min_separation)
            .err()
            .map(|error| error.code)
    };
    for changed in invalid {
        let mut axes = axes;
        axes[1] = changed;
        let error = Space::new(axes, SEPARATION).unwrap_err();
        assert_eq!(
            (error.code, error.details),
            (ErrorCode::AxisSettings, [1, 0])
        );
    }
    for min_separation in [f32::NAN, -0.1, 4.0] {
        assert_eq!(code(axes, min_separation), Some(ErrorCode::Limits));
    }
    assert_eq!(code(axes, 1.5), Some(ErrorCode::HomeTooClose));
    let swapped = [axes[2], axes[1], axes[0], axes[3]];
    assert_eq!(code(swapped, SEPARATION), Some(ErrorCode::HomeTooClose));
}

/// A ramp up to 4000 steps/s at 20,000 steps/s² and down again. Late polls slow the arms, but lose no steps.
#[test]
fn move_time_matches_trapezoid() {
    let machine = Machine::new([1; 4]);
    for (angle, round, late) in [(0.1, 1, 1.0), (3.0, 1, 1.0), (0.5, 997, 4.5)] {
        let mut arms = machine.homed(SEPARATION);
        go_to(&mut arms, [0.0, -PI, 1.5, -PI]);
        arms.go_to([0.0, angle - PI, 1.5, -PI]).unwrap();
        let mut polls = 0;
        settle(&mut arms, round, || polls += round).unwrap();
        let distance = settings(1).steps(angle) as f32;
        let peak = (distance * 20_000.0).sqrt().min(4000.0);
        let seconds = (distance / peak + peak / 20_000.0) * late;
        assert!((0.95..1.15).contains(&(polls as f32 * 1e-6 / seconds)));
        assert_eq!(arms.angles(), Some(machine.angles()));
    }
}

/// Steps lost away from the switch and toward it, at both kinds of homes, also with angles kept over a reset.
#[test]
fn homing_measures_lost_steps() {
    let (near, far) = ([0.1, 0.2, 1.2, 3.0], [0.6, 0.2, 0.8, 3.0]);
    for (arm, from, to, stalled, expected) in [
        (0, near, far, 60, Ok(Homed(Lost(0, 60)))),
        (0, far, near, 300, Ok(Homed(Lost(0, -300)))),
        (2, near, far, 30, Ok(Homed(Lost(2, -30)))),
        (2, far, near, 150, Ok(Homed(Lost(2, 150)))),
        (0, near, far, 1, Ok(Homed(Passed))), // within the tolerance
        (0, near, near, 0, Ok(Homed(Passed))),
        // The arm meets its switch during a move.
        (0, near, far, 500, Err(Error::new(ErrorCode::SwitchOpened))),
    ] {
        for is_reset in [false, true] {
            let machine = Machine::new([1; 4]);
            let mut arms = machine.homed(SEPARATION);
            go_to(&mut arms, from);
            machine.arms[arm].stalled.set(stalled);
            go_to(&mut arms, to);
            if is_reset {
                arms = machine.arms(SEPARATION, arms.angles());
                assert_eq!(arms.go_to(from), Err(Error::new(ErrorCode::NotHomed)));
            }
            let mut found = home(&mut arms);
            if let Err(error) = &mut found {
                error.details = [0; 2];
                assert_eq!(home(&mut arms), Ok(Homed(Unknown)));
            }
            assert_eq!((found, machine.positions()), (expected, [0; 4]));
        }
    }
    for damaged in [f32::NAN, f32::INFINITY, -0.2, 2.0] {
        let machine = Machine::new([500; 4]);
        let mut arms = machine.arms(SEPARATION, Some([damaged, 0.0, 0.5, 0.0]));
        assert_eq!(arms.angles(), None);
        assert_eq!(home(&mut arms), Ok(Homed(Unknown)));
    }
}

/// Each fault stops all arms within a bound. Nothing moves afterwards until the arms are homed.
#[test]
fn faults_stop_arms_until_homed() {
    // The fault, the time at which it occurs, the error, and the bounds toward the switch and away from it in percent of
    // the travel.
    for (fault, time, error, toward, away) in [
        (Broken, "homing first", ErrorCode::SwitchStuck, 0, 5),
        (Broken, "homing", ErrorCode::SwitchOpened, 0, 0),
        (Broken, "moving", ErrorCode::SwitchOpened, 1, 1),
        (Shorted, "homing first", ErrorCode::SwitchNotFound, 101, 0),
        (Shorted, "homing", ErrorCode::SwitchNotFound, 110, 0),
        (Bouncing, "homing first", ErrorCode::SwitchBounces, 0, 0),
        (Bouncing, "moving", ErrorCode::SwitchBounces, 15, 15),
        (Unreadable, "homing", ErrorCode::Pin, 0, 0),
        (Unreadable, "moving", ErrorCode::Pin, 0, 0),
        (Jammed, "homing first", ErrorCode::SwitchNotFound, 0, 0),
        (Jammed, "homing", ErrorCode::SwitchNotFound, 0, 0),
    ] {
        for arm in 0..4 {
            let machine = Machine::new([1000; 4]);
            let mut arms = machine.arms(SEPARATION, None);
            if time != "homing first" {
                home(&mut arms).unwrap();
                go_to(&mut arms, TARGET);
            }
            if time == "moving" {
                arms.go_to([0.5, 1.0, 0.9, 1.0]).unwrap();
                (0..5000).for_each(|_| assert_eq!(arms.poll(10), Ok(Progress::Moving)));
            } else {
                arms.home().unwrap();
            }
            let (faulty, before) = (&machine.arms[arm], machine.positions()[arm]);
            faulty.wiring.set(fault);
            let found = settle(&mut arms, 10, || ()).unwrap_err();
            assert_eq!(
                (found.details[0] as usize, found.code),
                (arm, error),
                "{fault:?} {time}"
            );
            let moved = faulty.position.get() - before;
            let bound = |percent: i32| settings(arm).travel() * percent / 100 + 3;
            assert!((-bound(toward)..=bound(away)).contains(&moved), "{moved}");

            assert_eq!(
                (arms.angles(), arms.go_to(TARGET)),
                (None, Err(Error::new(ErrorCode::NotHomed)))
            );
            faulty.wiring.set(Intact);
            assert_rest(&machine, &mut arms);
            faulty.position.update(|at| at.max(0)); // a mechanical stop
            assert_eq!(home(&mut arms), Ok(Homed(Unknown)));
        }
    }
}
