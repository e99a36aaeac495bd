//! A simulated machine with the template's axes. Its arms respond to edges on their pins only.

use std::array;
use std::cell::Cell;

use embedded_hal::digital::{ErrorKind, ErrorType, InputPin, OutputPin};
use glimpse_core::error::Error;
use glimpse_core::geometry;
use glimpse_scanner::axis::{Axis, Settings};
use glimpse_scanner::goniometer::Progress::{self, Homed};
use glimpse_scanner::goniometer::{Goniometer, StepCheck};
use glimpse_scanner::route::AxisAngles;

use crate::axes::{AXES, MIN_SEPARATION};

/// Reads for which a contact bounces after each change.
const BOUNCES: u32 = 8;
/// Steps between the positions at which a switch opens and closes.
const HYSTERESIS: i32 = 10;

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
    /// The switch is intact, but the motor turns the wrong way.
    Reversed,
    /// The pin returns errors.
    Unreadable,
}

/// A simulated arm.
#[derive(Debug, Default)]
pub struct Arm {
    /// Distance from its switch, steps. The switch opens at 0.
    pub position: Cell<i32>,
    /// Distance of its far switch.
    pub far: Cell<Option<i32>>,
    /// Steps by which every second opening is early.
    pub scatter: Cell<i32>,
    /// Level of the direction pin that moves it away from its switch.
    away: bool,
    /// Steps that the motor will miss.
    pub stalled: Cell<u32>,
    /// The state of its switch.
    pub wiring: Cell<Wiring>,
    /// Levels of the direction pin and the step pin.
    levels: [Cell<bool>; 2],
    was_open: Cell<bool>,
    openings: Cell<i32>,
    /// Reads during which the contact will bounce.
    bounces: Cell<u32>,
}

impl Arm {
    /// Returns its direction pin, which may switch a lamp instead.
    pub fn pin(&self) -> Pin<'_> {
        Pin {
            arm: self,
            is_step: false,
        }
    }

    /// Returns the level of that pin.
    pub fn level(&self) -> bool {
        self.levels[0].get()
    }

    /// Returns true if a working switch is open.
    fn is_open(&self) -> bool {
        let (position, was_open) = (self.position.get(), self.was_open.get());
        let early = (self.openings.get() + i32::from(!was_open)) % 2 * self.scatter.get();
        let margin = if was_open { HYSTERESIS } else { 0 };
        let is_at_far = |far| position + margin >= far;
        position - margin <= early || self.far.get().is_some_and(is_at_far)
    }
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
            let is_reversed = arm.wiring.get() == Wiring::Reversed;
            let is_away = (arm.levels[0].get() == arm.away) != is_reversed;
            match arm.stalled.get().checked_sub(1) {
                Some(left) => arm.stalled.set(left),
                None => arm.position.update(|at| at + if is_away { 1 } else { -1 }),
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
            Wiring::Intact | Wiring::Jammed | Wiring::Reversed => arm.is_open(),
            Wiring::Bouncing => !arm.was_open.get(),
            Wiring::Broken => true,
            Wiring::Shorted => false,
            Wiring::Unreadable => return Err(ErrorKind::Other),
        };
        if arm.was_open.replace(is_open) != is_open {
            arm.openings.update(|count| count + i32::from(is_open));
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

/// A goniometer of simulated arms.
pub type Arms<'a> = Goniometer<Pin<'a>, Pin<'a>, Pin<'a>>;

/// Four simulated arms.
#[derive(Debug)]
pub struct Machine {
    /// The arms of theta_i, phi_i, theta_o and phi_o.
    pub arms: [Arm; 4],
    /// The settings of the firmware.
    pub settings: [Settings; 4],
    /// The true steps per radian, relative to the settings.
    pub gears: Cell<[f32; 4]>,
    /// The minimum separation of the firmware, radians.
    pub min_separation: f32,
}

impl Machine {
    /// Creates a machine whose arms are at these distances from their switches.
    pub fn new(positions: [i32; 4]) -> Self {
        let arm = |number| Arm {
            position: Cell::new(positions[number]),
            away: number != 2, // the sensor's switch is at the horizon
            ..Arm::default()
        };
        Self {
            arms: array::from_fn(arm),
            settings: AXES,
            gears: Cell::new([1.0; 4]),
            min_separation: MIN_SEPARATION,
        }
    }

    /// Returns the distances of the arms from their switches, steps.
    pub fn positions(&self) -> [i32; 4] {
        self.arms.each_ref().map(|arm| arm.position.get())
    }

    /// Returns arms whose directions are unproven.
    pub fn unproven(&self) -> Arms<'_> {
        let axes = array::from_fn(|number| {
            let arm = &self.arms[number];
            let pin = |is_step| Pin { arm, is_step };
            Axis::new(pin(true), pin(false), pin(false), self.settings[number])
        });
        Goniometer::new(axes, self.min_separation).unwrap()
    }

    /// Returns arms that must be homed, as after a reset.
    pub fn arms(&self, angles: Option<AxisAngles>) -> Arms<'_> {
        let mut arms = self.unproven();
        arms.trust_directions();
        angles.into_iter().for_each(|angles| arms.assume(angles));
        arms
    }

    /// Returns the homed arms.
    pub fn homed(&self) -> Arms<'_> {
        let mut arms = self.arms(None);
        assert_eq!(home(&mut arms), Ok(Homed(StepCheck::Unknown)));
        arms
    }

    /// Returns the true angles of the arms.
    pub fn angles(&self) -> AxisAngles {
        array::from_fn(|number| {
            let (settings, position) = (self.settings[number], self.positions()[number]);
            let steps = if number == 2 { -position } else { position };
            let counted = steps as f32 / self.gears.get()[number];
            settings.angle(settings.steps(settings.home) + counted as i32)
        })
    }
}

/// Returns the angle between lamp and sensor, radians.
pub fn separation(angles: AxisAngles) -> f32 {
    let arms = geometry::Arms::from_array(angles);
    arms.directions().separation()
}

/// Polls every `round` us until the arms rest, and returns their last progress. `watch` is called after each poll.
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
    assert_eq!(settle(arms, 40, || ()), Ok(Progress::Arrived));
    assert_eq!(arms.poll(10), Ok(Progress::Resting));
}

/// Homes the arms, and polls until they rest.
///
/// # Errors
/// As [`Goniometer::home`] and [`Goniometer::poll`].
pub fn home(arms: &mut Arms) -> Result<Progress, Error> {
    arms.home()?;
    settle(arms, 40, || ())
}
