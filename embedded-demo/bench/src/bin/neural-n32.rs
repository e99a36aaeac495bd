//! Neural, 32 readings completed, then one step.

#![no_std]
#![no_main]

use glimpse_bench::recipes::large::NEURAL_32;
use glimpse_core::model::Neural;

glimpse_bench::fit!(Neural, NEURAL_32);
