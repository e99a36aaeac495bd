//! The trainer as its users meet it: its commands, what documents say of them, and readings from a lab.

mod command_line;
mod common;
mod documents;
mod measurement;
