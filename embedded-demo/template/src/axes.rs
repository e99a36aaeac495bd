//! The numbers of the axes. Tests of glimpse-scanner move a simulated machine with them.
//!
//! Until the axes have found their switches with these settings once, each arm has to be within 5 degrees of its switch when
//! the power comes on.

use core::f32::consts::{PI, TAU};

use glimpse_scanner::axis::Settings;

/// The smallest angle between lamp and sensor, in radians.
pub const MIN_SEPARATION: f32 = 0.09;

/// The axes: theta_i and phi_i turn the lamp, theta_o and phi_o the sensor. Angles in radians, from the normal or the
/// common azimuth 0. Step and speed: a motor of 200 steps with 16 microsteps and a gear of 4.
///
/// `home` is the angle of the switch, outside `min_angle` to `max_angle` by at most a tenth of that. A high direction
/// pin increases the angle, unless `reversed`. Speeds, acceleration and tolerance are in steps: scale them with microsteps
/// and gear. An axis makes at most 20,000 steps/s.
pub const AXES: [Settings; 4] = [
    POLAR,
    AZIMUTH,
    Settings {
        home: 1.55,
        ..POLAR
    },
    AZIMUTH,
];
const AZIMUTH: Settings = Settings {
    home: -PI - 0.05,
    min_angle: -PI,
    max_angle: PI,
    ..POLAR
};
const POLAR: Settings = Settings {
    steps_per_radian: 200.0 * 16.0 * 4.0 / TAU,
    speed: 4_000.0,         // steps/s
    acceleration: 20_000.0, // steps/s^2
    homing_speed: 1_000.0,  // steps/s
    home: -0.05,
    min_angle: 0.0,
    max_angle: 1.5,
    far: None,    // the angle of a second switch, which checks `steps_per_radian`
    tolerance: 8, // half a full step: a stepper loses whole electrical cycles, of four full steps or 64 microsteps
    reversed: false,
};
