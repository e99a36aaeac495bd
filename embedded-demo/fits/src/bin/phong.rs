//! Phong, 20 steps on 8 samples.

#![no_std]
#![no_main]

use glimpse_core::model::Phong;
use glimpse_core::scan::{Memory, Scan};
use glimpse_fits::SAMPLES;
use glimpse_fits::machine::only;
use glimpse_fits::recipes::PHONG;
use glimpse_fits::report::fit;

glimpse_fits::firmware!({
    static mut MEMORY: Memory<Phong, SAMPLES> = Memory::new();
    static mut SCAN: Option<Scan<'static, 'static, Phong, SAMPLES>> = None;
    // SAFETY: the entry point runs once, and nothing else knows of them.
    unsafe { fit(PHONG, only(&raw mut MEMORY), only(&raw mut SCAN)) }
});
