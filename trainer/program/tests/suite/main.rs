//! Tests of the trainer's commands, of readings from a lab, and of bundled recipes.

mod command_line;
mod common;
mod measurement;
mod physics;
