//! Settings of the arms, their limits, and a white tile's counts. **Change them** for your scanner.

use core::f32::consts::{FRAC_PI_2, PI, TAU};

use glimpse_arms::axis;
use glimpse_arms::sensor::White;
use glimpse_arms::station;
use glimpse_core::geometry::Directions;
use glimpse_core::gonio::{Footprint, Limits, Machine, Speeds};

/// Steps to a radian: 1.8 degrees, 16 microsteps, a gear of 1:4.
const STEPS_PER_RADIAN: f32 = 200.0 * 16.0 * 4.0 / TAU;
/// Steps/s, of all arms.
const SPEED: f32 = 4000.0;

/// Settings of an arm; 0 and 2 are polar angles, 1 and 3 azimuths. The lamp's home is near the
/// normal, where it points down; the sensor's is near the horizon.
pub fn arm(number: usize) -> axis::Settings {
    let (home, least, largest) = match number {
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
        least,
        largest,
        tolerance: 4, // switches open within a few steps
        reversed: false,
    }
}

/// Speeds and limits of the arms together.
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
                min_separation: 0.2, // keeps lamp and sensor from each other, on every way
                ..Limits::NONE
            },
            isotropic: true,
            through_normal: false,
        },
        arms_settle: 300_000,
        lamp_settles: 50_000,
    }
}

/// Counts of a white tile, lit and seen along the normal: read them with your own.
pub fn white() -> White {
    let normal = [0.0, 0.0, 1.0];
    White {
        counts: [3000.0; 3],
        reflectance: [0.99; 3],
        at: Directions {
            incoming: normal,
            outgoing: normal,
        },
        footprint: Footprint::LightLarger,
        full_scale: 4095,
    }
}
