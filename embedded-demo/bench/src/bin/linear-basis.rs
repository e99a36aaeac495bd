//! Linear, 8 readings completed to 24 components, and the BRDF by their basis.

#![no_std]
#![no_main]

use glimpse_bench::recipes::BASIS;
use glimpse_bench::recipes::completed::LINEAR;
use glimpse_core::fit::Linear;

glimpse_bench::fit!(Linear, LINEAR, false, Some(BASIS));
