//! A simulated machine. Its arms respond to edges on their pins only.

use std::array;
use std::cell::Cell;
use std::f32::consts::{FRAC_PI_2, PI, TAU};

use embedded_hal::digital::{ErrorKind, ErrorType, InputPin, OutputPin};
use glimpse_core::error::Error;
use glimpse_core::geometry::{ArmAngles, Spherical};

use glimpse_scanner::axis::{Axis, Settings};
use glimpse_scanner::goniometer::Progress::{self, Homed};
use glimpse_scanner::goniometer::{Goniometer, StepCheck};
use glimpse_scanner::route::AxisAngles;

/// Reads for which a contact bounces after each change.
const BOUNCES: u32 = 8;

/// State of a simulated switch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wiring {
    /// It works.
    #[default]
    Intact,
    /// The switch reads as open.
    Broken,
    /// The switch reads as closed.
    Shorted,
    /// The contact never settles.
    Bouncing,
    /// The switch is intact, but the motor does not turn.
    Jammed,
    /// The pin returns errors.
    Unreadable,
}

/// A simulated arm.
#[derive(Debug, Default)]
pub struct Arm {
    /// Distance from its switch, steps. The switch is open at 0 and below.
    pub position: Cell<i32>,
    /// Levels of the direction pin and the step pin. The arm moves away from its switch if the direction is high.
    levels: [Cell<bool>; 2],
    /// Steps that the motor will miss.
    pub stalled: Cell<u32>,
    /// The state of its switch.
    pub wiring: Cell<Wiring>,
    was_open: Cell<bool>,
    /// Reads during which the contact will bounce.
    pub bounces: Cell<u32>,
}

/// A pin of an arm: step, direction, or switch.
#[derive(Clone, Copy, Debug)]
pub struct Pin<'a> {
    arm: &'a Arm,
    is_step: bool,
}

impl Pin<'_> {
    fn set(&self, level: bool) -> Result<(), ErrorKind> {
        let Self { arm, is_step } = *self;
        let was_high = arm.levels[usize::from(is_step)].replace(level);
        if is_step && level && !was_high && arm.wiring.get() != Wiring::Jammed {
            let step = if arm.levels[0].get() { 1 } else { -1 };
            match arm.stalled.get().checked_sub(1) {
                Some(left) => arm.stalled.set(left),
                None => arm.position.update(|position| position + step),
            }
        }
        Ok(())
    }
}

impl ErrorType for Pin<'_> {
    type Error = ErrorKind;
}

impl OutputPin for Pin<'_> {
    fn set_low(&mut self) -> Result<(), ErrorKind> {
        self.set(false)
    }

    fn set_high(&mut self) -> Result<(), ErrorKind> {
        self.set(true)
    }
}

impl InputPin for Pin<'_> {
    fn is_high(&mut self) -> Result<bool, ErrorKind> {
        let arm = self.arm;
        let is_open = match arm.wiring.get() {
            Wiring::Intact | Wiring::Jammed => arm.position.get() <= 0,
            Wiring::Bouncing => !arm.was_open.get(),
            Wiring::Broken => true,
            Wiring::Shorted => false,
            Wiring::Unreadable => return Err(ErrorKind::Other),
        };
        if arm.was_open.replace(is_open) != is_open {
            arm.bounces.set(arm.bounces.get().max(BOUNCES));
        }
        let left = arm.bounces.get();
        arm.bounces.set(left.saturating_sub(1));
        Ok(is_open != (left % 2 == 1))
    }

    fn is_low(&mut self) -> Result<bool, ErrorKind> {
        self.is_high().map(|is_high| !is_high)
    }
}

/// An axis of a simulated arm.
pub type TestAxis<'a> = Axis<Pin<'a>, Pin<'a>, Pin<'a>>;
/// A goniometer of simulated arms.
pub type Arms<'a> = Goniometer<Pin<'a>, Pin<'a>, Pin<'a>>;

/// Four simulated arms.
#[derive(Debug, Default)]
pub struct Machine {
    /// The arms of theta_i, phi_i, theta_o and phi_o.
    pub arms: [Arm; 4],
}

impl Machine {
    /// Creates a machine whose arms are at these distances from their switches.
    pub fn new(positions: [i32; 4]) -> Self {
        let machine = Self::default();
        (0..4).for_each(|arm| machine.arms[arm].position.set(positions[arm]));
        machine
    }

    /// Returns the distances of the arms from their switches, steps.
    pub fn positions(&self) -> [i32; 4] {
        self.arms.each_ref().map(|arm| arm.position.get())
    }

    /// Returns an axis with these settings.
    pub fn axis(&self, number: usize, settings: Settings) -> TestAxis<'_> {
        let arm = &self.arms[number];
        let pin = |is_step| Pin { arm, is_step };
        Axis::new(pin(true), pin(false), pin(false), settings)
    }

    /// Returns arms that must be homed.
    pub fn arms(&self, min_separation: f32, angles: Option<AxisAngles>) -> Arms<'_> {
        let axes = array::from_fn(|number| self.axis(number, settings(number)));
        Goniometer::new(axes, min_separation, angles).unwrap()
    }

    /// Returns the homed arms.
    pub fn homed(&self, min_separation: f32) -> Arms<'_> {
        let mut arms = self.arms(min_separation, None);
        assert_eq!(home(&mut arms), Ok(Homed(StepCheck::Unknown)));
        arms
    }

    /// Returns the true angles of the arms.
    pub fn angles(&self) -> AxisAngles {
        array::from_fn(|number| {
            let (settings, position) = (settings(number), self.positions()[number]);
            let steps = if number == 2 { -position } else { position };
            settings.angle(settings.steps(settings.home) + steps)
        })
    }
}

/// Returns the settings of an axis. The sensor's polar axis, 2, has its switch at the horizon and a reversed motor.
pub fn settings(number: usize) -> Settings {
    let (home, min_angle, max_angle) = match number {
        0 => (-0.05, 0.0, FRAC_PI_2),
        2 => (FRAC_PI_2 - 0.01, 0.0, FRAC_PI_2 - 0.03),
        _ => (-PI - 0.05, -PI, PI),
    };
    Settings {
        steps_per_radian: 200.0 * 16.0 * 4.0 / TAU,
        speed: 4000.0,
        acceleration: 20_000.0,
        homing_speed: 1000.0,
        home,
        min_angle,
        max_angle,
        tolerance: 1,
        reversed: number == 2,
    }
}

/// Returns the angle between lamp and sensor, radians.
pub fn separation([theta_i, phi_i, theta_o, phi_o]: AxisAngles) -> f32 {
    let at = |theta, phi| Spherical { theta, phi };
    let (incoming, outgoing) = (at(theta_i, phi_i), at(theta_o, phi_o));
    ArmAngles { incoming, outgoing }.directions().separation()
}

/// Polls until the arms rest, and returns their last progress. `watch` is called after each poll.
///
/// # Errors
/// As [`Goniometer::poll`].
pub fn settle(arms: &mut Arms, round: u32, mut watch: impl FnMut()) -> Result<Progress, Error> {
    loop {
        let progress = arms.poll(round)?;
        watch();
        if progress != Progress::Moving {
            return Ok(progress);
        }
    }
}

/// Moves the arms, and polls until they rest.
pub fn go_to(arms: &mut Arms, angles: AxisAngles) {
    arms.go_to(angles).unwrap();
    assert_eq!(settle(arms, 10, || ()), Ok(Progress::Arrived));
    assert_eq!(arms.poll(10), Ok(Progress::Resting));
}

/// Homes the arms, and polls until they rest.
///
/// # Errors
/// As [`Goniometer::poll`].
pub fn home(arms: &mut Arms) -> Result<Progress, Error> {
    arms.home().unwrap();
    settle(arms, 10, || ())
}
