//! Baseline without a fit: the flash of a fit is the difference between its binary and this one.

#![no_std]
#![no_main]

use glimpse_bench::report;

glimpse_bench::firmware!({
    report::baseline();
    Some(())
});
