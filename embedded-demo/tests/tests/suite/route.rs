//! Lamp and sensor stay apart. The separation is computed from directions, independently of the planner.

use std::array;

use glimpse_desk::axes::AXES;
use glimpse_desk::{Machine, Random, separation, settle};
use glimpse_scanner::goniometer::{Progress, StepCheck};
use glimpse_scanner::route::{AxisAngles, Space};

/// Rounding error of an angle between directions in `f32`, radians.
const ROUNDING: f32 = 1e-5;

/// Returns the angles when each axis has moved by its own part of the way.
fn between(from: AxisAngles, to: AxisAngles, parts: [f32; 4]) -> AxisAngles {
    array::from_fn(|axis| from[axis] + parts[axis] * (to[axis] - from[axis]))
}

fn random_angles(random: &mut Random) -> AxisAngles {
    array::from_fn(|axis| {
        let axis = AXES[axis];
        let angle = axis.min_angle + random.unit() * (axis.max_angle - axis.min_angle);
        axis.angle(axis.steps(angle))
    })
}

fn random_safe(random: &mut Random, min_separation: f32) -> AxisAngles {
    let is_safe = |angles: &_| separation(*angles) > min_separation + ROUNDING;
    let mut angles = (0..).map(|_| random_angles(random));
    angles.find(is_safe).unwrap()
}

/// There is a route between any two safe configurations. It is safe at any relative speeds of the axes.
#[test]
fn route_connects_safe_configurations() {
    let mut random = Random(1);
    for case in 0..7500 {
        let min_separation = [0.0, 0.05, 0.2, 0.5, 1.0][case % 5];
        let space = Space::new(AXES, min_separation).unwrap();
        let [start, end] = [(); 2].map(|()| random_safe(&mut random, min_separation));
        let mut from = start;
        for to in space.route(start, end).unwrap() {
            for corner in 0..256 {
                let parts = array::from_fn(|axis| match corner < 16 {
                    true => (corner >> axis & 1) as f32,
                    false => random.unit(),
                });
                let angles = between(from, to, parts);
                assert!(separation(angles) >= min_separation - ROUNDING);
            }
            from = to;
        }
        assert_eq!(from, end);
    }
}

/// The simulated arms on random routes, with stops of moves and of homings, and resets.
#[test]
fn moving_arms_stay_apart() {
    let mut random = Random(3);
    for min_separation in [0.08, 0.3, 1.0] {
        let mut machine = Machine::new([0; 4]);
        machine.min_separation = min_separation;
        let mut arms = machine.homed();
        let check = || assert!(separation(machine.angles()) >= min_separation - ROUNDING);
        for case in 0..25 {
            arms.go_to(random_safe(&mut random, min_separation))
                .unwrap();
            for _ in 0..random.below(4) {
                for _ in 0..random.below(80_000) {
                    arms.poll(40).unwrap();
                    check();
                }
                match case % 2 {
                    0 => arms.stop(),
                    _ => arms = machine.arms(arms.angles()),
                }
                arms.home().unwrap();
            }
            arms.stop();
            arms.home().unwrap();
            let homed = settle(&mut arms, 40, check);
            assert_eq!(homed, Ok(Progress::Homed(StepCheck::Passed)));
        }
    }
}
