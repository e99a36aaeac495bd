//! Neural, 20 steps on 8 samples.

#![no_std]
#![no_main]

use glimpse_core::fit::Workspace;
use glimpse_core::model::Neural;
use glimpse_core::scan::Scan;
use glimpse_fits::SAMPLES;
use glimpse_fits::machine::only;
use glimpse_fits::recipes::NEURAL;
use glimpse_fits::report::descend;

glimpse_fits::firmware!({
    static mut WORKSPACE: Workspace<Neural> = Workspace::new();
    static mut SCAN: Option<Scan<'static, Neural, SAMPLES>> = None;
    // SAFETY: the entry point runs once, and nothing else knows of them.
    unsafe { descend(NEURAL, only(&raw mut WORKSPACE), only(&raw mut SCAN)) }
});
