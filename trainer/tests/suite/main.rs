//! Tests of the trainer's commands, of documents about them, and of readings from a lab.

mod command_line;
mod common;
mod documents;
mod measurement;
mod physics;
