//! Linear, 5 components, 8 samples.

#![no_std]
#![no_main]

use glimpse_bench::recipes::LINEAR;
use glimpse_bench::{Linear, SAMPLES};

glimpse_bench::fit!(Linear, SAMPLES, LINEAR);
