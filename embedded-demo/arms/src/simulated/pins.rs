//! Pins and sensor of the simulated scanner.

use core::convert::Infallible;
use core::f32::consts::PI;

use embedded_hal::digital::{ErrorType, InputPin, OutputPin};

use super::{Arm, DARK, FULL_SCALE, SimulatedScanner, WHITE, Wiring, brdf, half_angles};
use crate::sensor::Sensor;

/// Number of reads for which a contact bounces after each change.
const BOUNCES: u32 = 8;

/// Step pin of an arm. The arm moves on a rising edge.
#[derive(Debug)]
pub struct StepPin<'w>(pub(super) &'w Arm);

/// Direction pin of an arm: high is up.
#[derive(Debug)]
pub struct DirectionPin<'w>(pub(super) &'w Arm);

/// Home switch of an arm. Its contact bounces whenever it opens or closes.
#[derive(Debug)]
pub struct Switch<'w>(pub(super) &'w Arm);

/// The sensor.
#[derive(Debug)]
pub struct Photodiode<'w>(pub(super) &'w SimulatedScanner);

/// The lamp.
#[derive(Debug)]
pub struct Lamp<'w>(pub(super) &'w SimulatedScanner);

impl ErrorType for StepPin<'_> {
    type Error = Infallible;
}

impl ErrorType for DirectionPin<'_> {
    type Error = Infallible;
}

impl ErrorType for Switch<'_> {
    type Error = Infallible;
}

impl ErrorType for Lamp<'_> {
    type Error = Infallible;
}

impl OutputPin for StepPin<'_> {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.step.set(0);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        let Arm {
            position,
            step,
            direction,
            stalled,
            ..
        } = self.0;
        if step.replace(1) == 1 {
            return Ok(()); // no edge
        }
        match stalled.get().checked_sub(1) {
            Some(left) => stalled.set(left),
            None if direction.get() == 1 => position.set(position.get().saturating_add(1)),
            None => position.set(position.get().saturating_sub(1)),
        }
        Ok(())
    }
}

impl OutputPin for DirectionPin<'_> {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.direction.set(0);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.direction.set(1);
        Ok(())
    }
}

/// A normally closed switch to ground with a pull-up.
impl InputPin for Switch<'_> {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        let Arm {
            position,
            wiring,
            open,
            bounces,
            ..
        } = self.0;
        let is_open = match wiring.get() {
            wiring if wiring == Wiring::Broken as u32 => true,
            wiring if wiring == Wiring::Shorted as u32 => false,
            _ => position.get() <= 0,
        };
        if open.replace(is_open.into()) != u32::from(is_open) {
            bounces.set(bounces.get().max(BOUNCES));
        }
        let left = bounces.get();
        bounces.set(left.saturating_sub(1));
        Ok(is_open != (left % 2 == 1))
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        self.is_high().map(|is_high| !is_high)
    }
}

impl OutputPin for Lamp<'_> {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.lamp.set(0);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.lamp.set(1);
        Ok(())
    }
}

impl Sensor for Photodiode<'_> {
    type Error = Infallible;

    fn read(&mut self) -> Result<[u16; 3], Infallible> {
        let Self(simulated) = self;
        let directions = simulated.directions();
        let [_, _, cosine] = directions.incoming;
        let lit = half_angles(&directions)
            .filter(|_| simulated.lamp.get() == 1)
            .map(|[theta_h, theta_d]| brdf(theta_h, theta_d));
        // The lamp illuminates a larger spot than the sensor sees, so counts are proportional to cos(theta_i).
        let counts = lit.unwrap_or_default().map(|f| {
            let count = DARK + WHITE * PI * f * cosine + simulated.noise();
            count.clamp(0.0, f32::from(FULL_SCALE))
        });
        Ok(counts.map(|count| libm::roundf(count) as u16))
    }
}
