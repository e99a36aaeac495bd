//! Linear, 16 samples completed to 24 components; any of them might be missing.

#![no_std]
#![no_main]

use glimpse_bench::recipes::masked::LINEAR;
use glimpse_core::fit::Linear;

glimpse_bench::fit!(Linear, LINEAR);
