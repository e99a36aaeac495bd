//! Linear, 5 components, 8 samples.

#![no_std]
#![no_main]

use glimpse_core::scan::LinearScan;
use glimpse_fits::machine::only;
use glimpse_fits::recipes::LINEAR;
use glimpse_fits::report::solve;
use glimpse_fits::{LINEAR_MEMORY, SAMPLES};

glimpse_fits::firmware!({
    static mut MEMORY: [f32; LINEAR_MEMORY] = [0.0; LINEAR_MEMORY];
    static mut SCAN: Option<LinearScan<'static, SAMPLES>> = None;
    // SAFETY: the entry point runs once, and nothing else knows of them.
    unsafe { solve(LINEAR, only(&raw mut MEMORY), only(&raw mut SCAN)) }
});
