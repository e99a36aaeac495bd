//! A simulated scanner on a desk: arms, light, sensor, flash, line, host and operator, with faults, in virtual time. A
//! [`Desk`] runs the main loop of `glimpse-scanner`, for the tests of this package and of your firmware.

mod arms;
#[path = "../../template/src/axes.rs"]
pub mod axes;
mod desk;
#[path = "../../../core/examples/common/flash.rs"]
mod flash;
mod line;
pub mod optics;

use std::sync::{Mutex, MutexGuard, PoisonError};

use embassy_time::MockDriver;

pub use arms::{Arm, Arms, Machine, Pin, Wiring, go_to, home, separation, settle};
pub use desk::{Desk, LAYOUT, WHITE};
pub use flash::{Effect, Flash, SECTOR_BYTES};
pub use line::{Computer, Line};

/// Sets the clock to 0. All tests of a program share it, so only one has it at a time.
pub fn take_clock() -> MutexGuard<'static, ()> {
    static CLOCK: Mutex<()> = Mutex::new(());
    let clock = CLOCK.lock().unwrap_or_else(PoisonError::into_inner);
    MockDriver::get().reset();
    clock
}

/// A generator of random numbers.
#[derive(Clone, Copy, Debug)]
pub struct Random(pub u64);

impl Random {
    /// Returns an integer from 0 to `n` - 1.
    pub fn below(&mut self, n: u32) -> u32 {
        let product = self.0.wrapping_mul(6_364_136_223_846_793_005);
        self.0 = product.wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 32) as u32 % n
    }

    /// Returns a number from 0 to 1.
    pub fn unit(&mut self) -> f32 {
        self.below(1 << 24) as f32 / (1 << 24) as f32
    }
}
