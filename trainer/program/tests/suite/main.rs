//! Tests of the trainer's commands, of documents about them, of readings from a lab, and of bundled recipes.

mod bundled;
mod command_line;
mod common;
mod documents;
mod measurement;
mod outliers;
mod physics;
