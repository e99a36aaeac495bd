//! Simulated arms. They respond to edges on their pins only.

use std::array;
use std::cell::Cell;

use embedded_hal::digital::ErrorKind;
use glimpse_core::geometry::{self, Directions};
use glimpse_scanner::axis::{Axis, Settings};
use glimpse_scanner::goniometer::Goniometer;
use glimpse_scanner::route::AxisAngles;

use crate::axes::{AXES, MIN_SEPARATION};
use crate::pin::{Input, Output, Pin};

/// Reads for which a contact bounces after each change.
const BOUNCES: u32 = 8;
/// Steps between the positions at which a switch opens and closes.
const HYSTERESIS: i32 = 10;

/// State of a simulated axis.
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
    /// The motor does not turn.
    Jammed,
    /// The motor turns the wrong way.
    Reversed,
    /// The switch's pin returns errors.
    Unreadable,
}

/// A simulated arm.
#[derive(Debug, Default)]
pub struct Arm {
    /// Distance from its switch, steps. The switch opens at 0.
    pub position: Cell<i32>,
    /// Distance of its far switch.
    pub far: Option<i32>,
    /// Steps by which every second opening is early.
    pub scatter: i32,
    /// Steps that the motor will miss.
    pub stalled: Cell<u32>,
    /// The state of motor and switch.
    pub wiring: Cell<Wiring>,
    /// Levels of the pins.
    direction: Cell<bool>,
    step: Cell<bool>,
    /// Number of openings and closings of the switch, which begins closed.
    changes: Cell<i32>,
    /// Reads during which the contact will bounce.
    bounces: Cell<u32>,
}

impl Arm {
    /// Sets the step pin. `away` is the level of the direction pin that moves the arm away from its switch.
    fn set_step(&self, level: bool, away: bool) {
        let is_edge = !self.step.replace(level) && level;
        if is_edge && self.wiring.get() != Wiring::Jammed {
            let is_away = (self.direction.get() == away) != (self.wiring.get() == Wiring::Reversed);
            match self.stalled.get().checked_sub(1) {
                Some(left) => self.stalled.set(left),
                None => self.position.update(|at| at + if is_away { 1 } else { -1 }),
            }
        }
    }

    /// Reads the switch: high while it is open.
    fn read(&self) -> Result<bool, ErrorKind> {
        let was_open = self.changes.get() % 2 == 1;
        let is_open = match self.wiring.get() {
            Wiring::Intact | Wiring::Jammed | Wiring::Reversed => self.is_open(),
            Wiring::Bouncing => !was_open,
            Wiring::Broken => true,
            Wiring::Shorted => false,
            Wiring::Unreadable => return Err(ErrorKind::Other),
        };
        if is_open != was_open {
            self.changes.update(|changes| changes + 1);
            self.bounces.set(BOUNCES);
        }
        let left = self.bounces.get();
        self.bounces.set(left.saturating_sub(1));
        Ok(is_open != (left % 2 == 1))
    }

    fn is_open(&self) -> bool {
        let (position, changes) = (self.position.get(), self.changes.get());
        let early = (changes / 2 + 1) % 2 * self.scatter;
        let margin = changes % 2 * HYSTERESIS;
        position - margin <= early || self.far.is_some_and(|far| position + margin >= far)
    }
}

/// A goniometer of simulated arms.
pub type Arms<'a> = Goniometer<Output<'a>, Input<'a>>;

/// Four simulated arms.
#[derive(Debug)]
pub struct Machine {
    /// The arms of theta_i, phi_i, theta_o and phi_o.
    pub arms: [Arm; 4],
    /// The settings of the firmware.
    pub settings: [Settings; 4],
    /// The minimum separation of the firmware, radians.
    pub min_separation: f32,
    /// The true steps per radian, relative to the settings.
    pub gears: [f32; 4],
}

impl Machine {
    /// Creates a machine with the template's axes, whose arms are at these distances from their switches, steps.
    pub fn new(positions: [i32; 4]) -> Self {
        let machine = Self {
            arms: [(); 4].map(|()| Arm::default()),
            settings: AXES,
            min_separation: MIN_SEPARATION,
            gears: [1.0; 4],
        };
        machine.place(positions);
        machine
    }

    /// Moves the arms by hand to these distances from their switches, steps.
    pub fn place(&self, positions: [i32; 4]) {
        let arms = self.arms.iter().zip(positions);
        arms.for_each(|(arm, position)| arm.position.set(position));
    }

    /// Returns the distances of the arms from their switches, steps.
    pub fn positions(&self) -> [i32; 4] {
        self.arms.each_ref().map(|arm| arm.position.get())
    }

    /// Returns the firmware's arms, which are not homed. Their directions are proven or not.
    pub fn arms(&self, is_proven: bool) -> Arms<'_> {
        let axes = array::from_fn(|number| {
            let (arm, settings) = (&self.arms[number], self.settings[number]);
            let away = is_home_low(&settings) != settings.reversed;
            let step: Output<'_> = Pin(Box::new(move |level| arm.set_step(level, away)));
            let direction: Output<'_> = Pin(Box::new(|level| arm.direction.set(level)));
            let switch: Input<'_> = Pin(Box::new(|| arm.read()));
            Axis::new(step, direction, switch, settings)
        });
        let mut arms = Goniometer::new(axes, self.min_separation).unwrap();
        if is_proven {
            arms.trust_directions();
        }
        arms
    }

    /// Returns the true angles of the arms.
    pub fn angles(&self) -> AxisAngles {
        array::from_fn(|number| {
            let settings = &self.settings[number];
            let steps = self.arms[number].position.get() as f32 / self.gears[number];
            let sign = if is_home_low(settings) { 1 } else { -1 };
            settings.angle(settings.steps(settings.home) + sign * steps as i32)
        })
    }

    /// Returns the angle between lamp and sensor, radians.
    pub fn separation(&self) -> f32 {
        directions(self.angles()).separation()
    }

    /// Adds a far switch to each axis, as far beyond its limits as the home switch.
    pub fn add_far_switches(&mut self) {
        let axes = self.arms.iter_mut().zip(&mut self.settings);
        for ((arm, settings), gear) in axes.zip(self.gears) {
            let far = settings.min_angle + settings.max_angle - settings.home;
            settings.far = Some(far);
            let angle = (far - settings.home).abs();
            arm.far = Some((angle * settings.steps_per_radian * gear) as i32);
        }
    }
}

fn is_home_low(settings: &Settings) -> bool {
    settings.home < settings.min_angle
}

/// Returns the directions of lamp and sensor.
pub fn directions(angles: AxisAngles) -> Directions<f32> {
    geometry::Arms::from_array(angles).directions()
}
