//! Linear, 5 components, 8 samples.

#![no_std]
#![no_main]

use glimpse_core::scan::{Memory, Scan};
use glimpse_fits::Linear;
use glimpse_fits::SAMPLES;
use glimpse_fits::machine::only;
use glimpse_fits::recipes::LINEAR;
use glimpse_fits::report::fit;

glimpse_fits::firmware!({
    static mut MEMORY: Memory<Linear, SAMPLES> = Memory::new();
    static mut SCAN: Option<Scan<'static, 'static, Linear, SAMPLES>> = None;
    // SAFETY: the entry point runs once, and nothing else knows of them.
    unsafe { fit(LINEAR, only(&raw mut MEMORY), only(&raw mut SCAN)) }
});
