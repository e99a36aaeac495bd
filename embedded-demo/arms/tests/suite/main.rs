//! Tests of the motion firmware on a host.

mod axis;
mod board;
mod confirm;
mod memory;
mod paths;
mod power_cuts;
mod reach;
mod scan;
mod seeds;
mod serve;
mod skipped;
mod support;
mod switches;
