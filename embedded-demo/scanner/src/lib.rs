#![doc = include_str!("../README.md")]
#![no_std]
#![forbid(unsafe_code)]
#![deny(clippy::panic, clippy::indexing_slicing)]
#![deny(clippy::unwrap_used, clippy::expect_used)]
// The futures run on one core's executor, whose tasks need not be `Send`.
#![allow(async_fn_in_trait)]

pub mod axis;
mod button;
mod calibration;
mod color_sensor;
mod device;
pub mod goniometer;
mod instrument;
mod operator;
mod optics;
mod panel;
pub mod route;
mod run;

pub use button::{Button, Press};
pub use color_sensor::ColorSensor;
pub use device::report;
pub use instrument::Instrument;
pub use operator::{Command, Event, Operator, State};
pub use optics::{Counts, Sensor, White};
pub use panel::Panel;
pub use run::run;
