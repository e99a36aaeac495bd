//! Settings of the arms, their limits, and the calibration by a white tile. **Change them** for your scanner.

use core::f32::consts::{FRAC_PI_2, PI, TAU};

use glimpse_arms::axis;
use glimpse_arms::sensor::WhiteTile;
use glimpse_arms::station;
use glimpse_core::geometry::Directions;
use glimpse_core::gonio::{Footprint, Limits, Machine, Speeds};

/// Steps per radian: 1.8 degrees per step, 16 microsteps, a gear of 1:4.
const STEPS_PER_RADIAN: f32 = 200.0 * 16.0 * 4.0 / TAU;
/// Speed of all arms, steps/s.
const SPEED: f32 = 4000.0;

/// Returns the settings of an arm; 0 and 2 are polar angles, 1 and 3 azimuths. The home of the lamp is near the normal,
/// where it points down; that of the sensor is near the horizon.
pub fn arm(number: usize) -> axis::Settings {
    let (home, min_angle, max_angle) = match number {
        0 => (-0.05, 0.0, FRAC_PI_2),
        2 => (FRAC_PI_2 - 0.01, 0.0, FRAC_PI_2 - 0.03),
        _ => (-PI - 0.05, -PI, PI),
    };
    axis::Settings {
        steps_per_radian: STEPS_PER_RADIAN,
        speed: SPEED,
        acceleration: 20_000.0,
        homing_speed: 400.0,
        home,
        min_angle,
        max_angle,
        tolerance: 4, // switches open within a few steps
        reversed: false,
    }
}

/// Returns the speeds and limits of the machine.
pub fn machine() -> station::Settings {
    let speed = SPEED / STEPS_PER_RADIAN;
    station::Settings {
        machine: Machine {
            speeds: Speeds {
                theta_i: speed,
                phi_i: speed,
                theta_o: speed,
                phi_o: speed,
            },
            limits: Limits {
                min_separation: 0.2, // keeps lamp and sensor apart on every route
                ..Limits::NONE
            },
            isotropic: true,
            through_normal: false,
        },
        arm_settling_us: 300_000,
        lamp_settling_us: 50_000,
    }
}

/// Returns the calibration: counts of a white tile, lit and seen along the normal. Measure them with your own tile.
pub fn white() -> WhiteTile {
    let normal = [0.0, 0.0, 1.0];
    WhiteTile {
        counts: [3000.0; 3],
        reflectance: [0.99; 3],
        directions: Directions {
            incoming: normal,
            outgoing: normal,
        },
        footprint: Footprint::LightLarger,
        full_scale: 4095,
    }
}
