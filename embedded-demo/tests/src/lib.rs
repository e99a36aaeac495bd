//! A simulated scanner on a desk: arms, light, sensor, flash, line, host and operator, with faults, in virtual time. A
//! [`Desk`] runs the main loop of `glimpse-scanner` with the recipe, axes, white tile and options of your firmware:
//!
//! ```
//! use glimpse_core::error::ErrorCode;
//! use glimpse_desk::{Desk, METAL, SensorFault, ggx};
//! use glimpse_scanner::Command;
//!
//! static RECIPE: &[u8] = include_bytes!("../../../trainer/recipes/completed/neural-n8.recipe");
//! let mut desk = Desk::new(RECIPE);
//! desk.material = ggx(METAL);
//! desk.scan();
//! assert!(desk.results.borrow()[0].implausible.is_none() && desk.error() < 0.1);
//!
//! desk.sensor.set(Some(SensorFault::Absent));
//! desk.command.set(Some(Command::Restart));
//! desk.run(|| !desk.failures.borrow().is_empty());
//! assert_eq!(desk.failures.borrow()[0].code, ErrorCode::Sensor);
//! ```

mod arms;
#[path = "../../template/src/axes.rs"]
pub mod axes;
mod buses;
mod desk;
#[path = "../../../core/examples/common/flash.rs"]
mod flash;
mod line;
mod optics;
mod pin;
#[allow(dead_code)] // core's tests use all of it
#[path = "../../../core/tests/suite/random.rs"]
mod random;

use std::sync::{Mutex, MutexGuard, PoisonError};

use embassy_time::MockDriver;

pub use arms::{Arm, Arms, Machine, Wiring, directions};
pub use desk::Desk;
pub use flash::{Effect, Flash, SECTOR_BYTES};
pub use line::{Computer, Line};
pub use optics::{BLACK, Brdf, Ggx, METAL, PLASTIC, SensorFault, ggx, tile};
pub use pin::{Input, Output, Pin};

/// Sets the clock to 0. All tests of a program share it, so only one has it at a time.
pub fn take_clock() -> MutexGuard<'static, ()> {
    static CLOCK: Mutex<()> = Mutex::new(());
    let clock = CLOCK.lock().unwrap_or_else(PoisonError::into_inner);
    MockDriver::get().reset();
    clock
}
