//! Linear, 16 samples with every third reading missing, completed to 24 components.

#![no_std]
#![no_main]

use glimpse_bench::recipes::masked::LINEAR;
use glimpse_core::fit::Linear;

glimpse_bench::fit!(Linear, LINEAR, true);
