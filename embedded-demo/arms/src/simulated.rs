//! A simulated scanner: arms that see edges on their pins only, and a sensor that sees the sample
//! from where the arms **are**, not from where they should be.
//!
//! All of its state is plain numbers in cells, so that it may lie in memory that a reset leaves
//! alone, as a machine does.

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
use crate::sensor::{Photometer, White};
use crate::station::{self, ARMS, Station};

/// A simulated arm.
#[derive(Debug, Default)]
#[repr(C)]
pub struct Arm {
    /// Steps from its switch, which is open at 0 and below.
    position: Cell<i32>,
    /// Levels of its pins, 0 or 1.
    step: Cell<u32>,
    direction: Cell<u32>,
    /// Edges that it will not follow.
    stalled: Cell<u32>,
    /// The switch's wires; see [`Wiring`].
    wiring: Cell<u32>,
    /// 1 if the switch was open when it was read last.
    open: Cell<u32>,
    /// Reads for which its contact bounces.
    bounces: Cell<u32>,
}

/// The wires of a simulated switch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wiring {
    /// Whole.
    Whole = 0,
    /// One is broken, so that the switch reads as open.
    Broken = 1,
    /// They touch each other, so that the switch reads as closed.
    Shorted = 2,
}

/// A simulated scanner.
#[derive(Debug, Default)]
#[repr(C)]
pub struct World {
    arms: [Arm; ARMS],
    lamp: Cell<u32>,
    /// State of the sensor's noise.
    noise: Cell<u32>,
    /// 1 for a short press of the button, 2 for a long one.
    button: Cell<u32>,
}

/// A made-up material: a diffuse color, and a highlight of two widths; sr^-1, linear RGB. (That of
/// `glimpse-bench`, whose fit is counted.)
fn brdf(theta_h: f32, theta_d: f32) -> [f32; 3] {
    let lobe = |sharpness: f32| {
        let falloff = 1.0 + sharpness * theta_h * theta_h;
        1.0 / (falloff * falloff)
    };
    let grazing = 1.0 + 0.2 * theta_d * theta_d;
    let highlight = 0.9 * (8.0 * lobe(40.0) + lobe(4.0)) / 9.0 * grazing;
    [0.12 + highlight, 0.05 + highlight, 0.03 + 0.9 * highlight]
}

/// The angles theta_h and theta_d, radians; None below the horizon.
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

/// Counts that the sensor gives in the dark.
const DARK: f32 = 96.0;
/// Counts above them of a white tile of reflectance 1, lit from the normal.
const WHITE: f32 = 1200.0;
/// The largest count: 12 bits.
const FULL_SCALE: u16 = 4095;
/// Steps to a radian: 1.8 degrees, 16 microsteps, a gear of 1:4.
const STEPS_PER_RADIAN: f32 = 200.0 * 16.0 * 4.0 / TAU;
/// The switches of all arms but the sensor's polar one open a few degrees below the smallest angle.
const HOME_BELOW: f32 = 0.05;
/// The least angle between lamp and sensor, radians: a little less than in the bundled recipes.
const MIN_SEPARATION: f32 = 0.08;

impl World {
    /// All arms at these steps from their switches.
    pub fn new(positions: [i32; ARMS]) -> Self {
        let world = Self::default();
        world.place(positions);
        world
    }

    /// Puts the arms somewhere by hand; nobody holds or lights anything.
    pub fn place(&self, positions: [i32; ARMS]) {
        for (arm, position) in self.arms.iter().zip(positions) {
            arm.position.set(position);
            arm.stalled.set(0);
            arm.step.set(0);
            arm.direction.set(0);
            arm.bounces.set(0);
            arm.wiring.set(Wiring::Whole as u32);
        }
        self.lamp.set(0);
        self.noise.set(1);
        self.button.set(0);
    }

    /// Lets an arm miss its next steps.
    pub fn stall(&self, arm: usize, steps: u32) {
        if let Some(arm) = self.arms.get(arm) {
            arm.stalled.set(steps);
        }
    }

    /// Changes the wires of an arm's switch.
    pub fn wire(&self, arm: usize, wiring: Wiring) {
        if let Some(arm) = self.arms.get(arm) {
            arm.wiring.set(wiring as u32);
        }
    }

    /// Lets the contact of an arm's switch bounce for a number of reads from now.
    pub fn bounce(&self, arm: usize, reads: u32) {
        if let Some(arm) = self.arms.get(arm) {
            arm.bounces.set(reads);
        }
    }

    /// Gives a command; [`World::take_command`] returns it once.
    pub fn command(&self, command: Command) {
        self.button.set(match command {
            Command::NewScan => 1,
            Command::Continue => 2,
        });
    }

    /// The command that was given since the last call.
    pub fn take_command(&self) -> Option<Command> {
        match self.button.replace(0) {
            1 => Some(Command::NewScan),
            2 => Some(Command::Continue),
            _ => None,
        }
    }

    /// Positions of the arms, in steps from their switches.
    pub fn positions(&self) -> [i32; ARMS] {
        self.arms.each_ref().map(|arm| arm.position.get())
    }

    /// The arms' angles, radians: theta_i, phi_i, theta_o, phi_o.
    pub fn angles(&self) -> AxisAngles {
        core::array::from_fn(|arm| {
            let settings = settings(arm);
            let steps = self.arms.get(arm).map_or(0, |arm| arm.position.get());
            let away = if settings.home < settings.least {
                1
            } else {
                -1
            };
            settings.angle(
                steps
                    .saturating_mul(away)
                    .saturating_add(settings.steps(settings.home)),
            )
        })
    }

    /// The directions of lamp and sensor.
    pub fn directions(&self) -> Directions<f32> {
        let [theta_i, phi_i, theta_o, phi_o] = self.angles();
        let at = |theta, phi| Spherical { theta, phi };
        let arms = ArmAngles {
            incoming: at(theta_i, phi_i),
            outgoing: at(theta_o, phi_o),
        };
        arms.directions()
    }

    /// The arms as a firmware sees them.
    pub fn goniometer(&self) -> Goniometer<StepPin<'_>, DirectionPin<'_>, Switch<'_>, ARMS> {
        let mut numbers = 0..;
        Goniometer::new(self.arms.each_ref().map(|arm| {
            let settings = settings(numbers.next().unwrap_or(0));
            Axis::new(StepPin(arm), DirectionPin(arm), Switch(arm), settings)
        }))
    }

    /// The whole machine as a firmware sees it.
    pub fn station(
        &self,
    ) -> Station<StepPin<'_>, DirectionPin<'_>, Switch<'_>, Photodiode<'_>, Lamp<'_>> {
        self.station_within(Limits {
            min_separation: MIN_SEPARATION,
            ..Limits::NONE
        })
    }

    /// The whole machine with these limits.
    pub fn station_within(
        &self,
        limits: Limits,
    ) -> Station<StepPin<'_>, DirectionPin<'_>, Switch<'_>, Photodiode<'_>, Lamp<'_>> {
        let normal = [0.0, 0.0, 1.0];
        let white = White {
            counts: [WHITE; 3],
            reflectance: [1.0; 3],
            at: Directions {
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
            arms_settle: 20_000,
            lamp_settles: 5_000,
        };
        Station::new(self.goniometer(), photometer, settings)
    }

    /// A number from -1 to 1, nearly normal: the mean of four.
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

/// Settings of an arm; 0 and 2 are polar angles, 1 and 3 azimuths. The lamp's home is near the
/// normal, the sensor's near the horizon, where its motor turns the other way round.
pub fn settings(arm: usize) -> axis::Settings {
    let (home, least, largest) = match arm {
        0 => (-HOME_BELOW, 0.0, FRAC_PI_2),
        2 => (FRAC_PI_2 - 0.01, 0.0, FRAC_PI_2 - 0.03),
        _ => (-PI - HOME_BELOW, -PI, PI),
    };
    axis::Settings {
        steps_per_radian: STEPS_PER_RADIAN,
        speed: 4000.0,
        acceleration: 20_000.0,
        homing_speed: 1000.0,
        home,
        least,
        largest,
        tolerance: 1,
        reversed: arm == 2,
    }
}
