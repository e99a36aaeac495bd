//! Linear, 8 samples completed to 24 components.

#![no_std]
#![no_main]

use glimpse_bench::recipes::completed::LINEAR;
use glimpse_bench::{CompletedLinear, SAMPLES};

glimpse_bench::fit!(CompletedLinear, SAMPLES, LINEAR);
