//! A simulated scanner. Its arms respond to edges on their pins only. Its sensor reads the sample from the true
//! positions of the arms, not from their step counts.
//!
//! The state consists of plain numbers in cells. It can therefore lie in memory that survives a reset, as a real
//! machine's state does.

mod pins;

pub use pins::{DirectionPin, Lamp, Photodiode, StepPin, Switch};

use core::cell::Cell;
use core::f32::consts::{FRAC_PI_2, PI, TAU};

use glimpse_core::geometry::{ArmAngles, Directions, Spherical};
use glimpse_core::gonio::{Footprint, Limits, Machine, Speeds};

use crate::axis::{self, Axis};
use crate::goniometer::Goniometer;
use crate::route::AxisAngles;
use crate::scanner::Command;
use crate::sensor::{Photometer, WhiteTile};
use crate::station::{self, ARMS, Station};

/// A simulated arm.
#[derive(Debug, Default)]
#[repr(C)]
pub struct Arm {
    /// Distance from its switch, steps. The switch is open at 0 and below.
    position: Cell<i32>,
    /// Level of the step pin, 0 or 1.
    step: Cell<u32>,
    /// Level of the direction pin, 0 or 1.
    direction: Cell<u32>,
    /// Number of steps that the motor will miss.
    stalled: Cell<u32>,
    /// State of the switch's wires; see [`Wiring`].
    wiring: Cell<u32>,
    /// 1 if the switch was open at the last read.
    open: Cell<u32>,
    /// Number of reads during which the contact will bounce.
    bounces: Cell<u32>,
}

/// Wires of a simulated switch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wiring {
    /// The wires are intact.
    Intact = 0,
    /// A wire is broken: the switch reads as open.
    Broken = 1,
    /// The wires are short-circuited: the switch reads as closed.
    Shorted = 2,
}

/// A simulated scanner.
#[derive(Debug, Default)]
#[repr(C)]
pub struct SimulatedScanner {
    arms: [Arm; ARMS],
    lamp: Cell<u32>,
    /// State of the noise generator.
    noise: Cell<u32>,
    /// 1 after a short press of the button, 2 after a long one.
    button: Cell<u32>,
}

/// BRDF of a synthetic material in linear RGB, sr^-1: a diffuse color, and a highlight of two widths. The same as in
/// `glimpse-bench`.
fn brdf(theta_h: f32, theta_d: f32) -> [f32; 3] {
    let lobe = |sharpness: f32| {
        let falloff = 1.0 + sharpness * theta_h * theta_h;
        1.0 / (falloff * falloff)
    };
    let grazing = 1.0 + 0.2 * theta_d * theta_d;
    let highlight = 0.9 * (8.0 * lobe(40.0) + lobe(4.0)) / 9.0 * grazing;
    [0.12 + highlight, 0.05 + highlight, 0.03 + 0.9 * highlight]
}

/// Returns the angles theta_h and theta_d, radians. None below the horizon.
fn half_angles(directions: &Directions<f32>) -> Option<[f32; 2]> {
    let Directions { incoming, outgoing } = *directions;
    let [[_, _, cos_i], [_, _, cos_o]] = [incoming, outgoing];
    if cos_i <= 0.0 || cos_o <= 0.0 {
        return None;
    }
    let mut coordinates = outgoing.into_iter();
    let sum = incoming.map(|i| i + coordinates.next().unwrap_or_default());
    let [x, y, z] = sum; // along the half vector
    let across = libm::sqrtf(x * x + y * y);
    let length = libm::sqrtf(x * x + y * y + z * z);
    let theta_d = libm::acosf((length / 2.0).min(1.0)); // both are unit vectors
    Some([libm::atan2f(across, z), theta_d])
}

/// Counts of the sensor in the dark.
const DARK: f32 = 96.0;
/// Counts of a white tile of reflectance 1, lit from the normal, minus those in the dark.
const WHITE: f32 = 1200.0;
/// Maximum count: 12 bits.
const FULL_SCALE: u16 = 4095;
/// Steps per radian: 1.8 degrees per step, 16 microsteps, a gear of 1:4.
const STEPS_PER_RADIAN: f32 = 200.0 * 16.0 * 4.0 / TAU;
/// Angle by which a home switch is below the smallest angle of its axis, radians. The sensor's polar axis has its
/// switch at the largest angle.
const HOME_MARGIN: f32 = 0.05;
/// Minimum angle between lamp and sensor, radians: a little less than in the bundled recipes.
const MIN_SEPARATION: f32 = 0.08;

impl SimulatedScanner {
    /// Creates a scanner whose arms are at these distances from their switches, in steps.
    pub fn new(positions: [i32; ARMS]) -> Self {
        let simulated = Self::default();
        simulated.reset(positions);
        simulated
    }

    /// Moves the arms to these positions, repairs all faults, turns the lamp off, and
    /// releases the button.
    pub fn reset(&self, positions: [i32; ARMS]) {
        for (arm, position) in self.arms.iter().zip(positions) {
            arm.position.set(position);
            arm.stalled.set(0);
            arm.step.set(0);
            arm.direction.set(0);
            arm.bounces.set(0);
            arm.wiring.set(Wiring::Intact as u32);
        }
        self.lamp.set(0);
        self.noise.set(1);
        self.button.set(0);
    }

    /// Makes an arm miss its next `steps` steps.
    pub fn stall(&self, arm: usize, steps: u32) {
        if let Some(arm) = self.arms.get(arm) {
            arm.stalled.set(steps);
        }
    }

    /// Sets the state of a switch's wires.
    pub fn set_wiring(&self, arm: usize, wiring: Wiring) {
        if let Some(arm) = self.arms.get(arm) {
            arm.wiring.set(wiring as u32);
        }
    }

    /// Makes the contact of a switch bounce for the next `reads` reads.
    pub fn bounce(&self, arm: usize, reads: u32) {
        if let Some(arm) = self.arms.get(arm) {
            arm.bounces.set(reads);
        }
    }

    /// Gives a command. [`SimulatedScanner::take_command`] returns it once.
    pub fn command(&self, command: Command) {
        self.button.set(match command {
            Command::NewScan => 1,
            Command::Continue => 2,
        });
    }

    /// Returns the command that was given since the last call.
    pub fn take_command(&self) -> Option<Command> {
        match self.button.replace(0) {
            1 => Some(Command::NewScan),
            2 => Some(Command::Continue),
            _ => None,
        }
    }

    /// Returns the distances of the arms from their switches, in steps.
    pub fn positions(&self) -> [i32; ARMS] {
        self.arms.each_ref().map(|arm| arm.position.get())
    }

    /// Returns the angles of the arms, radians: theta_i, phi_i, theta_o, phi_o.
    pub fn angles(&self) -> AxisAngles {
        core::array::from_fn(|arm| {
            let settings = settings(arm);
            let steps = self.arms.get(arm).map_or(0, |arm| arm.position.get());
            let sign = if settings.home < settings.min_angle {
                1
            } else {
                -1
            };
            settings.angle(
                steps
                    .saturating_mul(sign)
                    .saturating_add(settings.steps(settings.home)),
            )
        })
    }

    /// Returns the directions of lamp and sensor.
    pub fn directions(&self) -> Directions<f32> {
        let [theta_i, phi_i, theta_o, phi_o] = self.angles();
        let at = |theta, phi| Spherical { theta, phi };
        let arms = ArmAngles {
            incoming: at(theta_i, phi_i),
            outgoing: at(theta_o, phi_o),
        };
        arms.directions()
    }

    /// Returns the arms with their pins.
    pub fn goniometer(&self) -> Goniometer<StepPin<'_>, DirectionPin<'_>, Switch<'_>, ARMS> {
        let mut numbers = 0..;
        Goniometer::new(self.arms.each_ref().map(|arm| {
            let settings = settings(numbers.next().unwrap_or(0));
            Axis::new(StepPin(arm), DirectionPin(arm), Switch(arm), settings)
        }))
    }

    /// Returns the station with default limits.
    pub fn station(
        &self,
    ) -> Station<StepPin<'_>, DirectionPin<'_>, Switch<'_>, Photodiode<'_>, Lamp<'_>> {
        self.station_with_limits(Limits {
            min_separation: MIN_SEPARATION,
            ..Limits::NONE
        })
    }

    /// Returns the station with these limits.
    pub fn station_with_limits(
        &self,
        limits: Limits,
    ) -> Station<StepPin<'_>, DirectionPin<'_>, Switch<'_>, Photodiode<'_>, Lamp<'_>> {
        let normal = [0.0, 0.0, 1.0];
        let white = WhiteTile {
            counts: [WHITE; 3],
            reflectance: [1.0; 3],
            directions: Directions {
                incoming: normal,
                outgoing: normal,
            },
            footprint: Footprint::LightLarger,
            full_scale: FULL_SCALE,
        };
        let photometer = Photometer::new(Photodiode(self), Lamp(self), white, 16);
        let speed = settings(0).speed / STEPS_PER_RADIAN;
        let machine = Machine {
            speeds: Speeds {
                theta_i: speed,
                phi_i: speed,
                theta_o: speed,
                phi_o: speed,
            },
            limits,
            isotropic: true,
            through_normal: false,
        };
        let settings = station::Settings {
            machine,
            arm_settling_us: 20_000,
            lamp_settling_us: 5_000,
        };
        Station::new(self.goniometer(), photometer, settings)
    }

    /// Returns a random number from -1 to 1, nearly normally distributed: the mean of four uniform random numbers.
    fn noise(&self) -> f32 {
        let mut sum = 0.0;
        for _ in 0..4 {
            let next = self.noise.get().wrapping_mul(1_664_525);
            self.noise.set(next.wrapping_add(1_013_904_223));
            sum += (self.noise.get() >> 8) as f32 / (1 << 24) as f32;
        }
        sum / 2.0 - 1.0
    }
}

/// Returns the settings of an arm. Arms 0 and 2 are the polar axes, and arms 1 and 3 the azimuths. The lamp's home is
/// near the normal. The sensor's home is near the horizon, and its motor is reversed.
pub fn settings(arm: usize) -> axis::Settings {
    let (home, min_angle, max_angle) = match arm {
        0 => (-HOME_MARGIN, 0.0, FRAC_PI_2),
        2 => (FRAC_PI_2 - 0.01, 0.0, FRAC_PI_2 - 0.03),
        _ => (-PI - HOME_MARGIN, -PI, PI),
    };
    axis::Settings {
        steps_per_radian: STEPS_PER_RADIAN,
        speed: 4000.0,
        acceleration: 20_000.0,
        homing_speed: 1000.0,
        home,
        min_angle,
        max_angle,
        tolerance: 1,
        reversed: arm == 2,
    }
}
