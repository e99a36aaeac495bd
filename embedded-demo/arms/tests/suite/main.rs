//! The tests of the motion firmware, on a host.

mod axis;
mod bench;
mod confirm;
mod paths;
mod power_cuts;
mod scan;
mod serve;
mod support;
mod switches;
