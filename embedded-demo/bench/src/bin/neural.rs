//! Neural, 20 steps on 8 samples.

#![no_std]
#![no_main]

use glimpse_bench::recipes::NEURAL;
use glimpse_core::model::Neural;

glimpse_bench::fit!(Neural, NEURAL);
