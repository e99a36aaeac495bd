//! Motion, homing, lost steps, and faults of switches, motors and pins.

use std::array;
use std::f32::consts::{PI, TAU};

use glimpse_desk::{Arms, Machine, Wiring::*, go_to, home, separation, settings, settle};
use glimpse_scanner::MotionError::*;
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
    assert_eq!(arms.go_to(TARGET), Err(NotHomed));
    assert_rest(&machine, &mut arms);
    home(&mut arms).unwrap();
    for axis in 0..4 {
        for angle in [f32::NAN, f32::INFINITY, -f32::INFINITY, 9.5, -9.5] {
            let mut target = TARGET;
            target[axis] = angle;
            assert!(matches!(arms.go_to(target), Err(OutOfReach(_))));
        }
    }
    assert_rest(&machine, &mut arms);
    arms.go_to(TARGET).unwrap();
    assert_eq!([arms.go_to(TARGET), arms.home()], [Err(Moving); 2]);
    arms.stop();
    assert_eq!(arms.go_to(TARGET), Err(NotHomed));
    assert_rest(&machine, &mut arms);

    // A single axis at step 0, to which NaN would be rounded.
    let error = machine.axis(0, settings(0)).unwrap().go_to(f32::NAN);
    assert!(matches!(error, Err(OutOfReach(_))));
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
    for changed in invalid {
        let error = Machine::default().axis(0, changed).err();
        assert!(matches!(error, Some(Settings(_))));
    }
    let axes = array::from_fn(settings);
    for min_separation in [f32::NAN, -0.1, 4.0] {
        assert!(matches!(Space::new(axes, min_separation), Err(Limits(_))));
    }
    assert_eq!(Space::new(axes, 1.5), Err(HomeTooClose));
    let swapped = [axes[2], axes[1], axes[0], axes[3]];
    assert_eq!(Space::new(swapped, SEPARATION), Err(HomeTooClose));
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
        (0, near, far, 500, Err((0, SwitchOpened(0)))),
    ] {
        for is_reset in [false, true] {
            let machine = Machine::new([1; 4]);
            let mut arms = machine.homed(SEPARATION);
            go_to(&mut arms, from);
            machine.arms[arm].stalled.set(stalled);
            go_to(&mut arms, to);
            if is_reset {
                arms = machine.arms(SEPARATION, arms.angles());
                assert_eq!(arms.go_to(from), Err(NotHomed));
            }
            let mut found = home(&mut arms);
            if let Err((_, SwitchOpened(steps))) = &mut found {
                *steps = 0;
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
        (Broken, "homing first", HomeStuck, 0, 5),
        (Broken, "homing", SwitchOpened(0), 0, 0),
        (Broken, "moving", SwitchOpened(0), 1, 1),
        (Shorted, "homing first", HomeNotFound, 101, 0),
        (Shorted, "homing", HomeNotFound, 110, 0),
        (Bouncing, "homing first", SwitchBounces, 0, 0),
        (Bouncing, "moving", SwitchBounces, 15, 15),
        (Unreadable, "homing", Pin, 0, 0),
        (Unreadable, "moving", Pin, 0, 0),
        (Jammed, "homing first", HomeNotFound, 0, 0),
        (Jammed, "homing", HomeNotFound, 0, 0),
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
            let (number, mut found) = settle(&mut arms, 10, || ()).unwrap_err();
            if let SwitchOpened(steps) = &mut found {
                *steps = 0;
            }
            assert_eq!(
                (usize::from(number), found),
                (arm, error),
                "{fault:?} {time}"
            );
            let moved = faulty.position.get() - before;
            let bound = |percent: i32| settings(arm).travel() * percent / 100 + 3;
            assert!((-bound(toward)..=bound(away)).contains(&moved), "{moved}");

            assert_eq!((arms.angles(), arms.go_to(TARGET)), (None, Err(NotHomed)));
            faulty.wiring.set(Intact);
            assert_rest(&machine, &mut arms);
            faulty.position.update(|at| at.max(0)); // a mechanical stop
            assert_eq!(home(&mut arms), Ok(Homed(Unknown)));
        }
    }
}
