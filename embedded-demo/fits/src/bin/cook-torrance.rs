//! Cook-Torrance, 20 steps on 8 samples.

#![no_std]
#![no_main]

use glimpse_core::model::CookTorrance;
use glimpse_core::scan::{Memory, Scan};
use glimpse_fits::SAMPLES;
use glimpse_fits::machine::only;
use glimpse_fits::recipes::COOK_TORRANCE;
use glimpse_fits::report::fit;

glimpse_fits::firmware!({
    static mut MEMORY: Memory<CookTorrance, SAMPLES> = Memory::new();
    static mut SCAN: Option<Scan<'static, 'static, CookTorrance, SAMPLES>> = None;
    // SAFETY: the entry point runs once, and nothing else knows of them.
    unsafe { fit(COOK_TORRANCE, only(&raw mut MEMORY), only(&raw mut SCAN)) }
});
