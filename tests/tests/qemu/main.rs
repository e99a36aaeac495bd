//! The firmware in QEMU. `tests/run firmware` builds its images and runs these tests.

mod faults;
mod firmware;
mod microcontrollers;
