//! Linear, 8 readings completed to 24 components.

#![no_std]
#![no_main]

use glimpse_bench::recipes::completed::LINEAR;
use glimpse_core::fit::Linear;

glimpse_bench::fit!(Linear, LINEAR);
