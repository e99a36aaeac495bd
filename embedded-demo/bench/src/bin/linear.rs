//! Linear, 5 components, 8 samples.

#![no_std]
#![no_main]

use glimpse_bench::recipes::LINEAR;
use glimpse_core::fit::Linear;

glimpse_bench::fit!(Linear, LINEAR);
