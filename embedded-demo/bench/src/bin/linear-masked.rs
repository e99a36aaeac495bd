//! Linear, 16 readings completed to 24 components, with a recipe that tolerates missing ones.

#![no_std]
#![no_main]

use glimpse_bench::recipes::masked::LINEAR;
use glimpse_core::fit::Linear;

glimpse_bench::fit!(Linear, LINEAR);
