//! Linear, 8 samples completed to 24 components, with the basis that makes a BRDF of them.

#![no_std]
#![no_main]

use glimpse_bench::recipes::BASIS;
use glimpse_bench::recipes::completed::LINEAR;
use glimpse_core::fit::Linear;

glimpse_bench::fit!(Linear, LINEAR, false, Some(BASIS));
