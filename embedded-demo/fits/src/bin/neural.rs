//! Neural, 20 steps on 8 samples.

#![no_std]
#![no_main]

use glimpse_core::model::Neural;
use glimpse_core::scan::{Memory, Scan};
use glimpse_fits::SAMPLES;
use glimpse_fits::machine::only;
use glimpse_fits::recipes::NEURAL;
use glimpse_fits::report::fit;

glimpse_fits::firmware!({
    static mut MEMORY: Memory<Neural, SAMPLES> = Memory::new();
    static mut SCAN: Option<Scan<'static, 'static, Neural, SAMPLES>> = None;
    // SAFETY: the entry point runs once, and nothing else knows of them.
    unsafe { fit(NEURAL, only(&raw mut MEMORY), only(&raw mut SCAN)) }
});
