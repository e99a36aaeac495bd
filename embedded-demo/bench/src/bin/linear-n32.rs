//! Linear, 32 readings completed to 24 components.

#![no_std]
#![no_main]

use glimpse_bench::recipes::large::LINEAR_32;
use glimpse_core::fit::Linear;

glimpse_bench::fit!(Linear, LINEAR_32);
