#![doc = include_str!("../README.md")]
#![no_std]
#![forbid(unsafe_code)]
#![deny(clippy::panic, clippy::indexing_slicing)]
#![deny(clippy::unwrap_used, clippy::expect_used)]
// The futures run on one core's executor, whose tasks need not be `Send`.
#![allow(async_fn_in_trait)]

pub mod axis;
mod button;
mod color_sensor;
pub mod goniometer;
mod machine;
mod memory;
mod operator;
pub mod route;
mod run;
pub mod store;

pub use button::Button;
pub use color_sensor::ColorSensor;
pub use machine::{Machine, Sensor, Steppers};
pub use memory::{FlashMemory, Memory};
pub use operator::{Command, Event, Operator};
pub use run::run;
